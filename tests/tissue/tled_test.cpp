#include "tactus/tissue/tled/tled.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/device_sets.h"
#include "tactus/base/error.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/tissue/body_monitors.h"
#include "tactus/tissue/tled/strain_energy.h"

namespace tactus {
namespace {

constexpr float kH = 0.005F;
std::size_t at(Index i) { return static_cast<std::size_t>(i); }

CubeLattice box(Vec3i cubes, float spacing_m = kH, Vec3f origin_m = {}) {
  return lattice_from_box(origin_m, cubes, {.spacing_m = spacing_m});
}
/// A ball: rows of every length, so tiles and groups are filled only in part.
CubeLattice ball(float radius_m) {
  const Vec3f r{radius_m, radius_m, radius_m};
  return lattice_from_sdf([&](Vec3f p) { return length(p) - radius_m; }, {-1.F * r, r}, {.spacing_m = kH});
}

std::vector<Vec3f> moved(const CubeLattice& lattice, const Mat3f& F) {
  std::vector<Vec3f> x = lattice.rest_positions_m();
  for (Vec3f& p : x) p = F * p;
  return x;
}
std::vector<Vec3f> shaken(const CubeLattice& lattice, float size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> u(-size, size);
  std::vector<Vec3f> x = lattice.rest_positions_m();
  for (Vec3f& p : x) p = p + Vec3f{u(random), u(random), u(random)};
  return x;
}

std::vector<Vec3f> forces(ExecContext& ctx, Tled& tled, const CubeLattice& lattice,
                          const std::vector<Vec3f>& x) {
  BodyState state = rest_state(ctx, lattice);
  state.x_m = to_device(ctx, x);
  tled.compute_forces(ctx, state);
  return tled.forces_N(ctx);
}

/// By the book and in double: B matrices at the integration points, S by inverses, hourglass vectors made
/// orthogonal to linear fields [P 3-6; Joldes et al. 2008].
std::vector<Vec3d> reference_forces(const CubeLattice& lattice, const ElasticMaterial& m,
                                    const std::vector<Vec3f>& x, bool full_integration) {
  const double h = static_cast<double>(lattice.spacing_m), mu = static_cast<double>(m.mu_Pa()),
               lambda = static_cast<double>(m.lambda_Pa());
  std::vector<Vec3d> f(lattice.nodes.size());
  const double g = full_integration ? 1 / std::sqrt(3.0) : 0;
  for (const auto& nodes : lattice.cube_nodes) {
    for (int point = 0; point < (full_integration ? 8 : 1); ++point) {
      const double at_point[3] = {(point & 1) != 0 ? g : -g, (point & 2) != 0 ? g : -g,
                                  (point & 4) != 0 ? g : -g};
      double dN[8][3];
      for (int q = 0; q < 8; ++q) {
        const double s[3] = {(q & 1) != 0 ? 1.0 : -1.0, (q & 2) != 0 ? 1.0 : -1.0, (q & 4) != 0 ? 1.0 : -1.0};
        for (int j = 0; j < 3; ++j) {
          dN[q][j] = 0.25 / h * s[j];
          for (int k = 0; k < 3; ++k)
            if (k != j) dN[q][j] *= 1 + s[k] * at_point[k];
        }
      }
      Mat3d F{};
      for (int q = 0; q < 8; ++q)
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) F(i, j) += static_cast<double>(x[at(nodes[at(q)])][i]) * dN[q][j];
      const double J = determinant(F);
      const Mat3d inverse_C = inverse(transpose(F) * F);
      Mat3d S{};
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          S(i, j) = mu * ((i == j ? 1.0 : 0.0) - inverse_C(i, j)) + lambda * J * (J - 1) * inverse_C(i, j);
      const Mat3d P = F * S;
      const double volume = h * h * h / (full_integration ? 8 : 1);
      for (int q = 0; q < 8; ++q)
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) f[at(nodes[at(q)])][i] -= volume * P(i, j) * dN[q][j];
    }
    if (full_integration) continue;
    for (int mode = 0; mode < 4; ++mode) {
      const auto sign = [mode](int q) {
        const int x1 = q & 1, y1 = q >> 1 & 1, z1 = q >> 2;
        const int odd[4] = {x1 ^ y1, y1 ^ z1, x1 ^ z1, x1 ^ y1 ^ z1 ^ 1};
        return odd[mode] != 0 ? -1.0 : 1.0;
      };
      Vec3d amount{};
      for (int q = 0; q < 8; ++q) amount += sign(q) * vec_cast<double>(x[at(nodes[at(q)])]);
      for (int q = 0; q < 8; ++q)
        f[at(nodes[at(q)])] += (-h * static_cast<double>(m.young_Pa) / 6 / 8 * sign(q)) * amount;
    }
  }
  return f;
}

