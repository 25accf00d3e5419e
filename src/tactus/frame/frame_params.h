#pragma once
/// Parameters that change from frame to frame and from substep to substep. They lie on the device, so a
/// recorded launch need not be recorded anew when they change.
#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"

namespace tactus {

struct FrameParams {
  float dt_s = 0;          ///< of a substep [s]
  float dt_before_s = 0;   ///< of the last substep of the frame before [s]; 0: there was none
  float dt_capture_s = 0;  ///< from the last surface's capture to this one's [s]; 0: there is no new one
  /// When the last surface was captured, counted from the frame's first substep [s].
  float surface_age_s = 0;
  Vec3f gravity_m_s2;
  Index substeps = 0;  ///< of this frame
  /// Done before the block of substeps that runs. A kernel recorded as substep k of a block works on substep
  /// `done` + k.
  Index done = 0;
  Index settles = 0;  ///< 1: bodies come to rest, and time stands for all that moves and loads them
  Index part = 0;     ///< number of the part, where a frame runs in parts: sums over a frame begin at part 0
};

/// Step and gravity of a substep: as the host gave them or, with `frame`, as they are on the device when the
/// kernel runs. Kernels that hold one call load() in theirs (compute/kernel.h).
struct StepTime {
  float dt_s = 0;
  Vec3f gravity_m_s2;
  View<const FrameParams> frame = {};
  View<const Index> stopped = {};          ///< (1) != 0: time stands still, nothing moves
  View<const Vec3f> body_spin_rad_s = {};  ///< one; none: the body does not turn
  Index in_block = 0;                      ///< with `frame`: which substep of its block
  /// Velocities belong to the middle of substeps: from one middle to the next, forces act for the mean of
  /// both steps. Else energy changes with every change of the step.
  float kick_s = 0;
  Vec3f spin_rad_s{};
  TACTUS_HD void load() {
    if (!body_spin_rad_s.empty()) spin_rad_s = body_spin_rad_s[0];
    if (!frame.empty()) {
      dt_s = !stopped.empty() && stopped[0] != 0 ? 0.F : frame[0].dt_s;
      gravity_m_s2 = frame[0].gravity_m_s2;
    }
    const bool changed = !frame.empty() && frame[0].done + in_block == 0 && frame[0].dt_before_s > 0;
    kick_s = changed ? 0.5F * (frame[0].dt_before_s + dt_s) : dt_s;
  }
  /// By how much x + ahead v of a turning body is turned; v, of the middle of the last step of dt, also
  /// points outwards by spin dt / 2.
  TACTUS_HD Vec3f turn_rad(float ahead_s, float dt_s_of_v) const {
    return (ahead_s / (1 + 0.5F * ahead_s * dt_s_of_v * dot(spin_rad_s, spin_rad_s))) * spin_rad_s;
  }
  TACTUS_HD bool stands_still() const { return dt_s == 0.F; }
  TACTUS_HD bool settles() const { return !frame.empty() && frame[0].settles != 0; }
};

/// A force that was found where a body will be a little later, which has turned by a small angle until then.
/// Only so is its moment that of inner forces where the body is: a body's turning is not damped.
TACTUS_HD inline Vec3f turned_back(Vec3f force, Vec3f angle_rad) {
  const Vec3f a = angle_rad, f = force;
  return {fma(a.z, f.y, fma(-a.y, f.z, f.x)), fma(a.x, f.z, fma(-a.z, f.x, f.y)),
          fma(a.y, f.x, fma(-a.x, f.y, f.z))};
}

/// More substeps than a frame may have.
inline constexpr Index kMostSubsteps = 10000;

/// A block of substeps is over.
struct EndBlock {
  View<FrameParams> frame;
  Index substeps;
  TACTUS_HD void operator()(Index) const { frame[0].done += substeps; }
};

/// How many substeps the frame has, for launches over them.
inline Count substep_count(View<const FrameParams> frame) {
  return {View<const Index>(&frame.data()->substeps, 1), kMostSubsteps};
}

}  // namespace tactus
