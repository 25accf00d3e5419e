#pragma once
/// The surfaces that are near particles: solids list them, liquids read them.
#include "tactus/base/vec.h"
#include "tactus/compute/view.h"
#include "tactus/compute/wide_load.h"

namespace tactus {

/// A surface near a particle: its plane there, as the particle sees it. Where it ends at an edge, the plane
/// beyond the edge is listed, too: only the space behind both is solid.
struct alignas(16) NearWall {
  static constexpr Index kBeside = 2;
  Vec3f n;               ///< unit, from the wall to the liquid
  float distance_m = 0;  ///< < 0 behind the wall
  Vec3f velocity_m_s;
  Index collider = -1;
  float inverse_mass_1_kg = 0;  ///< how much faster it is after a push of 1 N s; 0: nothing moves it
  Vec3f impulse_N_s;            ///< of the liquid on it, once the step was made
  Index side = 0;  ///< of an collider's surface: 0 is nearest, 1 across from it, kBeside ends the nearest
  float slope_1_m = 0;  ///< set by the liquid: minus the slope of the wall's fill along n
  float share = 1;      ///< set by the liquid: share of the space behind the plane that counts
  TACTUS_HD bool is_beside() const { return side == kBeside; }
  /// The larger, the sooner it may be left out.
  TACTUS_HD float needless_m() const { return is_beside() ? 1e30F : distance_m; }
};
inline constexpr Index kNearWalls = 4;

/// A particle in a gap, or beside an inner edge, sees two walls of one surface: the nearest point of it, and
/// the nearest from which it is seen in front, at another side. Points beside the nearest on the same wall
/// must not be taken for another wall. On a convex surface, the direction from such a point to the particle
/// leans from the normal there by no less than from the direction at the nearest point; so with a least lean
/// of 60 degrees from the one and a largest of 30 from the other, none is.
struct WallAcross {
  /// Whether any point of a triangle with that normal can be it. @param nearest direction to the particle
  /// from the nearest point, outward @param normal unit
  TACTUS_HD static bool may_face(Vec3f nearest, Vec3f normal) { return !(dot(nearest, normal) > kCos30); }
  /// @param offset from the triangle's nearest point to the particle, that long
  TACTUS_HD static bool faces(Vec3f nearest, Vec3f normal, Vec3f offset_m, float distance_m) {
    return dot(offset_m, normal) >= kCos30 * distance_m && dot(offset_m, nearest) <= kCos60 * distance_m;
  }

 private:
  static constexpr float kCos30 = 0.8661F, kCos60 = 0.5F;
};

/// The walls of all particles, by slot.
struct NearWalls {
  View<Index> count;
  View<NearWall> walls;  ///< kNearWalls each
  TACTUS_HD NearWall& at(Index i, Index k) const { return walls[kNearWalls * i + k]; }
  /// For kernels that need most fields of a wall.
  TACTUS_HD NearWall read(Index i, Index k) const { return load_wide(at(i, k)); }
  /// Cosine of the angle below which two planes are one. Walls press within a spacing; there, planes at that
  /// angle are no farther from each other than a quarter of it, which is as near as particles get to walls.
  static constexpr float kSamePlane = 0.968F;
  /// Among planes that face the same way the nearest counts: it is in front of the others. Where several are
  /// equally near, but for rounding, the newest counts. Where there are too many walls, one that is beside
  /// another is dropped, or the farthest.
  TACTUS_HD void add(Index i, const NearWall& wall) const { add(*this, i, wall); }
  /// Where there are kNearWalls, none of them in the same plane.
  TACTUS_HD void add_to_full(Index i, const NearWall& wall) const { add_to_full(*this, i, wall); }

 private:
  TACTUS_HD_CALLED static void add(NearWalls near, Index i, NearWall wall) {
    const Index n = near.count[i];
    TACTUS_ROLLED
    for (Index k = 0; k < n; ++k) {
      NearWall& old = near.at(i, k);
      if (old.is_beside() || wall.is_beside() || dot(old.n, wall.n) < kSamePlane) continue;
      if (wall.distance_m <= old.distance_m + 1e-3F * abs(old.distance_m)) old = wall;
      return;
    }
    if (n < kNearWalls) {
      store_wide(near.at(i, n), wall);
      near.count[i] = n + 1;
      return;
    }
    add_to_full(near, i, wall);
  }
  TACTUS_HD_CALLED static void add_to_full(NearWalls near, Index i, const NearWall& wall) {
    if (wall.is_beside()) return;
    Index least = 0;
    TACTUS_ROLLED
    for (Index k = 1; k < kNearWalls; ++k)
      if (near.at(i, k).needless_m() > near.at(i, least).needless_m()) least = k;
    if (wall.distance_m < near.at(i, least).needless_m()) near.at(i, least) = wall;
  }
};

}  // namespace tactus