class TledDevices : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(TledDevices);

/// Positions within 0.1 h of rest strain cubes by up to 40 %. Forces then are of the order (lambda + 2 mu)
/// h^2 times 0.4, and float32 differences of positions (up to 0.2 m, 1.2e-8 m each, 24 of them a cube) over h
/// = 5 mm make relative errors of some 1e-5 of that.
TEST_P(TledDevices, ForcesAreThoseOfTheBook) {
  DeviceSet set(GetParam(), 3);
  ExecContext& ctx = set.context(0);
  const ElasticMaterial material{.young_Pa = 3000, .poisson = 0.45F};
  for (const bool full : {false, true}) {
    for (const CubeLattice& lattice : {box({1, 1, 1}), box({33, 9, 5}), ball(0.031F)}) {
      Tled tled(ctx, lattice, {&material, 1}, {}, {.full_integration = full, .damping_ratio = 0});
      const std::vector<Vec3f> x = shaken(lattice, 0.1F * kH, 5), f = forces(ctx, tled, lattice, x);
      const std::vector<Vec3d> expected = reference_forces(lattice, material, x, full);
      const double unit = static_cast<double>((material.lambda_Pa() + 2 * material.mu_Pa()) * kH * kH);
      double worst = 0, largest = 0;
      for (std::size_t i = 0; i < f.size(); ++i) {
        worst = std::max(worst, length(vec_cast<double>(f[i]) - expected[i]));
        largest = std::max(largest, length(expected[i]));
      }
      EXPECT_GT(largest, 0.02 * unit);
      EXPECT_LT(worst, 1e-4 * unit) << lattice.cube_count() << " cubes, full integration " << full;
    }
  }
}

/// P = dW/dF by central differences in double: 1e-6 steps leave 1e-9 of error in the difference, float
/// stresses are good to some 1e-6 of the terms they are made of (up to ten times the result).
TEST(MaterialLaws, StressIsTheDerivativeOfTheEnergy) {
  const ElasticMaterial m{.young_Pa = 3000, .poisson = 0.45F};
  std::mt19937 random(4);
  std::uniform_real_distribution<double> u(-0.3, 0.3);
  for (const TledOptions& options :
       {TledOptions{}, TledOptions{.law = MaterialLaw::isochoric_neo_hookean},
        TledOptions{.law = MaterialLaw::transversely_isotropic, .fibre = {1, 2, -1}, .fibre_ratio = 4}}) {
    for (int sample = 0; sample < 20; ++sample) {
      Mat3d F{};
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) F(i, j) = (i == j ? 1 : 0) + u(random);
      if (determinant(F) < 0.15) continue;
      const auto column = [&](int j) {
        return Vec3f{static_cast<float>(F(0, j)), static_cast<float>(F(1, j)), static_cast<float>(F(2, j))};
      };
      const GradientColumns G{column(0), column(1), column(2)};
      GradientColumns P{};
      switch (options.law) {
        case MaterialLaw::neo_hookean:
          P = NeoHookean{}.stress(G, m.mu_Pa(), m.lambda_Pa());
          break;
        case MaterialLaw::isochoric_neo_hookean:
          P = IsochoricNeoHookean{}.stress(G, m.mu_Pa(), m.lambda_Pa());
          break;
        case MaterialLaw::transversely_isotropic:
          P = TransverselyIsotropic{normalized(options.fibre), options.fibre_ratio}.stress(G, m.mu_Pa(),
                                                                                           m.lambda_Pa());
          break;
      }
      const Vec3f columns[3] = {P.x, P.y, P.z};
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          Mat3d above = F, below = F;
          above(i, j) += 1e-6;
          below(i, j) -= 1e-6;
          const double expected =
              (strain_energy_J_m3(options, m, above) - strain_energy_J_m3(options, m, below)) / 2e-6;
          EXPECT_NEAR(static_cast<double>(columns[j][i]), expected,
                      1e-5 * static_cast<double>(m.lambda_Pa()));
        }
      }
    }
  }
}

