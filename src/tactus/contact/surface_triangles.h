#pragma once
/// The triangles of a boundary's surface, sorted by cells, and how far a point is from them. What touches is
/// decided here and by nothing coarser: a point outside the surface has no contact, however near it is.
#include "tactus/contact/piece_kernels.h"
#include "tactus/geom/closest_point.h"

namespace tactus {

/// A ball that holds a piece of a triangle.
struct TriangleBall {
  Vec3f middle_m;
  float radius_m;
};
struct TriangleCorners {
  Vec3f a, b, c;
};

/// Signed distance of a point to a surface, negative inside.
struct SurfaceGap {
  float gap_m = 0;
  Vec3f n;              ///< unit, outward: the direction in which the gap grows
  bool inside = false;  ///< only then are the other two meant
};

/// The nearest of the triangles seen so far. Of those that share the nearest edge or corner, the one whose
/// plane the point is farthest from tells the side (the others may be seen from behind by a point outside).
struct NearestTriangle {
  float distance2_m2 = 0;
  float side_m = 0;  ///< signed distance from its plane
  Vec3f offset_m, face;
  bool found = false;
  TACTUS_HD void see(Vec3f offset, float d2, float side, Vec3f n) {
    constexpr float kTie = 1e-4F;  // closest points on a shared edge differ by rounding
    const bool nearer = d2 < (1.F - kTie) * distance2_m2;
    const bool tied = found && d2 <= (1.F + kTie) * distance2_m2 && abs(side) > abs(side_m);
    if (!nearer && !tied) return;
    distance2_m2 = nearer ? d2 : min(d2, distance2_m2);
    side_m = side;
    offset_m = offset;
    face = n;
    found = true;
  }
  TACTUS_HD SurfaceGap gap() const {
    const float distance = tactus::sqrt(distance2_m2);
    return {-distance, distance > 1e-7F ? (-1.F / distance) * offset_m : face, true};
  }
};

struct SurfaceTrianglesView {
  View<const TriangleBall> balls;  ///< by slot, as the next two
  View<const TriangleCorners> corners;
  View<const Index> piece;  ///< >= 0
  CellRanges cells;         ///< runs of slots
  View<const std::uint32_t> near_rows;

  /// Whether any triangle can be within a cell's edge of p. Most points are near none; that costs one look.
  TACTUS_HD bool may_be_near(Vec3f p_m) const { return near_any_cell(cells.grid, near_rows, p_m); }

  /// The gap of a point that is inside, or crossed the surface since it was at `before_m`.
  ///  - A point that went through a triangle from its front is held on that triangle's plane: thin objects.
  ///  - Else the nearest triangle decides whether it is inside, and it is brought to the nearest one; if it
  ///    touched before, to the nearest one that faces as `facing` does.
  /// @param own the piece whose triangles count, or kAnyPiece @param reach_m no triangle farther than that
  /// counts; at most the cells' edge @param facing the normal where it touched last, or 0
  TACTUS_HD SurfaceGap gap(Index own, Vec3f p_m, Vec3f before_m, float reach_m, Vec3f facing) const {
    NearestTriangle nearest, held;
    nearest.distance2_m2 = held.distance2_m2 = reach_m * reach_m;
    const float way = min(length(p_m - before_m), reach_m);
    float within = reach_m, first_crossing = 2;
    SurfaceGap crossed;
    for_each_slot_within(p_m, within, [&](Index s) {
      const TriangleBall ball = balls[s];
      const Vec3f to = p_m - ball.middle_m;
      if (dot(to, to) > sqr(within + ball.radius_m)) return;
      if (own != kAnyPiece && piece[s] != own) return;
      const TriangleCorners t = corners[s];
      const Vec3f n = normalized(cross(t.b - t.a, t.c - t.a));
      const Vec3f offset = p_m - closest_point_on_triangle(p_m, t.a, t.b, t.c);
      const float side = dot(p_m - t.a, n), d2 = dot(offset, offset);
      nearest.see(offset, d2, side, n);
      if (dot(n, facing) > 0.F) held.see(offset, d2, side, n);
      const float side_before = dot(before_m - t.a, n);
      // What touched was put on the surface, to rounding.
      const float slack = dot(n, facing) > 0.F ? 0.02F * reach_m : 0.F;
      if (side < 0.F && side_before >= -slack && side < side_before) {
        const float share = max(side_before, 0.F) / (max(side_before, 0.F) - side);
        const Vec3f through = before_m + share * (p_m - before_m);
        if (share < first_crossing && holds(t, n, through)) {
          first_crossing = share;
          crossed = {side, n, true};
        }
      }
      // `held` needs its own nearest triangle, which may be the far side of something thin.
      const float bound = dot(facing, facing) > 0.F ? held.distance2_m2 : nearest.distance2_m2;
      within = max(way, tactus::sqrt(bound));
    });
    if (crossed.inside) return crossed;
    if (!nearest.found || !(nearest.side_m < 0.F)) return {};
    return held.found && held.side_m < 0.F ? held.gap() : nearest.gap();
  }

