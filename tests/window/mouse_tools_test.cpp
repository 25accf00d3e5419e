/// Tissue and tools in the hand of a mouse, without a window.
#include "tactus/window/mouse_tools.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tactus/base/timing.h"
#include "tactus/geom/mesh/box_surface.h"
#include "tactus/window/live_run.h"

namespace tactus {
namespace {

constexpr PicturePoint kSize{1280, 720}, kMiddle{640, 360};
/// From +z, level.
ViewCamera front_view() {
  return {.target_m = {0, 0.05F, 0}, .distance_m = 1, .azimuth_rad = 0, .elevation_rad = 0};
}

/// A soft box of 10 cm that is held at its left and right, a ball and a scalpel beside it.
Scene box_scene() {
  Scene scene;
  scene.name = "box";
  scene.source.kind = SourceKind::none;
  scene.source.fps = 100;
  scene.source.frames.last = 1'000'000;
  scene.gravity_m_s2 = {};
  BodyDescription& box = scene.bodies.emplace_back();
  box.name = "box";
  box.shape.size_m = {0.1, 0.1, 0.1};
  box.placement.position_m = {0, 0.05, 0};
  box.spacing_m = 0.0125;
  box.material.model = TissueModel::tled;
  box.cuttable = true;
  for (const double side : {-1.0, 1.0}) {
    FixedRegion& end = box.fixed.emplace_back();
    end.where.kind = RegionKind::half_space;
    end.where.point_m = {side * 0.045, 0, 0};
    end.where.normal = {-side, 0, 0};
  }
  ObstacleSetting& ball = scene.obstacles.emplace_back();
  ball.name = "ball";
  ball.kind = ObstacleShape::sphere;
  ball.radius_m = 0.01;
  ball.placement.position_m = {0.3, 0.3, 0};
  ball.held = true;
  BladeDescription& scalpel = scene.blades.emplace_back();
  scalpel.name = "scalpel";
  scalpel.held = true;
  scalpel.from_m = {0.3, 0.2, 0};
  scalpel.to_m = {0.3, 0.24, 0};
  return scene;
}

class MouseInTheRun : public ::testing::Test {
 protected:
  void SetUp() override {
    run_.control().set_paused(true);
    run_.start({});
    frame_ = next_frame();
    ASSERT_NE(frame_, nullptr);
  }
  std::shared_ptr<const ViewedFrame> next_frame() {
    const double until_s = now_s() + 20;  // a loaded machine isn't an error
    while (now_s() < until_s) {
      run_.rethrow_failure();
      if (auto frame = run_.take_frame()) return frame;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return nullptr;
  }
  /// One picture, and one frame after it.
  void look(const WindowInput& input) {
    mouse_.follow(input, *frame_, camera_, kSize);
    run_.control().step();
    frame_ = next_frame();
    ASSERT_NE(frame_, nullptr);
  }
  /// From one place to another in so many frames; the button stays pressed.
  void drag(Drag drag, PicturePoint from, PicturePoint to, int frames) {
    WindowInput input;
    input.begun = input.moved = drag;
    input.pressed_px = input.mouse_px = from;
    look(input);
    input.begun = Drag::none;
    for (int i = 1; i <= frames; ++i) {
      const float share = static_cast<float>(i) / static_cast<float>(frames);
      input.mouse_px = {from.x + share * (to.x - from.x), from.y + share * (to.y - from.y)};
      look(input);
    }
  }
  double value(const std::string& name) const {
    for (const ViewedValue& v : frame_->values)
      if (v.name == name) return v.value;
    ADD_FAILURE() << name;
    return 0;
  }
  float mean_z_m() const {
    float sum = 0;
    for (const Vec3f p : frame_->snapshot->bodies[0].positions_m) sum += p.z;
    return sum / static_cast<float>(frame_->snapshot->bodies[0].positions_m.size());
  }

  LiveRun run_{box_scene(), {.devices = "cpu", .tools = {"ball", "scalpel"}}};
  MouseTools mouse_{run_.scene(), run_.tools(), run_.control()};
  ViewCamera camera_ = front_view();
  std::shared_ptr<const ViewedFrame> frame_;
};

/// The line of sight through the picture's middle meets the front of a box whose front is 0.05 m nearer than
/// its middle, and of two boxes the one that is nearer.
TEST(Pick, TakesTheNearestSurfaceUnderTheMouse) {
  std::vector<TriangleMesh> boxes{box_surface({0.05F, 0.05F, 0.05F}, {2, 2, 2}),
                                  box_surface({0.05F, 0.05F, 0.05F}, {2, 2, 2})};
  for (Vec3f& p : boxes[0].positions_m) p = p + Vec3f{0, 0.05F, -0.3F};
  for (Vec3f& p : boxes[1].positions_m) p = p + Vec3f{0, 0.05F, 0};
  const auto picked = pick(boxes, front_view(), {641, 361}, kSize);
  ASSERT_TRUE(picked.has_value());
  EXPECT_EQ(picked->body, 1U);
  EXPECT_NEAR(picked->at_m.z, 0.05F, 1e-6F);
  EXPECT_LT(length(boxes[1].positions_m[static_cast<std::size_t>(picked->vertex)] - Vec3f{0, 0.05F, 0.05F}),
            1e-3F);
  EXPECT_FALSE(pick(boxes, front_view(), {10, 10}, kSize).has_value());
}

TEST_F(MouseInTheRun, GrabsTissueUntilItIsLetGo) {
  const PicturePoint up{640, 200};
  drag(Drag::grab, kMiddle, up, 20);
  EXPECT_GT(frame_->pull_N, 0.05);
  const auto spring = mouse_.spring(*frame_);
  ASSERT_TRUE(spring.has_value());
  // 160 px of 720, of a picture that shows 2 tan(0.3) of 0.95 m: 0.13 m up.
  EXPECT_NEAR(spring->to_m.y, 0.05F + 160.F / 720 * 2 * std::tan(0.3F) * 0.95F, 1e-3F);
  EXPECT_GT(spring->from_m.y, 0.055F) << "what is held comes along";
  WindowInput toward_the_eye;
  toward_the_eye.tool_wheel = -20;
  toward_the_eye.mouse_px = kMiddle;
  const float before_m = mean_z_m();
  for (int i = 0; i < 5; ++i, toward_the_eye.tool_wheel = 0) look(toward_the_eye);
  EXPECT_GT(mean_z_m(), before_m) << "the wheel pulls it out";
  WindowInput release;
  release.is_released = true;
  look(release);
  EXPECT_FALSE(mouse_.spring(*frame_).has_value());
  EXPECT_EQ(frame_->pull_N, 0);
}

/// The scalpel points into the picture; half of its edge of 4 cm is in the box. Led down through it, it
/// passes seven of its eight layers of cubes from edge to edge, and one of 1.25 cm in depth: it doesn't go
/// through the second. So the wall is 7 x 1 faces of 1.25 cm.
TEST_F(MouseInTheRun, CutsWithTheScalpel) {
  mouse_.take_next_tool();
  EXPECT_EQ(mouse_.tool(), "scalpel");
  const auto at = [&](float y_m) { return *project(camera_, {0.002F, y_m, 0.05F}, kSize); };
  drag(Drag::tool, at(0.098F), at(-0.02F), 60);
  EXPECT_NEAR(value("cut"), 7 * 1.25 * 1.25, 0.05);
  EXPECT_EQ(frame_->snapshot->blades.size(), 1U);
}

TEST_F(MouseInTheRun, PressesWithTheBallThatIsInTheHand) {
  EXPECT_EQ(mouse_.tool(), "ball");
  const auto above = project(camera_, {0, 0.13F, 0}, kSize), in = project(camera_, {0, 0.1F, 0}, kSize);
  drag(Drag::tool, *above, *above, 100);  // 0.35 m at 5 mm a frame
  drag(Drag::tool, *above, *in, 10);
  EXPECT_NEAR(frame_->tools.at(0).T_world.t.y, 0.1, 0.002);
  EXPECT_GT(frame_->tools.at(0).force_N, 0.01);
}

}  // namespace
}  // namespace tactus
