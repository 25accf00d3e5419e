/// What was found wrong by those who checked contact from outside, each with its bar.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "contact/soft_scene.h"
#include "tactus/geom/figures/figures.h"
#include "tactus/geom/mesh/polygonize.h"

namespace tactus {
namespace {

/// Force on a rigid ball pressed by `depth_m` into a layer that is bonded to a rigid base (Dimitriadis et al.
/// 2002, Biophys. J. 82: 2798): Hertz's force times a series in sqrt(R d) / thickness.
double layer_force_N(double young_Pa, double poisson, double radius_m, double depth_m, double thickness_m) {
  const double a0 = -(1.2876 - 1.4678 * poisson + 1.3442 * poisson * poisson) / (1 - poisson);
  const double b0 = (0.6387 - 1.0277 * poisson + 1.5164 * poisson * poisson) / (1 - poisson);
  const double pi = 3.14159265358979, x = std::sqrt(radius_m * depth_m) / thickness_m;
  const double series = 1 - 2 * a0 / pi * x + 4 * a0 * a0 / (pi * pi) * x * x -
                        8 / (pi * pi * pi) * (a0 * a0 * a0 + 4 * pi * pi / 15 * b0) * x * x * x +
                        16 * a0 / (pi * pi * pi * pi) * (a0 * a0 * a0 + 3 * pi * pi / 5 * b0) * x * x * x * x;
  return 4.0 / 3 * young_Pa / (1 - poisson * poisson) * std::sqrt(radius_m) * std::pow(depth_m, 1.5) * series;
}

double pressed_ball_N(float h, float points_per_spacing) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const float radius = 0.05F, depth = 0.002F;
  const Vec3i cubes{static_cast<Index>(std::lround(0.12F / h)), static_cast<Index>(std::lround(0.06F / h)),
                    static_cast<Index>(std::lround(0.12F / h))};
  const float half = 0.5F * h * static_cast<float>(cubes.x), top = h * static_cast<float>(cubes.y);
  test::SoftThing block =
      test::soft_box(ctx, {-half, 0, -half}, cubes, h, {.points_per_spacing = points_per_spacing},
                     [](Vec3f p) { return p.y < 1e-5F; });
  test::SoftScene scene(ctx, block, h, {.friction = 0});
  scene.show(
      test::transformed(test::unit_sphere(32), {Mat3f::identity(), {0, top + radius - depth, 0}}, radius));
  const float dt = 0.9F * block.solver.stable_step_s();
  for (int f = 0; f < 20; ++f) scene.run(static_cast<int>(0.05F / dt), dt, {}, 30);
  const ContactReport report = scene.run(10, dt, {}, 30);
  return static_cast<double>(report.force_N.y);
}

/// R/h = 8.3. The elements' own error (a contact radius of 1.7 spacings) and the ball's facets (sagitta 19 um
/// of 2 mm: 1.4 %) are what the bound of 10 % is for.
TEST(Outsider, ABallPressesAsHertzSays) {
  const double want = layer_force_N(10000, 0.45, 0.05, 0.002, 0.06), got = pressed_ball_N(0.006F, 2);
  std::printf("R/h 8.3: %.4f N of %.4f: %+.1f %%\n", got, want, 100 * (got / want - 1));
  EXPECT_NEAR(got, want, 0.1 * want);
}

/// The first point of a mesh along n, and of a box round 0.
float lowest(const TriangleMesh& mesh, Vec3f n) {
  float low = 1e9F;
  for (const Vec3f& p : mesh.positions_m) low = std::min(low, dot(n, p));
  return low;
}

/// Everything that is built in, at a gap of a tenth of a spacing from a soft box, from 60 sides each: between
/// a separating plane and the surface nothing can touch, so not one bit may change.
TEST(Outsider, NothingIsTouchedAcrossAGap) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const float h = 0.02F;
  const Vec3f half{0.1F, 0.04F, 0.08F};
  test::SoftThing body = test::soft_box(ctx, -half, {10, 4, 8}, h, {});
  test::SoftScene scene(ctx, body, h);
  std::vector<std::pair<std::string, TriangleMesh>> shapes;
  for (const std::string& name : figure_names()) {
    const Figure figure = make_figure(name, {.scale = 0.5F});
    const FigureShape shape = figure.at(0);
    shapes.emplace_back(name, polygonize(shape.bounds_m(), 60, [&](Vec3f p) { return shape.distance_m(p); }));
  }
  shapes.emplace_back("box", test::box({0.03F, 0.2F, 0.05F}, 8));
  shapes.emplace_back("blade", test::box({0.0005F, 0.1F, 0.02F}, 8));
  const std::vector<Vec3f> x = to_host(ctx, body.state.x_m.const_view()),
                           v = to_host(ctx, body.state.v_m_s.const_view());
  std::mt19937 random(11);
  std::normal_distribution<float> normal;
  for (auto& [name, mesh] : shapes) {
    mesh.normals.clear();
    for (int k = 0; k < 60; ++k) {
      const Vec3f n = k < 6 ? Vec3f{k / 2 == 0 ? 1.F : 0.F, k / 2 == 1 ? 1.F : 0.F, k / 2 == 2 ? 1.F : 0.F}
                            : normalized(Vec3f{normal(random), normal(random), normal(random)});
      const Mat3f turn = rotation_matrix(
          axis_angle(normalized(Vec3f{normal(random), normal(random), normal(random)}), 6 * normal(random)));
      const TriangleMesh turned = test::transformed(mesh, {turn, {}});
      const Vec3f out = k % 2 == 0 ? n : -n;
      // Its lowest point is above the box's highest, both along `out`; beside it, anywhere.
      const float top = std::abs(out.x) * half.x + std::abs(out.y) * half.y + std::abs(out.z) * half.z;
      const Vec3f beside = cross(out, Vec3f{0.03F * normal(random), 0.03F * normal(random), 0});
      scene.show(test::transformed(
          turned, {Mat3f::identity(), (top + 0.1F * h - lowest(turned, out)) * out + beside}));
      scene.contact.begin_frame(ctx, scene.surface, {.dt_s = 1e-3F, .substeps = 1});
      body.points.begin_frame(ctx);
      scene.contact.push_out(ctx, scene.surface, body.points, body.nodes());
      scene.contact.correct(ctx, scene.surface, {}, body.points, body.nodes(), 0);
      body.points.end_frame(ctx);
      const ContactReport report = contact_report(to_host(ctx, body.points.totals()), 1, 1);
      ASSERT_EQ(report.contacts_per_substep + report.pushed_out, 0) << name << " from side " << k;
      ASSERT_TRUE(x == to_host(ctx, body.state.x_m.const_view())) << name << " from side " << k;
      ASSERT_TRUE(v == to_host(ctx, body.state.v_m_s.const_view())) << name << " from side " << k;
    }
  }
}