 private:
  /// Whether a point of the triangle's plane is in it.
  TACTUS_HD static bool holds(const TriangleCorners& t, Vec3f n, Vec3f p) {
    return dot(cross(t.b - t.a, p - t.a), n) >= 0.F && dot(cross(t.c - t.b, p - t.b), n) >= 0.F &&
           dot(cross(t.a - t.c, p - t.c), n) >= 0.F;
  }
  /// f(slot) for the slots of the 27 cells round p that come within reach_m, which f may shorten.
  template <class F>
  TACTUS_HD void for_each_slot_within(Vec3f p_m, const float& reach_m, F&& f) const {
    const CellGrid& grid = cells.grid;
    if (!grid.holds(p_m)) return;
    const Vec3i c = grid.cell(p_m);
    const Vec3f in = grid.inverse_cell_1_m * p_m - vec_cast<float>(c);           // 0..1
    const auto step = [](int order) { return order == 0 ? 0 : 2 * order - 3; };  // 0, -1, 1: its own first
    const auto far2 = [](Index d, float at) { return d == 0 ? 0.F : sqr(d < 0 ? at : 1.F - at); };
    for (int order = 0; order < 27; ++order) {
      const Index dx = step(order % 3), dy = step(order / 3 % 3), dz = step(order / 9);
      const float most = grid.inverse_cell_1_m * reach_m + kLargestBall;
      if (far2(dx, in.x) + far2(dy, in.y) + far2(dz, in.z) > sqr(most)) continue;
      const Index w = grid.wrapped({c.x + dx, c.y + dy, c.z + dz});
      for (Index s = cells.begin[w], end = cells.end[w]; s < end; ++s) f(s);
    }
  }
  /// A piece of a triangle lies within that much of its middle, in cells: 2/3 of edges of 1.25 spacings,
  /// where cells have 2.
  static constexpr float kLargestBall = 0.42F;
};

/// Copies the triangles of all samples into the order of their cells.
struct SortTriangles {
  View<const Vec3f> vertices_m;
  View<const Vec3i> triangles;
  View<const Index> cuts;      ///< per triangle: k² pieces
  View<const Index> triangle;  ///< of each sample
  View<const Vec3f> x_m;       ///< middle of its piece
  View<const Index> root, number;
  View<const SurfacePieces> pieces;
  View<const Index> order;
  View<TriangleBall> balls;
  View<TriangleCorners> corners;
  View<Index> piece;
  TACTUS_HD void operator()(Index slot) const {
    const Index i = order[slot], t = triangle[i];
    const Vec3i v = triangles[t];
    const TriangleCorners all{vertices_m[v.x], vertices_m[v.y], vertices_m[v.z]};
    const Vec3f middle = (1.F / 3) * ((all.a + all.b) + all.c);
    const Vec3f a = all.a - middle, b = all.b - middle, c = all.c - middle;
    const float radius2 = max(dot(a, a), max(dot(b, b), dot(c, c)));
    // A piece is the triangle k times smaller; 1e-4 for rounding.
    balls[slot] = {x_m[i], 1.0001F * tactus::sqrt(radius2 / static_cast<float>(cuts[t]))};
    corners[slot] = all;
    piece[slot] = pieces[0].mixed != 0 ? max(number[root[i]], Index(0)) : 0;
  }
};

}  // namespace tactus
