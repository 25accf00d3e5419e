#pragma once
/// The triangles of a boundary's surface, sorted by cells, and how far a point is from them. Contact is
/// decided here and by nothing coarser: a point outside the surface has no contact, however near it is.
#include "tactus/contact/real/component_kernels.h"
#include "tactus/geom/mesh/closest_point.h"

namespace tactus {

/// A ball that holds a component of a triangle.
struct TriangleBall {
  Vec3f middle_m;
  float radius_m;
};
struct TriangleCorners {
  Vec3f a, b, c;
  /// From the nearest point to p. In coordinates round p: those of the world would round it to 3e-8 m.
  TACTUS_HD Vec3f offset_of(Vec3f p) const {
    return -closest_point_on_triangle(Vec3f{}, a - p, b - p, c - p);
  }
  /// Weight of a triangle in the side of a point whose nearest point is on it: the angle at a corner, for a
  /// corner; π for an edge.
  TACTUS_HD float weight(Vec3f p) const {
    const Vec3f offset = offset_of(p);
    const float near2 = sqr(kCorner) * dot(offset, offset);
    const auto is_at = [&](Vec3f corner) {
      const Vec3f to = (p - corner) - offset;
      return dot(to, to) <= near2;
    };
    if (is_at(a)) return angle(a, b, c);
    if (is_at(b)) return angle(b, c, a);
    return is_at(c) ? angle(c, a, b) : kPi;
  }

 private:
  static constexpr float kCorner = 0.01F;  ///< of the distance: so far from it triangles are as near as at it
  TACTUS_HD_CALLED static float angle(Vec3f at, Vec3f to, Vec3f and_to) {
    return arccos(dot(normalized(to - at), normalized(and_to - at)));
  }
  /// Arc cosine of x, clamped to [-1, 1] (error < 3e-7; Abramowitz & Stegun 4.4.46).
  TACTUS_HD static float arccos(float x) {
    constexpr float kTerms[] = {0.0066700901F, -0.0170881256F, 0.0308918810F, -0.0501743046F,
                                0.0889789874F, -0.2145988016F, 1.5707963050F};
    const float u = min(abs(x), 1.F);
    float sum = -0.0012624911F;
    for (const float term : kTerms) sum = fma(sum, u, term);
    const float angle = sum * tactus::sqrt(1.F - u);
    return x < 0.F ? kPi - angle : angle;
  }
};

/// Signed distance of a point to a surface, negative inside.
struct SurfaceGap {
  float gap_m = 0;
  Vec3f n;               ///< unit, outward: the direction in which the gap grows
  bool inside = false;   ///< only then are the others meant
  bool entered = false;  ///< it came through a triangle from the front since it was at `before`
};

/// A triangle as a point sees it that came from `before`.
struct SeenTriangle {
  float distance2_m2 = 0;
  float side_m = 0;  ///< signed distance from its plane
  float share = 2;   ///< where on the way the point went through it from the front, 0..1; 2: nowhere
  Index faces = 0;   ///< != 0: as the normal where the point touched last does
  TACTUS_HD static SeenTriangle of(const TriangleCorners& t, Vec3f p, Vec3f before, Vec3f facing,
                                   float slack_m) {
    const Vec3f n = normalized(cross(t.b - t.a, t.c - t.a));
    const Vec3f offset = t.offset_of(p);
    SeenTriangle seen{dot(offset, offset), dot(p - t.a, n), 2, dot(n, facing) > 0.F ? 1 : 0};
    const float side_before = dot(before - t.a, n);
    // A point that touched was put on the surface, to rounding.
    if (!(seen.side_m < 0.F && side_before >= (seen.faces != 0 ? -slack_m : 0.F) &&
          seen.side_m < side_before))
      return seen;
    const float share = max(side_before, 0.F) / (max(side_before, 0.F) - seen.side_m);
    const Vec3f q = before + share * (p - before);
    const bool through = dot(cross(t.b - t.a, q - t.a), n) >= 0.F &&
                         dot(cross(t.c - t.b, q - t.b), n) >= 0.F && dot(cross(t.a - t.c, q - t.c), n) >= 0.F;
    if (through) seen.share = share;
    return seen;
  }
};

/// Side and gap of a point at a surface, from triangles that are seen in any order, each by see(), then by
/// choose(). Where is_mixed(), SideOfTied tells `weighed`.
///  - A point that went through a triangle from its front is held on that triangle's plane: thin objects.
///  - Else the nearest triangle decides whether it is inside, and it is brought to the nearest one; if it
///    touched before, to the nearest one that faces as it did there.
/// Nothing farther than the reach counts.
/// Those that share the nearest edge or corner tell the side together: by their normals, weighted by their
/// angles there (Baerentzen & Aanaes 2005). The nearest point q is on all their planes, so
/// (p - q) . sum_t w_t n_t is the weighted sum of p's distances from the planes. It is summed as an integer,
/// in any order. A triangle in several components counts once.
struct GapOfTriangles {
  float reach2_m2, nearest2_m2, facing2_m2;  ///< squared distances
  float share = 2;
  Index crossed = -1, nearest = -1, facing = -1;  ///< slots
  float crossed_side_m = 0, nearest_side_m = 0, facing_side_m = 0;
  Index weighed = 0;  ///< < 0: the nearest triangles were weighed, and the point is inside; > 0: outside
  float least_side_m = 1e30F, most_side_m = -1e30F;  ///< of the nearest

