#include "tactus/reconstruct/visual_hull.h"
#include "tactus/frame/readback.h"
#include "tactus/frame/stage.h"
#include "tactus/geom/mesh/mesh_view.h"

#include <algorithm>
#include <string>

#include "tactus/base/error.h"
#include "tactus/base/free_memory.h"
#include "tactus/geom/image/mask_growth.h"
#include "tactus/multi_device/device_replay.h"
#include "tactus/multi_device/upload_ring.h"
#include "tactus/reconstruct/depth/depth_check.h"
#include "tactus/reconstruct/hull_part.h"

namespace tactus {

struct VisualHull::Impl {
  DeviceSet& devices;
  std::vector<Camera> cameras, depth_cameras;
  Box3f workspace_m;
  std::string depth_status;
  bool has_images = false;
  int slack_px;
  std::vector<BitMask> grown;  ///< silhouettes with their slack
  HullPlan plan;
  UploadRing<std::uint32_t> masks_staging;
  UploadRing<float> depth_staging;
  /// The first part's mesh is that of all: the others add theirs to it.
  Parts<HullPart> parts;
  /// Copies of the other parts' meshes, where kernels can't write to the first device.
  struct PartMesh {
    Buffer<Vec3f> positions_m;
    Buffer<Vec3i> triangles;
    Buffer<PartPlace> place;
  };
  Parts<PartMesh> staged;
  DeviceReplay reconstructing, carving, extracting;
  std::vector<Readback::Place> counts_report;  ///< per part

