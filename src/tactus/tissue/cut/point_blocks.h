#pragma once
/// Boxes of consecutive points, to find out quickly which of many points are near.
#include <span>
#include <vector>

#include "tactus/base/vec.h"

namespace tactus::cut {

/// Point i is in block i / kSize.
class PointBlocks {
 public:
  static constexpr std::size_t kSize = 16;
  /// On all cores. @param points none is NaN
  void build(std::span<const Vec3f> points);
  const std::vector<Box3f>& boxes() const { return boxes_; }

 private:
  std::vector<Box3f> boxes_;
};

}  // namespace tactus::cut
