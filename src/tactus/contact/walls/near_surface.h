#pragma once
/// The pieces of a body's surface that are near particles, and those that are near some of them.
#include <bit>

#include "tactus/contact/surface_triangles.h"
#include "tactus/contact/walls/body_wall_kernels.h"
#include "tactus/geom/search/neighbour_cells.h"

namespace tactus {

/// The pieces of a body's surface that are near particles, each in a place of a list.
struct NearSurface {
  /// Cells of the pieces' middles. Their ids are the pieces' numbers, on every device the same.
  NeighbourCells cells;
  View<const std::uint32_t> largest_m;  ///< (1) bits of the largest radius
  View<const Vec3i> corners;
  View<const float> radius_m;  ///< of a ball round the middle that holds the piece
  View<const Vec3f> normals;   ///< unit
  View<const PosedVertex> posed;
  /// Pieces within reach of a point have their middles within that.
  TACTUS_HD float reach_to_middle_m(float reach_m) const {
    return 1.002F * (reach_m + std::bit_cast<float>(largest_m[0]));  // rounding, of cells, too
  }
  /// f(run) for the cells that may hold the middles of pieces within reach of a box. Of a body that blows up,
  /// reach has no bound: cells beside the box's own are looked at, and no others.
  template <class F>
  TACTUS_HD TACTUS_ALWAYS_INLINE void for_each_run(Vec3f low_m, Vec3f high_m, float to_middle_m,
                                                   F&& f) const {
    const Vec3i one{1, 1, 1};
    const float r_m = min(to_middle_m, 2.F / cells.hash.inverse_cell_1_m);
    const Vec3f r{r_m, r_m, r_m};
    cells.for_each_run(max(cells.hash.cell(low_m - r), cells.hash.cell(low_m) - one),
                       min(cells.hash.cell(high_m + r), cells.hash.cell(high_m) + one), f);
  }
  TACTUS_HD TriangleCorners corners_of(Index place) const {
    const Vec3i v = corners[place];
    return {posed[v.x].x_m, posed[v.y].x_m, posed[v.z].x_m};
  }
};

/// Pieces near a run of particles that follow one another. A CPU's thread looks them up once for all of them:
/// cells are as large as the largest piece's reach, and hold far more pieces than are near one particle.
class PiecesNearRun {
 public:
  static constexpr Index kLongest = 32;  ///< particles of a run
  static constexpr Index kMost = 1024;   ///< pieces; a multiple of kVisitLanes

  bool is_of(Index particle) const { return first_ <= particle && particle < last_; }
  /// Otherwise there was no capacity for all pieces.
  bool is_whole() const { return count_ <= kMost; }

  /// Begins the run at particle i, and lists the pieces near it. Particles behind those that were placed are
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
    const float to_middle_m = surface.reach_to_middle_m(reach_m), search2_m2 = sqr(to_middle_m + radius_m);
    const SearchParticle* all = cells.particles.data();  // there is capacity behind the last
    surface.for_each_run(box.min, box.max, to_middle_m, [&](SlotRun run) {
      for_each_near(
          run.first, run.last, [&](Index slot) { return distance2_m2(middle, all[slot].x_m) <= search2_m2; },
          [&](Index slot) {
            const Index place = cells.order[slot];
            const float ball_m = surface.radius_m[place], reach = reach_m + ball_m;
            if (distance2_m2(middle, all[slot].x_m) <= sqr(reach + radius_m))
              add(slot, all[slot].x_m, surface.normals[place], ball_m, reach);
          });
    });
    if (!is_whole()) return;
    for (Index k = count_; k % kVisitLanes != 0; ++k) reach2_m2_[k] = -1;  // nothing is so near
  }
  /// The nearest middle of the pieces that come within reach of p.
  struct NearestMiddle {
    bool is_any = false;
    Index slot = -1;         ///< of the piece whose middle is nearest, if that is nearer than the bound
    float distance2_m2 = 0;  ///< of that middle; else the bound
  };
  NearestMiddle nearest_middle(Vec3f p, float bound2_m2) const {
    float least[kVisitLanes];
    Index from[kVisitLanes];
    std::uint32_t any = 0;
    for (int k = 0; k < kVisitLanes; ++k) least[k] = bound2_m2, from[k] = -1;
    for (Index row = 0; row < count_; row += kVisitLanes) {
#pragma omp simd reduction(| : any)
      for (int k = 0; k < kVisitLanes; ++k) {
        const float d2 = distance2_m2(p, middle(row + k));
        const bool is_near = d2 <= reach2_m2_[row + k], is_less = is_near & (d2 < least[k]);
        any |= is_near ? 1U : 0U;
        least[k] = is_less ? d2 : least[k];
        from[k] = is_less ? row : from[k];
      }
    }
    NearestMiddle nearest{any != 0, -1, bound2_m2};
    for (int k = 0; k < kVisitLanes; ++k)
      if (least[k] < nearest.distance2_m2) nearest = {true, slot_[from[k] + k], least[k]};
    return nearest;
  }
  /// f(slot, from its middle to p) for the pieces that come within reach of p, but for those with
  /// beyond(to p, normal, radius) > 0. That is asked for a row of them at once, and again before f. It is a
  /// number, since the compiler doesn't make vectors of several conditions.
  template <class B, class F>
  void for_each_that(Vec3f p, B&& beyond, F&& f) const {
    const auto is_near = [&](Index k) {
      const Vec3f to = p - middle(k);
      return max(dot(to, to) - reach2_m2_[k], beyond(to, Vec3f{n_x_[k], n_y_[k], n_z_[k]}, radius_m_[k])) <=
             0.F;
    };
    for_each_near(0, count_, is_near, [&](Index k) {
      if (is_near(k)) f(slot_[k], p - middle(k));
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
  void add(Index slot, Vec3f middle_m, Vec3f normal, float radius_m, float reach_m) {
    const Index k = count_++;
    if (k >= kMost) return;
    x_m_[k] = middle_m.x;
    y_m_[k] = middle_m.y;
    z_m_[k] = middle_m.z;
    n_x_[k] = normal.x;
    n_y_[k] = normal.y;
    n_z_[k] = normal.z;
    radius_m_[k] = radius_m;
    reach2_m2_[k] = sqr(reach_m);
    slot_[k] = slot;
  }
  Vec3f middle(Index k) const { return {x_m_[k], y_m_[k], z_m_[k]}; }

  Index first_ = 0, last_ = 0;  ///< the run
  Index count_ = 0;             ///< of pieces; above kMost: some are not here
  float x_m_[kMost], y_m_[kMost], z_m_[kMost], n_x_[kMost], n_y_[kMost], n_z_[kMost];
  float radius_m_[kMost], reach2_m2_[kMost];
  Index slot_[kMost];
};

}  // namespace tactus
