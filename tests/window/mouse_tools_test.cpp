/// Tissue and tools in the hand of a mouse, without a window.
#include "tactus/window/mouse_tools.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tactus/base/timing.h"
#include "tactus/geom/mesh/box_surface.h"
#include "tactus/geom/mesh/hook_surface.h"
#include "tactus/geom/mesh/mesh_defects.h"
#include "tactus/io/built_in_meshes.h"
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
  explicit MouseInTheRun(Scene scene = box_scene(), std::vector<std::string> tools = {"ball", "scalpel"})
      : run_(std::move(scene), {.devices = "cpu", .tools = std::move(tools)}) {}
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

  LiveRun run_;
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

/// A rod of radius r: a shaft of 3.5 bends, a half circle, a tip of 0.4 bends, and a half ball at each end
/// (the volume of a bent rod is that of a straight one, by Pappus). A regular polygon of 12 corners has
/// sin(pi / 6) / (pi / 6) = 0.955 of its circle's area; 16 chords of the bend and three circles of an end
/// take less than 1 % more.
TEST(Hook, IsAClosedRodThatDoesNotCrossItself) {
  const TriangleMesh hook = hook_surface(0.03F, 0.009F);
  EXPECT_NO_THROW(check_closed(hook, "hook"));
  EXPECT_EQ(topology(hook).components, 1);
  EXPECT_EQ(find_self_crossings(hook).pairs, 0);
  const double r = 0.009, rod = M_PI * r * r * 0.03 * (3.5 + M_PI + 0.4), ends = 4 * M_PI / 3 * r * r * r;
  EXPECT_NEAR(volume_m3(hook) / (rod + ends), 0.95, 0.01);
  TriangleMesh again = hook;
  compute_normals(again);
  // Facets of a circle turn by 30 degrees, those of an end by 22.5.
  for (std::size_t v = 0; v < hook.normals.size(); ++v)
    EXPECT_GT(dot(hook.normals[v], again.normals[v]), std::cos(0.35F)) << v;
}

/// A soft beam along z, 3 cm wide and 2 cm high, that is held at both ends; nothing falls.
Scene beam_scene() {
  Scene scene = box_scene();
  scene.obstacles.clear();
  scene.blades.clear();
  BodyDescription& beam = scene.bodies[0];
  beam.cuttable = false;
  beam.shape.size_m = {0.03, 0.02, 0.2};
  beam.spacing_m = 0.01;
  beam.material.young_modulus_pa = 2000;  // fewer substeps
  for (std::size_t i = 0; i < 2; ++i) {
    const double side = i == 0 ? -1 : 1;
    beam.fixed[i].where.point_m = {0, 0, side * 0.09};
    beam.fixed[i].where.normal = {0, 0, -side};
  }
  ObstacleSetting& hook = scene.obstacles.emplace_back();
  hook.name = "hook";
  hook.kind = ObstacleShape::mesh;
  hook.path = kHookPath;
  hook.unit_m = 0.03;
  hook.held = true;
  hook.placement.position_m = {0.1, 0.05, 0};
  return scene;
}

class HookInTheRun : public MouseInTheRun {
 protected:
  HookInTheRun() : MouseInTheRun(beam_scene(), {"hook"}) {}
  PicturePoint at(float x_m, float y_m) const { return *project(camera_, {x_m, y_m, 0}, kSize); }
  /// Of the beam's lower side, above the hook.
  float lowest_m() const {
    float lowest = 1;
    for (const Vec3f p : frame_->snapshot->bodies[0].positions_m)
      if (std::abs(p.z) < 0.008F) lowest = std::min(lowest, p.y);
    return lowest;
  }
};

/// Down beside the beam, below it, and up. The bend's inner side is 2.1 cm below its middle, so the beam lies
/// 6.9 cm high at the end, 2.9 cm higher than before. Its points are 5 mm apart, and between two of them it
/// sags around the rod of 9 mm by at most 9 mm - sqrt(9^2 - 2.5^2) mm = 0.35 mm; 2 mm are allowed.
TEST_F(HookInTheRun, LiftsTissueThatItsBendIsUnder) {
  EXPECT_NEAR(lowest_m(), 0.04F, 1e-4F);
  drag(Drag::tool, at(0.1F, 0.05F), at(0.1F, 0), 30);
  EXPECT_NEAR(frame_->tools.at(0).T_world.t.y, 0, 1e-6);
  EXPECT_LT(frame_->tools.at(0).T_world.R.row[0].x, 1.0001) << "the tip points to the beam";
  EXPECT_GT(frame_->tools.at(0).T_world.R.row[0].x, 0.9999);
  drag(Drag::tool, at(0.1F, 0), at(0, 0), 30);
  EXPECT_NEAR(lowest_m(), 0.04F, 1e-3F) << "it went below";
  drag(Drag::tool, at(0, 0), at(0, 0.09F), 50);
  EXPECT_NEAR(lowest_m(), 0.069F, 0.002F);
  EXPECT_GT(frame_->tools.at(0).force_N, 0.01);
  drag(Drag::tool, at(0, 0.09F), at(0, -0.02F), 50);
  EXPECT_LT(lowest_m(), 0.05F) << "and lets the beam down again, which then swings about 4 cm";
}

/// From the other side its tip points the other way; while it touches something, it stays as it is.
TEST_F(HookInTheRun, TurnsItsTipToTheBodies) {
  drag(Drag::tool, at(0.1F, -0.15F), at(-0.1F, -0.15F), 50);
  drag(Drag::tool, at(-0.1F, -0.15F), at(-0.1F, 0.02F), 40);
  EXPECT_NEAR(frame_->tools.at(0).T_world.R.row[0].x, -1, 1e-4);
  drag(Drag::tool, at(-0.1F, 0.02F), at(-0.03F, 0.05F), 30);
  ASSERT_GT(frame_->tools.at(0).force_N, 0);
  camera_.azimuth_rad = 0.5F;
  drag(Drag::tool, kMiddle, kMiddle, 1);
  EXPECT_NEAR(frame_->tools.at(0).T_world.R.row[0].x, -1, 1e-4);
}

}  // namespace
}  // namespace tactus
