#pragma once
/// Small records from all over a device's memory, one after the other.
#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"

namespace tactus {

struct ReadbackItem {
  const std::uint32_t* from = nullptr;
  Index words = 0;
  Index to = 0;  ///< first word in the gathered records
};

/// Thread i copies one word: item_of_word names its item.
struct GatherRecords {
  View<const ReadbackItem> items;
  View<const Index> item_of_word;
  View<std::uint32_t> gathered;
  TACTUS_HD void operator()(Index word) const {
    const ReadbackItem item = items[item_of_word[word]];
    gathered[word] = item.from[word - item.to];
  }
};

}  // namespace tactus