/// A free body that rings without damping: kinetic, elastic and hourglass energy go back and forth, their sum
/// stays. The scheme's velocities are half a step from its positions, so the sum wobbles by omega dt / 2: 10
/// % at a tenth of the stable step for the fastest mode.
TEST(Tled, MonitorsSeeEnergyConserved) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const CubeLattice lattice = box({6, 4, 3});
  const ElasticMaterial m{};
  const TledOptions options{.damping_ratio = 0};
  Tled tled(ctx, lattice, {&m, 1}, {}, options);
  BodyState body = rest_state(ctx, lattice);
  body.x_m = to_device(ctx, shaken(lattice, 0.05F * kH, 3));
  const auto measure = [&] {
    return measure_body(lattice, {}, {&m, 1}, {}, options, to_host(ctx, body.x_m.const_view()),
                        to_host(ctx, body.v_m_s.const_view()));
  };
  const BodyMonitors before = measure();
  EXPECT_EQ(before.kinetic_J, 0);
  EXPECT_GT(before.hourglass_J, 0);
  const double total = before.elastic_J + before.hourglass_J;
  double most_kinetic = 0;
  for (int k = 0; k < 400; ++k) {
    tled.step(ctx, body, {0.1F * tled.stable_step_s(), {}});
    const BodyMonitors now = measure();
    most_kinetic = std::max(most_kinetic, now.kinetic_J);
    ASSERT_NEAR((now.kinetic_J + now.elastic_J + now.hourglass_J) / total, 1, 0.1) << k;
    ASSERT_NEAR(now.volume_m3 / (72 * std::pow(static_cast<double>(kH), 3)), 1, 0.1);
  }
  EXPECT_GT(most_kinetic, 0.3 * total);
  EXPECT_LT(length(measure().momentum_kg_m_s), 1e-6 * std::sqrt(2 * lattice.mass_kg() * total));
}

/// One cube stretched by s along x, free across: P_xx h^2 pulls, with the lateral stretch that makes P_yy =
/// 0, found by bisection of the closed form. One float rounding of a force term is 1e-7: 0.1 % is generous.
TEST(Tled, UniaxialStretchFollowsTheClosedForm) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const CubeLattice lattice = box({1, 1, 1});
  const ElasticMaterial m{.young_Pa = 3000, .poisson = 0.4F};
  const double mu = static_cast<double>(m.mu_Pa()), lambda = static_cast<double>(m.lambda_Pa());
  Tled tled(ctx, lattice, {&m, 1}, {}, {.damping_ratio = 0});
  for (double s = 0.5; s <= 1.501; s += 0.125) {
    const auto lateral_stress = [&](double t) { return mu * (t - 1 / t) + lambda * (s * t * t - 1) * s * t; };
    double low = 0.3, high = 3;
    while (high - low > 1e-12) (lateral_stress((low + high) / 2) > 0 ? high : low) = (low + high) / 2;
    const double J = s * low * low, pull = mu * (s - 1 / s) + lambda * (J - 1) * low * low;
    const float t = static_cast<float>(low);
    const auto f =
        forces(ctx, tled, lattice, moved(lattice, {{{static_cast<float>(s), 0, 0}, {0, t, 0}, {0, 0, t}}}));
    const double area = static_cast<double>(kH * kH);
    for (std::size_t q = 0; q < 8; ++q) {
      const double sign = lattice.nodes[q].x != 0 ? -1 : 1;
      EXPECT_NEAR(static_cast<double>(f[q].x), sign * pull * area / 4,
                  1e-3 * std::abs(pull) * area / 4 + 1e-9)
          << s;
      EXPECT_NEAR(static_cast<double>(f[q].y), 0, 2e-4 * lambda * area / 4) << s;
    }
  }
}

