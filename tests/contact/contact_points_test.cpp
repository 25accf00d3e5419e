#include "tactus/contact/contact_points.h"

#include <gtest/gtest.h>

#include "contact/contact_scene.h"
#include "support/device_sets.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {
namespace {

constexpr float kSpacing = 0.005F, kFriction = 0.3F, kMass_kg = 1e-3F;

class ContactPoints : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(ContactPoints);

struct Met {
  test::Nodes nodes{test::block({6, 2, 6}, kSpacing, {0, 0.0025F, 0})};  // lower nodes at y = 0
  std::vector<Vec3f> v_before;
  ContactPointList list;
};

/// A block of nodes, each a point of its own, that glides 1 mm deep into a floor. The surface is far away.
Met meet(ExecContext& ctx, Vec3f v_m_s) {
  Met met;
  RealSurface surface(ctx.device(), test::small_surface(kSpacing));
  const test::DeviceMesh far(
      ctx, test::transformed(test::box({0.02F, 0.02F, 0.02F}, 8), {Mat3f::identity(), {0, 1, 0}}));
  surface.update(ctx, far.view(), 0);
  std::vector<ObstacleDescription> floor(1);
  floor[0].name = "floor";
  floor[0].T_world_obstacle.t = {0, 0.001F, 0};
  const Obstacles obstacles(ctx, floor, kSpacing);
  Contact contact(ctx.device(), {.friction = kFriction});
  for (std::size_t i = 0; i < met.nodes.v.size(); ++i)
    met.nodes.v[i] = v_m_s + Vec3f{0.01F * static_cast<float>(i % 7), 0, 0.02F * static_cast<float>(i % 3)};
  met.v_before = met.nodes.v;
  met.nodes.begin_frame(ctx);
  contact.begin_frame(ctx, surface, {.dt_s = 1e-3F, .substeps = 1, .dt_frame_s = 1e-3F});
  met.nodes.correct(ctx, contact, surface, 0, false, obstacles.view());
  met.nodes.report(ctx, 1e-3F, 1);
  met.list = read_contact_points(ctx, met.nodes.points);
  return met;
}

/// The sum is taken in double, so what is left are a rounding of each node's velocity and of each impulse,
/// 6e-8 of changes that are about as large as the velocities.
TEST_P(ContactPoints, AddUpToTheChangeOfMomentum) {
  DeviceSet devices(GetParam());
  const Met met = meet(devices.context(0), {0.3F, -1, 0.2F});
  Vec3d changed{}, given{};
  for (std::size_t i = 0; i < met.v_before.size(); ++i)
    changed += double{kMass_kg} * (vec_cast<double>(met.nodes.v[i]) - vec_cast<double>(met.v_before[i]));
  for (const ContactPoint& p : met.list.points) given += vec_cast<double>(p.impulse_N_s);
  EXPECT_EQ(met.list.points.size(), 36U) << "the lower layer";
  EXPECT_GT(changed.y, 0.03);
  EXPECT_LT(length(changed - given), 1e-6 * length(changed));
  for (const ReactionSums& sums : met.list.moved_on) {
    const Vec3f left_N_s = ReactionSums::value(sums.impulse);
    EXPECT_EQ(left_N_s, Vec3f{}) << "no point went on to another collider";
  }
}

/// Points at 1 m/s across get as much friction as Coulomb's law lets them have, those at 0.1 m/s all that
/// they need.
TEST_P(ContactPoints, HaveTheFloorsNormalAndStayInTheConeOfFriction) {
  DeviceSet devices(GetParam());
  for (const bool slides : {true, false}) {
    const Met met = meet(devices.context(0), {slides ? 1.F : 0.1F, -1, 0});
    for (const ContactPoint& p : met.list.points) {
      EXPECT_EQ(p.collider, kComponents);
      EXPECT_EQ(p.n, (Vec3f{0, 1, 0}));
      EXPECT_NEAR(p.gap_m, -0.001F, 1e-9);
      EXPECT_NEAR(p.x_m.y, 0.001F, 1e-9);
      const float normal_N_s = dot(p.impulse_N_s, p.n),
                  tangential_N_s = length(p.impulse_N_s - normal_N_s * p.n);
      EXPECT_NEAR(normal_N_s / kMass_kg, 1, 2e-6);  // weights are rounded up by 1e-6
      EXPECT_EQ(p.state, slides ? TouchState::sliding : TouchState::sticking);
      if (slides)
        EXPECT_NEAR(tangential_N_s / normal_N_s, kFriction, 1e-6);
      else
        EXPECT_LT(tangential_N_s, kFriction * normal_N_s);
    }
  }
}

/// Kernels go over the blocks of points, and of nodes, that something is in: 40 points are in two blocks of
/// 32, 40 nodes in three groups of 16. Points that come fill the second block, then they take the third. The
/// other 311 blocks are visited by none.
TEST_P(ContactPoints, CapacityIsNotVisited) {
  DeviceSet devices(GetParam());
  ExecContext& ctx = devices.context(0);
  constexpr Index kPoints = 40, kCapacity = 10000, kNodes = 5000;
  std::vector<EmbeddedPoint> all(kPoints + kCapacity);
  for (Index p = 0; p < kPoints; ++p) {
    all[static_cast<std::size_t>(p)].node[0] = p;
    all[static_cast<std::size_t>(p)].weight[0] = 1;
  }
  BodyPoints points(ctx, all, kNodes, kSpacing, kPoints + kCapacity, {}, kCapacity);
  const auto used = [&](const UsedEntries& entries) {
    const Index count = to_host(ctx, entries.count)[0];
    std::vector<Index> list = to_host(ctx, entries.entries);
    list.resize(static_cast<std::size_t>(count));
    return list;
  };
  EXPECT_EQ(points.block_count(), 314);
  EXPECT_EQ(used(points.used_points().used), (std::vector<Index>{0, 1}));
  EXPECT_EQ(used(points.table().row_groups), (std::vector<Index>{0, 1, 2}));
  PointChange change{.point = kPoints, .to = {}};
  change.to.node[0] = 4000;
  change.to.weight[0] = 1;
  points.apply(ctx, std::vector<PointChange>{change});
  EXPECT_EQ(used(points.used_points().used), (std::vector<Index>{0, 1}));
  EXPECT_EQ(used(points.table().row_groups), (std::vector<Index>{0, 1, 2, 250}));
  for (Index p = kPoints + 1; p <= 2 * kBlockPoints; ++p) {
    change.point = p;
    points.apply(ctx, std::vector<PointChange>{change});
  }
  EXPECT_EQ(used(points.used_points().used), (std::vector<Index>{0, 1, 2}));
}

}  // namespace
}  // namespace tactus
