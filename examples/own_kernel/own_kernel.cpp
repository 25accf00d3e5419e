// A kernel of one's own, without nvcc: the integral of 4 / (1 + x^2) over [0, 1], which is pi.
//   cmake -S examples/own_kernel -B build-own -DCMAKE_PREFIX_PATH=/where/tactus/is && cmake --build build-own
//   build-own/own_kernel         the host's cores;  build-own/own_kernel cpu:2   virtual devices
#include <tactus/base/error.h>
#include <tactus/compute/host_kernel.h>
#include <tactus/multi_device/device_set.h>

#include <cmath>
#include <cstdio>

/// Midpoint rule: y[i] is the component of the integral over cell i.
struct Cells {
  tactus::View<float> y;
  float width;
  void operator()(tactus::Index i) const {
    const float x = (static_cast<float>(i) + 0.5F) * width;
    y[i] = width * 4.F / (1.F + x * x);
  }
};

// On a GPU this kernel is an error that names it; listed in a .cu file instead, it runs there as well.
TACTUS_HOST_KERNEL(Cells);

namespace {

double pi_on(const char* device_text) {
  constexpr tactus::Index kCells = 4096;
  tactus::DeviceSet devices(device_text);
  tactus::ExecContext& ctx = devices.context(0);
  tactus::Buffer<float> cells(ctx.device(), kCells), total(ctx.device(), 1),
      scratch(ctx.device(), kCells / 256 + 2);
  ctx.parallel_for("own/cells", kCells, Cells{cells.view(), 1.F / kCells});
  ctx.sum("own/sum", cells.view(), total.view(), scratch.view());  // the same bits on every device
  return to_host(ctx, total.view())[0];
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const double pi = pi_on(argc > 1 ? argv[1] : "cpu");
    std::printf("pi = %.6f\n", pi);
    // The rule errs by 1 / (12 n^2) < 1e-8, float sums of 12 levels by 12 x 6e-8 x pi, the terms by 3 eps
    // each.
    return std::abs(pi - 3.14159265358979) < 4e-6 ? 0 : 1;
  } catch (const tactus::Error& e) {
    std::fprintf(stderr, "error: %s\n", e.what());
    return 1;
  }
}
