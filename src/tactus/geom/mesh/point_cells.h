#pragma once
/// Which points are near a place.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tactus/base/at.h"
#include "tactus/base/vec.h"

namespace tactus {

/// Points by hashed cells, in compact lists. Keeps a reference to the points.
class PointCells {
 public:
  PointCells(const std::vector<Vec3f>& points_m, float cell_m) : points_m_(points_m), per_m_(1 / cell_m) {
    std::size_t size = 64;
    while (size < 2 * points_m.size()) size *= 2;
    first_.assign(size + 1, 0);
    for (const Vec3f p : points_m)
      if (is_somewhere(p)) ++first_[hash(cell_of(p)) + 1];
    for (std::size_t k = 1; k <= size; ++k) first_[k] += first_[k - 1];
    ids_.resize(first_.back());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t i = 0; i < points_m.size(); ++i)
      if (is_somewhere(points_m[i])) ids_[next[hash(cell_of(points_m[i]))]++] = static_cast<std::uint32_t>(i);
  }
  /// Others are in no list.
  static bool is_somewhere(Vec3f p) { return std::abs(p.x) + std::abs(p.y) + std::abs(p.z) < 1e6F; }
  /// Calls f(point) for all in the 27 cells round p_m.
  template <class F>
  void around(Vec3f p_m, F&& f) const {
    const Vec3i c = cell_of(p_m);
    for (int k = 0; k < 27; ++k) {
      const Vec3i cell = c + Vec3i{k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
      const std::size_t h = hash(cell);
      for (std::size_t i = first_[h]; i < first_[h + 1]; ++i)
        if (cell_of(points_m_[ids_[i]]) == cell) f(static_cast<std::size_t>(ids_[i]));
    }
  }

 private:
  Vec3i cell_of(Vec3f p) const {
    const auto along = [&](float v) {
      return static_cast<Index>(std::floor(clamp(v * per_m_, -1e9F, 1e9F)));
    };
    return {along(p.x), along(p.y), along(p.z)};
  }
  std::size_t hash(Vec3i c) const {
    const std::uint32_t h = static_cast<std::uint32_t>(c.x) * 73856093U ^
                            static_cast<std::uint32_t>(c.y) * 19349663U ^
                            static_cast<std::uint32_t>(c.z) * 83492791U;
    return at(h) & (first_.size() - 2);
  }
  const std::vector<Vec3f>& points_m_;
  float per_m_;
  std::vector<std::uint32_t> first_, ids_;
};

}  // namespace tactus
