#pragma once
#include "tactus/compute/kernel.h"

namespace tactus::test {

/// One step of heat along a rod: b_i = a_i + (a_{i-1} - 2 a_i + a_{i+1}) / 4 for own nodes, with copies
/// around.
struct Diffuse {
  View<const float> a;
  View<float> b;
  Index first, last_node;  ///< first own node; the rod's last node, in this part's numbers
  bool is_left_end;
  TACTUS_HD void operator()(Index n) const {
    const Index i = first + n;
    const float left = i == 0 && is_left_end ? a[i] : a[i - 1], right = i == last_node ? a[i] : a[i + 1];
    b[i] = a[i] + 0.25F * (left - 2.F * a[i] + right);
  }
};

/// Each element of a chain adds its number to both of its nodes; copies are cleared first.
struct Clear {
  View<Index> sum;
  TACTUS_HD void operator()(Index i) const { sum[i] = 0; }
};
struct AddElements {
  View<Index> sum;
  Index first_element;  ///< of the chain; it joins nodes e and e + 1 of this part
  Index parity;
  TACTUS_HD void operator()(Index half) const {
    const Index e = 2 * half + parity;
    if (e + 1 >= sum.size()) return;
    sum[e] += first_element + e;
    sum[e + 1] += first_element + e;
  }
};

}  // namespace tactus::test
