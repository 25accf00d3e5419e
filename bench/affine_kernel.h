#pragma once
/// The smallest useful kernel: what the library adds to a loop shows nowhere better.
#include "tactus/base/math.h"
#include "tactus/compute/kernel.h"

namespace tactus::bench {

/// y = a x + b; one rounding.
struct AffineKernel {
  View<const float> x;
  View<float> y;
  float a, b;
  TACTUS_HD void operator()(Index i) const { y[i] = fma(a, x[i], b); }
};

}  // namespace tactus::bench
