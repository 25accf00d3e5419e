#include "reconstruct_case.h"

#include "tactus/base/timing.h"

namespace tactus::bench {
namespace {

SyntheticOptions source_options(const CaseOptions& options) {
  SyntheticOptions source;
  source.figure = options.figure + "-still";
  source.depth = options.depth;
  source.truth = false;
  source.colors = options.texture_k.has_value();
  source.rig = options.rig;
  return source;
}

}  // namespace

ReconstructCase::ReconstructCase(DeviceSet& devices, const CaseOptions& options)
    : devices_(devices),
      options_(options),
      source_(source_options(options)),
      surface_(
          devices, source_.rig().cameras,
          options.depth ? std::span<const Camera>(source_.rig().depth_cameras) : std::span<const Camera>(),
          {.hull = {.workspace_m = source_.rig().workspace_m, .resolution = options.resolution}}) {
  source_.next(frame_);
  if (!options.texture_k) return;
  texture_.emplace(devices.context(0), source_.rig().cameras,
                   TextureOptions{.k = *options.texture_k,
                                  .voxel_size_m = surface_.voxel_size_m(),
                                  .center_m = {0, 0.5F, 0},
                                  .max_vertices = surface_.surface().positions_m.size()});
}

void ReconstructCase::upload() { hull().upload(frame_.silhouettes, frame_.depths_m); }
void ReconstructCase::reconstruct() { hull().reconstruct(); }
void ReconstructCase::upload_photos() { texture_->upload(devices_.context(0), frame_.colors); }
void ReconstructCase::shade() {
  surface_.compute_normals();
  texture_->shade(devices_.context(0), surface_.surface(), surface_.normals());
}

std::vector<double> ReconstructCase::timed_ms(const std::function<void()>& body, int least, double seconds) {
  return time_ms(
      [&] {
        body();
        devices_.synchronize();
      },
      least, seconds);
}

double ReconstructCase::batch_ms(const std::function<void()>& body) {
  constexpr int kBatch = 20;
  const auto batch = [&] {
    for (int i = 0; i < kBatch; ++i) body();
  };
  return p(timed_ms(batch, 10, 1), 50) / kBatch;
}

nlohmann::json ReconstructCase::kernels_ms(const std::function<void()>& body, int device) {
  return bench::kernels_ms(devices_.context(device), [&] {
    const double begin_s = now_s();
    for (int i = 0; i < 3 || (i < 30 && now_s() - begin_s < 2); ++i) {
      check_stop();
      body();
      devices_.synchronize();
    }
  });
}

nlohmann::json ReconstructCase::row(const std::string& name, const std::vector<double>& ms) {
  const HullReport report = hull().report();
  nlohmann::json row{{"name", name},
                     {"case", options_.figure},
                     {"size", options_.resolution},
                     {"devices", devices_.name()},
                     {"ms_p50", p(ms, 50)},
                     {"ms_p99", p(ms, 99)},
                     {"ms_p10", p(ms, 10)},
                     {"ms_min", p(ms, 0)},
                     {"floor_ms", nullptr},
                     {"reference", nlohmann::json::object()},
                     {"vertices", report.vertices},
                     {"triangles", report.triangles},
                     {"active_bricks", report.active_bricks},
                     {"memory_MB", static_cast<double>(hull().memory_bytes()) * 1e-6}};
  if (report.overflow) row["overflow"] = report.overflow->text();
  return row;
}

}  // namespace tactus::bench
