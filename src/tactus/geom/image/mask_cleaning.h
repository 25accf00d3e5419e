#pragma once
/// Cleaning of silhouettes on packed bits and on runs of pixels: 32 pixels a step.
#include <vector>

#include "tactus/geom/image/image.h"

namespace tactus {

struct MaskCleaning {
  int open_px = 0;          ///< radius of the disc: parts thinner than it go
  int close_px = 0;         ///< radius: gaps that are narrower are closed
  int largest_hole_px = 0;  ///< smaller holes are filled [pixels]; 0: none
  /// Parts smaller than this share of the largest go; 1: only the largest stays.
  double least_part = 1;
};

/// Owns the memory for masks of one size; `clean` allocates nothing once the number of runs has been seen.
class MaskCleaner {
 public:
  MaskCleaner(Index width_px, Index height_px);
  /// Opens, closes, drops small parts (joined over edges and corners), fills small holes that do not touch
  /// the border (joined over edges).
  void clean(BitMask& mask, const MaskCleaning& how);

  /// Sets every pixel within a disc of this radius of a set one. Pixels beyond the image are clear.
  void dilate(BitMask& mask, int radius_px);
  /// Clears every pixel within a disc of this radius of a clear one. Pixels beyond the image are set.
  void erode(BitMask& mask, int radius_px);
  void keep_parts(BitMask& mask, double least_part);
  void fill_holes(BitMask& mask, int largest_hole_px);

 private:
  /// Pixels [begin, end) of a row.
  struct Run {
    Index y, begin, end, parent;
    std::int64_t area;
    bool at_border;
  };
  void invert(BitMask& mask) const;
  void find_runs(const BitMask& mask, bool value, Index reach);
  Index root(Index run);
  void join(Index a, Index b);

  Index width_px_, height_px_, row_words_;
  std::vector<std::uint32_t> widened_;  ///< rows dilated along x, an image per half width
  std::vector<Run> runs_;
  std::vector<Index> row_begin_;
};

}  // namespace tactus
