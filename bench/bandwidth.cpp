#include "bandwidth.h"

#include <algorithm>

#include "affine_kernel.h"
#include "bench.h"

namespace tactus::bench {

double measure_bandwidth_B_s(ExecContext& ctx) {
  constexpr Index kCount = 1 << 26;
  Buffer<float> from(ctx.device(), kCount), to(ctx.device(), kCount);
  ctx.fill_bytes(from.view(), 0);
  ctx.fill_bytes(to.view(), 0);
  const auto best_ms = [&](auto&& body) {
    return p(time_ms(
                 [&] {
                   body();
                   ctx.synchronize();
                 },
                 5, 0.3),
             10);
  };
  const double copy_ms = best_ms([&] { ctx.copy(from.const_view(), to.view()); });
  const double loop_ms = best_ms([&] {
    ctx.parallel_for("bandwidth", kCount, AffineKernel{from.const_view(), to.view(), 1.F, 0.F});
  });
  return 2.0 * sizeof(float) * kCount / (std::min(copy_ms, loop_ms) * 1e-3);
}

}  // namespace tactus::bench