  TACTUS_HD explicit GapOfTriangles(float reach_m)
      : reach2_m2(sqr(reach_m)), nearest2_m2(reach2_m2), facing2_m2(reach2_m2) {}
  TACTUS_HD void see(const SeenTriangle& t, Index slot) {
    if (t.distance2_m2 > reach2_m2) return;
    nearest2_m2 = min(nearest2_m2, t.distance2_m2);
    if (t.faces != 0) facing2_m2 = min(facing2_m2, t.distance2_m2);
    if (!(t.share < share || (t.share == share && t.share < 2.F && slot < crossed))) return;
    share = t.share;
    crossed = slot;
    crossed_side_m = t.side_m;
  }
  TACTUS_HD void choose(const SeenTriangle& t, Index slot) {
    if (choose(t, slot, nearest2_m2, nearest, nearest_side_m)) {
      least_side_m = min(least_side_m, t.side_m);
      most_side_m = max(most_side_m, t.side_m);
    }
    if (t.faces != 0) choose(t, slot, facing2_m2, facing, facing_side_m);
  }
  /// Whether the nearest triangles say different things, so that all have to be weighed.
  TACTUS_HD bool is_mixed() const { return least_side_m < 0.F && most_side_m >= 0.F; }
  TACTUS_HD bool inside() const {
    if (crossed >= 0 || nearest < 0) return crossed >= 0;
    if (!is_mixed()) return nearest_side_m < 0.F;
    return weighed != 0 ? weighed < 0 : nearest_side_m < 0.F;
  }
  /// All triangles within that have to be seen.
  TACTUS_HD float needed_m(bool touched) const {
    return (1.F + kTie) * tactus::sqrt(inside() && touched ? max(nearest2_m2, facing2_m2) : nearest2_m2);
  }
  /// The triangle that p is brought to, when it is inside.
  TACTUS_HD Index slot() const {
    if (crossed >= 0) return crossed;
    return facing >= 0 && facing_side_m < 0.F ? facing : nearest;
  }
  TACTUS_HD SurfaceGap gap(const TriangleCorners& t, Vec3f p) const {
    const Vec3f face = normalized(cross(t.b - t.a, t.c - t.a));
    if (crossed >= 0) return {crossed_side_m, face, true, true};
    const Vec3f offset = t.offset_of(p);
    const float distance = length(offset);
    return {-distance, distance > 1e-7F ? (-1.F / distance) * offset : face, true};
  }
  static constexpr float kTie = 1e-4F;  ///< closest points on a shared edge differ by rounding
  TACTUS_HD static bool ties(float distance2, float least2) { return distance2 <= (1.F + kTie) * least2; }

