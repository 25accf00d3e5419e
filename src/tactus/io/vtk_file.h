#pragma once
/// Strained lattices for viewers of results (ParaView): legacy VTK, ASCII.
#include <span>
#include <string>

#include "tactus/tissue/body_monitors.h"

namespace tactus {

/// Hexahedra where they are now, with displacement and velocity of their nodes and, per cube, J, Green's
/// strain, Cauchy's stress and von Mises' stress. Tensors are 3 x 3. @throws Error naming the path.
void write_vtk(const std::string& path, const CubeLattice& lattice, std::span<const Vec3f> x_m,
               std::span<const Vec3f> v_m_s, std::span<const CubeStrain> strains);

}  // namespace tactus
