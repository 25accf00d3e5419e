// Bodies that touch one another, and themselves.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "contact/pair_scene.h"
#include "support/device_sets.h"

namespace tactus {
namespace {

struct Collision {
  const char* name;
  bool first_matched, second_matched;
  float second_spacing_m;
};

void PrintTo(const Collision& c, std::ostream* out) { *out << c.name; }

class TwoBlocks : public ::testing::TestWithParam<Collision> {};
INSTANTIATE_TEST_SUITE_P(All, TwoBlocks,
                         ::testing::Values(Collision{"elements", false, false, 0.01F},
                                           Collision{"matched", true, true, 0.01F},
                                           Collision{"unequal", false, false, 0.006F},
                                           Collision{"mixed", false, true, 0.008F}),
                         [](const auto& i) { return i.param.name; });

/// One block of 6 cm flies at 1 m/s at another of the same size, shifted and turned a little, so that no
/// nodes meet.
TEST_P(TwoBlocks, MeetAtOneMetrePerSecond) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const float h = 0.01F, h2 = GetParam().second_spacing_m;
  const auto n2 = static_cast<Index>(0.06F / h2 + 0.5F);
  const test::SoftMaterial soft{.elastic = {.young_Pa = 2e4F, .poisson = 0.4F}};
  test::SoftMaterial first = soft, second = soft;
  first.matched = GetParam().first_matched;
  second.matched = GetParam().second_matched;
  test::SoftThing a = test::soft_box(ctx, {-0.065F, 0.003F, -0.002F}, {6, 6, 6}, h, first);
  test::SoftThing b = test::soft_box(ctx, {0, 0, 0}, {n2, n2, n2}, h2, second);
  a.launch(ctx, {1, 0, 0});
  test::PairScene scene(ctx, {&a, &b});
  const float dt = std::min(0.8F * scene.stable_step_s(), 5e-4F);
  const test::PairSums before = scene.sums();
  const bool has_elements = !first.matched && !second.matched;
  float deepest = 0;
  double most_J = 0, most_p = 0;
  for (int f = 0; f < 40; ++f) {
    scene.run(static_cast<int>(0.002F / dt), dt);
    const test::PairSums now = scene.sums();
    deepest = std::max(deepest, scene.deepest_m());
    most_J = std::max(most_J, has_elements ? now.energy_J : now.kinetic_J);
    most_p = std::max(most_p, length(now.momentum_kg_m_s - before.momentum_kg_m_s) / now.size_of_momentum);
  }
  const test::PairSums after = scene.sums();
  std::printf("deepest %.3f spacings, energy %.5f, at most %.5f, then %.5f J, dp %.2g, p of b %.3f of %.3f\n",
              static_cast<double>(deepest / h), before.energy_J, most_J,
              has_elements ? after.energy_J : after.kinetic_J, most_p, b.monitors(ctx).momentum_kg_m_s.x,
              before.momentum_kg_m_s.x);
  EXPECT_LE(deepest, 0.25F * std::min(h, h2));
  EXPECT_LE(most_p, 1e-6);
  EXPECT_LE(most_J, 1.001 * before.energy_J);
  EXPECT_GT(b.monitors(ctx).momentum_kg_m_s.x, 0.5 * before.momentum_kg_m_s.x) << "b was struck";
}

/// Three blocks on a plane, each on the one below. Returns how far any block's middle moved between the first
/// second and the end, in spacings.
double stack_creep(float seconds, bool matched, float* deepest) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const float h = 0.02F;
  const test::SoftMaterial soft{
      .elastic = {.young_Pa = 3e4F, .poisson = 0.3F}, .matched = matched, .damping = 0.5F};
  test::SoftThing low = test::soft_box(ctx, {-0.06F, 0, -0.06F}, {6, 3, 6}, h, soft);
  test::SoftThing middle = test::soft_box(ctx, {-0.05F, 0.0601F, -0.047F}, {5, 3, 5}, h, soft);
  test::SoftThing high = test::soft_box(ctx, {-0.04F, 0.1202F, -0.044F}, {4, 2, 4}, h, soft);
  test::PairScene scene(ctx, {&low, &middle, &high});
  scene.obstacles = Obstacles(ctx, std::vector<ObstacleDescription>{{.name = "floor"}}, h);
  const float dt = std::min(0.8F * scene.stable_step_s(), 2e-3F);
  const int frame = static_cast<int>(0.1F / dt);
  const auto pass = [&](float s) {
    for (int f = 0; f < static_cast<int>(10 * s + 0.5F); ++f) {
      scene.run(frame, dt, {0, -9.81F, 0});
      *deepest = std::max(*deepest, scene.deepest_m() / h);
    }
  };
  pass(1);
  std::vector<Vec3d> before;
  for (const test::SoftThing* body : scene.bodies) before.push_back(test::middle_m(ctx, *body));
  pass(seconds - 1);
  double most = 0;
  for (std::size_t b = 0; b < 3; ++b) {
    const Vec3d moved = test::middle_m(ctx, *scene.bodies[b]) - before[b];
    std::printf("block %zu moved by (%.2g, %.2g, %.2g) spacings\n", b, moved.x / 0.02, moved.y / 0.02,
                moved.z / 0.02);
    most = std::max(most, length(moved) / 0.02);
  }
  return most;
}

