#include "tactus/contact/contact.h"

#include <gtest/gtest.h>

#include <random>

#include "contact/contact_scene.h"
#include "support/device_sets.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {
namespace {

constexpr float kSpacing = 0.005F;
constexpr float kDt = 1.F / 30;
constexpr int kSubsteps = 5;
constexpr float kSubstep = kDt / kSubsteps;
constexpr ContactTimes kFrame{.dt_s = kSubstep, .substeps = kSubsteps, .dt_frame_s = kDt};

/// One substep that ends t after the surface's capture, t >= -kDt.
ContactTimes one_at(float t_s) { return {.dt_s = kDt + t_s, .substeps = 1, .dt_frame_s = kDt}; }

class ContactOn : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(ContactOn);

/// Depth of p in a box [m], negative outside.
float depth_in_box(Vec3f p, const Rigidf& T_world_box, Vec3f half) {
  const Vec3f q = inverse(T_world_box) * p;
  return std::min({half.x - std::abs(q.x), half.y - std::abs(q.y), half.z - std::abs(q.z)});
}

struct Push {
  bool sphere = false;
  bool blade = false;     ///< 1 mm, a fifth of a spacing thick
  float spring_1_s2 = 0;  ///< ω² of the springs that hold the nodes; 0: free
  float spin_rad_s = 0;
};

struct PushResult {
  std::vector<Vec3f> x;
  float deepest_m = 0;  ///< at the ends of frames
  Index touched = 0;
};

/// A shape comes down at 1 m/s through a block of nodes, tessellated anew in every frame.
PushResult push(ExecContext& ctx, const Push& scene) {
  const Vec3f half = {0.03F, scene.blade ? 0.0005F : 0.015F, 0.03F};
  const float radius = 0.03F;
  test::Nodes nodes(test::block({9, 5, 9}, kSpacing, {0, 0, 0}));
  const std::vector<Vec3f> rest = nodes.x;
  RealSurface surface(ctx.device(), test::small_surface(kSpacing));
  Contact contact(ctx.device());
  PushResult result;
  for (int f = 0; f < 6; ++f) {
    const float t = static_cast<float>(f) * kDt;
    const Rigidf T{rotation_matrix(axis_angle({0, 0, 1}, scene.spin_rad_s * t)),
                   {0.002F, 0.075F - t, 0.001F}};
    const test::DeviceMesh mesh(ctx, scene.sphere ? test::transformed(test::unit_sphere(14 + f), T, radius)
                                                  : test::transformed(test::box(half, 14 + f), T));
    surface.update(ctx, mesh.view(), kDt);
    nodes.begin_frame(ctx);
    contact.begin_frame(ctx, surface, kFrame);
    for (int k = 0; k < kSubsteps; ++k) {
      for (std::size_t i = 0; i < nodes.x.size(); ++i) {
        nodes.v[i] += (kSubstep * scene.spring_1_s2) * (rest[i] - nodes.x[i]);
        nodes.x[i] += kSubstep * nodes.v[i];
      }
      nodes.correct(ctx, contact, surface, k, k == 0);
    }
    result.touched += static_cast<Index>(nodes.report(ctx, kDt, kSubsteps).contacts_per_substep * kSubsteps);
    for (const Vec3f& p : nodes.x) {
      float depth = scene.sphere ? radius - length(p - T.t) : depth_in_box(p, T, half);
      if (scene.blade) depth = p.y - (T.t.y - half.y);  // none may come out on its other side
      result.deepest_m = std::max(result.deepest_m, depth);
    }
  }
  result.x = nodes.x;
  return result;
}

TEST_P(ContactOn, PushingAtOneMetrePerSecondLeavesNoNodeInside) {
  DeviceSet reference("cpu");
  DeviceSet devices(GetParam(), 5);
  int scene_number = 0;
  for (const Push scene :
       {Push{.spring_1_s2 = 0}, Push{.spring_1_s2 = 900}, Push{.spring_1_s2 = 900, .spin_rad_s = 2},
        Push{.sphere = true}, Push{.sphere = true, .spring_1_s2 = 900},
        Push{.blade = true, .spring_1_s2 = 900}}) {
    const PushResult expected = push(reference.context(0), scene);
    EXPECT_GT(expected.touched, 100);
    EXPECT_LT(expected.deepest_m, 0.5F * kSpacing)
        << "sphere " << scene.sphere << " spring " << scene.spring_1_s2 << " spin " << scene.spin_rad_s;
    RecordProperty("deepest_spacings_" + std::to_string(scene_number++),
                   std::to_string(expected.deepest_m / kSpacing));
    devices.for_each_part([&](ExecContext& ctx, int) { EXPECT_EQ(push(ctx, scene).x, expected.x); });
  }
}

struct Touched {
  std::vector<Vec3f> x, v;
};
/// Nodes in the middle of the top of a plate that moves by v; x, v after one correction at t = 0.
Touched touch_plate(const ContactSettings& settings, Vec3f plate_velocity,
                    const std::vector<Vec3f>& velocities, float height_m, ContactReport* report = nullptr) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  RealSurface surface(ctx.device(), test::small_surface(kSpacing));
  const TriangleMesh plate = test::box({0.04F, 0.01F, 0.04F}, 16);
  const test::DeviceMesh before(
      ctx, test::transformed(plate, {Mat3f::identity(), Vec3f{0, -0.01F, 0} - kDt * plate_velocity}));
  const test::DeviceMesh now(ctx, test::transformed(plate, {Mat3f::identity(), {0, -0.01F, 0}}));
  surface.update(ctx, before.view(), kDt);
  surface.update(ctx, now.view(), kDt);
  test::Nodes nodes(std::vector<Vec3f>(velocities.size()), 2e-3F);
  for (std::size_t i = 0; i < velocities.size(); ++i)
    nodes.x[i] = {0.003F * static_cast<float>(i) - 0.01F, height_m, 0.001F};
  nodes.v = velocities;
  nodes.fixed.back() = kAllAxes;
  Contact contact(ctx.device(), settings);
  nodes.begin_frame(ctx);
  contact.begin_frame(ctx, surface, one_at(0));
  nodes.correct(ctx, contact, surface, 0);
  if (report != nullptr) *report = nodes.report(ctx, kDt, 1);
  return {nodes.x, nodes.v};
}

