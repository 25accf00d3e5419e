#pragma once
/// Boundaries of known shape: planes, boxes and meshes that stand still, and tools, whose motion is given.
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tactus/contact/real/real_surface.h"
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

enum class ObstacleKind : Index { plane = 0, box = 1, mesh = 2 };

/// How a tool moves from a capture on, as a component of the real surface does. Its centre is the middle of
/// its mesh's box.
struct ToolMotion {
  Index is_there = 0;  ///< 0: nobody knows where it is, and it touches nothing
  Mat3f R_world_tool = Mat3f::identity();
  Vec3f center_m;      ///< world
  Vec3f velocity_m_s;  ///< of the centre
  Vec3f spin_rad_s;
};

/// At most so many tools.
inline constexpr Index kMostTools = 4;

/// Where a tool is at one time.
struct ToolPose {
  Index is_there = 0;
  Mat3f turn = Mat3f::identity();  ///< R_world_tool
  Vec3f center_m, velocity_m_s, spin_rad_s;
  TACTUS_HD static ToolPose at(const ToolMotion& m, float time_s) {
    const float rate = length(m.spin_rad_s);
    const Mat3f turned = rotation_matrix(axis_angle(normalized(m.spin_rad_s), rate * time_s));
    return {m.is_there, turned * m.R_world_tool, m.center_m + time_s * m.velocity_m_s, m.velocity_m_s,
            m.spin_rad_s};
  }
  /// A point in the tool's coordinates, whose origin is its centre; its mesh and edge are in them, too.
  TACTUS_HD Vec3f to_tool(Vec3f p_m) const { return transpose(turn) * (p_m - center_m); }
  TACTUS_HD Vec3f velocity_at(Vec3f p_m) const { return velocity_m_s + cross(spin_rad_s, p_m - center_m); }
};

/// An obstacle on the device.
struct Obstacle {
  ObstacleKind kind = ObstacleKind::plane;
  Rigidf T_obstacle_world;  ///< plane: y is its height; box: its middle is the origin
  Vec3f half_m;             ///< box
  SurfaceTrianglesView mesh;
  Index tool = -1;  ///< >= 0: it moves by that pose of SurfacePoses, and its mesh is in its own coordinates
  Box3f bounds;     ///< of a tool
  View<const Vec3f> edge_m;  ///< of a tool: a polyline that cuts, and so doesn't push
  float edge_reach_m = 0;    ///< so far from the polyline

  /// From a point to the nearest one of a tool's edge, in its coordinates.
  TACTUS_HD Vec3f to_edge(Vec3f p_m) const {
    Vec3f nearest{1e30F, 0, 0};
    for (Index k = 0; k + 1 < edge_m.size(); ++k) {
      const Vec3f along = edge_m[k + 1] - edge_m[k], to = edge_m[k] - p_m;
      const Vec3f off = to + clamp(-dot(to, along) / dot(along, along), 0.F, 1.F) * along;
      if (k == 0 || dot(off, off) < dot(nearest, nearest)) nearest = off;
    }
    return nearest;
  }
  /// How far a point is outside of a tool's box along the farthest axis, in its coordinates; < 0: in it.
  TACTUS_HD float outside_m(Vec3f p_m) const {
    const Vec3f out = max(bounds.min - p_m, p_m - bounds.max);
    return max(out.x, max(out.y, out.z));
  }

  /// The gap of a point that is inside a plane or box, or went through since it was at `before_m`, in world
  /// coordinates; `facing` as SurfaceTrianglesView::gap.
  TACTUS_HD SurfaceGap shape_gap(Vec3f p_m, Vec3f before_m, Vec3f facing) const {
    const Mat3f back = transpose(T_obstacle_world.R);
    const Vec3f p = T_obstacle_world * p_m;
    if (kind == ObstacleKind::plane) return {p.y, back.column(1), p.y < 0.F};
    SurfaceGap g = box_gap(p, T_obstacle_world * before_m, T_obstacle_world.R * facing);
    g.n = back * g.n;
    return g;
  }
  /// How far a point is outside of a plane or box; <= 0 inside.
  TACTUS_HD float distance_m(Vec3f p_m) const {
    const Vec3f p = T_obstacle_world * p_m;
    return kind == ObstacleKind::plane ? p.y
                                       : length(max(Vec3f{abs(p.x), abs(p.y), abs(p.z)} - half_m, Vec3f{}));
  }

