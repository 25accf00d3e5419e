#pragma once
/// The search round a point for the triangles that it may touch.
#include "tactus/compute/atomic.h"
#include "tactus/contact/surface_triangles.h"

namespace tactus {

/// A point as it meets one collider, in the coordinates of the collider's triangles: those of a component at
/// its capture.
struct MeetingPoint {
  Vec3f p_m, before_m;  ///< now, and at the last correction
  Vec3f facing;         ///< normal where it touched last, or 0
};

/// The smallest of many distances, found in any order.
struct LeastDistance {
  std::uint32_t key = 0;  ///< the bits of the distance, inverted; 0: none
  TACTUS_HD void see(float distance_m) { atomic_max(key, ~std::bit_cast<std::uint32_t>(distance_m)); }
  TACTUS_HD float value() const { return std::bit_cast<float>(~key); }
  TACTUS_HD bool found() const { return key != 0; }
};

/// Minima that decide a point's gap, over triangles that are seen in any order.
struct LeastOfTriangles {
  LeastDistance nearest2_m2, facing2_m2, share;

  TACTUS_HD void see(const SeenTriangle& t, float reach2_m2) {
    if (t.distance2_m2 > reach2_m2) return;
    nearest2_m2.see(t.distance2_m2);
    if (t.faces != 0) facing2_m2.see(t.distance2_m2);
    if (t.share < 2.F) share.see(t.share);
  }
  TACTUS_HD float nearest2(float reach2_m2) const {
    return nearest2_m2.found() ? nearest2_m2.value() : reach2_m2;
  }
  TACTUS_HD float facing2(float reach2_m2) const {
    return facing2_m2.found() ? facing2_m2.value() : reach2_m2;
  }
  /// Once all were seen: false only where GapOfTriangles finds the same without the triangle.
  TACTUS_HD bool may_decide(const SeenTriangle& t, float reach2_m2) const {
    return (share.found() && t.distance2_m2 <= reach2_m2 && t.share == share.value()) ||
           GapOfTriangles::ties(t.distance2_m2, nearest2(reach2_m2)) ||
           (t.faces != 0 && GapOfTriangles::ties(t.distance2_m2, facing2(reach2_m2)));
  }
};

/// Which of very many triangles decide a point's gap.
struct DecidingTriangles {
  static constexpr int kMost = 32;
  LeastOfTriangles least;
  float reach2_m2 = 0;
  std::uint32_t count = 0;
  Index slot[kMost];

  TACTUS_HD void see(const SeenTriangle& t) { least.see(t, reach2_m2); }
  TACTUS_HD float nearest2() const { return least.nearest2(reach2_m2); }
  TACTUS_HD float facing2() const { return least.facing2(reach2_m2); }
  /// Once all were seen.
  TACTUS_HD void take(const SeenTriangle& t, Index s) {
    if (!least.may_decide(t, reach2_m2)) return;
    const auto at = static_cast<int>(atomic_fetch_add(count, 1));  // in any order, as all are weighed
    if (at < kMost) slot[at] = s;
  }
};

/// A search round one point for the triangles of one collider, by all lanes of a block. Blocks wait for their
/// threads that work alone, so a GPU is to hold several: on an H200, frames with 64 lanes and with 256 are
/// slower.
struct TriangleSearch {
  static constexpr int kLanes = 128, kCells = 27, kOwnCell = 13, kCandidates = 32;
  MeetingPoint at;
  float displacement_m;  ///< since the last correction, at most the reach
  Index begin[kCells], end[kCells];
  float far2[kCells];         ///< squared distance to the cell, in cells
  int runs, cell_of[kCells];  ///< runs of slots: those of cells that come near enough
  LeastDistance least;
  LeastDistance
      facing;  ///< a point that touched goes to the nearest that faces as it did there, up to the reach
  std::uint32_t candidates, listed;
  float distance2_m2[kCandidates], side_m[kCandidates];
  float within_m;              ///< so near are the triangles that are listed; < 0: none are
  DecidingTriangles deciding;  ///< where they are too many for a list
  static constexpr float kNone = 1e30F;

  /// Lanes of a block that search together, and f(lane) on each of them.
  template <class Block>
  static constexpr int lanes() {
    return Block::kIsLoop ? 1 : kLanes;
  }
  template <class Block, class F>
  TACTUS_HD static void for_lanes(const Block& b, F&& f) {
    b.for_threads(lanes<Block>(), f);
  }