TEST(Contact, VelocitiesAsInClosedForm) {
  const std::vector<Vec3f> v = {{0, -1, 0}, {0, 1, 0}, {0.3F, -1, 0}, {2, -1, 0}, {0, 0, 0.7F}, {0, -1, 0}};
  for (const float e : {0.F, 0.4F, 1.F}) {
    const Touched n = touch_plate({e, 0.5F}, {}, v, -0.001F);
    const float tolerance =
        1e-4F;  // normals of the flat middle and the fitted velocity of a still plate: 1e-5
    EXPECT_LT(length(n.v[0] - Vec3f{0, e, 0}), tolerance);
    EXPECT_LT(length(n.v[1] - v[1]), tolerance) << "separating";
    EXPECT_LT(length(n.v[2] - Vec3f{0, e, 0}), tolerance) << "sticks: 0.3 < 0.5 (1 + e)";
    EXPECT_LT(length(n.v[3] - Vec3f{2 - 0.5F * (1 + e), e, 0}), tolerance) << "slips";
    EXPECT_LT(length(n.v[4] - v[4]), tolerance) << "no normal impulse, no friction";
    EXPECT_EQ(n.v[5], v[5]) << "fixed";
    EXPECT_EQ(n.x[5].y, -0.001F) << "fixed";
    for (std::size_t i = 0; i < 5; ++i)
      EXPECT_NEAR(n.x[i].y, 0, 1e-6) << "a position correction for all, along n only";
  }
  const Touched free = touch_plate({0, 0.5F}, {}, v, 0.001F);
  EXPECT_EQ(free.v, v);
  EXPECT_EQ(free.x[0].y, 0.001F);
}

