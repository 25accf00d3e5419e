/// Pauses, steps and pace of a run that somebody looks at.
#include "tactus/run/run_control.h"

#include <gtest/gtest.h>

#include "support/filmed_world.h"
#include "tactus/base/timing.h"
#include "tactus/geom/maths/rotation.h"

namespace tactus {
namespace {

RunControl::Options without_pace() {
  RunControl::Options options;
  options.keeps_pace = false;
  return options;
}

/// Whether a frame may begin before `should_stop` was asked so often.
bool may_begin(RunControl& control, int asked = 3) {
  int left = asked;
  return control.wait_for_turn(false, [&] { return left-- == 0; }) == RunControl::Turn::go;
}

TEST(RunControl, WaitsForAViewerThenRuns) {
  int viewers = 0;
  RunControl::Options options = without_pace();
  options.has_viewers = [&] { return viewers > 0; };
  options.waits_for_viewer = true;
  RunControl control(std::move(options));
  EXPECT_FALSE(may_begin(control));
  EXPECT_EQ(control.state(), RunControl::State::waiting);
  viewers = 1;
  EXPECT_TRUE(may_begin(control));
  EXPECT_EQ(control.state(), RunControl::State::running);
  viewers = 0;
  EXPECT_TRUE(may_begin(control)) << "it goes on without them";
}

TEST(RunControl, APauseEndsWhenTheLastViewerLeft) {
  int viewers = 1;
  RunControl::Options options = without_pace();
  options.has_viewers = [&] { return viewers > 0; };
  RunControl control(std::move(options));
  EXPECT_TRUE(may_begin(control));
  control.set_paused(true);
  EXPECT_FALSE(may_begin(control));
  viewers = 0;
  EXPECT_TRUE(may_begin(control));
  EXPECT_EQ(control.state(), RunControl::State::running);
}

TEST(RunControl, PausesStepsAndRuns) {
  std::vector<std::string> states;
  RunControl::Options options = without_pace();
  RunControl* self = nullptr;
  options.state_changed = [&] { states.emplace_back(RunControl::text(self->state())); };
  RunControl control(std::move(options));
  self = &control;
  EXPECT_TRUE(may_begin(control));
  control.set_paused(true);
  EXPECT_FALSE(may_begin(control));
  control.step();
  control.step();
  EXPECT_TRUE(may_begin(control));
  EXPECT_TRUE(may_begin(control));
  EXPECT_FALSE(may_begin(control)) << "two steps were asked for";
  control.toggle_pause();
  EXPECT_TRUE(may_begin(control));
  control.end();
  control.set_paused(true);
  EXPECT_EQ(states, (std::vector<std::string>{"running", "paused", "running", "ended"}));
}

/// A window has something to show though it is paused; then each step is one frame.
TEST(RunControl, ShowsTheFirstFrameOfAPausedRun) {
  RunControl::Options options = without_pace();
  options.shows_first_frame = true;
  RunControl control(std::move(options));
  control.set_paused(true);
  control.begin();
  EXPECT_TRUE(may_begin(control));
  EXPECT_FALSE(may_begin(control));
  control.restart();
  EXPECT_EQ(control.wait_for_turn(), RunControl::Turn::restart);
  EXPECT_FALSE(control.begin());
  EXPECT_TRUE(may_begin(control));
  control.go_back();
  EXPECT_EQ(control.wait_for_turn(), RunControl::Turn::restart);
  EXPECT_TRUE(control.begin()) << "to the frame that is kept";
}

TEST(RunControl, StopsWhileItWaits) {
  RunControl control(without_pace());
  control.set_paused(true);
  EXPECT_EQ(control.wait_for_turn(false, [] { return true; }), RunControl::Turn::stop);
  control.stop();
  EXPECT_EQ(control.wait_for_turn(), RunControl::Turn::stop);
}

/// Eleven frames of 20 ms: the last begins no sooner than 0.2 s after the first.
TEST(RunControl, ASecondOfTheSourceTakesOne) {
  RunControl control;
  const double begin_s = now_s();
  for (int f = 0; f <= 10; ++f) {
    EXPECT_EQ(control.wait_for_turn(), RunControl::Turn::go);
    control.note_frame(0.02 * f, 0.02);
  }
  EXPECT_GE(now_s() - begin_s, 0.179)
      << "the eleventh frame began after ten times of 20 ms, less the clock's step";
}

/// Asked to go 0.3 m, a tool of 0.5 m/s takes 30 frames of 20 ms; put down, it is there at once. What the
/// world refuses is said, and the rest is done.
TEST(RunControl, LeadsToolsAndTellsWhatIsRefused) {
  Scene scene;
  scene.source.kind = SourceKind::none;
  ObstacleSetting& ball = scene.obstacles.emplace_back();
  ball.name = "ball";
  ball.kind = ObstacleShape::sphere;
  ball.held = true;
  DeviceSet devices("cpu");
  World world(devices, scene, {});
  RunControl::Options options = without_pace();
  options.tool_speed_m_s = 0.5;
  RunControl control(std::move(options));
  world.step(0);
  control.note_frame(0, 0.02);
  control.move_tool("ball", {Mat3d::identity(), {0.3, 0, 0}});
  for (int f = 1; f <= 30; ++f) {
    EXPECT_TRUE(control.asked_pose("ball").has_value());
    EXPECT_EQ(control.apply(world).errors, "");
    world.step(0.02);
    EXPECT_NEAR(world.pose("ball").t.x, 0.01 * f, 1e-9);
  }
  control.apply(world);                                               // the last step may be a rounding away
  control.move_tool("ball", {Mat3d::identity(), {0.4, 0, 0}}, 0.25);  // slower than others: 5 mm a frame
  control.apply(world);
  world.step(0.02);
  EXPECT_NEAR(world.pose("ball").t.x, 0.305, 1e-9);
  control.move_tool("ball", {Mat3d::identity(), {0.3, 0, 0}});
  control.apply(world);
  world.step(0.02);
  EXPECT_FALSE(control.asked_pose("ball").has_value());
  control.put_tool("ball", {Mat3d::identity(), {5, 0, 0}});
  control.move_tool("bal", {});
  control.set_parameter("contact.friction", 0.1);
  const RunControl::Applied applied = control.apply(world);
  EXPECT_NE(applied.errors.find("did you mean 'ball'"), std::string::npos) << applied.errors;
  EXPECT_TRUE(applied.has_set);
  EXPECT_TRUE(control.pending_parameters().empty());
  world.step(0.02);
  EXPECT_EQ(world.pose("ball").t.x, 5);
}

/// A blade's edge may be far from its origin: turned at once, it would swing to elsewhere before it is led
/// there. So a tool that has gone half of its way has turned by half.
TEST(RunControl, LedToolsTurnAsFarAsTheyWent) {
  Scene scene;
  scene.source.kind = SourceKind::none;
  ObstacleSetting& ball = scene.obstacles.emplace_back();
  ball.name = "ball";
  ball.kind = ObstacleShape::sphere;
  ball.held = true;
  DeviceSet devices("cpu");
  World world(devices, scene, {});
  RunControl control(without_pace());
  world.step(0);
  control.note_frame(0, 0.02);
  constexpr double kQuarter = 1.5707963267948966;
  control.move_tool("ball", {rotation_from_vector({0, kQuarter, 0}), {0.3, 0, 0}}, 0.5);
  for (int f = 1; f <= 15; ++f) {
    EXPECT_EQ(control.apply(world).errors, "");
    world.step(0.02);
    // Sums of 15 steps, each a rounding off.
    EXPECT_NEAR(vector_of_rotation(world.pose("ball").R).y, f * kQuarter / 30, 1e-9);
  }
}

}  // namespace
}  // namespace tactus
