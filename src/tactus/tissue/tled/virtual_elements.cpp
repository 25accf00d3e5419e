#include "tactus/tissue/tled/virtual_elements.h"

#include <algorithm>
#include <span>
#include <vector>

#include "tactus/tissue/tled/virtual_element_kernels.h"

namespace tactus::tled {

void archive_fields(ExecContext& ctx, StateArchive& a, const char* name, View<float> fields, Index count) {
  const Index size = fields.size() / count;
  for (Index k = 0; k < count; ++k) {
    const View<float> field = fields.part(k * size, size);
    std::vector<float> values = to_host(ctx, View<const float>(field));
    a.values(name, values);
    if (!a.reads()) continue;
    ctx.upload(values, field);
    ctx.synchronize();
  }
}

VirtualElements::VirtualElements(ExecContext& ctx, std::span<const embed::CubeNodes> copies,
                                 std::span<const Stiffness> stiffness, View<const Index> cell,
                                 const OwnNodes& own, Index used, Index first_virtual_cell,
                                 Index history_fields)
    : own_(own), first_virtual_cell_(first_virtual_cell) {
  if (copies.empty()) return;
  Device& device = ctx.device();
  const auto count = static_cast<Index>(copies.size());
  cell_ = Buffer<Index>(device, cell.size());
  ctx.copy(cell, cell_.view());
  copies_ = to_device(ctx, copies);
  stiffness_ = to_device(ctx, stiffness);
  corners_ = Buffer<CopyCells>(device, count);
  f_N_ = to_device(ctx, std::vector<Vec3f>(8 * copies.size()));
  outer_m_s2_ = to_device(ctx, std::vector<Vec3f>(8 * copies.size()));
  for (auto* words : {&node_, &node_scratch_}) *words = Buffer<std::uint32_t>(device, 8 * count);
  for (auto* words : {&corner_, &corner_scratch_, &first_}) *words = Buffer<Index>(device, 8 * count);
  node_count_ = Buffer<Index>(device, 1);
  first_of_node_ = Buffer<Index>(device, cell.size());
  for (Buffer<float>& history : history_Pa_)
    history = to_device(ctx, std::vector<float>(static_cast<std::size_t>(history_fields) * copies.size()));
  use(0, used);
  for (Index c = 0; c < count; ++c)
    if (stiffness[static_cast<std::size_t>(c)].mu_Pa > 0) use(c + 1, used);
  used_on_device_ = to_device(ctx, std::span<const Index>(used_));
  sort_corners(ctx, count);
  ctx.synchronize();
}

void VirtualElements::rebuild(ExecContext& ctx, Index copies_end, Index nodes_end) {
  use(copies_end, nodes_end);
  ctx.upload(std::span<const Index>(used_), used_on_device_.view());
  sort_corners(ctx, used_[0]);
}

void VirtualElements::use(Index copies, Index nodes) {
  used_[0] = std::max(used_[0], copies);
  used_[1] = copy_blocks(used_[0]);
  used_[2] = std::max(used_[2], nodes);
}

/// Corners of copies behind `copies` have no node, and stay behind the others.
void VirtualElements::sort_corners(ExecContext& ctx, Index copies) {
  if (copies == 0) return ctx.fill_bytes(first_of_node_.view(), 0xff);
  const Index corners = 8 * copies;
  ctx.parallel_for("tled/copy_cells", copies,
                   FindCopyCells{copies_.const_view(), cell_.const_view(), corners_.view()});
  ctx.parallel_for(
      "tled/key_corners", corners,
      KeyCorners{copies_.const_view(), stiffness_.const_view(), own_, node_.view(), corner_.view()});
  ctx.sort_pairs("tled/sort_corners", node_.view().part(0, corners), corner_.view().part(0, corners),
                 node_scratch_.view().part(0, corners), corner_scratch_.view().part(0, corners));
  ctx.parallel_for("tled/first_corners", corners,
                   FlagFirstCorners{node_.const_view(), corner_scratch_.view()});
  ctx.compact("tled/first_corners", corners, corner_scratch_.const_view(), first_.view(), node_count_.view());
  ctx.fill_bytes(first_of_node_.view(), 0xff);
  ctx.parallel_for("tled/first_corners", nodes(), NoteFirstCorners{by_node(), first_of_node_.view()});
}

void VirtualElements::load(ExecContext& ctx, View<const float> external_m_s2, Index cells) {
  ctx.parallel_for("tled/keep_push", nodes(),
                   KeepExternal{by_node(), cell_.const_view(), external_m_s2, outer_m_s2_.view(), cells});
}

void VirtualElements::move(ExecContext& ctx, const MoveNodes& nodes_move, View<float> external_m_s2) {
  ctx.parallel_for("tled/move_virtual", nodes(),
                   MoveVirtualNodes{.corners = by_node(),
                                    .cell = cell_.const_view(),
                                    .outer_m_s2 = outer_m_s2_.const_view(),
                                    .external_m_s2 = external_m_s2,
                                    .move = nodes_move,
                                    .first_virtual_cell = first_virtual_cell_});
}

CornersOfNodes VirtualElements::by_node() const {
  return {first_.const_view(), node_.const_view(), corner_.const_view(), f_N_.const_view()};
}

SummedForces VirtualElements::forces(View<const float> of_tiles_N, Index cells) const {
  if (!has_capacity()) return {of_tiles_N, cells, cells};
  return {of_tiles_N, cells, first_virtual_cell_, by_node(), first_of_node_.const_view()};
}

void VirtualElements::add_to(ExecContext& ctx, View<float> f_N, Index cells) {
  ctx.parallel_for("tled/add_virtual", nodes(),
                   AddVirtualForces{by_node(), cell_.const_view(), forces(f_N, cells), f_N});
}

void VirtualElements::find_extremes(ExecContext& ctx, View<const float> x_m, Index cells, Index first_cube,
                                    float gradient_per_m, View<CubeExtremes> out) {
  ctx.parallel_for("tled/extremes", out.size(),
                   FindCopyExtremes{.copies = copies_.const_view(),
                                    .corners = corners_.const_view(),
                                    .stiffness = stiffness_.const_view(),
                                    .x_m = x_m,
                                    .own = own_,
                                    .out = out,
                                    .cells = cells,
                                    .first_cube = first_cube,
                                    .gradient_per_m = gradient_per_m});
}

void VirtualElements::keep_history(ExecContext& ctx, const MoveCount& moves) {
  ctx.parallel_for("tled/keep_history", history_Pa_[0].size(),
                   KeepHistory{history_Pa_[1].const_view(), history_Pa_[0].view(), moves});
}

}  // namespace tactus::tled
