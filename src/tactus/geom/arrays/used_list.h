#pragma once
/// Which entries of an array that has capacity for more are in use.
#include <algorithm>
#include <vector>

#include "tactus/compute/exec_context.h"

namespace tactus {

/// Entries in use, ascending, on the device; without a list all are.
struct UsedEntries {
  View<const Index> entries, count;
  TACTUS_HD Index operator[](Index k) const { return entries.empty() ? k : entries[k]; }
};

/// Kernels visit the entries in use alone, so capacity costs memory but no time. Their number is on the
/// device: recordings stay as they are when it grows.
class UsedList {
 public:
  UsedList() = default;
  /// Synchronizes. @param is_used per entry @param first so many entries are counted for themselves, too
  /// @param members places of an entry, used or not
  UsedList(ExecContext& ctx, const std::vector<bool>& is_used, Index first = 0, Index members = 1)
      : is_used_(is_used), first_(first), members_(members) {
    for (std::size_t e = 0; e < is_used.size(); ++e)
      if (is_used[e]) used_.push_back(static_cast<Index>(e));
    entries_ = Buffer<Index>(ctx.device(), std::max<Index>(1, static_cast<Index>(is_used.size())));
    counts_ = Buffer<Index>(ctx.device(), 3);
    upload(ctx);
    ctx.synchronize();
  }
  void add(Index entry) {
    const auto place = static_cast<std::size_t>(entry);
    if (is_used_.empty() || is_used_[place]) return;
    is_used_[place] = true;
    used_.insert(std::upper_bound(used_.begin(), used_.end(), entry), entry);
    has_changed_ = true;
  }
  /// The list must not change until the context was waited for.
  void upload(ExecContext& ctx) {
    if (!has_changed_) return;
    has_changed_ = false;
    const auto all = static_cast<Index>(used_.size());
    const auto first = std::lower_bound(used_.begin(), used_.end(), first_) - used_.begin();
    counted_ = {all, static_cast<Index>(first), members_ * all};
    ctx.upload(used_, entries_.view().part(0, all));
    ctx.upload(counted_, counts_.view());
  }
  UsedEntries view() const {
    if (is_used_.empty()) return {};
    return {entries_.const_view(), counts_.const_view().part(0, 1)};
  }
  /// For launches; without a list over `all`: the entries, those of the first, and the members of all.
  Count count(Index all) const { return counted(0, all, 1); }
  Count first_count(Index all) const { return counted(1, all, 1); }
  Count member_count(Index all) const { return counted(2, all, members_); }

 private:
  Count counted(Index which, Index all, Index members) const {
    if (is_used_.empty()) return all;
    return {counts_.const_view().part(which, 1), members * static_cast<Index>(is_used_.size())};
  }
  std::vector<bool> is_used_;  ///< empty: there is no list
  std::vector<Index> used_, counted_;
  Index first_ = 0, members_ = 1;
  bool has_changed_ = true;
  Buffer<Index> entries_, counts_;
};

}  // namespace tactus
