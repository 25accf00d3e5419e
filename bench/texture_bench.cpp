#include "bandwidth.h"
#include "reconstruct_case.h"

namespace tactus::bench {
namespace {

nlohmann::json run_case(DeviceSet& devices, const std::string& figure, Index n, Index k, double bandwidth) {
  ReconstructCase c(devices, {.figure = figure, .resolution = n, .texture_k = k});
  c.upload();
  c.reconstruct();
  const HullReport report = c.hull().report();
  ExecContext& ctx = devices.context(0);
  const auto upload = c.timed_ms([&] { c.upload_photos(); }, 30, 1);
  const auto normal = c.timed_ms([&] { c.surface().compute_normals(); }, 30, 1);
  const auto shade =
      c.timed_ms([&] { c.texture().shade(ctx, c.hull().mesh(), c.surface().normals()); }, 30, 1);
  nlohmann::json row = c.row("texture", shade);
  row["case"] = figure + " k=" + std::to_string(k);
  row["normals_ms_p50"] = p(normal, 50);
  row["upload_ms_p50"] = p(upload, 50);
  // A lower bound from memory alone: vertices, normals and triangles read, colours written, each once.
  row["floor_ms"] = (28.0 * report.vertices + 12.0 * report.triangles) / bandwidth * 1e3;
  return row;
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