TEST(Contact, AMovingPlateCarriesAndDrags) {
  const std::vector<Vec3f> v = {{0, 0, 0}, {0, 0.5F, 0}, {0, 0, 0}};
  const Touched n = touch_plate({0, 10.F}, {0.1F, 0.3F, 0}, v, -0.001F);
  // The fitted velocity is off by the sampling's noise, see real_surface_test: 0.03 m/s.
  EXPECT_LT(length(n.v[0] - Vec3f{0.1F, 0.3F, 0}), 0.03F);
  EXPECT_EQ(n.v[1], v[1]) << "leaves faster than the plate comes";
}

TEST(Contact, EachPlateDragsWhatTouchesIt) {
  // Two plates side by side rise and go apart: nodes on each take over its own velocity, also between frames.
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const Vec3f velocity[2] = {{-0.2F, 0.3F, 0}, {0.2F, -0.1F, 0.1F}};
  const auto plates = [&](float t) {
    TriangleMesh both;
    for (int k = 0; k < 2; ++k) {
      const Vec3f at = {k == 0 ? -0.06F : 0.06F, -0.01F, 0};
      both = test::together(both, test::transformed(test::box({0.04F, 0.01F, 0.04F}, 16),
                                                    {Mat3f::identity(), at + t * velocity[k]}));
    }
    return both;
  };
  RealSurface surface(ctx.device(), test::small_surface(kSpacing));
  for (const float t : {-kDt, 0.F}) surface.update(ctx, test::DeviceMesh(ctx, plates(t)).view(), kDt);
  ASSERT_EQ(surface.report(ctx).components.count, 2);
  for (const float t : {0.F, -0.5F * kDt}) {
    std::vector<Vec3f> x;
    for (int k = 0; k < 2; ++k) x.push_back(Vec3f{k == 0 ? -0.06F : 0.06F, -0.001F, 0} + t * velocity[k]);
    test::Nodes nodes(x, 2e-3F);
    nodes.v.assign(2, {0, -1, 0});
    Contact contact(ctx.device(), {.restitution = 0, .friction = 10});
    nodes.begin_frame(ctx);
    contact.begin_frame(ctx, surface, one_at(t));
    nodes.correct(ctx, contact, surface, 0);
    for (std::size_t k = 0; k < 2; ++k) {
      // As above; the top is where it was, so its error is the velocity's over half a frame.
      EXPECT_LT(length(nodes.v[k] - velocity[k]), 0.03F);
      EXPECT_NEAR(nodes.x[k].y, t * velocity[k].y, 0.03F * 0.5F * kDt + 1e-5F);
    }
  }
}

TEST(Contact, ReactionIsMinusTheChangeOfMomentum) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> u(-1, 1);
  std::vector<Vec3f> v(6);
  for (Vec3f& x : v) x = {u(random), u(random) - 0.5F, u(random)};
  ContactReport report;
  const Touched n = touch_plate({0.3F, 0.4F}, {}, v, -0.001F, &report);
  Vec3d impulse{}, moment{};
  const Vec3d center = {0, -0.01, 0};
  for (std::size_t i = 0; i < v.size(); ++i) {
    const Vec3d j = 2e-3 * vec_cast<double>(v[i] - n.v[i]);
    impulse += j;
    moment += cross(vec_cast<double>(n.x[i]) - center, j);
  }
  // Sums of 6 impulses of 4e-3 N s in float32, divided by dt: 6 * 4e-3 * 30 * 6e-8 = 4e-8 N; the centre is
  // good to 1e-5 m, so moments (force 0.3 N) to 3e-6 N m.
  EXPECT_LT(length(vec_cast<double>(kDt * report.force_N) - impulse), 1e-8);
  EXPECT_LT(length(vec_cast<double>(report.torque_N_m) - moment / static_cast<double>(kDt)), 1e-5);
  EXPECT_GT(length(impulse), 1e-3);
  EXPECT_NEAR(report.max_depth_m, 0.001, 1e-6);
}

