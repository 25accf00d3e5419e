#include "bandwidth.h"
#include "bench.h"
#include "tactus/reconstruct/surface_texture.h"
#include "tactus/rig/synthetic_source.h"

namespace tactus::bench {
namespace {

nlohmann::json run_case(DeviceSet& devices, const std::string& figure, Index n, Index k, double bandwidth) {
  SyntheticOptions options;
  options.figure = figure + "-still";
  options.depth = options.truth = false;
  options.colors = true;
  SyntheticSource source(options);
  FrameSet frame;
  source.next(frame);
  const Rig& rig = source.rig();
  ExecContext& ctx = devices.context(0);
  VisualHull hull(devices, rig.cameras, {.workspace_m = rig.workspace_m, .resolution = n});
  const Index room = hull.mesh().positions_m.size();
  SurfaceNormals normals(devices.device(0), room);
  SurfaceTexture texture(
      ctx, rig.cameras,
      {.k = k, .voxel_size_m = hull.voxel_size_m(), .center_m = {0, 0.5F, 0}, .max_vertices = room});
  hull.upload(frame.silhouettes);
  hull.carve();
  hull.extract();
  const HullReport report = hull.report();
  const auto timed = [&](auto&& body) {
    return time_ms(
        [&] {
          body();
          devices.synchronize();
        },
        30, 1);
  };
  const auto upload = timed([&] { texture.upload(ctx, frame.colors); });
  const auto normal = timed([&] { normals.compute(ctx, hull.mesh(), hull.voxel_size_m()); });
  const auto shade = timed([&] { texture.shade(ctx, hull.mesh(), normals.view()); });
  // A lower bound from memory alone: vertices, normals and triangles read, colours written, each once.
  const double bytes = 28.0 * report.vertices + 12.0 * report.triangles;
  return {{"name", "texture"},
          {"case", figure + " k=" + std::to_string(k)},
          {"size", n},
          {"devices", devices.name()},
          {"ms_p50", p(shade, 50)},
          {"ms_p99", p(shade, 99)},
          {"ms_p10", p(shade, 10)},
          {"normals_ms_p50", p(normal, 50)},
          {"upload_ms_p50", p(upload, 50)},
          {"floor_ms", bytes / bandwidth * 1e3},
          {"vertices", report.vertices},
          {"triangles", report.triangles},
          {"reference", nlohmann::json::object()}};
}

}  // namespace

Rows run_texture(const std::string& device_text) {
  DeviceSet devices(device_text);
  const double bandwidth = measure_bandwidth_B_s(devices.context(0));
  return collect([&](Rows& rows) {
    for (const char* figure : {"hand", "rabbit"}) {
      for (const Index n : {64, 100, 256}) {
        for (const Index k : {1, 3}) rows.push_back(run_case(devices, figure, n, k, bandwidth));
      }
    }
  });
}

}  // namespace tactus::bench
