#pragma once
/// How fast the nodes of a body are, and which are no longer where anything could be.
#include "tactus/base/vec.h"

namespace tactus {

/// Record of 256 nodes since the frame began.
struct NodeCheckRecord {
  Index bad_substep = -1;  ///< the first after which a node was bad; -1: none
  Index bad_node = -1;     ///< the lowest of those
  float fastest2_m2_s2 = 0;
  Index fastest_node = -1;
  float fastest_element2_m2_s2 = 0;  ///< of nodes of elements

  /// And those of later nodes, counted from `first`.
  TACTUS_HD void add(const NodeCheckRecord& later, Index first = 0) {
    if (later.bad_substep >= 0 && (bad_substep < 0 || later.bad_substep < bad_substep)) {
      bad_substep = later.bad_substep;
      bad_node = first + later.bad_node;
    }
    if (later.fastest2_m2_s2 > fastest2_m2_s2) {
      fastest2_m2_s2 = later.fastest2_m2_s2;
      fastest_node = first + later.fastest_node;
    }
    fastest_element2_m2_s2 = max(fastest_element2_m2_s2, later.fastest_element2_m2_s2);
  }
};

}  // namespace tactus
