#pragma once
#include "tactus/compute/kernel.h"
#include "tactus/frame/frame_params.h"

namespace tactus {

/// to[i] = 2 to[i] + from[i] + dt of the substep.
struct DoubleAndAdd {
  View<const double> from;
  View<double> to;
  StepTime time;
  TACTUS_HD void load() { time.load(); }
  TACTUS_HD void operator()(Index i) const { to[i] = 2 * to[i] + from[i] + static_cast<double>(time.dt_s); }
};

/// to[0] = sum of what the devices have.
struct SumDevices {
  View<const double> of[8];
  Index count;
  View<double> to;
  TACTUS_HD void operator()(Index) const {
    double sum = 0;
    for (Index p = 0; p < count; ++p) sum += of[p][0];
    to[0] = sum;
  }
};

}  // namespace tactus