struct Bounce {
  double most_energy = 0;  ///< over that at the start
  double rebound = 0;      ///< speed of the centre after over before
};

/// A stiff ball falls on a plane; no gravity, no damping.
Bounce bounce(float restitution, bool matched) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const float radius = 0.03F, speed = 0.5F;
  test::SoftThing ball = test::soft_ball(
      ctx, radius, 0.0075F, {.elastic = {.young_Pa = 1e5F, .poisson = 0.3F}, .matched = matched});
  test::SoftScene scene(ctx, ball, 0.0075F, {.restitution = restitution, .friction = 0.3F});
  scene.obstacles = Obstacles(ctx, std::vector<ObstacleDescription>{{.name = "table"}}, 0.0075F);
  ball.launch(ctx, {0, -speed, 0}, {0, radius + 0.001F, 0});
  const float dt = 0.8F * ball.solver.stable_step_s();
  const double before = ball.monitors(ctx).kinetic_J;
  Bounce result;
  for (int f = 0; f < 60; ++f) {
    scene.run(std::max(1, static_cast<int>(0.002F / dt)), dt);
    const BodyMonitors m = ball.monitors(ctx);
    // Of shape matching, no elastic energy is known: the kinetic one is a lower bound.
    const double energy = m.kinetic_J + (matched ? 0 : m.elastic_J + m.hourglass_J);
    result.most_energy = std::max(result.most_energy, energy / before);
    result.rebound = m.momentum_kg_m_s.y / (ball.lattice.mass_kg() * static_cast<double>(speed));
  }
  return result;
}

