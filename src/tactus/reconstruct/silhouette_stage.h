#pragma once
/// The host's side of the silhouettes: where the masks of all cameras lie, their memory on one device, and
/// the launches that prepare them. Used by VisualHull.
#include <cstdint>
#include <string>
#include <vector>

#include "tactus/compute/exec_context.h"
#include "tactus/reconstruct/silhouette_kernels.h"

namespace tactus {

/// Where the masks of all cameras lie, and which rows and columns the passes over them visit.
struct SilhouetteLayout {
  std::vector<HullCamera> cameras;
  std::vector<Vec2i> cell_rows, cell_columns, window_rows;
  Index raw_words = 1, bit_words = 0, cell_words = 0;  // a word is read beyond either end of the raw masks

  /// `camera` projects padded nodes; `center` is the middle of the grid. @throws Error for an image of more
  /// than about 16 megapixels.
  void add(HullCamera camera, Vec3f center, const std::string& name);
};

/// Buffers of silhouettes on one device, and their launches.
struct SilhouettePart {
  Buffer<HullCamera> cameras;
  Buffer<Vec2i> cell_rows, cell_columns, window_rows;
  Buffer<std::uint32_t> raw, bits, cells;

  /// visit(buffer, its number of elements), for all that grow with images.
  template <class F>
  void each_buffer(const SilhouetteLayout& layout, F&& visit) {
    visit(raw, std::int64_t{layout.raw_words} + 1);
    visit(bits, std::int64_t{layout.bit_words});
    visit(cells, std::int64_t{layout.cell_words});
  }
  /// After the buffers are there.
  void set_up(ExecContext& ctx, const SilhouetteLayout& layout);
  /// From the raw masks: patches and rows of cells, ...
  void prepare(ExecContext& ctx);
  /// ... their sums ...
  void sum_cells(ExecContext& ctx);
  /// ... and windows, which need neither.
  void prepare_windows(ExecContext& ctx);
};

}  // namespace tactus
