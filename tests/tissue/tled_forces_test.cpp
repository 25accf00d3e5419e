#include <gtest/gtest.h>

#include "support/device_sets.h"
#include "support/message_of.h"
#include "tactus/base/error.h"
#include "tactus/tissue/tled/material_laws.h"
#include "tissue/tled_bodies.h"

namespace tactus {
namespace {

using test::message_of;

double hourglass_sign(int mode, int q) {
  const int x1 = q & 1, y1 = q >> 1 & 1, z1 = q >> 2;
  const int odd[4] = {y1 ^ z1, x1 ^ z1, x1 ^ y1, x1 ^ y1 ^ z1 ^ 1};
  return odd[mode] != 0 ? -1.0 : 1.0;
}

/// Twists resist less than what bends: minus the derivative of -fade ((k - t) sum A^2 - t (sum A)^2) / 16 to
/// the nodes, A_j = F_j . mode_j with F by differences of faces (tled::HourglassControl).
void add_twists(const Vec3d (&modes)[4], const std::array<Index, 8>& nodes, const std::vector<Vec3f>& x,
                double h, const ElasticMaterial& m, std::vector<Vec3d>& f) {
  Vec3d F[3] = {};
  double A[3], square = 0;
  for (int j = 0; j < 3; ++j) {
    for (int q = 0; q < 8; ++q)
      F[j] += (((q >> j & 1) != 0 ? 1 : -1) / (4 * h)) * vec_cast<double>(x[at(nodes[at(q)])]);
    A[j] = dot(F[j], modes[j]);
    square += dot(F[j], F[j]);
  }
  const double k = h * static_cast<double>(m.young_Pa) / 6,
               t = 0.8436 * h * static_cast<double>(m.mu_Pa()) / 6;
  const double fade = std::clamp(1.95 - 0.31 * square, 0.0, 1.0);
  for (int j = 0; j < 3; ++j) {
    const double slope = -fade / 8 * ((k - t) * A[j] - t * (A[0] + A[1] + A[2]));
    for (int q = 0; q < 8; ++q)
      f[at(nodes[at(q)])] -=
          slope * (hourglass_sign(j, q) * F[j] + (((q >> j & 1) != 0 ? 1 : -1) / (4 * h)) * modes[j]);
  }
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
      Mat3d F = Mat3d::zero();
      for (int q = 0; q < 8; ++q)
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) F(i, j) += static_cast<double>(x[at(nodes[at(q)])][i]) * dN[q][j];
      const double J = determinant(F);
      const Mat3d inverse_C = inverse(transpose(F) * F);
      Mat3d S = Mat3d::zero();
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
    Vec3d modes[4];
    for (int mode = 0; mode < 4; ++mode) {
      const auto sign = [mode](int q) { return hourglass_sign(mode, q); };
      Vec3d amount{};
      for (int q = 0; q < 8; ++q) amount += sign(q) * vec_cast<double>(x[at(nodes[at(q)])]);
      modes[mode] = amount;
      for (int q = 0; q < 8; ++q)
        f[at(nodes[at(q)])] += (-h * static_cast<double>(m.young_Pa) / 6 / 8 * sign(q)) * amount;
    }
    add_twists(modes, nodes, x, h, m, f);
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
template <class Law>
void expect_derivative(const Law& law) {
  const ElasticMaterial m{.young_Pa = 3000, .poisson = 0.45F};
  const auto mu = static_cast<double>(m.mu_Pa()), lambda = static_cast<double>(m.lambda_Pa());
  std::mt19937 random(4);
  std::uniform_real_distribution<double> u(-0.3, 0.3);
  for (int sample = 0; sample < 20; ++sample) {
    Mat3d F = Mat3d::zero();
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) F(i, j) = (i == j ? 1 : 0) + u(random);
    if (determinant(F) < 0.15) continue;
    const auto column = [&](int j) { return vec_cast<float>(F.column(j)); };
    const GradientColumns P = law.stress({column(0), column(1), column(2)}, m.mu_Pa(), m.lambda_Pa());
    const Vec3f columns[3] = {P.x, P.y, P.z};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        Mat3d above = F, below = F;
        above(i, j) += 1e-6;
        below(i, j) -= 1e-6;
        const double expected = (law.energy(above, mu, lambda) - law.energy(below, mu, lambda)) / 2e-6;
        EXPECT_NEAR(static_cast<double>(columns[j][i]), expected, 1e-5 * lambda);
      }
    }
    EXPECT_NEAR(law.energy(F, 2 * mu, 3 * lambda), 2 * law.energy(F, mu, 0) + 3 * law.energy(F, 0, lambda),
                1e-9 * lambda);
  }
}

TEST(MaterialLaws, StressIsTheDerivativeOfTheEnergy) {
  const TledOptions constants{.fibre = {1, 2, -1}, .fibre_ratio = 4};
#define TACTUS_ROW(word, Law)              \
  {                                        \
    SCOPED_TRACE(#word);                   \
    expect_derivative(Law::of(constants)); \
  }
  TACTUS_MATERIAL_LAWS(TACTUS_ROW)
#undef TACTUS_ROW
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
  for (const MaterialLaw law : kEveryLaw) {
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
/// at each corner, k = h E / 6 for what bends the cube, and twice 0.8436 h mu / 6 for one twist alone: it has
/// two of the three shear strains.
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
      const bool twists = mode < 3 && axis == (mode + 2) % 3;
      const float expected = kH / 6 * size * (twists ? 2 * 0.8436F * m.mu_Pa() : m.young_Pa);
      // A twist also turns what it pulls at: by 2 size / h, in modes of its own.
      float mean = 0;
      for (std::size_t q = 0; q < 8; ++q) {
        mean += f[q][axis] * sign(q) / 8;
        EXPECT_NEAR(f[q][axis] * sign(q), -expected, (twists ? 0.2F : 1e-3F) * expected)
            << mode << " " << axis;
      }
      EXPECT_NEAR(mean, -expected, 1e-3F * expected) << mode << " " << axis;
    }
  }
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
    tled.find_extremes(ctx, body);
    return std::pair{to_host(ctx, body.x_m.const_view()), tled.extremes(ctx).speed_ratio};
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
    return message_of([&] { Tled(ctx, lattice, {&m, 1}, {}, options); });
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
