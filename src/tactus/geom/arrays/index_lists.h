#pragma once
/// Lists of indices that change now and then, in one array.
#include <algorithm>
#include <span>
#include <vector>

#include "tactus/compute/exec_context.h"
#include "tactus/geom/arrays/set_values.h"

namespace tactus {

/// Where a list lies in the array.
struct IndexRange {
  Index begin = 0, end = 0;
};

/// Many short lists, on the host and on a device. A list that changes goes behind the others; where that has
/// no capacity, all are packed first. So the cost of a change follows the length of its list, and no view
/// changes.
class IndexLists {
 public:
  IndexLists() = default;
  /// @param capacity values of all lists, at most. There is twice that, so packing is rare. Synchronizes.
  IndexLists(ExecContext& ctx, const std::vector<std::vector<Index>>& lists, Index capacity) {
    for (const std::vector<Index>& list : lists) {
      ranges_.push_back({size(), size() + static_cast<Index>(list.size())});
      values_.insert(values_.end(), list.begin(), list.end());
    }
    device_ranges_ = to_device(ctx, ranges_);
    device_values_ = Buffer<Index>(ctx.device(), capacity > size() ? 2 * capacity : size());
    if (capacity > 0) device_changes_ = Buffer<SetValues<IndexRange>::Change>(ctx.device(), count());
    ctx.upload(values_, device_values_.view().part(0, size()));
    ctx.synchronize();
    uploaded_ = size();
  }
  /// So many values more, whose pages are in place: the first change waits for none.
  void take_capacity(Index values) {
    const std::size_t now = values_.size();
    values_.resize(now + at(values));
    values_.resize(now);
  }

  std::span<const Index> operator[](Index list) const {
    const IndexRange range = ranges_[at(list)];
    return std::span(values_).subspan(at(range.begin), at(range.end - range.begin));
  }
  IndexRange range(Index list) const { return ranges_[at(list)]; }
  /// @throws Error when there is no capacity.
  void set(Index list, std::span<const Index> values) {
    const auto count = static_cast<Index>(values.size());
    if (size() + count > device_values_.size()) pack();
    if (size() + count > device_values_.size()) throw Error("index lists: there is no capacity for more");
    ranges_[at(list)] = {size(), size() + count};
    values_.insert(values_.end(), values.begin(), values.end());
    changed_.push_back(list);
  }
  /// Uploads the lists that were set since the last upload. Lists must not change until the context was
  /// waited for.
  void upload(ExecContext& ctx) {
    if (changed_.empty()) return;
    ctx.upload(std::span(values_).subspan(at(uploaded_)),
               device_values_.view().part(uploaded_, size() - uploaded_));
    uploaded_ = size();
    // A list may have changed twice.
    if (is_packed_ || static_cast<Index>(changed_.size()) > device_changes_.size()) {
      ctx.upload(ranges_, device_ranges_.view());
    } else {
      changes_.clear();
      for (const Index list : changed_) changes_.push_back({list, ranges_[at(list)]});
      const View<SetValues<IndexRange>::Change> part =
          device_changes_.view().part(0, static_cast<Index>(changes_.size()));
      ctx.upload(changes_, part);
      ctx.parallel_for("lists/set_ranges", part.size(), SetValues<IndexRange>{part, device_ranges_.view()});
    }
    changed_.clear();
    is_packed_ = false;
  }

  Index count() const { return static_cast<Index>(ranges_.size()); }
  /// Number of values that there is capacity for.
  Index capacity() const { return device_values_.size(); }
  View<const IndexRange> ranges() const { return device_ranges_.const_view(); }
  View<const Index> values() const { return device_values_.const_view(); }

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }
  Index size() const { return static_cast<Index>(values_.size()); }
  void pack() {
    std::vector<Index> packed;
    for (IndexRange& range : ranges_) {
      const auto begin = static_cast<Index>(packed.size());
      packed.insert(packed.end(), values_.begin() + range.begin, values_.begin() + range.end);
      range = {begin, static_cast<Index>(packed.size())};
    }
    values_ = std::move(packed);
    uploaded_ = 0;
    is_packed_ = true;
  }

  std::vector<IndexRange> ranges_;
  std::vector<Index> values_;
  Index uploaded_ = 0;
  std::vector<Index> changed_;  ///< lists
  bool is_packed_ = false;      ///< so all have changed
  std::vector<SetValues<IndexRange>::Change> changes_;
  Buffer<SetValues<IndexRange>::Change> device_changes_;
  Buffer<IndexRange> device_ranges_;
  Buffer<Index> device_values_;
};

}  // namespace tactus
