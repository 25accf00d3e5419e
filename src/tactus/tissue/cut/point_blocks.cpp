#include "tactus/tissue/cut/point_blocks.h"

#include <algorithm>
#include <array>

#include "tactus/compute/cpu_for.h"

namespace tactus::cut {
namespace {

/// Vectorised: four points are twelve lanes.
Box3f box_of_block(const Vec3f* points) {
  constexpr std::size_t kLanes = 12, kFloats = 3 * PointBlocks::kSize;
  const float* from = &points->x;
  std::array<float, kLanes> low, high;
  for (std::size_t j = 0; j < kLanes; ++j) low[j] = high[j] = from[j];
  for (std::size_t i = kLanes; i < kFloats; i += kLanes)
    for (std::size_t j = 0; j < kLanes; ++j) {
      low[j] = std::min(low[j], from[i + j]);
      high[j] = std::max(high[j], from[i + j]);
    }
  Box3f box{{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
  for (std::size_t j = 3; j < kLanes; j += 3)
    box = {min(box.min, Vec3f{low[j], low[j + 1], low[j + 2]}),
           max(box.max, Vec3f{high[j], high[j + 1], high[j + 2]})};
  return box;
}

}  // namespace

void PointBlocks::build(std::span<const Vec3f> points) {
  boxes_.resize((points.size() + kSize - 1) / kSize);
  const auto build_block = [&](std::size_t b) {
    const std::span<const Vec3f> of = points.subspan(b * kSize, std::min(kSize, points.size() - b * kSize));
    if (of.size() == kSize) {
      boxes_[b] = box_of_block(of.data());
      return;
    }
    boxes_[b] = {of.front(), of.front()};
    for (const Vec3f p : of) boxes_[b] = {min(boxes_[b].min, p), max(boxes_[b].max, p)};
  };
  cpu_for(boxes_.size(), 512, build_block);
}

}  // namespace tactus::cut
