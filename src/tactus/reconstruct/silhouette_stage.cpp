#include "tactus/reconstruct/silhouette_stage.h"

#include "tactus/base/error.h"

namespace tactus {
namespace {

constexpr Index kMaxCells = 65535;  // both halves of a summed cell must hold the count
constexpr float kWindowedSubBrick_px = 11;
Index round_up(Index n, Index step) { return ceil_div(n, step) * step; }

/// Windows cost time for each pixel, and pay where the contour is far thinner than a cell of the summed-area
/// table is wide: where sub-bricks look smaller than a large window.
bool wants_windows(const HullCamera& camera, Vec3f center) {
  const Vec3f h = project_node(camera, center);
  if (!(h.z > 0)) return false;
  const auto widest = [&](Vec3f row, float at) {
    const Vec3f per_node = row - (at / h.z) * camera.row[2];
    return 4 * (abs(per_node.x) + abs(per_node.y) + abs(per_node.z)) / h.z;
  };
  return max(widest(camera.row[0], h.x), widest(camera.row[1], h.y)) <= kWindowedSubBrick_px;
}

}  // namespace

void SilhouetteLayout::add(HullCamera camera, Vec3f center, const std::string& name) {
  const Index number = static_cast<Index>(cameras.size());
  const Index padded_width = camera.width_px + 2, padded_height = camera.height_px + 2;
  camera.raw_begin = raw_words;
  camera.bits_row_words = round_up(ceil_div(padded_width, 8), 8);
  camera.bits_begin = bit_words;
  camera.cell_shift = 2;
  const auto cells_along = [&](Index pixels) { return ceil_div(pixels, 1 << camera.cell_shift); };
  while (cells_along(padded_width) * cells_along(padded_height) > kMaxCells ||
         cells_along(padded_width) > PrepareSilhouettes::kMaxCells) {
    if (++camera.cell_shift > 4) {
      throw Error("camera '" + name + "': an image of " + std::to_string(camera.width_px) + "x" +
                  std::to_string(camera.height_px) + " pixels is too large (at most about 16 megapixels)");
    }
  }
  camera.cells_width = cells_along(padded_width);
  camera.cells_height = cells_along(padded_height);
  camera.cells_row = round_up(round_up(camera.cells_width, 8) + 1, SumCellColumns::kColumns);  // whole words
  camera.cells_begin = cell_words;
  raw_words += camera.raw_row_words() * camera.height_px;
  bit_words += camera.bits_row_words * ceil_div(padded_height, 2);
  cell_words += camera.cells_row * (camera.cells_height + 1);
  for (Index y = 0; y < camera.cells_height; ++y) cell_rows.push_back({number, y});
  for (Index x = 0; x <= camera.cells_width; x += SumCellColumns::kColumns)
    cell_columns.push_back({number, x});
  camera.windows_begin = -1;
  if (wants_windows(camera, center)) {
    camera.windows_begin = cell_words;
    cell_words += 2 * camera.height_px * camera.windows_row();
    for (Index y = 0; y < camera.height_px; ++y) window_rows.push_back({number, y});
  }
  cameras.push_back(camera);
}

void SilhouettePart::set_up(ExecContext& ctx, const SilhouetteLayout& layout) {
  cameras = to_device(ctx, layout.cameras);
  cell_rows = to_device(ctx, layout.cell_rows);
  cell_columns = to_device(ctx, layout.cell_columns);
  window_rows = to_device(ctx, layout.window_rows);
}

void SilhouettePart::prepare(ExecContext& ctx) {
  const SilhouettePart& in = *this;
  ctx.parallel_for(
      "hull/prepare_silhouettes", in.cell_rows.size(),
      PrepareSilhouettes{in.cameras.view(), in.raw.view(), in.cell_rows.view(), bits.view(), cells.view()});
}

void SilhouettePart::sum_cells(ExecContext& ctx) {
  const SilhouettePart& in = *this;
  ctx.parallel_for("hull/sum_cell_columns", in.cell_columns.size(),
                   SumCellColumns{in.cameras.view(), in.cell_columns.view(), cells.view()});
}

void SilhouettePart::prepare_windows(ExecContext& ctx) {
  const SilhouettePart& in = *this;
  ctx.parallel_for("hull/prepare_windows", in.window_rows.size(),
                   PrepareWindows{in.cameras.view(), in.raw.view(), in.window_rows.view(), cells.view()});
}

}  // namespace tactus
