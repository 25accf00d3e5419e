#pragma once
/// Sums over regions of half width 1, each from its 27 cells: 9 lines of 3 along x. What sums that slide
/// (flsm_kernels.h) save in additions they lose by the fields between x, y and z, which all go through
/// memory. So here nothing lies between. Fields are as there; additions are in one order, wherever a row is
/// worked out. Thread block: coordinate i % 3 of row i / 3.
#include "tactus/tissue/flsm/flsm_kernels.h"

namespace tactus::flsm {

/// Sums of three cells side by side along x.
struct LineSum {
  double all, moment;
};
template <class T>
TACTUS_HD TACTUS_ALWAYS_INLINE inline LineSum sum_line(View<const T> field, Index middle) {
  const double low = static_cast<double>(field[middle - 1]), high = static_cast<double>(field[middle + 1]);
  return {static_cast<double>(field[middle]) + (high + low), high - low};
}

/// 3 fields (m~ x) -> 12: sums, and first moments along x, y and z.
struct NearSums {
  static constexpr int kThreads = kLanes;
  static constexpr Index kGrain = 32;
  using Shared = NoShared;
  View<const Index> rows;
  View<const double> in;
  View<double> out;
  Index cells, stride_y, stride_z;

  struct PlaneSum {
    double all, along_x, along_y;
  };
  TACTUS_HD TACTUS_ALWAYS_INLINE PlaneSum sum_plane(Index middle) const {
    const LineSum low = sum_line(in, middle - stride_y), here = sum_line(in, middle),
                  high = sum_line(in, middle + stride_y);
    return {here.all + (high.all + low.all), here.moment + (high.moment + low.moment), high.all - low.all};
  }
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Index from = b.index() % 3 * cells + rows[b.index() / 3];
    b.for_each_thread([&](int t) {
      const Index cell = from + t;
      const PlaneSum low = sum_plane(cell - stride_z), here = sum_plane(cell),
                     high = sum_plane(cell + stride_z);
      out[cell] = here.all + (high.all + low.all);
      out[3 * cells + cell] = here.along_x + (high.along_x + low.along_x);
      out[6 * cells + cell] = here.along_y + (high.along_y + low.along_y);
      out[9 * cells + cell] = high.all - low.all;
    });
  }
};

/// Sum of T_r x0_i over the regions that hold i. Region i + k sees node i at -k.
struct NearGoals {
  static constexpr int kThreads = kLanes;
  static constexpr Index kGrain = 32;
  using Shared = NoShared;
  View<const Index> rows;
  View<const double> translation_m;
  View<const float> rotation;
  View<double> goal_sum_m;
  Index cells, stride_y, stride_z;

  /// Of a line's sum of translations, less its turn about the node at kx along it.
  TACTUS_HD TACTUS_ALWAYS_INLINE double line(Index middle) const {
    return sum_line(translation_m, middle).all - sum_line(rotation, middle).moment;
  }
  TACTUS_HD TACTUS_ALWAYS_INLINE double turn(Index axis, Index middle) const {
    return sum_line(rotation, 3 * axis * cells + middle).all;
  }
  TACTUS_HD TACTUS_ALWAYS_INLINE double plane(Index middle) const {
    const Index low = middle - stride_y, high = middle + stride_y;
    return line(middle) + (line(high) + line(low)) - (turn(1, high) - turn(1, low));
  }
  TACTUS_HD TACTUS_ALWAYS_INLINE double plane_turn(Index middle) const {
    return turn(2, middle) + (turn(2, middle + stride_y) + turn(2, middle - stride_y));
  }
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Index from = b.index() % 3 * cells + rows[b.index() / 3];
    b.for_each_thread([&](int t) {
      const Index cell = from + t, low = cell - stride_z, high = cell + stride_z;
      goal_sum_m[cell] = plane(cell) + (plane(high) + plane(low)) - (plane_turn(high) - plane_turn(low));
    });
  }
};

}  // namespace tactus::flsm
