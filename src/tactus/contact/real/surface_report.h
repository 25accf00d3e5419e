#pragma once
/// Report on the real surface once a frame is done, collected on its device.
#include <array>

#include "tactus/contact/real/motion_kernels.h"

namespace tactus {

/// Report on a surface, read when the caller synchronises anyway.
struct RealSurfaceReport {
  Index samples = 0;
  Index dropped_raw_samples = 0,
        dropped_samples = 0;     ///< > 0: overflow; raise max_raw_samples or max_samples
  SurfaceComponents components;  ///< the largest, at most kComponents
  std::array<SurfaceMotion, kComponents>
      motions{};  ///< of each; components that are too small move as the first
};

/// Collects it, so that one copy brings it to the host. Thread k: component k.
struct NoteReport {
  View<const SurfaceMotion> motion;
  View<const SurfaceComponents> components;
  View<const Index> samples, raw_overflow, fine_overflow, coarse_overflow;  ///< (1)
  View<RealSurfaceReport> report;
  TACTUS_HD void operator()(Index k) const {
    RealSurfaceReport& all = report[0];
    all.motions[static_cast<std::size_t>(k)] = motion[k];
    all.components.copy_part(components[0], k);
    if (k != 0) return;
    all.samples = samples[0];
    all.dropped_raw_samples = raw_overflow[0];
    all.dropped_samples = fine_overflow[0] + coarse_overflow[0];
  }
};

}  // namespace tactus
