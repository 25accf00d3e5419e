#pragma once
/// The motion of a body as a whole: momentum, angular momentum, and how fast it turns.
#include <span>

#include "tactus/compute/exec_context.h"
#include "tactus/geom/lattice/cube_lattice.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/tissue/body_state.h"
#include "tactus/tissue/motion_sums.h"

namespace tactus {

struct RigidMotion {
  double mass_kg = 0, kinetic_J = 0;
  Vec3d center_m, velocity_m_s;    ///< of the centre of mass
  Vec3d angular_momentum_kg_m2_s;  ///< about the centre of mass
  Mat3d inertia_kg_m2;             ///< about the centre of mass
  Vec3d low_m, high_m;             ///< box of the nodes
  /// The turn with this angular momentum; 0 for a body without inertia about some axis.
  Vec3d spin_rad_s;
};

/// @param sums in the order of the body's nodes
RigidMotion rigid_motion(std::span<const MotionSums> sums);

/// Sums of one device's nodes.
class MotionMeter {
 public:
  /// @param nodes that move on this device
  MotionMeter(ExecContext& ctx, const CubeLattice& lattice, Slab nodes);
  /// Asynchronous. @param x_m,v_m_s of those nodes
  void measure(ExecContext& ctx, View<const Vec3f> x_m, View<const Vec3f> v_m_s);
  /// Masses of those nodes [kg].
  View<float> mass_kg() { return mass_kg_.view(); }
  /// Sums that were measured last, in the order of the nodes.
  View<const MotionSums> sums() const { return sums_.const_view(); }

 private:
  Buffer<float> mass_kg_;
  Buffer<MotionBlock> blocks_;
  Buffer<MotionSums> sums_;
};

}  // namespace tactus
