#include "tactus/contact/contact_on_devices.h"

#include <algorithm>

#include "tactus/contact/copy_kernels.h"

namespace tactus {

ContactOnDevices::ContactOnDevices(DeviceSet& devices, int count, const RealSurfaceSettings& surface,
                                   const ContactSettings& contact,
                                   std::span<const ObstacleDescription> obstacles)
    : devices_(devices), copies_(static_cast<std::size_t>(count)) {
  for (int p = 0; p < count; ++p) {
    ExecContext& ctx = devices.context(p);
    parts_.push_back(std::unique_ptr<Part>(new Part{RealSurface(ctx.device(), surface),
                                                    Obstacles(ctx, obstacles, surface.sample_spacing_m),
                                                    Contact(ctx.device(), contact),
                                                    {}}));
    part(p).surface.clear(ctx);
    if (const Index tools = part(p).obstacles.tool_count(); tools > 0) {
      part(p).tools = Buffer<ToolMotion>(ctx.device(), tools);
      ctx.fill_bytes(part(p).tools.view(), 0);
    }
    if (p == 0) continue;
    copies_[static_cast<std::size_t>(p)] = {Buffer<Vec3f>(ctx.device(), surface.max_vertices),
                                            Buffer<Vec3i>(ctx.device(), surface.max_triangles),
                                            Buffer<Index>(ctx.device(), 2)};
  }
  if (first().obstacles.tool_count() > 0)
    tool_ring_ = UploadRing<ToolMotion>(devices, first().obstacles.tool_count());
  devices.synchronize();
}

void ContactOnDevices::move_tools(std::span<const ToolMotion> tools) {
  if (tools.empty()) return;
  std::vector<Index> there;
  for (const ToolMotion& tool : tools) there.push_back(tool.is_there);
  if (there != tools_there_)
    for (auto& part : parts_) part->contact.invalidate();
  tools_there_ = std::move(there);
  std::copy(tools.begin(), tools.end(), tool_ring_.next().begin());
  for (int p = 0; p < count(); ++p) devices_.context(p).upload(tool_ring_.newest(), part(p).tools.view());
  tool_ring_.sent();
}

/// Copies the used part of the mesh where kernels can read it in place, else all that there is capacity for.
MeshView ContactOnDevices::copied(int p, const MeshView& mesh) {
  ExecContext& ctx = devices_.context(p);
  MeshCopy& copy = copies_[static_cast<std::size_t>(p)];
  const auto count = [&](const Count& there, Index k) {
    if (there.device_count == nullptr) return there;
    ctx.copy(View<const Index>(there.device_count, 1), copy.counts.view().part(k, 1));
    return Count(copy.counts.const_view().part(k, 1), there.capacity);
  };
  const auto elements = [&]<class T>(View<const T> from, const Count& used, Buffer<T>& to) {
    const View<T> capacity = to.view().part(0, from.size());
    if (devices_.reads_peers())
      ctx.parallel_for("contact/copy_mesh", used, CopyElements<T>{from, capacity});
    else
      ctx.copy(from, capacity);
    return View<const T>(capacity);
  };
  MeshView here = mesh;
  here.vertex_count = count(mesh.vertex_count, 0);
  here.triangle_count = count(mesh.triangle_count, 1);
  here.positions_m = elements(mesh.positions_m, here.vertex_count, copy.vertices_m);
  here.triangles = elements(mesh.triangles, here.triangle_count, copy.triangles);
  return here;
}

void ContactOnDevices::update(const MeshView& mesh, const FrameOnDevices& frame) {
  if (count() > 1) devices_.context(0).record(ready_);
  for (int p = 0; p < count(); ++p) {
    ExecContext& ctx = devices_.context(p);
    if (p > 0) ctx.wait(ready_);
    part(p).surface.update(ctx, p > 0 ? copied(p, mesh) : mesh,
                           View<const float>(&frame.view(p).data()->dt_capture_s, 1));
  }
}

void ContactOnDevices::begin_frame(const FrameOnDevices& frame) {
  for (int p = 0; p < count(); ++p)
    part(p).contact.begin_frame(devices_.context(p), part(p).surface, {.frame = frame.view(p)},
                                part(p).tools.const_view());
}

}  // namespace tactus
