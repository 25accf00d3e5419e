#include "tactus/geom/arrays/tile_scan.h"

#include "tactus/geom/arrays/tile_scan_kernels.h"

namespace tactus {

TileScan::TileScan(Device& device, Index capacity) : tile_sum_(device, ceil_div(capacity, kScanTile)) {}

void TileScan::run(ExecContext& ctx, const char* name, Count count, View<Index> values, View<Index> total) {
  const Index tiles = ceil_div(count.capacity, kScanTile);
  ctx.parallel_for(name, tiles, SumTile{count, values, tile_sum_.view()});
  ctx.parallel_for(name, tiles, ScanTile{count, tile_sum_.const_view(), values, total});
}

}  // namespace tactus