/// A linear field strains all cubes alike: inner nodes feel nothing. Rounding of positions up to 0.1 m is
/// 4e-9 m, over h = 5 mm about 1e-6 strain a corner.
TEST(Tled, PatchTestAndRigidRotation) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const CubeLattice lattice = box({12, 7, 5});
  const ElasticMaterial m{};
  const double unit = static_cast<double>((m.lambda_Pa() + 2 * m.mu_Pa()) * kH * kH);
  for (const MaterialLaw law :
       {MaterialLaw::neo_hookean, MaterialLaw::isochoric_neo_hookean, MaterialLaw::transversely_isotropic}) {
    Tled tled(ctx, lattice, {&m, 1}, {},
              {.law = law, .fibre = {1, 1, 0}, .fibre_ratio = 2, .damping_ratio = 0});
    const auto strained =
        forces(ctx, tled, lattice, moved(lattice, {{{1.2F, 0.1F, 0}, {0.05F, 0.9F, 0}, {0, 0.2F, 1.1F}}}));
    for (Index i = 0; i < lattice.node_count(); ++i) {
      const Vec3i n = lattice.nodes[at(i)];
      if (n.x % 12 == 0 || n.y % 7 == 0 || n.z % 5 == 0) continue;
      EXPECT_LT(static_cast<double>(length(strained[at(i)])), 1e-5 * unit) << i;
    }
    for (const Vec3f& f : forces(ctx, tled, lattice, moved(lattice, {{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}})))
      EXPECT_LT(static_cast<double>(length(f)), 1e-5 * unit);
  }
}

/// Moving the corners by an hourglass mode strains the centre by nothing; what pushes back is k/8 * 8 * size
/// at each corner, k = h E / 6.
TEST(Tled, EveryHourglassModeIsResisted) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const CubeLattice lattice = box({1, 1, 1});
  const ElasticMaterial m{};
  Tled tled(ctx, lattice, {&m, 1}, {}, {.damping_ratio = 0});
  const float size = 0.05F * kH;
  for (int mode = 0; mode < 4; ++mode) {
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<Vec3f> x = lattice.rest_positions_m();
      const auto sign = [&](std::size_t q) {
        const Vec3i n = 2 * lattice.nodes[q] - Vec3i{1, 1, 1};
        const Index products[4] = {n.x * n.y, n.y * n.z, n.x * n.z, n.x * n.y * n.z};
        return static_cast<float>(products[mode]);
      };
      for (std::size_t q = 0; q < 8; ++q) x[q][axis] += size * sign(q);
      const auto f = forces(ctx, tled, lattice, x);
      const float expected = kH * m.young_Pa / 6 * size;
      for (std::size_t q = 0; q < 8; ++q)
        EXPECT_NEAR(f[q][axis] * sign(q), -expected, 1e-3F * expected) << mode << " " << axis;
    }
  }
}

/// Tip of a clamped beam of 0.1 x 0.02 x 0.02 m under its weight, against CalculiX with 20x4x4 quadratic
/// elements (nu 0.45, 1000 kg/m^3). Settled by drag for some 20 time constants.
TEST(Tled, CantileverBendsAsInCalculiX) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const auto tip = [&](float young_Pa, Index across) {
    const float h = 0.02F / static_cast<float>(across);
    CubeLattice lattice = box({5 * across, across, across}, h);
    lattice.fix_half_space({0.01F * h, 0, 0}, {1, 0, 0});
    const ElasticMaterial m{.young_Pa = young_Pa, .poisson = 0.45F};
    Tled tled(ctx, lattice, {&m, 1}, {}, {.damping_ratio = 0.1F});
    BodyState body = rest_state(ctx, lattice);
    const float dt = tled.stable_step_s(), drag = 20 * std::sqrt(young_Pa / 30000);
    for (float t = 0; t * drag < 45; t += dt) tled.step(ctx, body, {dt, {0, 0, -9.81F}, drag});
    const auto x = to_host(ctx, body.x_m.const_view());
    for (Index i = 0; i < lattice.node_count(); ++i) {
      if (lattice.nodes[at(i)] == Vec3i{5 * across, across / 2, across / 2})
        return x[at(i)] - lattice.rest_m(i);
    }
    return Vec3f{};
  };
  const Vec3f soft = tip(30000, 4), softer = tip(10000, 4), finer = tip(30000, 8);
  EXPECT_NEAR(soft.x, -0.034324F, 0.03F * 0.034324F);
  EXPECT_NEAR(soft.z, -0.073296F, 0.03F * 0.073296F);
  EXPECT_NEAR(softer.x, -0.068710F, 0.03F * 0.068710F);
  EXPECT_NEAR(softer.z, -0.097023F, 0.03F * 0.097023F);
  EXPECT_LT(std::abs(finer.z + 0.073296F), std::abs(soft.z + 0.073296F) + 1e-4F);
  RecordProperty("tip_30kPa_z_mm", std::to_string(soft.z * 1000));
  std::printf("tip 30 kPa (%.6f, %.6f), finer (%.6f, %.6f), 10 kPa (%.6f, %.6f) m\n", soft.x, soft.z, finer.x,
              finer.z, softer.x, softer.z);
}

