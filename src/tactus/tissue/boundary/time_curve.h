#pragma once
/// Values over time on the device: linear between keyframes.
#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"

namespace tactus::boundary {

/// Two keyframes and the share of the second in the value at a time.
struct CurvePlace {
  Index before, after;
  double share;
};

/// Where time_s lies in keyframes [begin, end), whose times increase; the first and the last hold beyond.
template <class Key>
TACTUS_HD CurvePlace place_on_curve(const View<const Key>& keys, Index begin, Index end, double time_s) {
  Index after = begin;
  while (after < end && keys[after].time_s <= time_s) ++after;
  if (after == begin) return {begin, begin, 0};
  if (after == end) return {end - 1, end - 1, 0};
  const double from = keys[after - 1].time_s;
  return {after - 1, after, (time_s - from) / (keys[after].time_s - from)};
}

}  // namespace tactus::boundary
