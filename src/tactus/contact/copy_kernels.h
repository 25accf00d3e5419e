#pragma once
/// Copies between devices of as much as there is.
#include "tactus/compute/kernel.h"

namespace tactus {

template <class T>
struct CopyElements {
  View<const T> from;
  View<T> to;
  TACTUS_HD void operator()(Index i) const { to[i] = from[i]; }
};

}  // namespace tactus