/// First bending frequency of a slender clamped beam (L/t = 10) for small motion, Euler-Bernoulli:
/// f = 0.1615 t/L^2 sqrt(E/rho). Shear and rotary inertia lower it by about 1 %, four cubes across raise or
/// lower it by about 1 %.
TEST(Tled, CantileverSwingsAtItsFrequency) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  CubeLattice lattice = box({40, 4, 4});
  lattice.fix_half_space({0.01F * kH, 0, 0}, {1, 0, 0});
  const ElasticMaterial m{.young_Pa = 30000, .poisson = 0.3F};
  Tled tled(ctx, lattice, {&m, 1}, {}, {.damping_ratio = 0});
  BodyState body = rest_state(ctx, lattice);
  std::vector<Vec3f> v(lattice.nodes.size());
  for (std::size_t i = 0; i < v.size(); ++i)
    v[i].z = 0.003F * sqr(static_cast<float>(lattice.nodes[i].x) / 40);
  body.v_m_s = to_device(ctx, v);
  const float dt = tled.stable_step_s();
  const auto last = at(lattice.node_count() - 1);
  const float rest_z = lattice.rest_m(lattice.node_count() - 1).z;
  std::vector<double> rises;
  float before = 0;
  for (int k = 0; rises.size() < 5 && k < 100000; ++k) {
    tled.step(ctx, body, {dt, {}});
    const float z = to_host(ctx, body.x_m.const_view())[last].z - rest_z;
    if (before < 0 && z >= 0)
      rises.push_back(static_cast<double>(dt) * (k + static_cast<double>(z / (before - z))));
    before = z;
  }
  ASSERT_EQ(rises.size(), 5U);
  const double frequency = 4 / (rises[4] - rises[0]);
  const double expected = 0.1615 * 0.02 / (0.2 * 0.2) * std::sqrt(30000.0 / 1000);
  EXPECT_NEAR(frequency / expected, 1, 0.03);
}

CubeLattice corner_chain() {
  CubeLattice lattice = lattice_from_sdf(
      [](Vec3f p) {
        const Vec3f c = p / kH;
        for (int k = 0; k < 6; ++k) {
          const Vec3f d = c - Vec3f{0.5F + static_cast<float>(k), 0.5F + static_cast<float>(k),
                                    0.5F + static_cast<float>(k)};
          if (max(abs(d.x), max(abs(d.y), abs(d.z))) < 0.4F) return -0.1F * kH;
        }
        return 0.1F * kH;
      },
      {{0, 0, 0}, {6 * kH, 6 * kH, 6 * kH}}, {.spacing_m = kH});
  return lattice;
}

double kinetic_J(ExecContext& ctx, const CubeLattice& lattice, const BodyState& body) {
  const auto v = to_host(ctx, body.v_m_s.const_view());
  double energy = 0;
  for (std::size_t i = 0; i < v.size(); ++i)
    energy += 0.5 * static_cast<double>(lattice.node_mass_kg[i]) * static_cast<double>(dot(v[i], v[i]));
  return energy;
}

