#pragma once
/// One record out of many.
#include "tactus/compute/kernel.h"
#include "tactus/tissue/node_check_kernels.h"
#include "tactus/tissue/tled/tled_kernels.h"

namespace tactus {

/// Merges records in their order: of equals the first stays. One block. A record is merged by
/// `Merge{}(first, later)`, and Merge::none() changes nothing.
template <class Record, class Merge>
struct MergeRecords {
  static constexpr int kThreads = 256, kStrips = 16, kStrip = kThreads / kStrips;
  View<const Record> records;
  View<Record> merged;  ///< (1)
  struct Shared {
    Record of_thread[kThreads], of_strip[kStrips];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Merge merge{};
    const Index chunk = (records.size() + kThreads - 1) / kThreads;
    b.for_each_thread([&](int t) {
      Record all = Merge::none();
      const Index begin = t * chunk, end = min(begin + chunk, records.size());
      for (Index i = begin; i < end; ++i) all = merge(all, records[i]);
      s.of_thread[t] = all;
    });
    b.for_threads(kStrips, [&](int strip) {
      Record all = Merge::none();
      for (int t = strip * kStrip; t < (strip + 1) * kStrip; ++t) all = merge(all, s.of_thread[t]);
      s.of_strip[strip] = all;
    });
    b.on_one_thread([&] {
      Record all = Merge::none();
      for (const Record& strip : s.of_strip) all = merge(all, strip);
      merged[0] = all;
    });
  }
};

struct MergeNodeChecks {
  TACTUS_HD static NodeCheckRecord none() { return {}; }
  TACTUS_HD NodeCheckRecord operator()(NodeCheckRecord first, const NodeCheckRecord& later) const {
    first.add(later);
    return first;
  }
};
struct MergeExtremes {
  TACTUS_HD static tled::CubeExtremes none() { return tled::FindExtremes::kNone; }
  TACTUS_HD tled::CubeExtremes operator()(const tled::CubeExtremes& first,
                                          const tled::CubeExtremes& later) const {
    return tled::FindExtremes::worse(first, later);
  }
};
using SummariseNodeCheck = MergeRecords<NodeCheckRecord, MergeNodeChecks>;
using SummariseExtremes = MergeRecords<tled::CubeExtremes, MergeExtremes>;

}  // namespace tactus
