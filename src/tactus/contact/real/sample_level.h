#pragma once
/// Thins samples to one per small cell and main direction, and sorts those that remain for neighbour search.
#include "tactus/contact/real/sample_kernels.h"
#include "tactus/geom/search/cell_list.h"

namespace tactus {

class SampleLevel {
 public:
  /// @param cell_m edge of the search cells [m]
  /// @param subcells each search cell is thinned to at most subcells³ places (times six directions)
  SampleLevel(Device& device, Index max_in, Index max_out, float cell_m, int subcells);

  /// Merges the first `count` samples. Samples that don't fit into max_out are dropped and counted in
  /// overflow().
  /// @param component of each sample: kept, those that are merged get their first one's
  void build(ExecContext& ctx, View<const Vec3f> x_m, View<const Vec3f> n, View<const float> area_m2,
             View<const Index> component, Count count);

  /// Edge of the search cells of the builds from now on [m].
  void set_cell_m(float cell_m) { list_.set_cell_m(cell_m); }

  SamplesView view() const;
  /// Cells of the samples that were merged: slots, and the input's number of each slot.
  CellListView input_cells() const { return list_.view(); }
  View<Index> components() { return component_.view(); }
  Count count() const { return Count(count_.const_view(), x_m_.size()); }
  View<const Index> overflow() const { return overflow_.const_view(); }

 private:
  float subcells_;
  CellList list_;
  Buffer<std::uint64_t> labels_;
  Buffer<Index> flags_, reference_nodes_, reference_node_count_, count_, overflow_, begin_, end_, component_;
  Buffer<Vec3f> x_m_, n_;
  Buffer<float> area_m2_;
  Buffer<std::uint32_t> keys_, near_rows_;
};

}  // namespace tactus
