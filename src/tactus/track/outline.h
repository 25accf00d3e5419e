#pragma once
/// Where the outline of a posed model lies in a picture, exactly: from the edges of its mesh between faces
/// that look at the camera and faces that don't.
#include <array>
#include <vector>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// A closed mesh, prepared for outlines.
class OutlineMesh {
 public:
  /// @throws Error naming the mesh when it is not closed (check_closed).
  OutlineMesh(const TriangleMesh& mesh, const char* what);

  /// Vectors, an array per coordinate: loops over them do several at once.
  struct Vectors {
    std::vector<double> x, y, z;
    void push_back(Vec3d v) {
      x.push_back(v.x);
      y.push_back(v.y);
      z.push_back(v.z);
    }
    void resize(std::size_t count) {
      for (auto* coordinate : {&x, &y, &z}) coordinate->resize(count);
    }
    Vec3d operator[](Index i) const {
      const auto k = static_cast<std::size_t>(i);
      return {x[k], y[k], z[k]};
    }
  };
  /// Between the faces `left`, whose corners have `from` before `to`, and `right`.
  struct Edge {
    Index from, to, left, right;
  };
  std::vector<Vec3d> vertices_m;
  Vectors vertex_coordinates_m;  ///< the same
  Vectors normals;               ///< of the faces, outward, of any length
  std::vector<double> offsets_m;
  std::vector<std::array<Index, 3>> triangles;
  std::vector<Edge> edges;
  Vec3d center_m;              ///< of the volume
  double radius_m = 0;         ///< of all vertices about it
  std::array<Vec3d, 8> box_m;  ///< corners of the box around all vertices
};

/// A point of the outline. The picture there: the model from `inner_px` inside of it to its surface, nothing
/// of the model up to `outer_px` outside.
struct OutlinePoint {
  Vec3d at_m;               ///< of the model's surface, world
  Vec2d px, normal;         ///< in the picture, pointing out
  double thickness_px = 0;  ///< of the model behind it, along the normal
  double inner_px = 0;      ///< half of that, at most the reach
  double outer_px = 0;      ///< half of the way to the next part of the model, at most the reach
};

/// Finds outlines; keeps its memory. Points that follow each other are neighbours on the outline, but where
/// it is covered or begins again.
class OutlineFinder {
 public:
  /// @param spacing_px of the points @param reach_px how far from the outline pictures are looked at
  /// @returns whether all of the model is well in front of the camera; else no points
  bool find(const OutlineMesh& mesh, const Rigidd& T_world_model, const Camera& camera, double spacing_px,
            double reach_px);
  const std::vector<OutlinePoint>& points() const { return points_; }

 private:
  /// An edge of the mesh with one of its faces seen: the model behind it is on its left.
  struct Segment {
    Vec2d from_px, to_px;
    Index from, to;
  };
  /// @returns the least depth [m]
  double transform_vertices(const Rigidd& T_cam_model);
  void find_seen(Vec3d eye_m);
  void add_segments(const Camera& camera);
  void chain_segments();
  void add_points(std::size_t own, double spacing_px, double& left_px);
  void find_beside(std::size_t own, Vec2d normal);
  void measure(OutlinePoint point, double reach_px);

  const OutlineMesh* mesh_ = nullptr;
  Rigidd T_world_model_;
  std::vector<std::uint8_t> seen_;
  OutlineMesh::Vectors camera_m_;  ///< vertices in the camera's frame
  std::vector<Segment> segments_, unchained_;
  std::vector<Index> first_from_;  ///< of each vertex: the segment that begins there, or -1
  std::vector<Index> next_from_;   ///< of each segment: another that begins at the same vertex, or -1
  /// Of each segment: its middle, and from there to its end, from the first segment's begin. Floats do to
  /// tell which segments may lie beside another.
  struct Middles {
    std::vector<float> x, y, half_x, half_y;
  };
  Middles middles_px_;
  std::vector<std::int32_t> is_beside_;
  struct Crossing {
    double at_px;
    int change;  ///< of the number of layers, inwards
  };
  std::vector<Crossing> crossings_;
  std::vector<OutlinePoint> points_;
  /// A segment, in the axes of the one whose points are measured.
  struct Turned {
    double from_along, from_out, to_along, to_out;
  };
  std::vector<Turned> beside_;  ///< those that normals of its points may cross
  double reach_px_ = 0;
};

}  // namespace tactus
