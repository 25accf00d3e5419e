#pragma once
/// The pieces of a body's surface that are near particles, and those that are near some of them.
#include <bit>

#include "tactus/contact/body_wall_kernels.h"
#include "tactus/contact/surface_triangles.h"
#include "tactus/geom/neighbour_cells.h"

namespace tactus {

/// The pieces of a body's surface that are near particles, each in a place of a list.
struct NearSurface {
  NeighbourCells
      cells;  ///< of the pieces' middles; their ids are the pieces' numbers, on every device the same
  float search_reach_m;  ///< of those
  View<const Vec3i> corners;
  View<const float> radius_m;  ///< of a ball round the middle that holds the piece
  View<const Vec3f> normals;   ///< unit
  View<const PosedVertex> posed;
  TACTUS_HD TriangleCorners corners_of(Index place) const {
    const Vec3i v = corners[place];
    return {posed[v.x].x_m, posed[v.y].x_m, posed[v.z].x_m};
  }
};

/// Pieces near a run of particles that follow one another. A CPU's thread looks them up once for all of them:
/// cells are as large as the largest piece's reach, and hold far more than what is near one particle.
class PiecesNearRun {
 public:
  static constexpr Index kLongest = 32;  ///< particles of a run
  static constexpr Index kMost = 1024;   ///< pieces; a multiple of kVisitLanes

  bool is_of(Index particle) const { return first_ <= particle && particle < last_; }
  /// Otherwise there was no room for all pieces.
  bool is_whole() const { return count_ <= kMost; }

  /// The run that begins with particle i, and what is near it. Particles behind those that were placed are
  /// of an earlier search: they may make the run's box larger, and no more.
  void begin(Index i, View<const SearchParticle> particles, const NearSurface& surface, float reach_m) {
    const NeighbourCells& cells = surface.cells;
    first_ = i;
    last_ = i + 1;
    count_ = 0;
    Box3f box{particles[i].x_m, particles[i].x_m};
    if (!cells.hash.holds(box.min)) return;
    for (const Index most = min(i + kLongest, particles.size()); last_ < most; ++last_) {
      const Vec3f x = particles[last_].x_m;
      const Box3f with{min(box.min, x), max(box.max, x)};
      const Vec3f edge = with.extent();
      if (!cells.hash.holds(x) || !(max(edge.x, max(edge.y, edge.z)) <= kWidest * reach_m)) break;
      box = with;
    }
    const Vec3f middle = box.center();
    const float radius_m = 1.0001F * length(box.max - middle);  // rounding
    const float search2_m2 = sqr(surface.search_reach_m + radius_m);
    const Vec3i one{1, 1, 1};
    const SearchParticle* all = cells.particles.data();  // there is room behind the last
    cells.for_each_run(cells.hash.cell(box.min) - one, cells.hash.cell(box.max) + one, [&](SlotRun run) {
      for_each_near(
          run.first, run.last, [&](Index slot) { return distance2_m2(middle, all[slot].x_m) <= search2_m2; },
          [&](Index slot) {
            const float reach = reach_m + surface.radius_m[cells.order[slot]];
            if (distance2_m2(middle, all[slot].x_m) <= sqr(reach + radius_m)) add(slot, all[slot].x_m, reach);
          });
    });
  }
  /// f(slot, from its middle to p) for the pieces that come within reach of a particle of the run.
  template <class F>
  void for_each_within(Vec3f p, F&& f) const {
    for_each_near(
        0, count_,
        [&](Index k) {
          return distance2_m2(p, {x_m_[k], y_m_[k], z_m_[k]}) <= reach2_m2_[k];
        },
        [&](Index k) {
          f(slot_[k], p - Vec3f{x_m_[k], y_m_[k], z_m_[k]});
        });
  }

 private:
  static constexpr float kWidest = 2;  ///< edge of a run's box, in reaches

  static float distance2_m2(Vec3f a, Vec3f b) { return dot(a - b, a - b); }
  /// f(k) for k in [first, last) with is_near(k), which is asked for a row of them at once, and may be asked
  /// for the rest of the last row, too. Most are not near.
  template <class N, class F>
  static void for_each_near(Index first, Index last, N&& is_near, F&& f) {
    constexpr Index kRow = kVisitLanes;
    for (Index row = first; row < last; row += kRow) {
      std::uint32_t near = 0;
#pragma omp simd reduction(| : near)
      for (int k = 0; k < kRow; ++k) near |= is_near(row + k) ? 1U << k : 0U;
      for (near &= (2U << min(last - 1 - row, kRow - 1)) - 1U; near != 0; near &= near - 1)
        f(row + std::countr_zero(near));
    }
  }
  void add(Index slot, Vec3f middle_m, float reach_m) {
    if (count_ < kMost) {
      x_m_[count_] = middle_m.x;
      y_m_[count_] = middle_m.y;
      z_m_[count_] = middle_m.z;
      reach2_m2_[count_] = sqr(reach_m);
      slot_[count_] = slot;
    }
    ++count_;
  }

  Index first_ = 0, last_ = 0;  ///< the run
  Index count_ = 0;             ///< of pieces; above kMost: some are not here
  float x_m_[kMost], y_m_[kMost], z_m_[kMost], reach2_m2_[kMost];
  Index slot_[kMost];
};

}  // namespace tactus
