#include <gtest/gtest.h>

#include <cmath>

#include "tactus/base/timing.h"
#include "tactus/window/camera_moves.h"
#include "tactus/window/live_run.h"
#include "tactus/window/panel_model.h"

namespace tactus {
namespace {

constexpr PicturePoint kSize{1280, 720};

TEST(CameraMoves, ProjectionAndItsInverseAgree) {
  const ViewCamera camera{.target_m = {0.1F, 0.2F, -0.3F}, .distance_m = 1.7F, .azimuth_rad = 0.9F};
  for (const Vec3f p : {Vec3f{0.1F, 0.2F, -0.3F}, Vec3f{0.3F, 0.4F, 0.1F}}) {
    const auto at = project(camera, p, kSize);
    ASSERT_TRUE(at);
    // Floats of a metre: 1e-7 each, some ten operations.
    EXPECT_LT(length(point_under(camera, *at, kSize, depth_m(camera, p)) - p), 2e-6F);
  }
  const auto middle = project(camera, camera.target_m, kSize);
  EXPECT_NEAR(middle->x, 640, 1e-3);
  EXPECT_NEAR(middle->y, 360, 1e-3);
  EXPECT_FALSE(project(camera, camera.eye_m() + (camera.eye_m() - camera.target_m), kSize));
}

TEST(CameraMoves, PannedTargetFollowsTheMouse) {
  ViewCamera camera{.distance_m = 2, .azimuth_rad = 0.4F, .elevation_rad = 0.7F};
  const Vec3f seen = camera.target_m;
  pan(camera, {100, -40}, kSize.y);
  const auto now = project(camera, seen, kSize);
  EXPECT_NEAR(now->x, 740, 0.01);
  EXPECT_NEAR(now->y, 320, 0.01);
}

TEST(CameraMoves, OrbitKeepsDistanceAndStopsBelowThePole) {
  ViewCamera camera{.distance_m = 2, .azimuth_rad = 0, .elevation_rad = 0};
  orbit(camera, {-360, 0}, kSize.y);  // half the height: a quarter turn
  EXPECT_NEAR(camera.azimuth_rad, kPi / 2, 1e-5);
  orbit(camera, {0, 5000}, kSize.y);
  EXPECT_LT(camera.elevation_rad, kPi / 2);
  EXPECT_NEAR(length(camera.eye_m() - camera.target_m), 2, 1e-5);
  zoom(camera, 1);
  EXPECT_NEAR(camera.distance_m, 1.8F, 1e-6);
}

TEST(PanelText, NumbersHaveThreeDigits) {
  EXPECT_EQ(short_number(0), "0");
  EXPECT_EQ(short_number(0.0081), "0.008");
  EXPECT_EQ(short_number(0.8449), "0.84");
  EXPECT_EQ(short_number(12.34), "12.3");
  EXPECT_EQ(short_number(-219.2), "-219");
  EXPECT_EQ(short_number(1.5e7), "1.5e+07");
}

ViewedFrame frame_at(int number, double time_s, double shown_at_s) {
  ViewedFrame frame;
  frame.number = number;
  frame.time_s = time_s;
  frame.shown_at_s = shown_at_s;
  frame.stages = {{"hull", 2, 4}, {"latency", 9, 9}, {"frame", 5, 8}};
  frame.values = {{"contact", "N", 0.5 * number}};
  return frame;
}

TEST(PanelText, TellsPaceStagesAndCurves) {
  RunHistory history;
  EXPECT_EQ(panel_model("demo", history, LiveRun::State::building, false).title, "tactus: demo, building");
  for (int i = 1; i <= 31; ++i) history.add(std::make_shared<ViewedFrame>(frame_at(i, i / 60.0, i / 30.0)));
  const PanelModel model = panel_model("demo", history, LiveRun::State::running, false);
  EXPECT_EQ(model.title, "tactus: demo, running, frame 31");
  EXPECT_EQ(model.state, "running at 0.50 of real time");
  EXPECT_EQ(model.clock, "0.52 s, frame 31");
  EXPECT_EQ(model.arrows, "no contacts");
  ASSERT_EQ(model.stages.size(), 2U);  // the latency is no stage
  EXPECT_EQ(model.stages[0].name, "frame");
  EXPECT_EQ(model.stages[0].text, "5.00 / 8.00");
  EXPECT_FLOAT_EQ(model.stages[1].p99, 0.5F);  // 4 of 8 ms
  ASSERT_EQ(model.curves.size(), 1U);
  EXPECT_EQ(model.curves[0].now, "15.5 N");
  EXPECT_EQ(model.curves[0].range, "0.50 to 15.5");
  EXPECT_FLOAT_EQ(model.curves[0].heights.back(), 1);
  EXPECT_EQ(panel_model("demo", history, LiveRun::State::running, true).title,
            "tactus: demo, paused, frame 31");
}

/// A bar is a share of the budget, and words say which stages exceed it: colours alone wouldn't.
TEST(PanelText, StagesStandAgainstTheBudget) {
  const auto model_of = [](double budget_ms, std::vector<StageTime> stages) {
    ViewedFrame frame = frame_at(1, 0, 0);
    frame.stages = std::move(stages);
    frame.budget_ms = budget_ms;
    RunHistory history;
    history.add(std::make_shared<ViewedFrame>(frame));
    return panel_model("demo", history, LiveRun::State::running, false);
  };
  const PanelModel within = model_of(10, {{"hull", 2, 4}, {"frame", 5, 8}});
  EXPECT_EQ(within.budget, "budget of a frame: 10.0 ms");
  EXPECT_FLOAT_EQ(within.budget_at, 1);
  EXPECT_EQ(within.stages.at(0).text, "5.00 / 8.00");
  EXPECT_FLOAT_EQ(within.stages.at(0).p50, 0.5F);
  EXPECT_FLOAT_EQ(within.stages.at(1).p99, 0.4F);
  const PanelModel over =
      model_of(10, {{"hull", 2, 12}, {"solve", 11, 15}, {"frame", 13, 16}, {"latency", 90, 90}});
  EXPECT_FLOAT_EQ(over.budget_at, 10 / 16.F);
  EXPECT_EQ(over.stages.at(0).text, "over: 13.0 / 16.0");
  EXPECT_EQ(over.stages.at(1).text, "p99 over: 2.00 / 12.0");
  EXPECT_EQ(over.stages.at(2).text, "over: 11.0 / 15.0");
  // The age of live images is no part of the frame.
  const PanelModel live = model_of(10, {{"hull to bodies", 30, 60}, {"frame", 5, 8}});
  EXPECT_EQ(live.stages.at(1).text, "30.0 / 60.0");
  EXPECT_TRUE(live.stages.at(1).is_age);
  EXPECT_FALSE(live.stages.at(0).is_age);
  EXPECT_FLOAT_EQ(live.budget_at, 1);
  // One frame that took a second leaves the bars of the others their length: the mark is at half.
  const PanelModel far = model_of(10, {{"hull", 2, 4}, {"frame", 5, 1000}});
  EXPECT_FLOAT_EQ(far.budget_at, 0.5F);
  EXPECT_FLOAT_EQ(far.stages.at(0).p99, 1);
  EXPECT_FLOAT_EQ(far.stages.at(1).p50, 0.1F);
  EXPECT_LT(model_of(0, {{"frame", 5, 8}}).budget_at, 0);
  EXPECT_EQ(model_of(0, {{"frame", 5, 8}}).budget, "");
}

/// A run of an hour takes no more memory than one of a minute.
TEST(PanelText, CurvesAreBounded) {
  RunHistory history;
  for (int i = 0; i < 2000; ++i) history.add(std::make_shared<ViewedFrame>(frame_at(i, i, i)));
  EXPECT_EQ(history.curves()[0].values.size(), RunHistory::kMostSamples);
  EXPECT_FLOAT_EQ(history.curves()[0].values.back(), 999.5F);
}

TEST(PanelText, SlidersStayWithinLimits) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const auto slider = [](double value, double least, double most) {
    SceneParameter p;
    p.name = "bodies.b.x";
    p.value = value;
    p.least = least;
    p.most = most;
    return slider_of(p, value);
  };
  EXPECT_EQ(slider(0.4, 0, 1).label, "b.x");
  EXPECT_EQ(slider(0.4, 0, 1).high, 1);
  EXPECT_FALSE(slider(0.4, 0, 1).is_logarithmic);
  const PanelModel::Slider stiffness = slider(2e4, 0, 1e9);
  EXPECT_DOUBLE_EQ(stiffness.low, 2e3);
  EXPECT_DOUBLE_EQ(stiffness.high, 2e5);
  EXPECT_TRUE(stiffness.is_logarithmic);
  const PanelModel::Slider gravity = slider(-9.81, -kInfinite, kInfinite);
  EXPECT_DOUBLE_EQ(gravity.low, -19.62);
  EXPECT_DOUBLE_EQ(gravity.high, 19.62);
  EXPECT_DOUBLE_EQ(slider(0, 0, kInfinite).high, 1);
}

/// A soft box on a plane, a held ball beside it, and nobody who films.
Scene small_scene() {
  Scene scene;
  scene.name = "small";
  scene.source.kind = SourceKind::none;
  scene.source.fps = 100;
  scene.source.frames.last = 1'000'000;
  BodyDescription& body = scene.bodies.emplace_back();
  body.name = "box";
  body.shape.size_m = {0.1, 0.1, 0.1};
  body.placement.position_m = {0, 0.05, 0};
  body.spacing_m = 0.025;
  ObstacleSetting& ball = scene.obstacles.emplace_back();
  ball.name = "ball";
  ball.kind = ObstacleShape::sphere;
  ball.radius_m = 0.02;
  ball.placement.position_m = {0, 0.5, 0};
  ball.held = true;
  ObstacleSetting& floor = scene.obstacles.emplace_back();
  floor.name = "floor";
  return scene;
}

class Viewed : public ::testing::Test {
 protected:
  void start(bool paused) {
    run_.control().set_paused(paused);
    run_.start({});
  }
  /// The next frame, or nullptr after 20 s: a loaded machine isn't an error.
  std::shared_ptr<const ViewedFrame> next_frame() {
    const double until_s = now_s() + 20;
    while (now_s() < until_s) {
      run_.rethrow_failure();
      if (auto frame = run_.take_frame()) return frame;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return nullptr;
  }
  std::shared_ptr<const ViewedFrame> step() {
    run_.control().step();
    return next_frame();
  }
  static double value(const ViewedFrame& frame, const std::string& name) {
    for (const SceneParameter& p : *frame.parameters)
      if (p.name == name) return p.value;
    ADD_FAILURE() << name;
    return 0;
  }
  LiveRun run_{small_scene(), {.devices = "cpu", .tools = {"ball"}}};
};

TEST_F(Viewed, PausedShowsTheFirstFrameAndStepsOneByOne) {
  start(true);
  const auto first = next_frame();
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(first->number, 1);
  EXPECT_NE(run_.take_view(), nullptr);
  EXPECT_EQ(first->snapshot->bodies.size(), 1U);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(run_.take_frame(), nullptr);
  for (const int number : {2, 3, 4}) {
    const auto frame = step();
    ASSERT_NE(frame, nullptr);
    EXPECT_EQ(frame->number, number);
    EXPECT_DOUBLE_EQ(frame->budget_ms, 10) << "100 frames a second";
  }
}

TEST_F(Viewed, SlidersValueIsTheNextFrames) {
  start(true);
  ASSERT_NE(next_frame(), nullptr);
  run_.control().set_parameter("gravity_m_s2.y", -3.5);
  EXPECT_EQ(run_.control().pending_parameters().size(), 1U);
  const auto frame = step();
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(value(*frame, "gravity_m_s2.y"), -3.5);
  EXPECT_TRUE(frame->refusal.empty());
  EXPECT_TRUE(run_.control().pending_parameters().empty());
  run_.control().set_parameter("contact.friction", -1);
  const auto refused = step();
  ASSERT_NE(refused, nullptr);
  EXPECT_NE(refused->refusal.find("contact.friction"), std::string::npos) << refused->refusal;
}

/// By no more than its speed times a frame: 0.5 m/s for 10 ms.
TEST_F(Viewed, ToolFollowsAsFastAsItMay) {
  start(true);
  ASSERT_NE(next_frame(), nullptr);
  run_.control().move_tool("ball", {Mat3d::identity(), {0, 0.1, 0}});
  double before_m = 0.5;
  for (int i = 0; i < 5; ++i) {
    const auto frame = step();
    ASSERT_NE(frame, nullptr);
    EXPECT_NEAR(before_m - frame->tools.at(0).T_world.t.y, 0.005, 1e-9);
    before_m = frame->tools.at(0).T_world.t.y;
  }
}

TEST_F(Viewed, HeldToolPressesTheBody) {
  start(true);
  ASSERT_NE(next_frame(), nullptr);
  run_.control().move_tool(
      "ball", {Mat3d::identity(), {0, 0.105, 0}});  // the ball's lowest point is 15 mm below the box's top
  std::shared_ptr<const ViewedFrame> frame;
  for (int i = 0; i < 100; ++i) frame = step();
  ASSERT_NE(frame, nullptr);
  EXPECT_NEAR(frame->tools.at(0).T_world.t.y, 0.105, 1e-9);
  EXPECT_GT(frame->tools.at(0).force_N, 0.01);
  EXPECT_FALSE(frame->contacts.empty());
}

TEST_F(Viewed, RestartBeginsAtTheFirstFrameAndThePaceIsThatOfTime) {
  start(false);
  const double begin_s = now_s();
  while (true) {
    const auto frame = next_frame();
    ASSERT_NE(frame, nullptr);
    if (frame->number >= 31) break;
  }
  EXPECT_GE(now_s() - begin_s, 0.29);  // 30 frames of 10 ms; faster is impossible, slower allowed
  run_.control().set_paused(true);
  run_.take_view();
  run_.control().restart();
  std::shared_ptr<const ViewedFrame> frame = next_frame();
  while (frame != nullptr && frame->number > 1) frame = next_frame();
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->time_s, 0);
  EXPECT_NE(run_.take_view(), nullptr);
}

/// To the bit: the archive has all that the coming frames depend on.
TEST_F(Viewed, KeptFrameIsSimulatedAgainWithTheSameBits) {
  start(true);
  ASSERT_NE(next_frame(), nullptr);
  run_.control().set_parameter("gravity_m_s2.y", -5);
  for (int i = 0; i < 4; ++i) ASSERT_NE(step(), nullptr);
  run_.control().keep();
  while (run_.kept() == nullptr) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(run_.kept()->number, 5);
  std::vector<std::vector<Vec3f>> first;
  for (int i = 0; i < 6; ++i) first.push_back(step()->snapshot->bodies[0].positions_m);
  run_.simulate_again(run_.kept());
  std::shared_ptr<const ViewedFrame> frame = next_frame();  // the one after the kept one
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->number, 6);
  EXPECT_EQ(value(*frame, "gravity_m_s2.y"), -5);
  for (std::size_t i = 0; i < first.size(); ++i) {
    ASSERT_NE(frame, nullptr);
    EXPECT_EQ(frame->number, 6 + static_cast<int>(i));
    EXPECT_EQ(frame->snapshot->bodies[0].positions_m, first[i]) << "frame " << frame->number;
    frame = step();
  }
  EXPECT_NE(first[0], first[5]);
}

