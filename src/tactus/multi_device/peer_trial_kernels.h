#pragma once
/// Tests whether one device really sees the values that another wrote.
#include "tactus/compute/kernel.h"

namespace tactus {

struct ReadPeer {
  View<const std::uint32_t> peer;
  View<std::uint32_t> seen;
  TACTUS_HD void operator()(Index i) const { seen[i] = peer[i]; }
};

}  // namespace tactus