 private:
  /// Returns whether the triangle is one of the nearest.
  TACTUS_HD static bool choose(const SeenTriangle& t, Index slot, float least2, Index& best, float& side_m) {
    if (!ties(t.distance2_m2, least2)) return false;
    const bool farther = abs(t.side_m) > abs(side_m);
    if (best >= 0 && !farther && !(abs(t.side_m) == abs(side_m) && slot < best)) return true;
    best = slot;
    side_m = t.side_m;
    return true;
  }
};

/// The side of a point whose nearest triangles, those that share an edge or a corner, say different things.
struct SideOfTied {
  static constexpr int kMost = 12;  ///< more are at no edge and at few corners
  float nearest2_m2;
  Index faces[kMost], count = 0;
  std::int64_t side = 0;
  TACTUS_HD explicit SideOfTied(float nearest_m2) : nearest2_m2(nearest_m2) {}
  /// @param face the triangle that the slot is a component of
  TACTUS_HD void weigh(const SeenTriangle& t, Index face, const TriangleCorners& corners, Vec3f p) {
    if (!GapOfTriangles::ties(t.distance2_m2, nearest2_m2)) return;
    for (int k = 0; k < min(count, kMost); ++k) {
      if (faces[k] == face) return;
    }
    if (count < kMost) faces[count] = face;
    ++count;
    constexpr float kUnits = 1 << 30;
    const float part = clamp(t.side_m / max(tactus::sqrt(nearest2_m2), 1e-12F), -1.F, 1.F);
    side += static_cast<std::int64_t>(kUnits * (corners.weight(p) * part));
  }
  /// As GapOfTriangles::weighed. Among too many, the one whose plane the point is farthest from decides: 0.
  TACTUS_HD Index sign() const { return count > kMost || side == 0 ? 0 : side < 0 ? -1 : 1; }
};

struct SurfaceTrianglesView {
  View<const TriangleBall> balls;  ///< by slot, as the next two
  View<const TriangleCorners> corners;
  View<const Index> component;  ///< >= 0
  View<const Index> face;       ///< the triangle that it is a part of
  CellRanges cells;             ///< runs of slots
  View<const std::uint32_t> near_rows;

  /// A component of a triangle lies within that much of its middle, in cells: 2/3 of edges of 1.25 spacings,
  /// where cells have 2.
  static constexpr float kLargestBall = 0.42F;
  /// All triangles that are nearer are in the 27 cells round a point.
  TACTUS_HD float sure_reach_m() const { return (1.F - kLargestBall) / cells.grid.inverse_cell_1_m; }
  /// Whether any triangle can be within sure_reach_m() of p. Most points are near none; that costs one look.
  TACTUS_HD bool may_be_near(Vec3f p_m) const { return near_any_cell(cells.grid, near_rows, p_m); }
  TACTUS_HD bool is_of(Index own, Index slot) const { return own == kAnyComponent || component[slot] == own; }
  /// A point that touched was put on the surface, to rounding.
  TACTUS_HD static float slack_m(float reach_m) { return 0.02F * reach_m; }