TEST(Contact, DeepNodesAreRescuedAndOutsideOnesAreNot) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const float radius = 0.05F;
  RealSurface surface(ctx.device(), test::small_surface(kSpacing));
  const test::DeviceMesh mesh(ctx, test::transformed(test::unit_sphere(24), {}, radius));
  surface.update(ctx, mesh.view(), kDt);
  std::vector<Vec3f> x;
  for (int k = 0; k < 40; ++k) {
    const Vec3f d = normalized(Vec3f{static_cast<float>(k % 5) - 2, static_cast<float>(k % 7) - 3,
                                     static_cast<float>(k % 3) - 0.9F});
    x.push_back((k < 20 ? radius - 5 * kSpacing : radius + (1 + 0.2F * static_cast<float>(k)) * kSpacing) *
                d);
  }
  test::Nodes nodes(x);
  Contact contact(ctx.device());
  nodes.begin_frame(ctx);
  contact.begin_frame(ctx, surface, one_at(0));
  nodes.correct(ctx, contact, surface, 0, true);
  EXPECT_EQ(nodes.report(ctx, kDt, 1).pushed_out, 20);
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (k < 20)
      EXPECT_GT(length(nodes.x[k]), radius - 0.5F * kSpacing) << k;
    else
      EXPECT_EQ(nodes.x[k], x[k]);
    EXPECT_EQ(nodes.v[k], Vec3f{});
  }
}

/// A plate touches a node from above; the body then springs the node up, past the plate's middle or out on
/// the other side. The nearest side is then the upper one, and only the way that the node went tells the
/// right one.
TEST(Contact, WhatSpringsThroughAPlateIsHeldOnItsSide) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const float dt = 1e-3F;
  // 1.6, 0.4 and 0.04 spacings thick: what is farther than 2 spacings from a point is not seen.
  for (const float half : {0.004F, 0.001F, 0.0001F}) {
    RealSurface surface(ctx.device(), test::small_surface(kSpacing));
    const test::DeviceMesh plate(ctx, test::box({0.04F, half, 0.04F}, 16));
    surface.update(ctx, plate.view(), 0);
    Contact contact(ctx.device(), {0, 0.5F});
    test::Nodes nodes({{0, -0.9F * half, 0}});
    nodes.v[0] = {0, 0.2F * half / dt, 0};
    nodes.begin_frame(ctx);
    contact.begin_frame(ctx, surface, {.dt_s = dt, .substeps = 9, .dt_frame_s = 9 * dt});
    nodes.correct(ctx, contact, surface, 0);
    EXPECT_NEAR(nodes.x[0].y, -half, 1e-6F);
    for (const float to : {0.5F * half, 1.4F * half}) {
      nodes.v[0] = (1 / dt) * (Vec3f{0.0001F, to, 0} - nodes.x[0]);
      nodes.x[0] += dt * nodes.v[0];
      nodes.correct(ctx, contact, surface, 1);
      EXPECT_NEAR(nodes.x[0].y, -half, 1e-6F) << half << " to " << to;
      EXPECT_NEAR(nodes.v[0].y, 0, 1e-3F);
      nodes.x[0].x = 0;
    }
  }
}

