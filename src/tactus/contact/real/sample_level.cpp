#include "tactus/contact/real/sample_level.h"

namespace tactus {

SampleLevel::SampleLevel(Device& device, Index max_in, Index max_out, float cell_m, int subcells)
    : subcells_(static_cast<float>(subcells)),
      list_(device, max_in, cell_m, kCellBits),
      labels_(device, max_in),
      flags_(device, max_in),
      reference_nodes_(device, max_in),
      reference_node_count_(device, 1),
      count_(device, 1),
      overflow_(device, 1),
      begin_(device, list_.grid().cell_count()),
      end_(device, list_.grid().cell_count()),
      component_(device, max_out),
      x_m_(device, max_out),
      n_(device, max_out),
      area_m2_(device, max_out),
      keys_(device, max_out),
      near_rows_(device, kCellRows) {}

void SampleLevel::build(ExecContext& ctx, View<const Vec3f> x_m, View<const Vec3f> n,
                        View<const float> area_m2, View<const Index> component, Count count) {
  list_.build(ctx, x_m, count);
  const CellListView cells = list_.view();
  ctx.parallel_for("contact/labels", count,
                   SampleLabels{list_.grid(), subcells_, cells.order, list_.keys(), x_m, n, labels_.view()});
  ctx.parallel_for("contact/reference_nodes", count,
                   SampleReferenceNodes{cells.ranges, list_.keys(), labels_.const_view(), flags_.view()});
  ctx.compact("contact/reference_nodes", count, flags_.const_view(), reference_nodes_.view(),
              reference_node_count_.view());
  ctx.parallel_for(
      "contact/limit", 1,
      LimitCount{reference_node_count_.const_view(), x_m_.size(), count_.view(), overflow_.view()});
  ctx.parallel_for("contact/merge", this->count(),
                   MergeSamples{reference_nodes_.const_view(), cells.ranges, cells.order, list_.keys(),
                                labels_.const_view(), x_m, n, area_m2, component, x_m_.view(), n_.view(),
                                area_m2_.view(), component_.view(), keys_.view()});
  // ReferenceNodes are in the order of slots, so merged samples are already sorted by cells.
  find_cell_ranges(ctx, keys_.const_view(), this->count(), list_.grid(), begin_.view(), end_.view());
  ctx.parallel_for("contact/near_rows", kRowCells, NearRows{end_.const_view(), near_rows_.view()});
}

SamplesView SampleLevel::view() const {
  return {x_m_.const_view(),
          n_.const_view(),
          area_m2_.const_view(),
          component_.const_view(),
          {list_.grid(), begin_.const_view(), end_.const_view()},
          near_rows_.const_view(),
          count_.const_view()};
}

}  // namespace tactus