/// What e means for a soft body (contact.h): no e adds energy, a larger e gives no smaller rebound, and e = 1
/// takes none, so that the ball leaves with what it came with, but for what goes on ringing in it.
TEST(Outsider, RestitutionNeverAddsEnergy) {
  for (const bool matched : {false, true}) {
    double last = 0;
    for (const float e : {0.F, 0.5F, 1.F}) {
      const Bounce b = bounce(e, matched);
      std::printf("%s, e %.1f: rebound %.3f, most energy %.5f\n", matched ? "matched" : "elements",
                  static_cast<double>(e), b.rebound, b.most_energy);
      // Leapfrog's energy is off by O((omega dt)^2) while it oscillates: 2 %.
      EXPECT_LE(b.most_energy, 1.02);
      EXPECT_GE(b.rebound, last - 0.02);
      EXPECT_LE(b.rebound, 1.01);
      last = b.rebound;
    }
    EXPECT_GT(last, 0.7);
  }
}

/// How far a block slides in the second half of the time on a plane that is tilted, with gravity turned
/// instead of the plane.
double slide_m(double tilt_rad, double seconds, double* acceleration_m_s2) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const float h = 0.01F;
  test::SoftThing block = test::soft_box(ctx, {-0.03F, 0, -0.02F}, {6, 2, 4}, h,
                                         {.elastic = {.young_Pa = 3e4F, .poisson = 0.3F}, .damping = 0.5F});
  test::SoftScene scene(ctx, block, h, {.friction = 0.5F});
  scene.obstacles = Obstacles(ctx, std::vector<ObstacleDescription>{{.name = "slope"}}, h);
  const float dt = 0.8F * block.solver.stable_step_s();
  const Vec3f g{static_cast<float>(9.81 * std::sin(tilt_rad)), static_cast<float>(-9.81 * std::cos(tilt_rad)),
                0};
  const auto middle = [&] {
    Vec3d sum{};
    const std::vector<Vec3f> x = to_host(ctx, block.state.x_m.const_view());
    for (const Vec3f& p : x) sum += vec_cast<double>(p) / static_cast<double>(x.size());
    return sum;
  };
  // It settles on the level first.
  for (int f = 0; f < 10; ++f) scene.run(static_cast<int>(0.03F / dt), dt, {0, -9.81F, 0}, 5);
  const int half = static_cast<int>(static_cast<float>(seconds) / 2 / dt);
  const auto speed = [&] { return block.monitors(ctx).momentum_kg_m_s.x / block.lattice.mass_kg(); };
  scene.run(half, dt, g);
  const double begin = middle().x, begin_m_s = speed();
  scene.run(half, dt, g);
  *acceleration_m_s2 = (speed() - begin_m_s) / (static_cast<double>(dt) * half);
  return middle().x - begin;
}

TEST(Outsider, ATiltedPlaneHoldsAndLetsSlide) {
  const double critical = std::atan(0.5), degree = 0.0174533;
  double acceleration = 0;
  // In half a second, after half a second to lean over: a hundredth of a spacing.
  const double held = slide_m(critical - degree, 1, &acceleration);
  std::printf("held: %.2g m\n", held);
  EXPECT_LT(std::abs(held), 1e-4);
  const double tilt = critical + degree, a = 9.81 * (std::sin(tilt) - 0.5 * std::cos(tilt));
  slide_m(tilt, 1, &acceleration);
  std::printf("slides at %.4f m/s^2 of %.4f\n", acceleration, a);
  EXPECT_NEAR(acceleration, a, 0.05 * a);
}

