#pragma once
/// Walls that are near particles, and what the liquid does to them.
#include "tactus/compute/atomic.h"
#include "tactus/fluid/liquid_views.h"
#include "tactus/geom/neighbour_cells.h"

namespace tactus {

/// What walls get, as integers: in any order, the same sums.
struct WallSums {
  static constexpr float kUnit = 1.F / (1ULL << 48);  ///< [N s]
  static constexpr Index kCopies = 16;                ///< so that threads seldom wait for one another
  std::uint64_t impulse[3];
  TACTUS_HD void add_atomically(Vec3f impulse_N_s) {
    for (int a = 0; a < 3; ++a) atomic_add(impulse[a], units(impulse_N_s[a]));
  }
  TACTUS_HD static std::uint64_t units(float value) {
    constexpr float kMost = 1.6e4F;  // N s: 2^62 units
    if (value != value) return 0;
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(clamp(value, -kMost, kMost) / kUnit));
  }
};

/// The faces of the box within reach of every particle. Faces are numbered -x, +x, -y, +y, -z, +z.
struct FindBoxWalls {
  static constexpr int kFaces = 6;
  View<const SearchParticle> particles;
  Box3f box_m;
  Index open_faces;  ///< bits: nothing stops there
  float reach_m;
  NearWalls near;
  TACTUS_HD void operator()(Index i) const {
    const Vec3f x = particles[i].x_m;
    Index count = 0;
    for (int a = 0; a < 3; ++a) {
      count = see(i, count, 2 * a, x[a] - box_m.min[a]);
      count = see(i, count, 2 * a + 1, box_m.max[a] - x[a]);
    }
    near.count[i] = count;
  }

 private:
  TACTUS_HD Index see(Index i, Index count, int face, float distance_m) const {
    if (!(distance_m < reach_m) || (open_faces >> face & 1) != 0 || count == kNearWalls) return count;
    Vec3f n{};
    n[face / 2] = face % 2 == 0 ? 1.F : -1.F;
    near.at(i, count) = {n, distance_m, {}, face};
    return count + 1;
  }
};

}  // namespace tactus
