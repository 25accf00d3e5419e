#pragma once
/// Nearest neighbours among a fixed set of points on the host.
#include <algorithm>
#include <numeric>
#include <span>
#include <vector>

#include "tactus/base/vec.h"

namespace tactus {

/// A balanced k-d tree; ties are decided by the order of the points, so results are reproducible.
class PointTree {
 public:
  PointTree() = default;
  explicit PointTree(std::vector<Vec3d> points_m) : points_(std::move(points_m)), order_(points_.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    split(0, points_.size(), 0);
  }
  /// Index of the point nearest to p within `reach_m`, or -1.
  Index nearest(Vec3d p, double reach_m) const {
    Best best{-1, reach_m * reach_m};
    search(p, 0, points_.size(), 0, best);
    return best.index;
  }

 private:
  struct Best {
    Index index;
    double distance2;
  };
  const Vec3d& at(std::size_t slot) const { return points_[static_cast<std::size_t>(order_[slot])]; }
  void split(std::size_t begin, std::size_t end, int axis) {
    if (end - begin < 2) return;
    const std::size_t middle = begin + (end - begin) / 2;
    const auto slot = [this](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(slot(begin), slot(middle), slot(end), [&](Index a, Index b) {
      const double x = points_[static_cast<std::size_t>(a)][axis],
                   y = points_[static_cast<std::size_t>(b)][axis];
      return x != y ? x < y : a < b;
    });
    split(begin, middle, (axis + 1) % 3);
    split(middle + 1, end, (axis + 1) % 3);
  }
  void search(Vec3d p, std::size_t begin, std::size_t end, int axis, Best& best) const {
    if (begin >= end) return;
    const std::size_t middle = begin + (end - begin) / 2;
    const Vec3d d = p - at(middle);
    if (dot(d, d) < best.distance2) best = {order_[middle], dot(d, d)};
    const bool low_first = d[axis] < 0;
    const int next = (axis + 1) % 3;
    if (low_first)
      search(p, begin, middle, next, best);
    else
      search(p, middle + 1, end, next, best);
    if (d[axis] * d[axis] >= best.distance2) return;
    if (low_first)
      search(p, middle + 1, end, next, best);
    else
      search(p, begin, middle, next, best);
  }

  std::vector<Vec3d> points_;
  std::vector<Index> order_;
};

}  // namespace tactus