TEST(BodyPairs, AStackOfThreeStands) {
  const bool is_long = std::getenv("TACTUS_LONG_TESTS") != nullptr;
  for (const bool matched : {false, true}) {
    float deepest = 0;
    // In two seconds it is still settling: 0.008 spacings. After a minute a twentieth is allowed.
    EXPECT_LE(stack_creep(is_long ? 60.F : 3.F, matched, &deepest), 0.05);
    EXPECT_LE(deepest, 0.25F);
  }
}

/// A U lying on its side: two arms that are joined at the left, with a slot of 4 spacings between them.
TriangleMesh flap_mesh(float h) {
  const float length = 16.5F * h, low = 2.25F * h, high = low + 4 * h, top = high + 2.25F * h,
              back = 3.25F * h, depth = 4.5F * h;
  const std::vector<Vec3f> outline{{0, 0, 0},       {length, 0, 0},    {length, low, 0}, {back, low, 0},
                                   {back, high, 0}, {length, high, 0}, {length, top, 0}, {0, top, 0},
                                   {0, high, 0},    {0, low, 0}};
  TriangleMesh mesh;
  for (const float z : {0.F, depth}) {
    for (const Vec3f& p : outline) mesh.positions_m.push_back({p.x, p.y, z});
  }
  // Seen from +z, counter-clockwise.
  const std::vector<std::array<Index, 3>> cap{{0, 1, 2}, {0, 2, 3}, {0, 3, 9}, {9, 3, 4},
                                              {9, 4, 8}, {7, 8, 4}, {7, 4, 5}, {7, 5, 6}};
  for (const auto& t : cap) {
    mesh.triangles.push_back({t[0] + 10, t[1] + 10, t[2] + 10});
    mesh.triangles.push_back({t[0], t[2], t[1]});
  }
  for (Index a = 0; a < 10; ++a) {
    const Index b = (a + 1) % 10;
    mesh.triangles.push_back({a, b, b + 10});
    mesh.triangles.push_back({a, b + 10, a + 10});
  }
  return mesh;
}