  /// The gap of a point that is inside, or crossed the surface since it was at `before_m`, by all triangles
  /// that count. @param own the component whose triangles count, or kAnyComponent @param reach_m no triangle
  /// farther than that counts; at most the cells' edge @param facing the normal where it touched last, or 0
  TACTUS_HD SurfaceGap gap(Index own, Vec3f p_m, Vec3f before_m, float reach_m, Vec3f facing) const {
    GapOfTriangles found(reach_m);
    const float way = min(length(p_m - before_m), reach_m);
    const bool touched = dot(facing, facing) > 0.F;
    float within = reach_m;
    const auto seen_by = [&](auto&& use) {
      for_each_slot_within(p_m, within, [&](Index s) {
        const TriangleBall ball = balls[s];
        const Vec3f to = p_m - ball.middle_m;
        if (dot(to, to) > sqr(within + ball.radius_m) || !is_of(own, s)) return;
        use(SeenTriangle::of(corners[s], p_m, before_m, facing, slack_m(reach_m)), s);
      });
    };
    seen_by([&](const SeenTriangle& t, Index s) {
      found.see(t, s);
      // `facing` needs its own nearest triangle, which may be the far side of something thin.
      within = max(
          way, (1.F + GapOfTriangles::kTie) * tactus::sqrt(touched ? found.facing2_m2 : found.nearest2_m2));
    });
    if (found.crossed < 0) {
      seen_by([&](const SeenTriangle& t, Index s) { found.choose(t, s); });
      if (found.is_mixed()) {
        SideOfTied tied(found.nearest2_m2);
        seen_by([&](const SeenTriangle& t, Index s) { tied.weigh(t, face[s], corners[s], p_m); });
        found.weighed = tied.sign();
      }
    }
    return found.inside() ? found.gap(corners[found.slot()], p_m) : SurfaceGap{};
  }

  /// In cells: how far the cell d cells on (-1, 0 or 1) begins from a place `in` (0..1) in its own.
  TACTUS_HD static float to_cell(Index d, float in) { return d == 0 ? 0.F : d < 0 ? in : 1.F - in; }

 private:
  /// f(slot) for the slots of the 27 cells round p that come within reach_m, which f may shorten.
  template <class F>
  TACTUS_HD void for_each_slot_within(Vec3f p_m, const float& reach_m, F&& f) const {
    const CellGrid& grid = cells.grid;
    if (!grid.holds(p_m)) return;
    const Vec3i c = grid.cell(p_m);
    const Vec3f in = grid.inverse_cell_1_m * p_m - vec_cast<float>(c);           // 0..1
    const auto step = [](int order) { return order == 0 ? 0 : 2 * order - 3; };  // 0, -1, 1: its own first
    for (int order = 0; order < 27; ++order) {
      const Index dx = step(order % 3), dy = step(order / 3 % 3), dz = step(order / 9);
      const float most = grid.inverse_cell_1_m * reach_m + kLargestBall;
      if (sqr(to_cell(dx, in.x)) + sqr(to_cell(dy, in.y)) + sqr(to_cell(dz, in.z)) > sqr(most)) continue;
      const Index w = grid.wrapped({c.x + dx, c.y + dy, c.z + dz});
      for (Index s = cells.begin[w], end = cells.end[w]; s < end; ++s) f(s);
    }
  }
};

/// Copies the triangles of all samples into the order of their cells.
struct SortTriangles {
  View<const Vec3f> vertices_m;
  View<const Vec3i> triangles;
  View<const Index> cuts;      ///< per triangle: k² components
  View<const Index> triangle;  ///< of each sample
  View<const Vec3f> x_m;       ///< middle of its component
  View<const Index> root, number;
  View<const SurfaceComponents> components;
  View<const Index> order;
  View<TriangleBall> balls;
  View<TriangleCorners> corners;
  View<Index> component, face;
  TACTUS_HD void operator()(Index slot) const {
    const Index i = order[slot], t = triangle[i];
    const Vec3i v = triangles[t];
    const TriangleCorners all{vertices_m[v.x], vertices_m[v.y], vertices_m[v.z]};
    const Vec3f middle = (1.F / 3) * ((all.a + all.b) + all.c);
    const Vec3f a = all.a - middle, b = all.b - middle, c = all.c - middle;
    const float radius2 = max(dot(a, a), max(dot(b, b), dot(c, c)));
    // A component is the triangle k times smaller; 1e-4 for rounding.
    balls[slot] = {x_m[i], 1.0001F * tactus::sqrt(radius2 / static_cast<float>(cuts[t]))};
    corners[slot] = all;
    face[slot] = t;
    component[slot] = components[0].mixed != 0 ? max(number[root[i]], Index(0)) : 0;
  }
};

}  // namespace tactus