/// What rests on two obstacles presses them with its weight, each with its part; the sum is the whole.
TEST(Outsider, ReactionsAddUpToTheWeight) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const float h = 0.01F;
  test::SoftThing beam = test::soft_box(ctx, {-0.05F, 0, -0.02F}, {10, 3, 4}, h,
                                        {.elastic = {.young_Pa = 5e4F, .poisson = 0.3F}, .damping = 0.5F});
  test::SoftScene scene(ctx, beam, h);
  std::vector<ObstacleDescription> two(2);
  two[0] = {.name = "left", .kind = ObstacleKind::box, .half_m = {0.02F, 0.02F, 0.05F}};
  two[0].T_world_obstacle.t = {-0.035F, -0.02F, 0};
  two[1] = {.name = "right", .kind = ObstacleKind::mesh};
  two[1].T_world_obstacle.t = {0.04F, -0.02F, 0};
  two[1].mesh = test::box({0.02F, 0.02F, 0.05F}, 2);
  scene.obstacles = Obstacles(ctx, two, h);
  const float dt = 0.8F * beam.solver.stable_step_s();
  for (int f = 0; f < 20; ++f) scene.run(static_cast<int>(0.03F / dt), dt, {0, -9.81F, 0}, 10);
  const int substeps = static_cast<int>(0.03F / dt);
  const double before = beam.monitors(ctx).momentum_kg_m_s.y;
  const ContactReport report = scene.run(substeps, dt, {0, -9.81F, 0});
  const double after = beam.monitors(ctx).momentum_kg_m_s.y;
  ASSERT_EQ(report.colliders.size(), 2U);
  const double weight = 9.81 * beam.lattice.mass_kg(), frame_s = static_cast<double>(dt) * substeps;
  const double left = static_cast<double>(-report.colliders[0].force_N.y),
               right = static_cast<double>(-report.colliders[1].force_N.y);
  std::printf("weight %.5f N, left %.5f N, right %.5f N\n", weight, left, right);
  // The balance of momentum, to the rounding of ~100 substeps' impulses in float.
  EXPECT_NEAR(left + right, weight + (after - before) / frame_s, 2e-5 * weight);
  EXPECT_NEAR(left + right, weight, 0.02 * weight);  // what still swings
  EXPECT_GT(left, 0.3 * weight);
  EXPECT_GT(right, 0.3 * weight);
}

TEST(Outsider, BadObstaclesAreNamed) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const auto error_of = [&](const ObstacleDescription& d) -> std::string {
    try {
      const Obstacles obstacles(ctx, std::vector<ObstacleDescription>{d}, 0.01F);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  ObstacleDescription mesh{.name = "tray", .kind = ObstacleKind::mesh};
  mesh.mesh = test::box({0.1F, 0.01F, 0.1F}, 2);
  EXPECT_EQ(error_of(mesh), "");
  ObstacleDescription open = mesh, nan = mesh, flat = mesh, inside_out = mesh;
  open.mesh.triangles.pop_back();
  EXPECT_NE(error_of(open).find("obstacle 'tray': "), std::string::npos) << error_of(open);
  EXPECT_NE(error_of(open).find("3 open edges"), std::string::npos) << error_of(open);
  nan.mesh.positions_m[3].x = std::nanf("");
  EXPECT_NE(error_of(nan), "");
  for (Vec3f& p : flat.mesh.positions_m) p.y = 0;
  EXPECT_NE(error_of(flat).find("volume of 0"), std::string::npos) << error_of(flat);
  for (auto& t : inside_out.mesh.triangles) std::swap(t[0], t[1]);
  EXPECT_NE(error_of(inside_out).find("counter-clockwise"), std::string::npos) << error_of(inside_out);
  EXPECT_NE(
      error_of({.name = "thin", .kind = ObstacleKind::box, .half_m = {1, 0, 1}}).find("obstacle 'thin'"),
      std::string::npos);
}

}  // namespace
}  // namespace tactus
