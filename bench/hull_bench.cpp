#include "bandwidth.h"
#include "bench.h"
#include "plain_voxel_loop.h"
#include "tactus/base/timing.h"
#include "tactus/reconstruct/visual_hull.h"
#include "tactus/rig/synthetic_source.h"

namespace tactus::bench {
namespace {

/// A lower bound from memory alone: every byte that the result consists of, and the masks, moved once.
double floor_ms(const HullReport& report, double mask_bytes, double bandwidth) {
  const double brick_bytes = 64 + 256 + 256 + 32;  // signs, crossings, numbering, cameras: written and read
  const double bytes =
      mask_bytes + 2 * brick_bytes * report.active_bricks + 12.0 * report.vertices + 12.0 * report.triangles;
  return bytes / bandwidth * 1e3;
}

/// Milliseconds per run of `body` when several are in flight: the device's own time, without the wait for
/// each.
double batch_ms(DeviceSet& devices, const std::function<void()>& body) {
  constexpr int kBatch = 20;
  const std::vector<double> ms = time_ms(
      [&] {
        for (int i = 0; i < kBatch; ++i) body();
        devices.synchronize();
      },
      10, 1);
  return percentile(ms, 50) / kBatch;
}

/// Median; the largest grid takes seconds and runs once.
double plain_loop_ms(PlainVoxelLoop& loop, Index n) {
  if (n > 256) {
    const double begin_s = now_s();
    loop.run();
    return (now_s() - begin_s) * 1e3;
  }
  return p(time_ms([&] { loop.run(); }, n > 128 ? 7 : 20, 1), 50);
}

/// Median milliseconds of every kernel, run one by one: what fills the gap to the floor.
nlohmann::json kernel_ms(DeviceSet& devices, VisualHull& hull) {
  Timings timings;
  devices.context(0).profile(&timings);
  for (int i = 0; i < 30; ++i) {
    check_stop();
    hull.carve();
    hull.extract();
    devices.synchronize();
  }
  devices.context(0).profile(nullptr);
  nlohmann::json kernels;
  for (const std::string& name : timings.stages()) kernels[name] = timings.percentile_ms(name, 50);
  return kernels;
}

nlohmann::json run_case(DeviceSet& devices, const std::string& figure, Index n, double bandwidth) {
  SyntheticOptions options;
  options.figure = figure + "-still";
  options.depth = options.truth = false;
  SyntheticSource source(options);
  FrameSet frame;
  source.next(frame);
  VisualHull hull(devices, source.rig().cameras, {.workspace_m = source.rig().workspace_m, .resolution = n});
  const auto upload = time_ms(
      [&] {
        hull.upload(frame.silhouettes);
        devices.synchronize();
      },
      20, 0.3);
  const auto carve = time_ms(
      [&] {
        hull.carve();
        devices.synchronize();
      },
      30, 1.5);
  const auto whole = time_ms(
      [&] {
        hull.carve();
        hull.extract();
        devices.synchronize();
      },
      30, 2);
  const HullReport report = hull.report();
  nlohmann::json row{{"name", "hull+mesh"},
                     {"case", figure},
                     {"size", n},
                     {"devices", devices.name()},
                     {"ms_p50", p(whole, 50)},
                     {"ms_p99", p(whole, 99)},
                     {"ms_p10", p(whole, 10)},
                     {"hull_ms_p50", p(carve, 50)},
                     {"upload_ms_p50", p(upload, 50)},
                     {"floor_ms", floor_ms(report, 8.0 * 640 * 480 / 8, bandwidth)},
                     {"kernels_ms_p50", kernel_ms(devices, hull)},
                     {"vertices", report.vertices},
                     {"triangles", report.triangles}};
  if (devices.is_cuda()) {
    row["device_ms"] = batch_ms(devices, [&] {
      hull.carve();
      hull.extract();
    });
    row["device_hull_ms"] = batch_ms(devices, [&] { hull.carve(); });
  }
  PlainVoxelLoop loop(source.rig().cameras, frame.silhouettes, source.rig().workspace_m, n);
  const double plain_ms = plain_loop_ms(loop, n);
  row["reference"] = {{"plain_loop", plain_ms}};
  row["plain_loop_over_hull"] = plain_ms / p(carve, 50);
  return row;
}

/// The extended hull: one depth camera of 200x200 pixels more.
nlohmann::json run_depth_case(DeviceSet& devices, const std::string& figure, Index n) {
  SyntheticOptions options;
  options.figure = figure + "-still";
  options.truth = false;
  SyntheticSource source(options);
  FrameSet frame;
  source.next(frame);
  VisualHull hull(devices, source.rig().cameras, {.workspace_m = source.rig().workspace_m, .resolution = n},
                  source.rig().depth_cameras);
  const auto upload = time_ms(
      [&] {
        hull.upload(frame.silhouettes, frame.depths_m);
        devices.synchronize();
      },
      20, 0.3);
  const auto whole = time_ms(
      [&] {
        hull.carve();
        hull.extract();
        devices.synchronize();
      },
      30, 2);
  const HullReport report = hull.report();
  nlohmann::json row{{"name", "hull+depth+mesh"},
                     {"case", figure},
                     {"size", n},
                     {"devices", devices.name()},
                     {"ms_p50", p(whole, 50)},
                     {"ms_p99", p(whole, 99)},
                     {"ms_p10", p(whole, 10)},
                     {"ms_min", p(whole, 0)},
                     {"upload_ms_p50", p(upload, 50)},
                     {"vertices", report.vertices},
                     {"triangles", report.triangles}};
  if (devices.is_cuda()) {
    row["device_ms"] = batch_ms(devices, [&] {
      hull.carve();
      hull.extract();
    });
  }
  return row;
}

}  // namespace

Rows run_hull(const std::string& device_text) {
  DeviceSet devices(device_text);
  const double bandwidth = measure_bandwidth_B_s(devices.context(0));
  return collect([&](Rows& rows) {
    for (const char* figure : {"hand", "rabbit"}) {
      double ms_at_128 = 0;
      for (const Index n : {64, 100, 128, 256, 512}) {
        nlohmann::json row = run_case(devices, figure, n, bandwidth);
        if (n == 128) ms_at_128 = row["ms_p50"];
        if (n == 256)
          row["growth_from_128"] = row["ms_p50"].get<double>() / ms_at_128;  // volume would give 8
        rows.push_back(std::move(row));
      }
      for (const Index n : {64, 100, 256}) rows.push_back(run_depth_case(devices, figure, n));
    }
  });
}

}  // namespace tactus::bench