/// Points that are outside keep their bits, from far off to 1 um; all inside are brought out.
TEST_P(ContactOn, WhatIsOutsideChangesNothing) {
  const float half = 0.02F;
  const TriangleMesh boxes = test::together(
      test::box({half, half, half}, 12),
      test::transformed(test::box({half, half, half}, 12), {Mat3f::identity(), {-0.3F, 0, 0}}));
  std::vector<Vec3f> x;
  for (int k = 0; k < 800; ++k) {
    // To 1 m: cells of 2 spacings wrap around every 32 of them, 0.32 m, so far points share slots with
    // triangles.
    const float out = half - 0.003F + (k < 40 ? 0.0002F : 0.00125F) * static_cast<float>(k) + 1e-6F;
    x.insert(x.end(), {{out, 0.001F, 0.002F}, {0.001F, -out, 0.002F}, {out, out, out}, {out, out, 0.0011F}});
  }
  x.push_back({std::numeric_limits<float>::quiet_NaN(), 0, 0});
  DeviceSet devices(GetParam(), 7);
  devices.for_each_part([&](ExecContext& ctx, int) {
    RealSurface surface(ctx.device(), test::small_surface(kSpacing));
    const test::DeviceMesh mesh(ctx, boxes);
    surface.update(ctx, mesh.view(), 0);
    const RealSurfaceReport report = surface.report(ctx);
    ASSERT_EQ(report.components.count, 2);
    test::Nodes nodes(x, 1e-3F);
    Contact contact(ctx.device());
    nodes.begin_frame(ctx);
    contact.begin_frame(ctx, surface, one_at(0));
    nodes.correct(ctx, contact, surface, 0, true);
    Index moved = 0;
    for (std::size_t i = 0; i + 1 < x.size(); ++i) {
      const bool inside = std::abs(x[i].x) < half && std::abs(x[i].y) < half && std::abs(x[i].z) < half;
      moved += inside ? 1 : 0;
      if (!inside) {
        EXPECT_EQ(nodes.x[i], x[i]) << i;
        continue;
      }
      // To the nearest side, to rounding.
      const Vec3f p = nodes.x[i];
      EXPECT_NEAR(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}), half, 1e-7F) << i;
    }
    EXPECT_EQ(nodes.report(ctx, kDt, 1).contacts_per_substep, moved);
    EXPECT_GT(moved, 10);
    EXPECT_TRUE(std::isnan(nodes.x.back().x));
  });
}

/// A plate that is 13 cm (13 reaches) above a node when the frame begins and in it when it ends, and a node
/// that jumps as far to a plate at rest, in one substep: whatever moves, it is where it is now that counts.
TEST_P(ContactOn, WhatArrivesWithinAFrameTouches) {
  const Vec3f velocity = {0, -4, 0};
  const TriangleMesh plate = test::box({0.04F, 0.01F, 0.04F}, 16);
  const auto at = [&](Vec3f t) { return test::transformed(plate, {Mat3f::identity(), t}); };
  DeviceSet devices(GetParam(), 3);
  devices.for_each_part([&](ExecContext& ctx, int) {
    RealSurface moving(ctx.device(), test::small_surface(kSpacing)),
        still(ctx.device(), test::small_surface(kSpacing));
    const test::DeviceMesh before(ctx, at(Vec3f{0, 0.009F, 0} - kDt * velocity)),
        now(ctx, at({0, 0.009F, 0}));
    moving.update(ctx, before.view(), kDt);
    moving.update(ctx, now.view(), kDt);
    still.update(ctx, now.view(), kDt);
    Contact contact(ctx.device());
    test::Nodes node(std::vector<Vec3f>(1));
    node.begin_frame(ctx);
    contact.begin_frame(ctx, moving, kFrame);
    for (int k = 0; k < kSubsteps; ++k) {
      node.correct(ctx, contact, moving, k, k == 0);
      if (k + 1 < kSubsteps) {
        ASSERT_EQ(node.x[0], Vec3f{}) << "after substep " << k;
      }
    }
    // The plate's lower side is at -1 mm; it is as far off as its fitted velocity (0.03 m/s, as above) at 0
    // s.
    EXPECT_NEAR(node.x[0].y, -0.001F, 1e-5F);
    EXPECT_NEAR(node.v[0].y, -4, 0.03F);
    EXPECT_EQ(node.report(ctx, kDt, kSubsteps).contacts_per_substep * kSubsteps, 1);

    test::Nodes jumps(std::vector<Vec3f>{{0, -0.13F, 0}});
    jumps.begin_frame(ctx);
    contact.begin_frame(ctx, still, kFrame);
    jumps.correct(ctx, contact, still, 0, true);
    EXPECT_EQ(jumps.x[0], (Vec3f{0, -0.13F, 0}));
    jumps.x[0] = {};
    jumps.correct(ctx, contact, still, 1);
    EXPECT_NEAR(jumps.x[0].y, -0.001F, 1e-5F);
  });
}

