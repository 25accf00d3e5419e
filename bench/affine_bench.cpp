#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "affine_kernel.h"
#include "bandwidth.h"
#include "bench.h"
#include "tactus/base/timing.h"
#include "tactus/multi_device/device_set.h"

namespace tactus::bench {
namespace {

/// What one would write without the library.
void hand_written(const float* x, float* y, Index n, float a, float b) {
  tbb::parallel_for(tbb::blocked_range<Index>(0, n, 2048), [=](const tbb::blocked_range<Index>& r) {
#pragma omp simd
    for (Index i = r.begin(); i < r.end(); ++i) y[i] = __builtin_fmaf(a, x[i], b);
  });
}

/// Sizes from one core's first cache to main memory. Both loops are timed in turn, so that a slow moment of
/// the machine meets both. Floor: 4 B read and 4 B written per element at copy bandwidth; none for what stays
/// in caches.
nlohmann::json run_size(DeviceSet& devices, Index n, double bandwidth_B_s) {
  ExecContext& ctx = devices.context(0);
  Buffer<float> x(ctx.device(), n), y(ctx.device(), n);
  ctx.fill_bytes(x.view(), 0);
  ctx.fill_bytes(y.view(), 0);
  ctx.synchronize();
  const bool in_cache = n < (1 << 20);
  const int batch = in_cache ? 200 : 4;  // clocks and waits cost microseconds
  const AffineKernel kernel{x.const_view(), y.view(), 1.5F, 0.25F};
  const bool has_reference = ctx.device().kind() == DeviceKind::cpu;
  std::vector<double> library_ms, hand_ms;
  const auto timed = [&](auto&& body) {
    const double begin_s = now_s();
    for (int i = 0; i < batch; ++i) body();
    ctx.synchronize();
    return (now_s() - begin_s) * 1e3 / batch;
  };
  constexpr int kWarmUps = 3, kRepetitions = 60;
  for (int i = -kWarmUps; i < kRepetitions; ++i) {
    check_stop();
    const double library = timed([&] { ctx.parallel_for("affine", n, kernel); });
    const double hand =
        has_reference ? timed([&] { hand_written(x.view().data(), y.view().data(), n, 1.5F, 0.25F); }) : 0;
    if (i < 0) continue;
    library_ms.push_back(library);
    hand_ms.push_back(hand);
  }
  nlohmann::json row{
      {"name", "affine kernel"},
      {"case", "y=ax+b"},
      {"size", n},
      {"devices", devices.name()},
      {"ms_p50", p(library_ms, 50)},
      {"ms_p99", p(library_ms, 99)},
      {"ms_p10", p(library_ms, 10)},
      {"floor_ms", in_cache ? nlohmann::json() : nlohmann::json(8.0 * n / bandwidth_B_s * 1e3)},
      {"reference", nlohmann::json::object()}};
  if (has_reference) {
    row["reference"]["hand_written"] = p(hand_ms, 50);
    row["over_hand_written"] = p(library_ms, 50) / p(hand_ms, 50);
  }
  return row;
}

}  // namespace

Rows run_affine(const std::string& device_text) {
  DeviceSet devices(device_text);
  const double bandwidth_B_s = measure_bandwidth_B_s(devices.context(0));
  return collect([&](Rows& rows) {
    for (const Index n : {1 << 13, 1 << 17, 1 << 24}) rows.push_back(run_size(devices, n, bandwidth_B_s));
  });
}

}  // namespace tactus::bench
