#pragma once
/// Values of an array that change now and then, one by one.
#include "tactus/base/hd.h"
#include "tactus/compute/view.h"

namespace tactus {

/// Takes over the i-th change.
template <class T>
struct SetValues {
  struct Change {
    Index at = 0;
    T value;
  };
  View<const Change> changes;
  View<T> values;
  TACTUS_HD void operator()(Index i) const { values[changes[i].at] = changes[i].value; }
};

}  // namespace tactus
