#pragma once
#include "tactus/compute/buffer.h"
#include "tactus/compute/exec_context.h"

namespace tactus {

/// Exclusive sums in place, of a count that the device knows; see tile_scan_kernels.h.
class TileScan {
 public:
  TileScan(Device& device, Index capacity);
  /// @param values count numbers, and a place for the sum of all behind them
  /// @param total (1) the same sum
  void run(ExecContext& ctx, const char* name, Count count, View<Index> values, View<Index> total);

 private:
  Buffer<Index> tile_sum_;
};

}  // namespace tactus
