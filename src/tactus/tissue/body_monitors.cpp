#include "tactus/tissue/body_monitors.h"

#include <cmath>
#include <numeric>

#include "tactus/tissue/rigid_motion.h"
#include "tactus/tissue/tled/cube_forces.h"

namespace tactus {
namespace {

/// Deformation gradient of a cube at local coordinates -1..1.
Mat3d gradient(const Vec3d (&x)[8], double h, const Vec3d& at) {
  Mat3d F = Mat3d::zero();
  for (int q = 0; q < 8; ++q) {
    const double s[3] = {(q & 1) != 0 ? 1.0 : -1.0, (q & 2) != 0 ? 1.0 : -1.0, (q & 4) != 0 ? 1.0 : -1.0};
    for (int j = 0; j < 3; ++j) {
      double dN = 0.25 / h * s[j];
      for (int k = 0; k < 3; ++k)
        if (k != j) dN *= 1 + s[k] * at[k];
      for (int i = 0; i < 3; ++i) F(i, j) += x[q][i] * dN;
    }
  }
  return F;
}

/// tled::HourglassControl. @param F at the centre
double hourglass_energy_J(const Vec3d (&x)[8], const Mat3d& F, double h, const ElasticMaterial& m,
                          double lasting) {
  const double mu = lasting * double{m.mu_Pa()}, lambda = double{m.lambda_Pa()};
  const double k = h / 6 * mu * (3 * lambda + 2 * mu) / (lambda + mu);
  const double t = h / 6 * mu * double{tled::HourglassControl::kTwist};
  double squares = 0, twist[3] = {};
  for (int mode = 0; mode < 4; ++mode) {
    Vec3d amount{};
    for (int q = 0; q < 8; ++q) {
      const int a = q & 1, b = q >> 1 & 1, c = q >> 2;
      const int odd[4] = {b ^ c, a ^ c, a ^ b, a ^ b ^ c ^ 1};
      amount += (odd[mode] != 0 ? -1.0 : 1.0) * x[q];
    }
    squares += dot(amount, amount);
    if (mode < 3) twist[mode] = dot(F.column(mode), amount);
  }
  const auto [A, B, C] = twist;
  const double fade = double{tled::HourglassControl::fade(static_cast<float>(trace_C(F)))};
  return (k * squares - fade * ((k - t) * (A * A + B * B + C * C) - t * sqr(A + B + C))) / 16;
}

double strain_energy_J_m3(const TledOptions& options, const ElasticMaterial& m, const Mat3d& F) {
  const auto mu = static_cast<double>(m.mu_Pa()), lambda = static_cast<double>(m.lambda_Pa());
  return with_law(options, [&](const auto& law) { return law.energy(F, mu, lambda); });
}

double elastic_energy_J(const Vec3d (&x)[8], double h, const TledOptions& options,
                        const ElasticMaterial& material) {
  const double volume = h * h * h;
  if (!options.full_integration) return volume * strain_energy_J_m3(options, material, gradient(x, h, {}));
  double sum = 0;
  const double g = 1 / std::sqrt(3.0);
  for (int i = 0; i < 8; ++i) {
    const Vec3d at{(i & 1) != 0 ? g : -g, (i & 2) != 0 ? g : -g, (i & 4) != 0 ? g : -g};
    sum += volume / 8 * strain_energy_J_m3(options, material, gradient(x, h, at));
  }
  return sum;
}

void corners_of(const CubeLattice& lattice, std::size_t cube, std::span<const Vec3f> x_m, Vec3d (&x)[8]) {
  for (std::size_t q = 0; q < 8; ++q)
    x[q] = vec_cast<double>(x_m[static_cast<std::size_t>(lattice.cube_nodes[cube][q])]);
}

Mat3d first_piola_kirchhoff_Pa(const TledOptions& options, const ElasticMaterial& m, const Mat3d& F) {
  const auto column = [&](int j) { return vec_cast<float>(F.column(j)); };
  const GradientColumns P = with_law(options, [&](const auto& law) {
    return law.stress(GradientColumns{column(0), column(1), column(2)}, m.mu_Pa(), m.lambda_Pa());
  });
  const Vec3d x = vec_cast<double>(P.x), y = vec_cast<double>(P.y), z = vec_cast<double>(P.z);
  return {{{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}}};
}

}  // namespace

double CubeStrain::von_mises_Pa() const {
  const Mat3d& s = stress_Pa;
  const double normal = sqr(s(0, 0) - s(1, 1)) + sqr(s(1, 1) - s(2, 2)) + sqr(s(2, 2) - s(0, 0));
  return std::sqrt(0.5 * normal + 3 * (sqr(s(0, 1)) + sqr(s(1, 2)) + sqr(s(2, 0))));
}

std::vector<CubeStrain> cube_strains(const CubeLattice& lattice, const ElementMask& elements,
                                     std::span<const ElasticMaterial> materials,
                                     std::span<const std::uint8_t> material_of_cube,
                                     const TledOptions& options, std::span<const Vec3f> x_m) {
  std::vector<Index> cubes(lattice.cubes.size());
  std::iota(cubes.begin(), cubes.end(), 0);
  return cube_strains(lattice, elements, materials, material_of_cube, options, x_m, cubes);
}

std::vector<CubeStrain> cube_strains(const CubeLattice& lattice, const ElementMask& elements,
                                     std::span<const ElasticMaterial> materials,
                                     std::span<const std::uint8_t> material_of_cube,
                                     const TledOptions& options, std::span<const Vec3f> x_m,
                                     std::span<const Index> cubes) {
  std::vector<CubeStrain> all;
  for (const Index cube : cubes) {
    const auto c = static_cast<std::size_t>(cube);
    CubeStrain& found = all.emplace_back();
    Vec3d x[8];
    corners_of(lattice, c, x_m, x);
    const Mat3d F = gradient(x, static_cast<double>(lattice.spacing_m), {});
    found.strain = 0.5 * (transpose(F) * F - Mat3d::identity());
    found.J = determinant(F);
    if (!elements.empty() && elements[c] == 0) continue;
    const ElasticMaterial& material = materials[material_of_cube.empty() ? 0 : material_of_cube[c]];
    const double J = std::max(found.J, double{kSmallestJ});
    found.stress_Pa = (1 / J) * (first_piola_kirchhoff_Pa(options, material, F) * transpose(F));
  }
  return all;
}

BodyMonitors measure_body(const CubeLattice& lattice, const ElementMask& elements,
                          std::span<const ElasticMaterial> materials,
                          std::span<const std::uint8_t> material_of_cube, const TledOptions& options,
                          std::span<const Vec3f> x_m, std::span<const Vec3f> v_m_s, double step_s) {
  BodyMonitors m;
  MotionSums nodes;
  for (std::size_t i = 0; i < x_m.size(); ++i)
    nodes.add_node(double{lattice.node_mass_kg[i]}, vec_cast<double>(x_m[i]), vec_cast<double>(v_m_s[i]));
  m.kinetic_J = nodes.kinetic_J;
  m.momentum_kg_m_s = nodes.momentum_kg_m_s;
  m.angular_momentum_kg_m2_s = rigid_motion({&nodes, 1}).angular_momentum_kg_m2_s;
  const auto h = static_cast<double>(lattice.spacing_m);
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    if (!lattice.has_cube(c)) continue;
    Vec3d x[8];
    corners_of(lattice, c, x_m, x);
    const double fill = lattice.cube_fill.empty() ? 1 : static_cast<double>(lattice.cube_fill[c]);
    const double J = determinant(gradient(x, h, {}));
    m.volume_m3 += fill * h * h * h * J;
    m.inverted_cubes += J > 0 ? 0 : 1;
    if (!(J >= m.min_J)) m.min_J = J, m.min_J_cube = static_cast<Index>(c);
    if (!elements.empty() && elements[c] == 0) continue;
    const ElasticMaterial& material = materials[material_of_cube.empty() ? 0 : material_of_cube[c]];
    for (std::size_t q = 0; q < 8; ++q)
      x[q] -= 0.5 * step_s * vec_cast<double>(v_m_s[static_cast<std::size_t>(lattice.cube_nodes[c][q])]);
    m.elastic_J += fill * elastic_energy_J(x, h, options, material);
    if (!options.full_integration)
      m.hourglass_J +=
          fill * hourglass_energy_J(x, gradient(x, h, {}), h, material, 1 - double{options.faded_share()});
  }
  return m;
}

}  // namespace tactus