  Impl(DeviceSet& set, std::span<const Camera> rig, const HullOptions& options,
       std::span<const Camera> depth_rig);
  void check_memory(const HullOptions& options) const;
  void check_sizes(std::span<const BitMask> silhouettes, std::span<const DepthImage> depths_m) const;
  void stage_masks(std::span<const BitMask> silhouettes, std::span<std::uint32_t> staging);
  void stage_depth(std::span<const DepthImage> depths_m, std::uint32_t used, std::span<float> staging);
  HullReport report_of(std::span<const PartCounts> counts) const;
  void note_depth(const std::string& what);
  void carve_parts();
  void extract_parts();
  void wait_for_mesh();
  void gather_staged();
  HullPart& part(int p) { return parts[static_cast<std::size_t>(p)]; }
  HullRole role(int p) const { return {p, devices.count(), devices.reads_peers()}; }
};

VisualHull::Impl::Impl(DeviceSet& set, std::span<const Camera> rig, const HullOptions& options,
                       std::span<const Camera> depth_rig)
    : devices(set),
      cameras(rig.begin(), rig.end()),
      depth_cameras(depth_rig.begin(), depth_rig.end()),
      workspace_m(options.workspace_m),
      slack_px(options.slack_px),
      grown(rig.size()),
      plan(plan_hull(rig, options, depth_rig)) {
  if (set.count() > kMaxHullParts)
    throw usage_error("devices '" + set.name() + "': a hull is shared by at most " +
                      std::to_string(kMaxHullParts));
  check_memory(options);
  parts.resize(static_cast<std::size_t>(set.count()));
  set.for_each_part([&](ExecContext& ctx, int p) { part(p).allocate(ctx, plan, role(p)); });
  Device& first = set.device(0);
  masks_staging = UploadRing<std::uint32_t>(set, plan.silhouettes.raw_words + 1);
  if (!plan.depth.empty()) depth_staging = UploadRing<float>(set, plan.depth.buffer_pixels());
  if (!set.reads_peers()) {
    for (int p = 1; p < set.count(); ++p) {
      staged.push_back({Buffer<Vec3f>(first, plan.capacity.vertices),
                        Buffer<Vec3i>(first, plan.capacity.triangles), Buffer<PartPlace>(first, 1)});
    }
  }
  set.synchronize();
}

void VisualHull::Impl::check_memory(const HullOptions& options) const {
  const std::string size = "resolution " + std::to_string(options.resolution);
  const double copy_bytes =
      devices.reads_peers() ? 0 : 12.0 * plan.capacity.vertices + 12.0 * plan.capacity.triangles;
  for (int p = 0; p < devices.count(); ++p) {
    const Device& device = devices.device(p);
    double bytes = 0, memory = 0;  // of all parts that share this memory
    if (p == 0) bytes += options.beside_vertex_bytes * plan.capacity.vertices;
    for (int q = 0; q < devices.count(); ++q) {
      const Device& other = devices.device(q);
      const bool shares = !device.is_cuda() || other.ordinal() == device.ordinal();
      if (shares) bytes += HullPart::needed_bytes(plan, role(q)) + (q > 0 && p == 0 ? copy_bytes : 0);
    }
    for (const DeviceInfo& info : list_devices()) {
      if (device.is_cuda() ? info.spec == DeviceSpec{DeviceKind::cuda, device.ordinal()}
                           : info.spec.kind == DeviceKind::cpu)
        memory = info.memory_bytes;
    }
    if (!device.is_cuda()) memory = std::min(memory, free_memory_bytes());
    if (bytes > 0.9 * memory) {
      throw Error(size + " would need " + bytes_text(bytes) + " on " + device.name() + ", which has " +
                  bytes_text(memory) + "; choose a lower resolution or a smaller workspace");
    }
  }
  if (plan.tiles * kTileBricks > (std::int64_t{1} << 31) - 1)
    throw Error(size + ": more bricks than can be indexed; choose a lower resolution");
}

VisualHull::VisualHull(DeviceSet& devices, std::span<const Camera> cameras, const HullOptions& options,
                       std::span<const Camera> depth_cameras)
    : impl_(std::make_unique<Impl>(devices, cameras, options, depth_cameras)) {}
VisualHull::~VisualHull() = default;
VisualHull::VisualHull(VisualHull&&) noexcept = default;

void VisualHull::Impl::check_sizes(std::span<const BitMask> silhouettes,
                                   std::span<const DepthImage> depths_m) const {
  const auto check = [](const Camera& camera, const char* what, const auto& image, std::size_t held,
                        Index row) {
    if (image.width_px != camera.width_px || image.height_px != camera.height_px)
      throw Error("camera '" + camera.name + "': the " + what + " has " + std::to_string(image.width_px) +
                  "x" + std::to_string(image.height_px) + " pixels, its calibration says " +
                  std::to_string(camera.width_px) + "x" + std::to_string(camera.height_px));
    const std::size_t expected = static_cast<std::size_t>(row) * static_cast<std::size_t>(image.height_px);
    if (held != expected)
      throw Error("camera '" + camera.name + "': the " + what + " holds " + std::to_string(held) +
                  " values, expected " + std::to_string(expected) + " for its " +
                  std::to_string(image.width_px) + "x" + std::to_string(image.height_px) + " pixels");
  };
  if (silhouettes.size() != cameras.size()) {
    throw Error(std::to_string(silhouettes.size()) + " silhouettes for " + std::to_string(cameras.size()) +
                " cameras");
  }
  if (!depths_m.empty() && depths_m.size() != depth_cameras.size()) {
    throw Error(std::to_string(depths_m.size()) + " depth images for " +
                std::to_string(depth_cameras.size()) + " depth cameras");
  }
  for (std::size_t c = 0; c < silhouettes.size(); ++c) {
    const BitMask& mask = silhouettes[c];
    if (!mask.words.empty()) check(cameras[c], "silhouette", mask, mask.words.size(), mask.words_per_row());
  }
  for (std::size_t d = 0; d < depths_m.size(); ++d) {
    const DepthImage& image = depths_m[d];
    if (!image.empty()) check(depth_cameras[d], "depth image", image, image.pixels.size(), image.width_px);
  }
}

void VisualHull::Impl::note_depth(const std::string& what) {
  depth_status += (depth_status.empty() ? "" : "; ") + what;
}

void VisualHull::Impl::stage_masks(std::span<const BitMask> silhouettes, std::span<std::uint32_t> staging) {
  for (std::size_t c = 0; c < silhouettes.size(); ++c) {
    const HullCamera& camera = plan.silhouettes.cameras[c];
    std::uint32_t* to = staging.data() + camera.raw_begin;
    const std::vector<std::uint32_t>& words = silhouettes[c].words;
    if (words.empty())
      std::fill_n(to, camera.raw_row_words() * camera.height_px, ~0U);
    else
      std::copy(words.begin(), words.end(), to);
  }
}

void VisualHull::Impl::stage_depth(std::span<const DepthImage> depths_m, std::uint32_t used,
                                   std::span<float> staging) {
  for (std::size_t d = 0; d < depth_cameras.size(); ++d) {
    const DepthImage* image = (used >> d & 1U) != 0 ? &depths_m[d] : nullptr;
    const std::int64_t measured = plan.depth.stage(d, image, staging.data());
    if (measured == 0 && image != nullptr && !image->empty())
      note_depth("camera '" + depth_cameras[d].name + "': the depth image has no valid pixel");
  }
}

void VisualHull::upload(std::span<const BitMask> silhouettes, std::span<const DepthImage> depths_m) {
  Impl& m = *impl_;
  m.check_sizes(silhouettes, depths_m);
  m.has_images = true;
  m.depth_status.clear();
  std::uint32_t used = 0;  // bit d: the image of depth camera d
  for (std::size_t d = 0; d < depths_m.size(); ++d) {
    const std::string odd =
        depth_inconsistency(m.cameras, silhouettes, m.depth_cameras[d], depths_m[d], m.workspace_m);
    if (odd.empty())
      used |= 1U << d;
    else
      m.note_depth(odd);
  }
  if (m.slack_px > 0) {
    for (std::size_t c = 0; c < silhouettes.size(); ++c) grow_mask(silhouettes[c], m.slack_px, m.grown[c]);
    silhouettes = m.grown;
  }
  m.stage_masks(silhouettes, m.masks_staging.next());
  if (!m.plan.depth.empty()) m.stage_depth(depths_m, used, m.depth_staging.next());
  m.devices.for_each_part([&](ExecContext& ctx, int p) {
    ctx.upload(m.masks_staging.newest(), m.part(p).masks.raw.view());
    if (!m.plan.depth.empty()) ctx.upload(m.depth_staging.newest(), m.part(p).depth.raw.view());
  });
  m.masks_staging.sent();
  if (!m.plan.depth.empty()) m.depth_staging.sent();
}

void VisualHull::reconstruct() {
  Impl& m = *impl_;
  m.wait_for_mesh();
  m.reconstructing.run(m.devices, [&] {
    m.carve_parts();
    m.extract_parts();
  });
  m.devices.context(0).record(m.part(0).done);
}

void VisualHull::carve() {
  Impl& m = *impl_;
  m.carving.run(m.devices, [&] { m.carve_parts(); });
}

void VisualHull::extract() {
  Impl& m = *impl_;
  m.wait_for_mesh();
  m.extracting.run(m.devices, [&] { m.extract_parts(); });
  m.devices.context(0).record(m.part(0).done);
}

std::vector<Stage> VisualHull::stages(std::function<void()> upload) {
  Impl& m = *impl_;
  std::vector<Stage> stages;
  stages.push_back({.name = "hull/upload",
                    .timed_as = "upload",
                    .rate = Rate::upload,
                    .devices = StageDevices::all,
                    .writes = {"hull/masks"},
                    .submit = [upload = std::move(upload)](BlockPlace) { upload(); }});
  stages.push_back({.name = "hull/carve",
                    .timed_as = "hull",
                    .rate = Rate::capture,
                    .devices = StageDevices::all,
                    .writes = {"hull/signs"},
                    .reads = {"hull/masks"},
                    .submit = [&m](BlockPlace) { m.carve_parts(); }});
  stages.push_back({.name = "hull/extract",
                    .timed_as = "mesh",
                    .rate = Rate::capture,
                    .devices = StageDevices::all,
                    .writes = {kMesh},
                    .reads = {"hull/signs"},
                    .submit = [&m](BlockPlace) { m.extract_parts(); }});
  return stages;
}

/// While parts make the last mesh they read one another's counts. The first is done after all others.
void VisualHull::Impl::wait_for_mesh() {
  for (int p = 1; p < devices.count(); ++p) devices.context(p).wait(part(0).done);
}

void VisualHull::Impl::carve_parts() {
  devices.for_each_part([&](ExecContext& ctx, int p) { part(p).carve(ctx, plan); });
}

void VisualHull::Impl::extract_parts() {
  const int count = devices.count();
  devices.for_each_part([&](ExecContext& ctx, int p) { ctx.record(part(p).carved); });
  devices.for_each_part([&](ExecContext& ctx, int p) {
    for (int ghosts = p + 1; ghosts < count; ++ghosts) ctx.wait(part(ghosts).carved);
    part(p).count(ctx, plan, parts);
    ctx.record(part(p).counted);
  });
  devices.for_each_part([&](ExecContext& ctx, int p) {
    for (int other = 0; other < count; ++other) {
      if (other != p) ctx.wait(part(other).counted);
    }
    if (count > 1) part(p).find_place(ctx, parts);
    part(p).emit(ctx, plan, part(0));
    if (p > 0) ctx.record(part(p).done);
  });
  for (int p = 1; p < count; ++p) devices.context(0).wait(part(p).done);
  if (!devices.reads_peers()) gather_staged();
}

void VisualHull::Impl::gather_staged() {
  ExecContext& ctx = devices.context(0);
  for (std::size_t p = 1; p < parts.size(); ++p) {
    const HullPart& from = parts[p];
    PartMesh& copy = staged[p - 1];
    ctx.copy(from.positions_m.const_view(), copy.positions_m.view());
    ctx.copy(from.triangles.const_view(), copy.triangles.view());
    ctx.copy(from.place.const_view(), copy.place.view());
    push_vertices(ctx, copy.positions_m.view(), copy.place.view(), part(0).positions_m.view());
    push_triangles(ctx, copy.triangles.view(), copy.place.view(), part(0).triangles.view());
  }
}

MeshView VisualHull::mesh() const {
  const HullPart& first = impl_->parts.front();
  const PartCounts* counts = (impl_->parts.size() > 1 ? first.total.view() : first.counts.view()).data();
  const View<const Vec3f> positions_m = first.positions_m.view();
  const View<const Vec3i> triangles = first.triangles.view();
  return {positions_m,
          triangles,
          {View<const Index>(&counts->vertices, 1), positions_m.size()},
          {View<const Index>(&counts->triangles, 1), triangles.size()},
          {}};
}

std::string HullOverflow::text(const std::string& as) const {
  const std::string number = std::to_string(wanted);
  return number + " " + what + ", capacity for " + std::to_string(capacity) + ": raise " + as + " to " +
         number + " or more";
}

void VisualHull::add_reports(Readback& readback) {
  impl_->counts_report.clear();
  for (int p = 0; p < impl_->devices.count(); ++p)
    impl_->counts_report.push_back(readback.add(impl_->part(p).counts.const_view(), p));
}

HullReport VisualHull::report(const Readback& readback) const {
  std::vector<PartCounts> counts;
  for (const Readback::Place& place : impl_->counts_report)
    counts.push_back(readback.get<PartCounts>(place)[0]);
  return impl_->report_of(counts);
}

HullReport VisualHull::report() {
  Impl& m = *impl_;
  if (!m.has_images) return {};
  std::vector<PartCounts> counts;
  m.devices.for_each_part(
      [&](ExecContext& ctx, int p) { counts.push_back(to_host(ctx, m.part(p).counts.const_view())[0]); });
  m.devices.synchronize();
  return m.report_of(counts);
}

HullReport VisualHull::Impl::report_of(std::span<const PartCounts> counts) const {
  HullReport report;
  report.depth = depth_status;
  const HullCapacity& has = plan.capacity;
  const auto check = [&](Index wanted, Index capacity, const char* what, const char* option) {
    if (wanted > capacity && !report.overflow)
      report.overflow = {.what = what, .wanted = wanted, .capacity = capacity, .option = option};
  };
  Index most_bricks = 0;
  for (const PartCounts& part : counts) {
    report.active_bricks += part.active_bricks;
    report.vertices += part.vertices;
    report.triangles += part.triangles;
    most_bricks = std::max(most_bricks, part.held_bricks);
  }
  check(most_bricks, has.bricks, "surface bricks", "max_active_bricks");
  check(report.vertices, has.vertices, "vertices", "max_vertices");
  check(report.triangles, has.triangles, "triangles", "max_triangles");
  report.vertices = std::min(report.vertices, has.vertices);
  report.triangles = std::min(report.triangles, has.triangles);
  return report;
}

TriangleMesh VisualHull::download() {
  const HullReport r = report();
  ExecContext& ctx = impl_->devices.context(0);
  const MeshView device_mesh = mesh();
  TriangleMesh out;
  out.positions_m = to_host(ctx, device_mesh.positions_m.part(0, r.vertices));
  const std::vector<Vec3i> triangles = to_host(ctx, device_mesh.triangles.part(0, r.triangles));
  out.triangles.reserve(triangles.size());
  for (const Vec3i t : triangles) {  // after an overflow some name vertices that are not there, or none
    if (max(t.x, max(t.y, t.z)) < r.vertices && t.x != t.y) out.triangles.push_back({t.x, t.y, t.z});
  }
  return out;
}

float VisualHull::voxel_size_m() const { return impl_->plan.voxel_size_m; }
std::int64_t VisualHull::memory_bytes() const {
  std::int64_t bytes = 0;
  for (HullPart& part : impl_->parts) bytes += part.bytes(impl_->plan);
  return bytes;
}

}  // namespace tactus
