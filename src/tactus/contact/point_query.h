#pragma once
/// State of one point of a body while contact finds the colliders that it touches.
#include "tactus/base/bits.h"
#include "tactus/contact/response_kernels.h"
#include "tactus/contact/triangle_search.h"

namespace tactus {

/// A triangle in a point's list: its collider, and its slot there.
struct NearTriangle {
  static constexpr int kSlotBits = 26;
  static_assert(kColliders <= 1 << (32 - kSlotBits));
  Index collider, slot;
  TACTUS_HD std::uint32_t packed() const {
    return static_cast<std::uint32_t>(collider) << kSlotBits | static_cast<std::uint32_t>(slot);
  }
  TACTUS_HD static NearTriangle of(std::uint32_t packed) {
    return {static_cast<Index>(packed >> kSlotBits), static_cast<Index>(packed & ((1U << kSlotBits) - 1U))};
  }
};

/// The collider that a point is deepest in.
struct Deepest {
  float gap_m = 0;
  Vec3f n, velocity_m_s;
  Index collider = -1;
  bool parts = false;  ///< a blade is there already: the wall gives way little by little
  TACTUS_HD void see(float gap, Vec3f normal, Vec3f velocity, Index who, bool is_parted = false) {
    if (!(gap < gap_m)) return;
    parts = is_parted;
    gap_m = gap;
    n = normal;
    velocity_m_s = velocity;
    collider = who;
  }
};

/// An entry of a point's list.
struct ListedTriangle {
  NearTriangle near;
  SeenTriangle seen;
};

inline constexpr Index kListBits = 32, kListWords = ceil_div(kNearTriangles, kListBits);

/// How an collider keeps from a point, as far as is known without a search.
struct ColliderApart {
  float free_m = 1e30F;   ///< it is no nearer
  bool is_near = false;   ///< unless this
  bool is_shape = false;  ///< has no triangles, and is always looked at
};

/// State of the search for one point.
struct PointQuery {
  enum class Now : Index { nothing, lost, listed, done };
  Now now;
  Vec3f x_m, v_m_s;
  float moved_m;  ///< since the search
  float sleep_m;  ///< so far a node of it may move before it touches anything
  PointNeighbours near;
  std::uint32_t to_search, crowded;  ///< colliders, as bits
  SurfaceGap gap;  ///< to the collider with too many triangles for a list, where all lanes looked for it
  Index gap_collider;
  MeetingPoint* meeting = nullptr;    ///< (kColliders) how it meets those that are near or to be searched
  ListedTriangle* list = nullptr;     ///< (kNearTriangles)
  std::uint32_t* deciding = nullptr;  ///< (kListWords) bits of those of the list that may decide
};

}  // namespace tactus