/// Each triangle in four.
TriangleMesh split(const TriangleMesh& mesh) {
  TriangleMesh out;
  out.positions_m = mesh.positions_m;
  std::map<std::pair<Index, Index>, Index> middles;
  const auto middle = [&](Index a, Index b) {
    const auto [found, is_new] =
        middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<Index>(out.positions_m.size()));
    if (is_new)
      out.positions_m.push_back(0.5F * (mesh.positions_m[static_cast<std::size_t>(a)] +
                                        mesh.positions_m[static_cast<std::size_t>(b)]));
    return found->second;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    const Index ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    out.triangles.insert(out.triangles.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return out;
}

/// The upper arm falls on the lower one, which is held at its lower half. Returns how often a node that is at
/// least half a spacing inside of the body was inside of it twice: the deformed surface, in triangles of a
/// spacing, goes round it two times.
int nodes_inside_twice(bool touches_itself, bool matched) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const float h = 0.01F;
  const TriangleMesh mesh = flap_mesh(h);
  CubeLattice lattice = lattice_from_mesh(mesh, {.spacing_m = h, .density_kg_m3 = 1000});
  const PointInMesh solid(mesh);
  std::vector<float> outside_m;
  for (const Vec3f p : lattice.rest_positions_m()) outside_m.push_back(solid.signed_distance_m(p));
  lattice.fix_half_space({0, 1.5F * h, 0}, {0, 1, 0});
  const test::SoftMaterial soft{
      .elastic = {.young_Pa = 5e4F, .poisson = 0.3F}, .matched = matched, .damping = 0.3F};
  test::SoftThing flap(ctx, lattice, mesh, soft);
  test::PairScene scene(ctx, {&flap}, {}, touches_itself);
  EmbeddedSurface fine(ctx, lattice, split(split(split(split(mesh)))));
  const float dt = std::min(0.5F * scene.stable_step_s(), 1e-3F);
  int twice = 0;
  for (int f = 0; f < 30; ++f) {
    scene.run(static_cast<int>(0.02F / dt), dt, {0, -9.81F, 0});
    if (f % 5 != 4) continue;
    fine.update(ctx, flap.state);
    const PointInMesh now(fine.to_mesh(ctx));
    const std::vector<Vec3f> x = to_host(ctx, flap.state.x_m.const_view());
    for (std::size_t n = 0; n < x.size(); ++n)
      twice += outside_m[n] < -0.5F * h && now.winding(x[n]) > 1 ? 1 : 0;
  }
  return twice;
}

TEST(BodyPairs, AFoldedFlapNeverPassesItself) {
  for (const bool matched : {false, true}) {
    EXPECT_EQ(nodes_inside_twice(true, matched), 0) << (matched ? "matched" : "elements");
    const int without = nodes_inside_twice(false, matched);
    std::printf("%d nodes were inside twice without contact\n", without);
    EXPECT_GT(without, 10) << "the arm must get there";
  }
}

/// How a block slides on a body all of whose nodes are held, with gravity turned.
double slide_on_body_m(double tilt_rad, double* acceleration_m_s2) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const float h = 0.01F;
  const test::SoftMaterial soft{.elastic = {.young_Pa = 3e4F, .poisson = 0.3F}, .damping = 0.5F};
  test::SoftThing block = test::soft_box(ctx, {-0.03F, 0, -0.02F}, {6, 2, 4}, h, soft);
  test::SoftThing slope =
      test::soft_box(ctx, {-0.1F, -0.06F, -0.05F}, {26, 5, 9}, 0.012F, soft, [](Vec3f) { return true; });
  test::PairScene scene(ctx, {&block, &slope}, {.friction = 0.5F});
  const float dt = 0.8F * scene.stable_step_s();
  const Vec3f g{static_cast<float>(9.81 * std::sin(tilt_rad)), static_cast<float>(-9.81 * std::cos(tilt_rad)),
                0};
  for (int f = 0; f < 10; ++f) scene.run(static_cast<int>(0.03F / dt), dt, {0, -9.81F, 0}, 5);
  const int half = static_cast<int>(0.4F / dt);
  const auto speed = [&] { return block.monitors(ctx).momentum_kg_m_s.x / block.lattice.mass_kg(); };
  scene.run(half, dt, g);
  const double begin = test::middle_m(ctx, block).x, begin_m_s = speed();
  scene.run(half, dt, g);
  *acceleration_m_s2 = (speed() - begin_m_s) / (static_cast<double>(dt) * half);
  return test::middle_m(ctx, block).x - begin;
}

