#pragma once
/// Sums over a body's state: energies, momentum, volume. On the host and in double, independent of the
/// solvers.
#include <span>

#include "tactus/tissue/body_measures.h"
#include "tactus/tissue/hybrid/hybrid.h"

namespace tactus {

/// @param elements,material_of_cube empty: all, and all of the first material
/// @param step_s the last substep: velocities are those of its middle, so energies of strain are told there,
/// too. Else energy would seem to grow by (omega dt)^2 / 4 where it goes over to a mode omega.
BodyMonitors measure_body(const CubeLattice& lattice, const ElementMask& elements,
                          std::span<const ElasticMaterial> materials,
                          std::span<const std::uint8_t> material_of_cube, const TledOptions& options,
                          std::span<const Vec3f> x_m, std::span<const Vec3f> v_m_s, double step_s = 0);

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
