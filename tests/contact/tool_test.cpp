/// A tool whose shape and motion are given: it pushes and rubs with its flanks, and not with its edge.
#include <gtest/gtest.h>

#include <cmath>

#include "contact/contact_scene.h"
#include "support/device_sets.h"
#include "support/message_of.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {
namespace {

constexpr float kSpacing = 0.005F;
constexpr int kSubsteps = 10;
constexpr float kFrame_s = 0.02F, kSubstep_s = kFrame_s / kSubsteps;
constexpr float kHalf_m = 0.0005F;  // of a blade 1 mm thick

class ToolOn : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(ToolOn);

/// 60 x 20 x 1 mm; its flanks face z, its edge is at y = -10 mm.
ObstacleDescription blade() {
  return {.name = "blade",
          .kind = ObstacleKind::mesh,
          .mesh = test::box({0.03F, 0.01F, kHalf_m}, 4),
          .moves = true,
          .edge_m = {{-0.03F, -0.01F, 0}, {0.03F, -0.01F, 0}}};
}

/// Free nodes and one tool, in frames of 20 ms.
struct Capacity {
  ExecContext& ctx;
  test::Nodes nodes;
  RealSurface surface;
  Obstacles obstacles;
  Contact contact;
  Buffer<ToolMotion> motion;
  Vec3f center_m;  ///< of the tool at the last capture
  Vec3d impulse_N_s;