TEST(BodyPairs, ATiltedBodyThatIsHeldHoldsAndLetsSlide) {
  const double critical = std::atan(0.5), degree = 0.0174533;
  double acceleration = 0;
  const double held = slide_on_body_m(critical - degree, &acceleration);
  const double tilt = critical + degree, a = 9.81 * (std::sin(tilt) - 0.5 * std::cos(tilt));
  slide_on_body_m(tilt, &acceleration);
  std::printf("held: %.2g m, slides at %.4f m/s^2 of %.4f\n", held, acceleration, a);
  EXPECT_LT(std::abs(held), 1e-4);
  EXPECT_NEAR(acceleration, a, 0.05 * a);
}

/// Weights: what lies on a body presses it with its weight, and that body the floor with both.
TEST(BodyPairs, ReactionsAreWeightsAndOpposite) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const float h = 0.02F;
  const test::SoftMaterial soft{.elastic = {.young_Pa = 3e4F, .poisson = 0.3F}, .damping = 0.5F};
  test::SoftThing low = test::soft_box(ctx, {-0.06F, 0, -0.06F}, {6, 3, 6}, h, soft);
  test::SoftThing high = test::soft_box(ctx, {-0.05F, 0.0601F, -0.047F}, {5, 3, 5}, h, soft);
  test::PairScene scene(ctx, {&low, &high});
  scene.obstacles = Obstacles(ctx, std::vector<ObstacleDescription>{{.name = "floor"}}, h);
  const float dt = 0.8F * scene.stable_step_s();
  const int frame = static_cast<int>(0.1F / dt);
  for (int f = 0; f < 15; ++f) scene.run(frame, dt, {0, -9.81F, 0}, 5);
  const auto momentum = [&](const test::SoftThing& body) { return body.monitors(ctx).momentum_kg_m_s.y; };
  const double low_before = momentum(low), high_before = momentum(high);
  scene.run(frame, dt, {0, -9.81F, 0});
  const double frame_s = static_cast<double>(scene.frame_s);
  const double on_low = (momentum(low) - low_before) / frame_s + 9.81 * low.lattice.mass_kg(),
               on_high = (momentum(high) - high_before) / frame_s + 9.81 * high.lattice.mass_kg();
  const std::vector<PairReaction> reactions = scene.reactions();
  ASSERT_EQ(reactions.size(), 2U);
  EXPECT_EQ(reactions[0].body, 0);
  EXPECT_EQ(reactions[0].other, 1);
  EXPECT_EQ(reactions[0].reaction.force_N, -reactions[1].reaction.force_N);
  EXPECT_EQ(reactions[0].reaction.torque_N_m, -reactions[1].reaction.torque_N_m);
  const double up = static_cast<double>(reactions[0].reaction.force_N.y),
               floor = -static_cast<double>(scene.on_obstacles(0).colliders.at(0).force_N.y);
  std::printf("high %.5f N of %.5f, floor %.5f N, low takes %.5f of %.5f\n", up, on_high, floor, floor - up,
              on_low);
  // The balance of momentum, to the rounding of the impulses of ~100 substeps in float.
  EXPECT_NEAR(up, on_high, 2e-5 * on_high);
  EXPECT_NEAR(floor - up, on_low, 4e-5 * floor);
  EXPECT_NEAR(up, 9.81 * high.lattice.mass_kg(), 0.02 * up);  // what still swings
}

