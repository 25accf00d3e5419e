#pragma once
/// Points on edges of triangles that are cut.
#include "tactus/tissue/cut/flat_lists.h"

namespace tactus::cut {

/// Points on edges, in the order in which they were found.
class EdgePoints {
 public:
  void add(std::uint64_t edge, Index point) {
    const auto [list, is_new] = list_.try_emplace(edge, points_.count());
    if (is_new) points_.resize(*list + 1);
    points_.push_back(*list, point);
  }
  bool has(std::uint64_t edge) const { return list_.contains(edge); }
  template <class F>
  void for_each(std::uint64_t edge, F&& f) const {
    if (const Index* list = list_.find(edge); list != nullptr)
      for (const Index point : points_.of(*list)) f(point);
  }
  void clear() {
    list_.clear();
    points_.reset(0);
  }
  void take_capacity_for(std::size_t points) {
    list_.reserve(points);
    points_.take_capacity_for(points, points);
  }

 private:
  FlatMap<std::uint64_t, Index> list_;
  Chains<Index> points_;
};

}  // namespace tactus::cut
