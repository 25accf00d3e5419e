#pragma once
/// Film on its way from one mesh to the next.
#include <cstdint>

#include "tactus/base/vec.h"
#include "tactus/compute/view.h"

namespace tactus {

/// The film of a vertex, or of a place where it waits for a surface. Places are in an array beside.
struct FilmPoint {
  std::int64_t units = 0, stain = 0;
  Vec3f normal;
  Index tag = -1;  ///< of its vertex
  Index change = 0;
  Index vertex = -1;  ///< of the new surface: the nearest that faces as it does
};

/// Numbers on the device, in one array.
struct FilmCarryCounts {
  static constexpr Index kVertices = 0, kTriangles = 1,  ///< of the surface that is linked; 0: none is
      kHeld = 2,                                         ///< vertices that something lies on
      kPoints = 3, kWaiting = 4, kLinkVertices = 5, kLinkTriangles = 6,  ///< to be linked now
      kSize = 7;
  View<Index> all;
};

/// Film, and stain, that waits for a surface, in units.
struct FilmWaiting {
  std::uint64_t film = 0, stain = 0;
};

}  // namespace tactus