/// Two real fingers, 5 cm across so that no edge holds, pinch a free block of 4 cm by 3 mm from each side and
/// lift it.
struct Pinch {
  static constexpr float kFrame_s = 1.F / 30, kLift_m = 0.05F;
  ExecContext& ctx;
  test::SoftThing block;
  test::SoftScene scene;
  float dt_s;
  int substeps;
  explicit Pinch(ExecContext& context, float friction)
      : ctx(context),
        block(test::soft_box(ctx, {-0.02F, -0.02F, -0.02F}, {4, 4, 4}, 0.01F,
                             {.elastic = {.young_Pa = 3e4F, .poisson = 0.3F}, .damping = 0.5F})),
        scene(ctx, block, 0.01F, {.friction = friction}),
        dt_s(0.8F * block.solver.stable_step_s()),
        substeps(static_cast<int>(kFrame_s / dt_s) + 1) {
    dt_s = kFrame_s / static_cast<float>(substeps);
  }
  /// One frame, at the end of which the fingers have closed and risen by so much. Drag lets swings die.
  ContactReport frame(float closed_m, float risen_m, float gravity_m_s2, float drag_per_s) {
    const TriangleMesh finger = test::box({0.01F, 0.025F, 0.025F}, 6);
    const float x = 0.031F - closed_m;
    scene.show(test::together(test::transformed(finger, {Mat3f::identity(), {-x, risen_m, 0}}),
                              test::transformed(finger, {Mat3f::identity(), {x, risen_m, 0}})),
               kFrame_s);
    return scene.run(substeps, dt_s, {0, -gravity_m_s2, 0}, drag_per_s, true);
  }
  /// Without weight until it is held; then held; then lifted. Returns how far the block came behind.
  double lift() {
    for (int f = 0; f <= 12; ++f) frame(0.004F * std::min(1.F, static_cast<float>(f) / 8), 0, 0, 10);
    for (int f = 0; f < 10; ++f) frame(0.004F, 0, 9.81F, 10);
    const double before = test::middle_m(ctx, block).y;
    for (int f = 1; f <= 15; ++f) frame(0.004F, kLift_m / 15 * static_cast<float>(f), 9.81F, 0);
    for (int f = 0; f < 10; ++f) frame(0.004F, kLift_m, 9.81F, 10);
    return static_cast<double>(kLift_m) - (test::middle_m(ctx, block).y - before);
  }
};

TEST(PinchAndLift, FingersCarryWhatTheyHold) {
  DeviceSet cpu("cpu");
  Pinch pinch(cpu.context(0), 0.5F);
  const double behind = pinch.lift();
  const auto momentum = [&] { return pinch.block.monitors(pinch.ctx).momentum_kg_m_s; };
  const Vec3d before = momentum();
  const ContactReport report = pinch.frame(0.004F, Pinch::kLift_m, 9.81F, 0);
  const Vec3d change = (momentum() - before) / double{Pinch::kFrame_s};
  ASSERT_EQ(report.colliders.size(), 2U);
  const Vec3d left = vec_cast<double>(report.colliders[0].force_N),
              right = vec_cast<double>(report.colliders[1].force_N);
  const double weight = 9.81 * pinch.block.lattice.mass_kg();
  std::printf("left (%.4f, %.4f) N, right (%.4f, %.4f) N, weight %.4f N, behind by %.2g m\n", left.x, left.y,
              right.x, right.y, weight, behind);
  // On the fingers: what the block's momentum gains is what they push it with. Both alike, by symmetry.
  EXPECT_NEAR(-(left.y + right.y), weight + change.y, 2e-5 * weight);
  EXPECT_NEAR(-(left.x + right.x), change.x, 2e-5 * std::abs(left.x));
  EXPECT_NEAR(-left.y, 0.5 * weight, 0.02 * weight);
  EXPECT_NEAR(-right.y, 0.5 * weight, 0.02 * weight);
  EXPECT_LT(0.5 * weight, 0.5 * std::abs(left.x)) << "below the limit of friction";
  // The components' measured motion is noisy by a hundredth of a spacing (real_surface_test).
  EXPECT_LT(std::abs(behind), 0.02 * 0.01);
  // The sum over the components is the whole.
  const Vec3d sum = left + right - vec_cast<double>(report.force_N);
  EXPECT_LT(length(sum), 1e-6 * (length(left) + length(right)));
}

TEST(PinchAndLift, WhatIsTooSlipperyIsLost) {
  DeviceSet cpu("cpu");
  Pinch pinch(cpu.context(0), 0.01F);
  EXPECT_GT(pinch.lift(), 0.02);
}

}  // namespace
}  // namespace tactus