/// What is known of a tracked tool can't be kept: the run goes on, and nothing is kept.
TEST(LiveRun, AFrameThatCannotBeKeptEndsNothing) {
  Scene scene = small_scene();
  scene.source.kind = SourceKind::synthetic;
  scene.source.figure = "scalpel";
  scene.source.fps = 30;
  scene.reconstruction.resolution = 16;
  scene.blades.emplace_back().name = "scalpel";
  scene.blades[0].tracked.emplace();
  LiveRun run(scene, {.devices = "cpu", .tools = {"ball"}});
  run.control().set_paused(true);
  run.start({});
  const auto next_number = [&] {
    for (const double until_s = now_s() + 20; now_s() < until_s;) {
      run.rethrow_failure();
      if (const auto frame = run.take_frame()) return frame->number;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return 0;
  };
  EXPECT_EQ(next_number(), 1);
  run.control().keep();
  run.control().step();
  EXPECT_EQ(next_number(), 2);
  EXPECT_EQ(run.kept(), nullptr);
  EXPECT_NE(run.why_not_again().find("is tracked"), std::string::npos) << run.why_not_again();
  EXPECT_EQ(run.state(), LiveRun::State::running);
}

/// A picture that takes long leaves frames unseen; the one at which it pauses is seen.
TEST_F(Viewed, PauseShowsTheFrameAtWhichItStands) {
  start(false);
  ASSERT_NE(next_frame(), nullptr);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // about 20 frames that nobody takes
  run_.control().set_paused(true);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  const auto stands = next_frame();
  ASSERT_NE(stands, nullptr);
  EXPECT_GT(stands->number, 3);
  EXPECT_EQ(run_.take_frame(), nullptr);
  const auto next = step();
  ASSERT_NE(next, nullptr);
  EXPECT_EQ(next->number, stands->number + 1);
}

TEST(LiveRun, LastFrameOfASourceIsSeen) {
  Scene scene = small_scene();
  scene.source.frames.last = 19;  // twenty frames
  LiveRun run(scene, {.devices = "cpu", .tools = {}});
  run.start({});
  const double until_s = now_s() + 20;
  while (run.state() != LiveRun::State::ended && now_s() < until_s)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const auto frame = run.take_frame();
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->number, 20);
}

TEST_F(Viewed, StopsSoon) {
  start(false);
  ASSERT_NE(next_frame(), nullptr);
  const double begin_s = now_s();
  EXPECT_TRUE(run_.stop(10));
  EXPECT_LT(now_s() - begin_s, 2);  // a frame of this scene takes 1 ms
}

TEST(LiveRun, FailureReachesTheWindow) {
  Scene scene = small_scene();
  scene.source.kind = SourceKind::recording;
  scene.source.path = "/nowhere.rec";
  LiveRun run(scene, {.devices = "cpu", .tools = {}});
  run.start({});
  const double until_s = now_s() + 10;
  while (run.state() == LiveRun::State::building && now_s() < until_s)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(run.state(), LiveRun::State::failed);
  EXPECT_THROW(run.rethrow_failure(), std::exception);
}

}  // namespace
}  // namespace tactus
