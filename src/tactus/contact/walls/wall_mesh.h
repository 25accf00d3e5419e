#pragma once
/// A body's surface in triangles that are small beside the particles of a liquid, as the body is cut.
#include <array>
#include <span>
#include <vector>

#include "tactus/geom/lattice/boundary_points.h"

namespace tactus {

/// A vertex inside of a triangle of the surface, or on its edge: x = (1 - b - c) x_0 + b x_1 + c x_2.
struct WallVertex {
  Vec3i corners;
  float b = 0, c = 0;
};

/// Changes of a cut to a surface: vertices and triangles that are new, or others from now on.
struct WallChange {
  struct Vertex {
    Index vertex = 0;
    EmbeddedPoint to;
    Vec3f rest_m{};
  };
  struct Triangle {
    Index triangle = 0;
    std::array<Index, 3> vertices{};  ///< all the same: it is not in use
  };
  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;
};

/// Triangles whose edges are too long at rest are halved at their longest edge, again and again. Each moves
/// with its corners alone, so pieces of one triangle stay flat, and those of two neighbours meet where these
/// do.
class WallMesh {
 public:
  /// Vertices, vertices that halving adds, triangles, and triangles of the surface that there is capacity
  /// for.
  struct Capacity {
    Index vertices = 0, added = 0, triangles = 0, surface = 0;
  };
  /// Parts of a triangle of the surface.
  struct Parts {
    std::vector<Index> triangles, added;
  };
  WallMesh() = default;
  /// @throws Error for a length that is not positive.
  WallMesh(float longest_m, Capacity capacity);

  void apply(const WallChange& change);
  /// Some triangles found no capacity.
  bool is_full() const { return is_full_; }

  const std::vector<EmbeddedPoint>& vertices() const { return points_; }
  /// Their numbers begin at capacity().vertices.
  const std::vector<WallVertex>& added() const { return added_; }
  /// Corners, by vertex; (-1, -1, -1): not in use.
  const std::vector<Vec3i>& triangles() const { return fine_; }
  /// Corners, by vertex; (-1, -1, -1): not in use.
  const std::vector<Vec3i>& surface() const { return coarse_; }
  const std::vector<Parts>& parts() const { return parts_; }
  const Capacity& capacity() const { return capacity_; }

 private:
  struct Corner {
    Index vertex;
    float b, c;
  };
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }
  void divide(Index triangle);
  void drop(Index triangle);
  Index add_vertex(Index triangle, float b, float c);
  void add_triangle(Index triangle, const std::array<Corner, 3>& corners);

  float longest_m_ = 0;
  Capacity capacity_;
  std::vector<EmbeddedPoint> points_;
  std::vector<Vec3f> rest_m_;
  std::vector<Vec3i> coarse_;
  std::vector<Parts> parts_;  ///< of each triangle of the surface
  std::vector<WallVertex> added_;
  std::vector<Vec3i> fine_;
  std::vector<Index> free_added_, free_fine_;
  bool is_full_ = false;
};

}  // namespace tactus
