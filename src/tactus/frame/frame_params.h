#pragma once
/// What changes from frame to frame and from substep to substep. It lies on the device, so a recorded launch
/// need not be recorded anew when it changes.
#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"

namespace tactus {

struct FrameParams {
  float dt_s = 0;          ///< of a substep [s]
  float dt_capture_s = 0;  ///< from the last surface's capture to this one's [s]; 0: there is no new one
  /// When the last surface was captured, counted from the frame's first substep [s].
  float surface_age_s = 0;
  Vec3f gravity_m_s2;
  Index substeps = 0;  ///< of this frame
  Index substep = 0;   ///< that runs now, 0 .. substeps - 1
};

/// Step and gravity of a substep: as the host gave them or, with `frame`, as they are on the device when the
/// kernel runs. Kernels that hold one call load() in theirs (compute/kernel.h).
struct StepTime {
  float dt_s = 0;
  Vec3f gravity_m_s2;
  View<const FrameParams> frame = {};
  View<const Index> stopped = {};  ///< (1) != 0: time stands still, and what would move stays
  TACTUS_HD void load() {
    if (frame.empty()) return;
    dt_s = !stopped.empty() && stopped[0] != 0 ? 0.F : frame[0].dt_s;
    gravity_m_s2 = frame[0].gravity_m_s2;
  }
  TACTUS_HD bool stands_still() const { return dt_s == 0.F; }
};

/// More substeps than a frame may have.
inline constexpr Index kMostSubsteps = 10000;

/// A substep is over.
struct NextSubstep {
  View<FrameParams> frame;
  TACTUS_HD void operator()(Index) const { frame[0].substep += 1; }
};

/// How many substeps the frame has, for launches over them.
inline Count substep_count(View<const FrameParams> frame) {
  return {View<const Index>(&frame.data()->substeps, 1), kMostSubsteps};
}

}  // namespace tactus
