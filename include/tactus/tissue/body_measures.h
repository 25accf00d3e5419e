#pragma once
/// Measures of a body: energies, momentum, volume, strain.
#include "tactus/base/vec.h"

namespace tactus {

/// Sums over a body's state.
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

/// Strain and stress of a cube, at its centre.
struct CubeStrain {
  Mat3d strain = Mat3d::zero();  ///< Green's, (C - 1) / 2, in the axes at rest
  Mat3d stress_Pa =
      Mat3d::zero();  ///< Cauchy's, in the world's axes; of elements, as if nothing had relaxed; else 0
  double J = 1;       ///< volume over that at rest
  double von_mises_Pa() const;
};

}  // namespace tactus
