#include "tactus/contact/body_points.h"

#include <algorithm>
#include <string>

#include "tactus/contact/response_kernels.h"

namespace tactus {

BodyPoints::BodyPoints(ExecContext& ctx, std::span<const EmbeddedPoint> points, Index node_count,
                       float lattice_spacing_m)
    : lattice_spacing_m_(lattice_spacing_m) {
  const auto at = [](Index i) { return static_cast<std::size_t>(i); };
  std::vector<Index> leaders, count(at(node_count));
  for (std::size_t p = 0; p < points.size(); ++p) {
    leaders.push_back(points[p].node[0]);
    for (int k = 0; k < 8; ++k) {
      const Index node = points[p].node[k];
      if (node < 0 || node >= node_count) {
        throw Error("contact: point " + std::to_string(p) + " moves with node " + std::to_string(node) +
                    ", the body has " + std::to_string(node_count));
      }
      if (points[p].weight[k] != 0) ++count[at(node)];
    }
  }
  std::vector<Index> nodes, first{0}, place(at(node_count), -1);
  for (Index i = 0; i < node_count; ++i) {
    if (count[at(i)] == 0) continue;
    place[at(i)] = first.back();
    nodes.push_back(i);
    first.push_back(first.back() + count[at(i)]);
  }
  std::vector<Index> incident(at(first.back()));
  for (std::size_t p = 0; p < points.size(); ++p) {
    for (int k = 0; k < 8; ++k) {
      if (points[p].weight[k] != 0)
        incident[at(place[at(points[p].node[k])]++)] = 8 * static_cast<Index>(p) + k;
    }
  }
  points_ = to_device(ctx, points);
  leaders_ = to_device(ctx, leaders);
  nodes_ = to_device(ctx, nodes);
  first_ = to_device(ctx, first);
  incident_ = to_device(ctx, incident);
  const auto n = static_cast<std::int64_t>(points.size());
  touching_ = Buffer<Index>(ctx.device(), n);
  recorded_ = Buffer<Index>(ctx.device(), n);
  contact_ = Buffer<PointContact>(ctx.device(), n);
  records_ = Buffer<ContactRecord>(ctx.device(), n);
  node_weight_ = Buffer<std::uint32_t>(ctx.device(), node_count);
  totals_ = Buffer<ContactRecord>(ctx.device(), kOwners);
  moved_on_ = Buffer<ReactionSums>(ctx.device(), kOwners);
  owner_used_ = Buffer<std::uint32_t>(ctx.device(), kOwners);
  reset(ctx);
  ctx.synchronize();
}

void BodyPoints::reset(ExecContext& ctx) {
  ctx.fill_bytes(touching_.view(), 0);
  ctx.fill_bytes(recorded_.view(), 0);
  ctx.fill_bytes(node_weight_.view(), 0);
  ctx.fill_bytes(moved_on_.view(), 0);
  ctx.fill_bytes(owner_used_.view(), 0);
  ctx.fill_bytes(totals_.view(), 0);
}

void BodyPoints::end_frame(ExecContext& ctx) {
  ctx.parallel_for("contact/totals", kOwners,
                   SumRecords{recorded_.const_view(), records_.const_view(), moved_on_.view(),
                              owner_used_.view(), totals_.view()});
}

PointTable BodyPoints::table() const {
  return {points_.const_view(), leaders_.const_view(), nodes_.const_view(), first_.const_view(),
          incident_.const_view()};
}

PointState BodyPoints::state() {
  return {touching_.view(), contact_.view(),  node_weight_.view(), recorded_.view(),
          records_.view(),  moved_on_.view(), owner_used_.view()};
}

}  // namespace tactus