TEST(Contact, FramesOfManySubstepsMeetTheSurfaceWhereItIs) {
  // More substeps than are posed at once, and a body that goes 40 of them at a time beside one that does not.
  constexpr Index kMany = 160, kEvery = 40;
  const Vec3f velocity = {0, -0.3F, 0};
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const TriangleMesh plate = test::box({0.04F, 0.01F, 0.04F}, 16);
  RealSurface surface(ctx.device(), test::small_surface(kSpacing));
  for (const float t : {-kDt, 0.F})
    surface.update(
        ctx, test::DeviceMesh(ctx, test::transformed(plate, {Mat3f::identity(), t * velocity})).view(), kDt);
  const SurfaceMotion motion = surface.report(ctx).motions[0];
  const ContactTimes times{.dt_s = kDt / kMany, .substeps = kMany, .dt_frame_s = kDt};
  Contact contact(ctx.device());
  contact.begin_frame(ctx, surface, times);
  for (Index k = 0; k < kMany; ++k) {
    for (const Index steps : {Index{1}, kEvery}) {
      if (k % steps != 0) continue;
      // Where the lower side is then, by what was fitted; 4 mm is well within reach.
      const float y = -0.01F + times.after_s(k + steps) * motion.velocity_m_s.y;
      test::Nodes node({{0, y + 0.004F, 0}});
      node.begin_frame(ctx);
      node.correct(ctx, contact, surface, k, false, {}, steps);
      // Rounding of positions of 1e-2 m, and of a turn by what spin was fitted to a flat plate: below 1e-5 m.
      EXPECT_NEAR(node.x[0].y, y, 1e-5F) << k << ", " << steps;
    }
  }
}

/// A point with weight 0.99 at a held node and 0.01 at a free one, 1 mm inside: to bring it out, the free
/// node alone would have to go 0.1 m. It goes no farther than a free point would.
TEST(Contact, WhatIsHeldDoesNotThrowItsNeighbours) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  RealSurface surface(ctx.device(), test::small_surface(kSpacing));
  const test::DeviceMesh plate(ctx, test::box({0.04F, 0.01F, 0.04F}, 16));
  surface.update(ctx, plate.view(), 0);
  Contact contact(ctx.device());
  const float depth = 0.001F;
  EmbeddedPoint point{};
  point.node[1] = 1;
  point.weight[0] = 0.99F;
  point.weight[1] = 0.01F;
  BodyPoints points(ctx, std::vector{point}, 2, kSpacing);
  Buffer<Vec3f> x = to_device(ctx, std::vector<Vec3f>(2, {0, 0.01F - depth, 0})),
                v = to_device(ctx, std::vector<Vec3f>(2, {0, -0.1F, 0}));
  const Buffer<float> mass = to_device(ctx, std::vector<float>(2, 1e-3F));
  const Buffer<Index> held = to_device(ctx, std::vector<Index>{1, 0});
  contact.begin_frame(ctx, surface, {.dt_s = 1e-3F, .substeps = 1});
  points.begin_frame(ctx);
  contact.correct(ctx, surface, {}, points, {x.view(), v.view(), mass.const_view(), held.const_view()}, 0);
  const Vec3f moved = to_host(ctx, x.const_view())[1] - Vec3f{0, 0.01F - depth, 0},
              kicked = to_host(ctx, v.const_view())[1] - Vec3f{0, -0.1F, 0};
  EXPECT_GT(moved.y, 0);
  EXPECT_LE(length(moved), depth);
  EXPECT_LE(length(kicked), 0.1F);
}

TEST(Contact, BadSettingsAndSizesAreNamed) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  EXPECT_THROW(Contact(ctx.device(), {1.5F, 0}), Error);
  EXPECT_THROW(Contact(ctx.device(), {0, -1.F}), Error);
  RealSurface surface(ctx.device(), test::small_surface(kSpacing));
  Contact contact(ctx.device());
  test::Nodes uneven(std::vector<Vec3f>(3));
  uneven.mass.pop_back();
  EXPECT_THROW(uneven.correct(ctx, contact, surface, 0), Error);
  EmbeddedPoint stray{};
  stray.node[3] = 7;
  EXPECT_THROW(BodyPoints(ctx, std::vector{stray}, 7, kSpacing), Error);
}

}  // namespace
}  // namespace tactus