/// Shaken bodies without damping stay bounded at the step that is reported, whatever their shape: at a part r
/// of its critical step the scheme keeps v^2/2 (1 - r^2) + ..., so a mode's kinetic energy stays below 1 / (1
/// - r^2) = 10 times what was put in (r = 0.95), while instability multiplies it at every step. At 1.2 of the
/// critical step they blow up.
TEST(Tled, ReportedStepIsStableAndNotTimid) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  for (const float poisson : {0.3F, 0.45F, 0.49F}) {
    const ElasticMaterial m{.young_Pa = 3000, .poisson = poisson};
    for (const CubeLattice& lattice :
         {box({1, 1, 1}), corner_chain(), box({1, 1, 12}), box({20, 4, 4}), box({6, 6, 6})}) {
      const auto grows = [&](float dt_s, Tled& tled) {
        BodyState body = rest_state(ctx, lattice);
        const std::vector<Vec3f> x = shaken(lattice, 1e-3F * kH, 2);
        std::vector<Vec3f> v(x.size());
        for (std::size_t i = 0; i < x.size(); ++i)
          v[i] = 100.F * (x[i] - lattice.rest_m(static_cast<Index>(i)));
        body.v_m_s = to_device(ctx, v);
        const double energy = kinetic_J(ctx, lattice, body);
        for (int k = 0; k < 3000; ++k) tled.step(ctx, body, {dt_s, {}});
        return !(kinetic_J(ctx, lattice, body) < 12 * energy);
      };
      Tled guaranteed(ctx, lattice, {&m, 1}, {}, {.damping_ratio = 0});
      EXPECT_FALSE(grows(0.95F * guaranteed.stable_step_s(), guaranteed)) << lattice.cube_count();
      Tled measured(ctx, lattice, {&m, 1}, {}, {.damping_ratio = 0});
      const float step = measured.measure_stable_step(ctx, lattice);
      EXPECT_GE(step, 0.95F * 0.95F * guaranteed.stable_step_s()) << lattice.cube_count();
      EXPECT_FALSE(grows(step, measured)) << lattice.cube_count() << " cubes, nu " << poisson;
      // The same forces on masses so light that this step is 1.2 / 0.95 of theirs.
      CubeLattice light = lattice;
      for (float& mass : light.node_mass_kg) mass /= sqr(1.2F / 0.95F);
      Tled beyond(ctx, light, {&m, 1}, {}, {.damping_ratio = 0});
      EXPECT_FLOAT_EQ(beyond.measure_stable_step(ctx, lattice), step);
      EXPECT_TRUE(grows(step, beyond)) << lattice.cube_count() << " cubes, nu " << poisson;
    }
  }
}

/// Strain makes waves faster: a cube held at 1.5 along two axes is stable with the substeps that the monitor
/// asks for.
TEST(Tled, MonitorSplitsTheStepsOfAStretchedCube) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  CubeLattice lattice = box({3, 3, 3});
  std::fill(lattice.fixed.begin(), lattice.fixed.end(), std::uint8_t{1});
  for (Index i = 0; i < lattice.node_count(); ++i) {
    const Vec3i n = lattice.nodes[at(i)];
    if (n.x % 3 != 0 && n.y % 3 != 0 && n.z % 3 != 0) lattice.fixed[at(i)] = 0;
  }
  const ElasticMaterial m{.young_Pa = 3000, .poisson = 0.45F};
  Tled tled(ctx, lattice, {&m, 1}, {}, {.damping_ratio = 0});
  BodyState body = rest_state(ctx, lattice);
  body.x_m = to_device(ctx, moved(lattice, {{{1.5F, 0, 0}, {0, 1.5F, 0}, {0, 0, 1}}}));
  tled.compute_forces(ctx, body);
  const tled::CubeExtremes e = tled.extremes(ctx, body);
  EXPECT_NEAR(e.smallest_J, 2.25F, 1e-4F);
  EXPECT_EQ(e.inverted, 0);
  // cof F = diag(1.5, 1.5, 2.25): (lambda + mu/J^2) 5.06 + mu over lambda + 2 mu.
  const float lambda = m.lambda_Pa(), mu = m.mu_Pa();
  EXPECT_NEAR(e.speed_ratio, std::sqrt(((lambda + mu / 5.0625F) * 5.0625F + mu) / (lambda + 2 * mu)), 1e-3F);
  const int substeps = tled.substeps_for(0.01F, e.speed_ratio);
  std::vector<Vec3f> v(lattice.nodes.size(), Vec3f{0.001F, -0.002F, 0.001F});
  body.v_m_s = to_device(ctx, v);
  for (int k = 0; k < 200 * substeps; ++k) tled.step(ctx, body, {0.01F / static_cast<float>(substeps), {}});
  EXPECT_LT(kinetic_J(ctx, lattice, body), 1e-7);
}