  TACTUS_HD void find_cell(const SurfaceTrianglesView& mesh, int c) {
    begin[c] = end[c] = 0;
    const CellGrid& grid = mesh.cells.grid;
    if (!grid.holds(at.p_m)) return;
    const Vec3i cell = grid.cell(at.p_m), d{c % 3 - 1, c / 3 % 3 - 1, c / 9 - 1};
    const Vec3f in = grid.inverse_cell_1_m * at.p_m - vec_cast<float>(cell);
    far2[c] = sqr(mesh.to_cell(d.x, in.x)) + sqr(mesh.to_cell(d.y, in.y)) + sqr(mesh.to_cell(d.z, in.z));
    const Index w = grid.wrapped({cell.x + d.x, cell.y + d.y, cell.z + d.z});
    begin[c] = mesh.cells.begin[w];
    end[c] = mesh.cells.end[w];
  }
  /// The middle of a ball is on its triangle: the nearest triangle is no farther than that.
  TACTUS_HD void see_middles(const SurfaceTrianglesView& mesh, Index own, Index first, Index last,
                             Index step) {
    float nearest2 = kNone;
#pragma omp simd reduction(min : nearest2)
    TACTUS_ROLLED
    for (Index s = first; s < last; s += step) {
      const Vec3f to = at.p_m - mesh.balls[s].middle_m;
      const float d2 = mesh.is_of(own, s) ? dot(to, to) : kNone;
      nearest2 = d2 < nearest2 ? d2 : nearest2;
    }
    if (nearest2 < kNone) least.see(tactus::sqrt(nearest2));
  }
  /// So far away a triangle may have to be listed, as far as is known.
  TACTUS_HD float listed_within_m(float reach_m, float margin_m) const {
    const bool is_near = least.found() && !touched();
    return max(displacement_m, is_near ? min(least.value(), reach_m) : reach_m) + 2 * margin_m;
  }
  /// Strings together the slots of all cells that come so near.
  template <class Block>
  TACTUS_HD void choose_runs(const Block& b, const SurfaceTrianglesView& mesh, float bound_m) {
    const float most = mesh.cells.grid.inverse_cell_1_m * bound_m + mesh.kLargestBall;
    b.compact(
        kCells, [&](int c) { return begin[c] < end[c] && far2[c] <= 1.0001F * sqr(most); }, cell_of, &runs);
  }
  /// f(first, last): the slots of the runs, for one lane of `lanes` every lanes-th of them.
  template <class F>
  TACTUS_HD void for_each_run(int lane, int lanes, F&& f) const {
    // Lanes go on from run to run, so that all are busy.
    TACTUS_ROLLED
    for (Index run = 0, next = lane; run < runs; ++run) {
      const Index first = begin[cell_of[run]], size = end[cell_of[run]] - first;
      if (next < size) {
        f(first + next, first + size);
        next += ceil_div(size - next, lanes) * lanes;
      }
      next -= size;
    }
  }
  TACTUS_HD void see_runs(const SurfaceTrianglesView& mesh, Index own, int lane, int lanes) {
    for_each_run(lane, lanes, [&](Index first, Index last) { see_middles(mesh, own, first, last, lanes); });
  }
  /// f(slot, squared distance, corner, normal) for triangles of the runs that are so near.
  template <class F>
  TACTUS_HD void for_each_within(const SurfaceTrianglesView& mesh, Index own, float distance_m, int lane,
                                 int lanes, F&& f) const {
    for_each_run(lane, lanes, [&](Index first, Index last) {
      TACTUS_ROLLED
      for (Index s = first; s < last; s += lanes) {
        const TriangleBall ball = mesh.balls[s];
        const Vec3f to = at.p_m - ball.middle_m;
        if (dot(to, to) > sqr(distance_m + ball.radius_m) || !mesh.is_of(own, s)) continue;
        const TriangleCorners t = mesh.corners[s];
        const Vec3f offset = t.offset_of(at.p_m);
        const float d2 = dot(offset, offset);
        if (d2 <= sqr(distance_m)) f(s, d2, t.a, normalized(cross(t.b - t.a, t.c - t.a)));
      }
    });
  }
  /// f(slot, triangle) for triangles of the runs whose balls are so near.
  template <class F>
  TACTUS_HD void for_each_seen(const SurfaceTrianglesView& mesh, Index own, float reach_m, int lane,
                               int lanes, F&& f) const {
    for_each_run(lane, lanes, [&](Index first, Index last) {
      TACTUS_ROLLED
      for (Index s = first; s < last; s += lanes) {
        const TriangleBall ball = mesh.balls[s];
        const Vec3f to = at.p_m - ball.middle_m;
        if (dot(to, to) > sqr(within_m + ball.radius_m) || !mesh.is_of(own, s)) continue;
        f(s, SeenTriangle::of(mesh.corners[s], at.p_m, at.before_m, at.facing, mesh.slack_m(reach_m)));
      }
    });
  }
  /// Begins the search for the gap among all triangles; a point that touched may be held by one up to the
  /// reach.
  TACTUS_HD void begin_gap(float reach_m) {
    deciding.least = {};
    deciding.count = 0;
    deciding.reach2_m2 = sqr(reach_m);
    within_m = touched() ? reach_m : max(displacement_m, nearest_within_m(reach_m));
  }
  /// Once distances are known, only the nearest count, or those on the way.
  TACTUS_HD void narrow_gap() {
    within_m = max(displacement_m, (1.F + GapOfTriangles::kTie) *
                                       tactus::sqrt(touched() ? deciding.facing2() : deciding.nearest2()));
  }
  TACTUS_HD bool touched() const { return dot(at.facing, at.facing) > 0.F; }
  TACTUS_HD SurfaceGap gap(const SurfaceTrianglesView& mesh, Index own, float reach_m) const {
    const auto count = static_cast<int>(deciding.count);
    if (count > DecidingTriangles::kMost) return mesh.gap(own, at.p_m, at.before_m, reach_m, at.facing);
    GapOfTriangles found(reach_m);
    const auto for_each = [&](auto&& f) {
      for (int k = 0; k < count; ++k) {
        const Index s = deciding.slot[k];
        f(SeenTriangle::of(mesh.corners[s], at.p_m, at.before_m, at.facing, mesh.slack_m(reach_m)), s);
      }
    };
    for_each([&](const SeenTriangle& t, Index s) { found.see(t, s); });
    if (found.crossed < 0) for_each([&](const SeenTriangle& t, Index s) { found.choose(t, s); });
    if (found.crossed < 0 && found.is_mixed()) {
      SideOfTied tied(found.nearest2_m2);
      for_each([&](const SeenTriangle& t, Index s) { tied.weigh(t, mesh.face[s], mesh.corners[s], at.p_m); });
      found.weighed = tied.sign();
    }
    return found.inside() ? found.gap(mesh.corners[found.slot()], at.p_m) : SurfaceGap{};
  }
  /// The triangle that is nearest is no farther.
  TACTUS_HD float nearest_within_m(float reach_m) const {
    return least.found() ? min(1.0002F * least.value(), reach_m) : reach_m;
  }
  /// So far triangles are looked at in the search for the nearest.
  TACTUS_HD float seen_within_m(float reach_m) const {
    return touched() ? reach_m : nearest_within_m(reach_m);
  }
  TACTUS_HD void see(float d2, Vec3f corner, Vec3f n, float reach_m) {
    if (touched() && dot(n, at.facing) > 0.F) facing.see(tactus::sqrt(d2));
    if (d2 <= sqr(nearest_within_m(reach_m))) add_candidate(d2, dot(at.p_m - corner, n));
  }
  TACTUS_HD void add_candidate(float d2, float side) {
    const auto at_index =
        static_cast<Index>(atomic_fetch_add(candidates, 1));  // in any order, as all are weighed
    if (at_index >= kCandidates) return;
    distance2_m2[at_index] = d2;
    side_m[at_index] = side;
  }
  struct Nearest {
    float distance_m, side_m;
  };
  /// So far a list has to reach, at least. Distances are rounded and compared with a tolerance.
  TACTUS_HD float needed_m(const Nearest& all, float reach_m) const {
    const float far = !touched() || all.side_m >= 0.F ? 0.F : facing.found() ? facing.value() : reach_m;
    return (1.F + 2 * GapOfTriangles::kTie) * max(max(all.distance_m, displacement_m), far);
  }
  /// The nearest of the candidates; inside, which is looked at more closely, where any of the nearest says
  /// so.
  TACTUS_HD Nearest nearest() const {
    float least2 = kNone, side = kNone;
    const auto n = static_cast<Index>(candidates);
    TACTUS_ROLLED
    for (Index c = 0; c < n; ++c) least2 = min(least2, distance2_m2[c]);
    TACTUS_ROLLED
    for (Index c = 0; c < n; ++c) {
      if (distance2_m2[c] <= (1.F + GapOfTriangles::kTie) * least2) side = min(side, side_m[c]);
    }
    return {tactus::sqrt(least2), side};
  }
};

/// The gap of a point with too many triangles for a list, by all lanes of a block: one thread alone takes
/// half a millisecond. report(gap)
template <class Block, class F>
TACTUS_HD void find_gap_together(const Block& b, TriangleSearch& q, const SurfaceTrianglesView& mesh,
                                 Index own, float reach_m, F&& report) {
  const auto for_each_seen = [&](auto&& f) {
    TriangleSearch::for_lanes(
        b, [&](int lane) { q.for_each_seen(mesh, own, reach_m, lane, TriangleSearch::lanes<Block>(), f); });
  };
  b.on_one_thread([&] { q.begin_gap(reach_m); });
  q.choose_runs(b, mesh, q.within_m);
  for_each_seen([&](Index, const SeenTriangle& t) { q.deciding.see(t); });
  b.on_one_thread([&] { q.narrow_gap(); });
  for_each_seen([&](Index slot, const SeenTriangle& t) { q.deciding.take(t, slot); });
  b.on_one_thread([&] { report(q.gap(mesh, own, reach_m)); });
}

}  // namespace tactus
