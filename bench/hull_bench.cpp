#include "bandwidth.h"
#include "plain_voxel_loop.h"
#include "reconstruct_case.h"
#include "tactus/base/timing.h"

namespace tactus::bench {
namespace {

/// A lower bound from memory alone: every byte that the result consists of, and the masks, moved once.
double floor_ms(const HullReport& report, const Rig& rig, double bandwidth) {
  const double brick_bytes = 64 + 256 + 256 + 32;  // signs, crossings, numbering, cameras: written and read
  double bytes = 2 * brick_bytes * report.active_bricks + 12.0 * report.vertices + 12.0 * report.triangles;
  for (const Camera& camera : rig.cameras) bytes += camera.width_px / 8.0 * camera.height_px;
  return bytes / bandwidth * 1e3;
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

/// Times of the whole, of its parts, and of every kernel on every device.
nlohmann::json reconstruction_row(ReconstructCase& c, const std::string& name, double bandwidth) {
  const auto reconstruct = [&] { c.reconstruct(); };
  const auto carve = [&] { c.hull().carve(); };
  const std::vector<double> upload = c.timed_ms([&] { c.upload(); }, 20, 0.3);
  const std::vector<double> hull = c.timed_ms(carve, 20, 1);
  nlohmann::json row = c.row(name, c.timed_ms(reconstruct));
  row["hull_ms_p50"] = p(hull, 50);
  row["upload_ms_p50"] = p(upload, 50);
  row["floor_ms"] = floor_ms(c.hull().report(), c.rig(), bandwidth);
  if (c.devices().is_cuda()) {
    row["device_ms"] = c.batch_ms(reconstruct);
    row["device_hull_ms"] = c.batch_ms(carve);
  }
  row["kernels_ms_p50"] = c.kernels_ms(reconstruct);
  for (int device = 1; device < c.devices().count(); ++device)
    row["other_devices_kernels_ms_p50"].push_back(c.kernels_ms(reconstruct, device));
  return row;
}

/// The voxel loop stops at 512: it would want a byte for each of 1024^3 voxels.
nlohmann::json hull_row(DeviceSet& devices, const std::string& figure, Index n, double bandwidth) {
  ReconstructCase c(devices, {.figure = figure, .resolution = n});
  nlohmann::json row = reconstruction_row(c, "hull+mesh", bandwidth);
  if (n > 512) return row;
  PlainVoxelLoop loop(c.rig().cameras, c.frame().silhouettes, c.rig().workspace_m, n);
  const double plain_ms = plain_loop_ms(loop, n);
  row["reference"]["plain_loop"] = plain_ms;
  row["plain_loop_over_hull"] = plain_ms / row["hull_ms_p50"].get<double>();
  return row;
}

/// The extended hull: one depth camera of 200x200 pixels more.
nlohmann::json depth_row(DeviceSet& devices, const std::string& figure, Index n, double bandwidth) {
  ReconstructCase c(devices, {.figure = figure, .resolution = n, .depth = true});
  return reconstruction_row(c, "hull+depth+mesh", bandwidth);
}

/// A whole reconstruction as the paper draws it: normals and colours of every vertex, too.
nlohmann::json textured_row(DeviceSet& devices, const std::string& figure, Index n) {
  ReconstructCase c(devices, {.figure = figure, .resolution = n, .depth = true, .texture_k = 1});
  c.upload();
  c.upload_photos();
  const auto all = [&] {
    c.reconstruct();
    c.shade();
  };
  nlohmann::json row = c.row("hull+depth+mesh+texture", c.timed_ms(all));
  if (devices.is_cuda()) row["device_ms"] = c.batch_ms(all);
  row["kernels_ms_p50"] = c.kernels_ms(all);
  return row;
}

/// Many large images: what several devices are compared with one on.
nlohmann::json wide_row(DeviceSet& devices, const std::string& figure, Index n, double bandwidth) {
  CaseOptions options{.figure = figure, .resolution = n};
  options.rig.camera_count = 16;
  options.rig.width_px = 1920;
  options.rig.height_px = 1080;
  options.rig.focal_px = 1350;  // as much of the workspace in the height as in the 480 rows of the others
  ReconstructCase c(devices, options);
  return reconstruction_row(c, "hull+mesh 16x1080p", bandwidth);
}

}  // namespace

Rows run_hull(const std::string& device_text) {
  DeviceSet devices(device_text);
  const double bandwidth = measure_bandwidth_B_s(devices.context(0));
  return collect([&](Rows& rows) {
    for (const char* figure : {"hand", "rabbit"}) {
      double ms_at_128 = 0;
      for (const Index n : {64, 100, 128, 256, 512, 1024}) {
        nlohmann::json row = hull_row(devices, figure, n, bandwidth);
        if (n == 128) ms_at_128 = row["ms_p50"];
        if (n == 256)
          row["growth_from_128"] = row["ms_p50"].get<double>() / ms_at_128;  // volume would give 8
        rows.push_back(std::move(row));
      }
      for (const Index n : {64, 100, 256, 1024}) rows.push_back(depth_row(devices, figure, n, bandwidth));
      for (const Index n : {64, 100}) rows.push_back(textured_row(devices, figure, n));
      for (const Index n : {512, 1024}) rows.push_back(wide_row(devices, figure, n, bandwidth));
    }
  });
}

}  // namespace tactus::bench
