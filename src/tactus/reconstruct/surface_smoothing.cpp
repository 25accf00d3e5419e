#include "tactus/reconstruct/surface_smoothing.h"

#include <utility>

#include "tactus/base/error.h"
#include "tactus/reconstruct/smoothing_kernels.h"

namespace tactus {
namespace {

// Places of `sums_`.
constexpr Index kWanted = 0, kVolume = 1, kGrowth = 2;

}  // namespace

SurfaceSmoothing::SurfaceSmoothing(Device& device, Index max_vertices, Index max_triangles)
    : corner_vertices_(device, 3 * std::int64_t{max_triangles}),
      vertices_scratch_(device, 3 * std::int64_t{max_triangles}),
      corners_(device, 3 * std::int64_t{max_triangles}),
      corners_scratch_(device, 3 * std::int64_t{max_triangles}),
      fan_begin_(device, std::int64_t{max_vertices} + 1),
      normals_(device, max_triangles),
      filtered_(device, max_triangles),
      directions_(device, max_vertices),
      positions_(device, max_vertices),
      moved_(device, max_vertices),
      areas_(device, max_triangles),
      volumes_(device, max_triangles),
      growth_(device, max_vertices),
      sums_(device, 3),
      sum_scratch_(device, max(max_vertices, max_triangles) / 256 + 2) {}

void SurfaceSmoothing::find_fans(ExecContext& ctx, const MeshView& mesh) {
  ctx.parallel_for(
      "smooth/corners", corners_.size(),
      ListCorners{mesh.triangles, mesh.triangle_count, corner_vertices_.view(), corners_.view()});
  ctx.sort_pairs("smooth/sort", corner_vertices_.view(), corners_.view(), vertices_scratch_.view(),
                 corners_scratch_.view(), 31);
  ctx.parallel_for("smooth/fans", fan_begin_.size(),
                   FindFans{corner_vertices_.const_view(), fan_begin_.view()});
}

void SurfaceSmoothing::measure(ExecContext& ctx, const MeshView& mesh, View<const Vec3f> positions_m,
                               View<float> volume_m3) {
  ctx.parallel_for("smooth/faces", volumes_.size(),
                   MeasureFaces{positions_m, mesh.triangles, mesh.triangle_count, normals_.view(),
                                areas_.view(), volumes_.view()});
  ctx.sum("smooth/volume", volumes_.const_view(), volume_m3, sum_scratch_.view());
}

void SurfaceSmoothing::restore_volume(ExecContext& ctx, const MeshView& mesh, View<Vec3f> positions_m,
                                      float edge_m) {
  const Fans fans{fan_begin_.const_view(), corners_.const_view()};
  measure(ctx, mesh, positions_m, sums_.view().part(kVolume, 1));
  ctx.parallel_for("smooth/growth", growth_.size(),
                   FindGrowth{mesh.vertex_count, fans, areas_.const_view(), normals_.const_view(),
                              directions_.view(), growth_.view()});
  ctx.sum("smooth/growth", growth_.const_view(), sums_.view().part(kGrowth, 1), sum_scratch_.view());
  const View<const float> sums = sums_.const_view();
  ctx.parallel_for("smooth/restore", mesh.vertex_count,
                   RestoreVolume{sums.part(kWanted, 1), sums.part(kVolume, 1), sums.part(kGrowth, 1),
                                 directions_.const_view(), edge_m, positions_m});
}

MeshView SurfaceSmoothing::smooth(ExecContext& ctx, const MeshView& mesh, float edge_m, int steps) {
  if (mesh.positions_m.size() != positions_.size() || mesh.triangles.size() != normals_.size())
    throw Error("smoothing: the mesh has capacity for " + std::to_string(mesh.positions_m.size()) +
                " vertices and " + std::to_string(mesh.triangles.size()) + " triangles, expected " +
                std::to_string(positions_.size()) + " and " + std::to_string(normals_.size()));
  if (steps < 1 || !(edge_m > 0))
    throw Error("smoothing: " + std::to_string(steps) + " steps with edges of " + std::to_string(edge_m) +
                " m, expected at least 1 and more than 0");
  const Count vertices = mesh.vertex_count, triangles = mesh.triangle_count;
  find_fans(ctx, mesh);
  const Fans fans{fan_begin_.const_view(), corners_.const_view()};
  View<Vec3f> at = positions_.view(), next = moved_.view();
  ctx.copy(mesh.positions_m, at);
  measure(ctx, mesh, at, sums_.view().part(kWanted, 1));
  View<Vec3f> normals = normals_.view(), filtered = filtered_.view();
  for (int i = 0; i < steps; ++i) {
    ctx.parallel_for("smooth/normals", triangles,
                     FilterNormals{mesh.triangles, fans, areas_.const_view(), normals, filtered});
    std::swap(normals, filtered);
  }
  for (int i = 0; i < 2 * steps; ++i) {
    ctx.parallel_for("smooth/vertices", vertices,
                     FollowNormals{at, mesh.triangles, fans, areas_.const_view(), normals, next});
    std::swap(at, next);
  }
  // The second time removes the rest that the first order left.
  for (int i = 0; i < 2; ++i) restore_volume(ctx, mesh, at, edge_m);
  return {at,
          mesh.triangles,
          mesh.vertex_count,
          mesh.triangle_count,
          {}};  // after an even number of exchanges: positions_
}

}  // namespace tactus
