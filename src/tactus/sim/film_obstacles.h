#pragma once
/// Surfaces of obstacles, fine enough for a film of liquid.
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "tactus/contact/obstacles.h"
#include "tactus/fluid/film/film_surface.h"
#include "tactus/fluid/liquid_report.h"
#include "tactus/geom/arrays/index_lists.h"
#include "tactus/geom/mesh/mesh.h"
#include "tactus/sim/notice.h"

namespace tactus {

/// @param film,stain volumes of its vertices, in units of kFilmUnit_m3
FilmThickness film_thickness(const std::vector<Vec3f>& x_m,
                             const std::vector<std::array<Index, 3>>& triangles,
                             const std::vector<std::int64_t>& film, const std::vector<std::int64_t>& stain);

/// Owns one surface of all obstacles that liquid can reach, on a device. Those that move are rigid.
class FilmObstacles {
 public:
  /// In all. Dry ones cost memory, no time.
  static constexpr std::size_t kMostVertices = 60000;

  /// One obstacle: its whole surface, for pictures, and the part of it that a film can lie on.
  struct Part {
    std::string name;
    Index moving = -1;            ///< number among the obstacles that move
    TriangleMesh mesh;            ///< with normals; its own coordinates if it moves, else world
    std::vector<Index> vertices;  ///< of the film: their numbers in the mesh
    std::vector<std::array<Index, 3>> triangles;  ///< of the film, by vertices of the mesh
    Index first = 0;                              ///< of its vertices in the surface
    /// @param film,stain of its vertices, in units of kFilmUnit_m3 @returns no triangles where it is dry
    WetObstacle where_wet(const std::vector<std::int64_t>& film,
                          const std::vector<std::int64_t>& stain) const;
  };

  /// Triangles in the liquid's box get edges of a particle's spacing, and no shorter than 2 mm: a film's edge
  /// is 1 mm wide. Where obstacles stand on one another, there is no film between them. Synchronizes.
  /// @param has_floor the lower face of the liquid's box is one, too, where no obstacle lies on it
  /// @param notices for each obstacle that would need too many vertices: it has no film
  FilmObstacles(ExecContext& ctx, std::span<const ObstacleDescription> obstacles, const Box3f& box_m,
                bool has_floor, float spacing_m, std::vector<Notice>& notices);

  bool empty() const { return parts_.empty(); }
  bool move() const;  ///< any of them
  Index vertex_count() const { return static_cast<Index>(x_m_.size()); }
  float edge_m() const { return edge_m_; }  ///< the longest
  FilmSurface surface() const;
  View<const Vec3f> normals() const { return normals_.const_view(); }
  const std::vector<Part>& parts() const { return parts_; }
  /// Between frames. @param T_world of the obstacles that move, in the scene's order
  void place(ExecContext& ctx, std::span<const Rigidd> T_world);

 private:
  bool refine(const ObstacleDescription& obstacle, const Box3f& wet_m, Part& part,
              const std::function<bool(Vec3f)>& can_be_wet) const;
  void add(const ObstacleDescription& obstacle, Part part);
  void take_to_device(ExecContext& ctx);

  float edge_m_;
  std::vector<Part> parts_;
  std::vector<Vec3f> x_m_, normal_;  ///< world
  Buffer<Vec3f> x_, normals_;
  Buffer<Index> corners_;
  IndexLists incident_;
};

}  // namespace tactus
