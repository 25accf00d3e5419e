#pragma once
/// A change of topology as one device needs it.
#include <algorithm>
#include <vector>

#include "tactus/compute/exec_context.h"
#include "tactus/tissue/changed_element.h"

namespace tactus {

/// The part of a change that concerns a device, in ids of its part of the body.
struct LocalChange {
  std::vector<Index> cut;  ///< cubes that are no more
  std::vector<cut::LocalCopy> copies;
  std::vector<cut::LocalNode> nodes;
};

/// Lists of a change in a device's memory. They are as long as a body has capacity for, so a change allocates
/// nothing there.
class ChangeLists {
 public:
  /// @param capacity for copies that the body has
  ChangeLists(ExecContext& ctx, Index capacity)
      : cut_(ctx.device(), capacity), copies_(ctx.device(), capacity), nodes_(ctx.device(), 8 * capacity) {}
  /// Synchronizes.
  void upload(ExecContext& ctx, const LocalChange& change) {
    const auto put = [&]<class T>(const std::vector<T>& from, Buffer<T>& to, View<const T>& of_change) {
      const auto count = static_cast<Index>(from.size());
      of_change = to.const_view().part(0, count);
      if (count > 0) ctx.upload(std::span<const T>(from), to.view().part(0, count));
    };
    put(change.cut, cut_, cubes);
    put(change.copies, copies_, copies);
    put(change.nodes, nodes_, nodes);
    copies_end = nodes_end = 0;
    for (const cut::LocalCopy& copy : change.copies) copies_end = std::max(copies_end, copy.copy + 1);
    for (const cut::LocalNode& node : change.nodes) nodes_end = std::max(nodes_end, node.node + 1);
    ctx.synchronize();
  }
  View<const Index> cubes;
  View<const cut::LocalCopy> copies;
  View<const cut::LocalNode> nodes;
  Index copies_end = 0, nodes_end = 0;  ///< no copy or node of the change has this number or a higher one

 private:
  Buffer<Index> cut_;
  Buffer<cut::LocalCopy> copies_;
  Buffer<cut::LocalNode> nodes_;
};

}  // namespace tactus
