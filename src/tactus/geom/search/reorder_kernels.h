#pragma once
/// Fields of particles, moved to a new order.
#include "tactus/compute/kernel.h"

namespace tactus {

inline constexpr int kMostMovedFields = 8;

struct MovedField {
  const std::uint32_t* in = nullptr;
  std::uint32_t* out = nullptr;
  int words = 0;  ///< of 4 bytes, an element
};

struct ReorderFields {
  View<const Index> order;
  MovedField fields[kMostMovedFields];
  int field_count;
  TACTUS_HD void operator()(Index slot) const {
    const auto from = static_cast<std::size_t>(order[slot]), to = static_cast<std::size_t>(slot);
    for (int f = 0; f < field_count; ++f) {
      const auto words = static_cast<std::size_t>(fields[f].words);
      for (std::size_t w = 0; w < words; ++w) fields[f].out[to * words + w] = fields[f].in[from * words + w];
    }
  }
};

}  // namespace tactus