 private:
  /// In the box's coordinates: through the face where the way from `before` enters, else to the face where it
  /// touched, else to the nearest.
  TACTUS_HD SurfaceGap box_gap(Vec3f p, Vec3f before, Vec3f facing) const {
    float enter = -1, leave = 2;
    int face = -1;
    bool inside = true, misses = false;
    float nearest = -1e30F, facing_most = -1;
    int nearest_axis = 0, facing_axis = -1;
    for (int a = 0; a < 3; ++a) {
      const float d = abs(p[a]) - half_m[a];
      inside = inside && d < 0.F;
      if (d > nearest) {
        nearest = d;
        nearest_axis = a;
      }
      const float along = p[a] < 0.F ? -facing[a] : facing[a];
      if (along > max(facing_most, 0.7F)) {
        facing_most = along;
        facing_axis = a;
      }
      const float way = p[a] - before[a];
      if (abs(before[a]) >= half_m[a]) {  // it has to enter through this pair of faces
        const float sign = before[a] < 0.F ? -1.F : 1.F;
        const float share = sign * way < 0.F ? (sign * half_m[a] - before[a]) / way : 2.F;
        misses = misses || share > 1.F;
        if (share > enter) {
          enter = share;
          face = a;
        }
      }
      const float out = abs(way) > 0.F ? ((way < 0.F ? -half_m[a] : half_m[a]) - before[a]) / way : 2.F;
      leave = min(leave, out);
    }
    if (face >= 0 && !misses && enter <= leave) {
      const float sign = before[face] < 0.F ? -1.F : 1.F;
      const float gap = sign * p[face] - half_m[face];
      if (gap < 0.F) return {gap, axis(face, sign), true};
    }
    if (!inside) return {};
    // A side that faces away from where it touched is not the one to go back to.
    const int to = facing_axis >= 0 ? facing_axis : nearest_axis;
    const float sign = p[to] < 0.F ? -1.F : 1.F;
    return {abs(p[to]) - half_m[to], axis(to, sign), true};
  }
  TACTUS_HD static Vec3f axis(int a, float sign) {
    return {a == 0 ? sign : 0.F, a == 1 ? sign : 0.F, a == 2 ? sign : 0.F};
  }
};

/// As a scene says it.
struct ObstacleDescription {
  std::string name;
  ObstacleKind kind = ObstacleKind::plane;
  Rigidf T_world_obstacle{};
  Vec3f half_m{0.5F, 0.05F, 0.5F};  ///< box
  TriangleMesh mesh{};              ///< closed, in the obstacle's coordinates
  bool moves = false;               ///< a tool: of kind mesh, T_world_obstacle isn't used
  std::vector<Vec3f> edge_m{};      ///< of a tool: polyline that cuts; no points: it has no edge
};

class Obstacles {
 public:
  Obstacles() = default;
  /// @param sample_spacing_m of meshes. Synchronizes.
  /// @throws Error naming the obstacle: too many of them; a box without volume; a mesh that is open, not
  /// finite, without volume, or with triangles too long for the spacing.
  Obstacles(ExecContext& ctx, std::span<const ObstacleDescription> descriptions, float sample_spacing_m);

  View<const Obstacle> view() const { return obstacles_.const_view(); }
  Index tool_count() const { return tools_; }
  const std::vector<std::string>& names() const { return names_; }

 private:
  std::vector<std::string> names_;
  std::vector<std::unique_ptr<RealSurface>> meshes_;
  std::vector<Buffer<Vec3f>> edges_;
  Index tools_ = 0;
  Buffer<Obstacle> obstacles_;
};

}  // namespace tactus