/// Inner forces come in pairs: momentum changes by rounding only. Damping damps no fall.
TEST(Tled, FreeFlightKeepsMomentumAndFalls) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const CubeLattice lattice = ball(0.021F);
  const ElasticMaterial m{};
  const auto fly = [&](Vec3f gravity, float damping, Vec3f v0, float time_s) {
    Tled tled(ctx, lattice, {&m, 1}, {}, {.damping_ratio = damping});
    BodyState body = rest_state(ctx, lattice);
    std::vector<Vec3f> v(lattice.nodes.size(), v0);
    if (damping == 0) v[3].x += 0.2F;  // it also rings
    body.v_m_s = to_device(ctx, v);
    const int steps = tled.substeps_for(time_s);
    for (int k = 0; k < steps; ++k) tled.step(ctx, body, {time_s / static_cast<float>(steps), gravity});
    Vec3d momentum{}, center{};
    double mass = 0;
    const auto vel = to_host(ctx, body.v_m_s.const_view()), x = to_host(ctx, body.x_m.const_view());
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double mi = static_cast<double>(lattice.node_mass_kg[i]);
      momentum += mi * (vec_cast<double>(vel[i]) - vec_cast<double>(v[i]));
      center += mi * (vec_cast<double>(x[i]) - vec_cast<double>(lattice.rest_m(static_cast<Index>(i))));
      mass += mi;
    }
    return std::pair{(1 / mass) * momentum, (1 / mass) * center};
  };
  const auto [drift, way] = fly({}, 0, {0.5F, 0, 0}, 1);
  EXPECT_LT(length(drift), 1e-5 * 0.7);
  EXPECT_NEAR(way.x, 0.5, 1e-3);
  const auto [speed, fall] = fly({0, -9.81F, 0}, 0.3F, {}, 0.5F);
  EXPECT_NEAR(speed.y, -9.81 * 0.5, 1e-4 * 9.81 * 0.5);
  // Velocity first, then position: the first-order scheme falls g dt t / 2 further, 0.6 mm here.
  EXPECT_NEAR(fall.y, -0.5 * 9.81 * 0.25, 2e-3 * 0.5 * 9.81 * 0.25);
}

TEST_P(TledDevices, SameBitsAsOneCpu) {
  CubeLattice lattice = ball(0.041F);
  lattice.fix_half_space({0, -0.035F, 0}, {0, 1, 0});
  const ElasticMaterial materials[2] = {{.young_Pa = 3000},
                                        {.young_Pa = 20000, .poisson = 0.3F, .density_kg_m3 = 1200}};
  std::vector<std::uint8_t> of_cube(lattice.cubes.size());
  for (std::size_t c = 0; c < of_cube.size(); ++c) of_cube[c] = lattice.cubes[c].x < 6 ? 1 : 0;
  const auto run = [&](const std::string& devices, const TledOptions& options) {
    DeviceSet set(devices, 7);
    ExecContext& ctx = set.context(0);
    Tled tled(ctx, lattice, materials, of_cube, options);
    BodyState body = rest_state(ctx, lattice);
    body.x_m = to_device(ctx, shaken(lattice, 0.1F * kH, 9));
    for (int k = 0; k < 50; ++k) tled.step(ctx, body, {tled.stable_step_s()});
    return std::pair{to_host(ctx, body.x_m.const_view()), tled.extremes(ctx, body).speed_ratio};
  };
  for (const TledOptions& options :
       {TledOptions{}, TledOptions{.law = MaterialLaw::isochoric_neo_hookean},
        TledOptions{.law = MaterialLaw::transversely_isotropic, .fibre = {1, 2, 0}, .fibre_ratio = 3},
        TledOptions{.full_integration = true}}) {
    EXPECT_EQ(run(GetParam(), options), run("cpu", options));
  }
}

TEST(Tled, BadParametersAreNamed) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const CubeLattice lattice = box({2, 2, 2});
  const auto message = [&](const ElasticMaterial& m, const TledOptions& options = {}) {
    try {
      Tled(ctx, lattice, {&m, 1}, {}, options);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(message({.poisson = 0.5F}), "Poisson's ratio is 0.5, expected more than -1 and less than 0.5");
  EXPECT_EQ(message({.young_Pa = -3}), "Young's modulus [Pa] is -3, expected a positive number");
  EXPECT_EQ(message({.density_kg_m3 = NAN}), "density [kg/m^3] is nan, expected a positive number");
  EXPECT_EQ(message({}, {.damping_ratio = 2}), "damping ratio is 2, expected 0 to 0.7");
  const ElasticMaterial m{};
  Tled tled(ctx, lattice, {&m, 1});
  BodyState body = rest_state(ctx, lattice);
  try {
    tled.step(ctx, body, {.dt_s = 1});
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(
        std::string(e.what()).find("a substep of 1 s is not stable: expected more than 0 and at most 0.000"),
        std::string::npos)
        << e.what();
  }
}

}  // namespace
}  // namespace tactus
