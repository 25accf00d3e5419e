#pragma once
/// Which part of a body's surface a step of the liquid looks at.
#include <vector>

#include "tactus/compute/buffer.h"
#include "tactus/contact/walls/active_wall_kernels.h"

namespace tactus {

/// Owns the active set of a body's surface on one device: triangles, and their vertices. Either it is all of
/// them, or it follows the liquid: then watch, once the cells near the liquid are known, and choose, in each
/// step. Asynchronous, may be recorded. See active_wall_kernels.h.
class ActiveWalls {
 public:
  /// @param capacity of the surface
  ActiveWalls(ExecContext& ctx, const WallGrid& grid, const WallMesh::Capacity& capacity, Index nodes);

  Count vertices() const { return {counts().part(1, 1), vertex_list_.size()}; }
  Count triangles() const { return {counts().part(0, 1), triangle_list_.size()}; }
  View<const Index> vertex_list() const { return vertex_list_.const_view(); }
  View<const Index> triangle_list() const { return triangle_list_.const_view(); }

  /// All of the first so many are active. Synchronizes.
  void take_all(ExecContext& ctx, Index vertices, Index triangles);
  /// The surface has changed: none are active, and the next liquid near it has the set chosen. Synchronizes.
  void follow(ExecContext& ctx, const std::vector<EmbeddedPoint>& points);

  /// Near cells that ask for another set.
  View<const std::uint32_t> guarded() const { return guarded_.const_view(); }
  void watch(ExecContext& ctx, const ContactNodes& nodes, const WallRefresh& refresh);
  /// Where it was asked for. @param pose of all vertices @param triangles of the surface
  void choose(ExecContext& ctx, const PoseWallVertices& pose, View<const Vec3i> triangles,
              View<const std::uint32_t> near, const WallRefresh& refresh);

 private:
  /// Cells that the liquid may go before another set is needed, and one for the body.
  static constexpr Index kMargin = 3;
  View<const Index> counts() const {
    return {reinterpret_cast<const Index*>(counts_.const_view().data()), 2};
  }

  WallGrid grid_;
  Buffer<std::uint32_t> counts_;  ///< of triangles and vertices
  Buffer<Index> triangle_list_, vertex_list_;
  Buffer<std::uint32_t> is_active_, wide_, taken_, guarded_;
  Buffer<Vec3f> chosen_m_;
  Buffer<float> most_m_;
};

}  // namespace tactus