  Capacity(ExecContext& context, std::vector<Vec3f> x, Vec3f tool_m,
           const ObstacleDescription& tool = blade(), const ContactSettings& settings = {.friction = 0})
      : ctx(context),
        nodes(std::move(x)),
        surface(ctx.device(), test::small_surface(kSpacing)),
        obstacles(ctx, std::vector<ObstacleDescription>{tool}, kSpacing),
        contact(ctx.device(), settings),
        motion(ctx.device(), 1),
        center_m(tool_m) {
    surface.clear(ctx);
  }
  /// The tool gets to its next place by a steady motion.
  void frame(Vec3f velocity_m_s, bool is_there = true) {
    center_m += kFrame_s * velocity_m_s;
    const std::vector<ToolMotion> now{
        {.is_there = is_there ? 1 : 0, .center_m = center_m, .velocity_m_s = velocity_m_s, .spin_rad_s = {}}};
    ctx.upload(now, motion.view());
    nodes.begin_frame(ctx);
    contact.begin_frame(ctx, surface, {.dt_s = kSubstep_s, .substeps = kSubsteps, .dt_frame_s = kFrame_s},
                        motion.const_view());
    for (int k = 0; k < kSubsteps; ++k) {
      for (std::size_t i = 0; i < nodes.x.size(); ++i) nodes.x[i] += kSubstep_s * nodes.v[i];
      nodes.correct(ctx, contact, surface, k, false, obstacles.view());
    }
    for (const ColliderReaction& r : nodes.report(ctx, kFrame_s, kSubsteps).colliders) {
      EXPECT_EQ(r.collider, kComponents);
      impulse_N_s += vec_cast<double>(r.impulse_N_s);
    }
  }
  Vec3d momentum_N_s() const {
    Vec3d sum{};
    for (std::size_t i = 0; i < nodes.v.size(); ++i)
      sum += static_cast<double>(nodes.mass[i]) * vec_cast<double>(nodes.v[i]);
    return sum;
  }
};

/// Moved along the normal of its flank, the blade takes along what is before it, and gets the opposite of its
/// momentum. Rounding: 45 nodes of 1 g in floats of 0.1 m/s, and sums in units of 2^-40 N s.
TEST_P(ToolOn, AFlankPushes) {
  DeviceSet devices(GetParam());
  Capacity capacity(devices.context(0), test::block({5, 3, 3}, 0.004F, {0, 0, 0.006F}), {0, 0, -0.004F});
  for (int f = 0; f < 6; ++f) capacity.frame({0, 0, 0.1F});
  for (std::size_t i = 0; i < capacity.nodes.x.size(); ++i) {
    EXPECT_GE(capacity.nodes.x[i].z, capacity.center_m.z + kHalf_m - 1e-6F) << i;
    EXPECT_EQ(capacity.nodes.v[i].x, 0.F);
    if (capacity.nodes.v[i].z != 0.F) {
      EXPECT_NEAR(capacity.nodes.v[i].z, 0.1F, 1e-5F) << i;
    }
  }
  const Vec3d momentum = capacity.momentum_N_s();
  EXPECT_GT(momentum.z, 15 * 1e-3 * 0.0999);  // at least the first layer
  EXPECT_NEAR(length(capacity.impulse_N_s + momentum), 0, 1e-6 * momentum.z);
}

/// Sliding along its flank ten times as fast as it presses, it rubs by mu times what it presses.
TEST_P(ToolOn, AFlankRubs) {
  DeviceSet devices(GetParam());
  Capacity capacity(devices.context(0), {{0, 0, 0.0006F}}, {0, 0, 0}, blade(), {.friction = 0.3F});
  capacity.frame({0.1F, 0, 0.01F});
  const Vec3f v = capacity.nodes.v[0];
  EXPECT_NEAR(v.z, 0.01F, 1e-6F);
  EXPECT_NEAR(v.x, 0.3F * 0.01F, 1e-6F);  // Coulomb, at the first touch; then it presses no more
  EXPECT_NEAR(capacity.impulse_N_s.x / capacity.impulse_N_s.z, 0.3, 1e-3);
}

/// What the edge comes upon is parted and not driven before it: nothing moves along the way of the edge, and
/// aside by no more than half of the thickness. A blade that has no edge drives it down.
TEST_P(ToolOn, AnEdgeDoesNotPush) {
  DeviceSet devices(GetParam());
  const std::vector<Vec3f> rest{{0, 0, 0}, {0.004F, 0, 0.0002F}, {-0.004F, 0, -0.0003F}};
  ObstacleDescription blunt = blade();
  blunt.edge_m = {};
  Capacity sharp(devices.context(0), rest, {0, 0.02F, 0}),
      dull(devices.context(0), rest, {0, 0.02F, 0}, blunt);
  for (int f = 0; f < 5; ++f) {
    sharp.frame({0, -0.15F, 0});
    dull.frame({0, -0.15F, 0});
    const bool has_come = sharp.center_m.y - 0.01F < 0;
    for (std::size_t i = 0; i < rest.size(); ++i) {
      const Vec3f moved_m = sharp.nodes.x[i] - rest[i];
      EXPECT_NEAR(moved_m.y, 0, 1e-8F);  // rounding of places 20 mm off: 2e-9 m a substep in contact
      EXPECT_LE(std::abs(moved_m.z), has_come ? kHalf_m + 1e-6F : 0.F);
    }
  }
  EXPECT_LT(sharp.center_m.y - 0.01F, -0.003F);  // it went through them
  for (const Vec3f& x : dull.nodes.x) EXPECT_LT(x.y, -0.003F);
}

/// It is where nobody knows: it touches nothing.
TEST_P(ToolOn, WhatIsNotThereDoesNotTouch) {
  DeviceSet devices(GetParam());
  Capacity capacity(devices.context(0), {{0, 0, 0.002F}}, {0, 0, 0});
  for (int f = 0; f < 3; ++f) capacity.frame({0, 0, 0.1F}, false);
  EXPECT_EQ(capacity.nodes.x[0].z, 0.002F);
  EXPECT_EQ(length(capacity.impulse_N_s), 0);
}

/// Both walls of a cut are where the blade is. Each goes to its own side, from wherever in the blade, little
/// by little: 0.05 m/s, so 0.9 mm take 9 substeps after the first.
TEST_P(ToolOn, WallsOfACutGoToTheirSides) {
  DeviceSet devices(GetParam());
  ExecContext& ctx = devices.context(0);
  Capacity capacity(ctx, {}, {0, 0, 0});
  // Of each point two nodes: one where it is, and one a spacing farther along z.
  const std::vector<float> at_m{-0.0004F, -0.0001F, 0, 0.0001F, 0.0004F};
  std::vector<Vec3f> x_m;
  std::vector<PointChange> points;
  for (const float z : at_m) {
    for (const float out : {-1.F, 1.F}) {
      const auto node = static_cast<Index>(x_m.size());
      x_m.push_back({0.002F * static_cast<float>(points.size()) - 0.01F, 0, z});
      x_m.push_back(x_m.back() + Vec3f{0, 0, kSpacing});
      PointChange& change = points.emplace_back();
      change.point = static_cast<Index>(points.size()) - 1;
      for (int k = 0; k < 8; ++k) change.to.node[k] = node + (k == 0 ? 0 : 1);
      change.to.weight[0] = 1;
      change.side.weight[0] = -out;
      change.side.weight[1] = out;
    }
  }
  const auto count = static_cast<Index>(points.size()), nodes = static_cast<Index>(x_m.size());
  std::vector<EmbeddedPoint> none(points.size());
  BodyPoints touching(ctx, none, nodes, kSpacing, count, {}, count);
  touching.apply(ctx, points);
  Buffer<Vec3f> x = to_device(ctx, x_m), v = to_device(ctx, std::vector<Vec3f>(x_m.size()));
  const Buffer<float> mass = to_device(ctx, std::vector<float>(x_m.size(), 1e-3F));
  const std::vector<ToolMotion> still{{.is_there = 1, .center_m = {}, .velocity_m_s = {}, .spin_rad_s = {}}};
  ctx.upload(still, capacity.motion.view());
  touching.begin_frame(ctx);
  capacity.contact.begin_frame(ctx, capacity.surface, {.dt_s = kSubstep_s, .substeps = 10},
                               capacity.motion.const_view());
  std::vector<Vec3f> before_m = x_m;
  for (int k = 0; k < 10; ++k) {
    capacity.contact.correct(ctx, capacity.surface, capacity.obstacles.view(), touching,
                             ContactNodes{x.view(), v.view(), mass.const_view(), {}}, k);
    const std::vector<Vec3f> now_m = to_host(ctx, x.const_view());
    for (std::size_t p = 0; p < points.size(); ++p)
      EXPECT_LE(length(now_m[2 * p] - before_m[2 * p]), 0.05F * kSubstep_s + 1e-8F) << p;
    before_m = now_m;
  }
  for (std::size_t p = 0; p < points.size(); ++p)  // what faces down lies above the blade
    EXPECT_NEAR(before_m[2 * p].z, p % 2 == 0 ? kHalf_m : -kHalf_m, 1e-8F) << p;
}

TEST(Tool, IsCheckedByName) {
  DeviceSet cpu("cpu");
  const auto expect = [&](const std::vector<ObstacleDescription>& tools, const char* part) {
    const std::string message =
        test::message_of([&] { Obstacles(cpu.context(0), tools, kSpacing); }, ErrorKind::usage);
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  expect({{.name = "b", .kind = ObstacleKind::box, .moves = true}}, "must be a mesh");
  expect(std::vector<ObstacleDescription>(kMostTools + 1, blade()), "at most 4");
}

}  // namespace
}  // namespace tactus
