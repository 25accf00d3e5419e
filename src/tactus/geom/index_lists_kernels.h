#pragma once
/// Where lists lie that change.
#include "tactus/base/hd.h"
#include "tactus/compute/view.h"

namespace tactus {

/// Where a list lies in the array.
struct IndexRange {
  Index begin = 0, end = 0;
};

/// Takes over where lists lie that changed.
struct SetRanges {
  struct Change {
    Index list = 0;
    IndexRange range;
  };
  View<const Change> changes;
  View<IndexRange> ranges;
  TACTUS_HD void operator()(Index i) const { ranges[changes[i].list] = changes[i].range; }
};

}  // namespace tactus
