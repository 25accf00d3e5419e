#pragma once
/// Takes a film from one mesh of a surface to the next one.
#include <functional>

#include "tactus/fluid/film/film.h"
#include "tactus/fluid/film/film_carry_views.h"
#include "tactus/geom/mesh/mesh_view.h"
#include "tactus/geom/search/neighbour_search.h"

namespace tactus {

struct FilmCarrySettings {
  Index max_vertices = 0, max_triangles = 0;  ///< of meshes; a larger one has no film
  float reach_m = 0;                          ///< vertices farther than that take nothing
  Index max_waiting = 4096;                   ///< places where film waits for a surface
};

/// Has a surface whose mesh is another one now and then, and all film that is on its way. For a new mesh:
/// lift(); then the caller moves point() and places_m() to where they are in it; land(). Film that finds no
/// surface that faces as it did waits where it is, and tries again with each mesh. Volumes and stains are
/// exact. Asynchronous, may be recorded.
class FilmCarry {
 public:
  /// @throws Error naming the setting that is out of range.
  FilmCarry(ExecContext& ctx, const FilmCarrySettings& settings);

  /// Takes all off the surface. It has none until the next link().
  void lift(ExecContext& ctx, Film& film);
  Count points() const { return count(FilmCarryCounts::kPoints, points_.size()); }
  View<FilmPoint> point() { return points_.view(); }
  View<Vec3f> places_m() { return place_m_.view(); }
  /// Lays it on the mesh, which is linked if there is anything.
  void land(ExecContext& ctx, Film& film, const MeshView& mesh);
  /// Makes lists and normals of a mesh that has none yet. @param wanted (1) 0: not now
  void link(ExecContext& ctx, const MeshView& mesh, View<const Index> wanted);
  /// After those, for the vertices that were linked: numbers by which the caller moves them, >= 0. A point
  /// has its vertex'; one that waited has -1.
  Count new_vertices() const { return count(FilmCarryCounts::kLinkVertices, x_m_.size()); }
  View<Index> tags() { return tag_.view(); }

  /// Those of the mesh that is linked; none: 0.
  Count vertices() const { return count(FilmCarryCounts::kVertices, x_m_.size()); }
  Count triangles() const { return count(FilmCarryCounts::kTriangles, max_triangles_); }
  View<const Vec3f> x_m() const { return x_m_.const_view(); }
  View<const Vec3f> normals() const { return normal_.const_view(); }
  View<const Index> tags() const { return tag_.const_view(); }
  /// @param mesh that was linked last @param x_m of its vertices now
  FilmSurface surface(const MeshView& mesh, View<const Vec3f> x_m) const {
    return {vertices(),
            triangles(),
            x_m,
            {reinterpret_cast<const Index*>(mesh.triangles.data()), 3 * mesh.triangles.size()},
            lists_.const_view(),
            incident_.const_view()};
  }
  /// (1)
  View<const FilmWaiting> waiting() const { return sums_.const_view(); }
  Index max_incident() const { return incident_.size(); }
  /// All that later meshes depend on. Synchronizes. @param link links the mesh that was there @returns the
  /// stain that waits @throws Error.
  std::int64_t archive(ExecContext& ctx, StateArchive& a, const std::function<void()>& link);

 private:
  View<Index> one(Index which) { return counts_.view().part(which, 1); }
  Count count(Index which, Index capacity) const { return {counts_.const_view().part(which, 1), capacity}; }

  Index max_triangles_;
  Buffer<Index> counts_;
  Buffer<FilmWaiting> sums_;
  Buffer<Vec3f> x_m_, normal_, offset_m_;
  Buffer<Index> tag_, degree_, first_, incident_;
  Buffer<IndexRange> lists_;
  Buffer<std::uint64_t> moment_;
  Buffer<Index> flag_, list_;
  Buffer<FilmPoint> points_, waiting_;
  Buffer<Vec3f> place_m_, waiting_m_;
  NeighbourSearch from_, to_;
};

}  // namespace tactus
