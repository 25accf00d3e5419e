#pragma once
/// Sums over a body's state: energies, momentum, volume. On the host and in double, independent of the
/// solvers.
#include <span>

#include "tactus/tissue/hybrid/hybrid.h"

namespace tactus {

struct BodyMonitors {
  double kinetic_J = 0;
  double elastic_J = 0;  ///< of the elements, at their integration points; as if nothing had relaxed
  double hourglass_J =
      0;  ///< of the elements' hourglass control: far below elastic_J where the lattice is fine enough
  Vec3d momentum_kg_m_s{};
  Vec3d angular_momentum_kg_m2_s{};  ///< about the centre of mass
  double volume_m3 = 0;              ///< of all cubes, by their fill
  double min_J = 1;                  ///< smallest ratio of a cube's volume to that at rest; <= 0 is inverted
  Index min_J_cube = 0;
  Index inverted_cubes = 0;
  friend bool operator==(const BodyMonitors&, const BodyMonitors&) = default;
};

/// @param elements,material_of_cube empty: all, and all of the first material
/// @param step_s the last substep: velocities are those of its middle, so energies of strain are told there,
/// too. Else energy would seem to grow by (omega dt)^2 / 4 where it goes over to a mode omega.
BodyMonitors measure_body(const CubeLattice& lattice, const ElementMask& elements,
                          std::span<const ElasticMaterial> materials,
                          std::span<const std::uint8_t> material_of_cube, const TledOptions& options,
                          std::span<const Vec3f> x_m, std::span<const Vec3f> v_m_s, double step_s = 0);

/// Strain and stress of a cube, at its centre.
struct CubeStrain {
  Mat3d strain = Mat3d::zero();  ///< Green's, (C - 1) / 2, in the axes at rest
  Mat3d stress_Pa =
      Mat3d::zero();  ///< Cauchy's, in the world's axes; of elements, as if nothing had relaxed; else 0
  double J = 1;       ///< volume over that at rest
  double von_mises_Pa() const;
};
/// Strain and stress of the lattice's cubes, in their order. Parameters as measure_body's.
std::vector<CubeStrain> cube_strains(const CubeLattice& lattice, const ElementMask& elements,
                                     std::span<const ElasticMaterial> materials,
                                     std::span<const std::uint8_t> material_of_cube,
                                     const TledOptions& options, std::span<const Vec3f> x_m);
/// The same for some of them.
std::vector<CubeStrain> cube_strains(const CubeLattice& lattice, const ElementMask& elements,
                                     std::span<const ElasticMaterial> materials,
                                     std::span<const std::uint8_t> material_of_cube,
                                     const TledOptions& options, std::span<const Vec3f> x_m,
                                     std::span<const Index> cubes);

}  // namespace tactus
