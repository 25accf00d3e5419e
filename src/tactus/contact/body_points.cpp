#include "tactus/contact/body_points.h"

#include <algorithm>
#include <set>
#include <string>

#include "tactus/contact/response_kernels.h"

namespace tactus {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

BodyPoints::BodyPoints(ExecContext& ctx, std::span<const EmbeddedPoint> points, Index node_count,
                       float lattice_spacing_m, Index first_part, std::span<const NodeShare> share)
    : lattice_spacing_m_(lattice_spacing_m), node_count_(node_count) {
  std::vector<Index> count(at(node_count));
  for (std::size_t p = 0; p < points.size(); ++p) {
    for (int k = 0; k < 8; ++k) {
      const Index node = points[p].node[k];
      if (node < 0 || node >= node_count) {
        throw Error("contact: point " + std::to_string(p) + " moves with node " + std::to_string(node) +
                    ", the body has " + std::to_string(node_count));
      }
      if (points[p].weight[k] != 0) ++count[at(node)];
    }
  }
  std::vector<Index> nodes, first{0}, place(at(node_count)), row(at(node_count)), rows;
  const auto add_rows = [&](NodeShare wanted) {
    for (Index i = 0; i < node_count; ++i) {
      if (count[at(i)] == 0 || (share.empty() ? NodeShare::own : share[at(i)]) != wanted) continue;
      place[at(i)] = first.back();
      row[at(i)] = static_cast<Index>(nodes.size());
      nodes.push_back(i);
      first.push_back(first.back() + count[at(i)]);
    }
    return static_cast<Index>(nodes.size());
  };
  own_rows_ = add_rows(NodeShare::own);
  moved_rows_ = add_rows(NodeShare::copy);
  add_rows(NodeShare::outside);
  std::vector<Index> incident(at(first.back()));
  for (std::size_t p = 0; p < points.size(); ++p) {
    for (int k = 0; k < 8; ++k) {
      rows.push_back(row[at(points[p].node[k])]);
      if (points[p].weight[k] != 0)
        incident[at(place[at(points[p].node[k])]++)] = 8 * static_cast<Index>(p) + k;
    }
  }
  points_ = to_device(ctx, points);
  nodes_ = to_device(ctx, nodes);
  first_ = to_device(ctx, first);
  incident_ = to_device(ctx, incident);
  rows_ = to_device(ctx, rows);
  const auto n = static_cast<std::int64_t>(points.size());
  touching_ = Buffer<Index>(ctx.device(), n);
  recorded_ = Buffer<Index>(ctx.device(), n);
  searched_ = Buffer<Index>(ctx.device(), n);
  neighbours_ = Buffer<PointNeighbours>(ctx.device(), n);
  near_ = Buffer<std::uint32_t>(ctx.device(), n * kNearTriangles);
  contact_ = Buffer<PointContact>(ctx.device(), n);
  records_ = Buffer<ContactRecord>(ctx.device(), n);
  node_weight_ = Buffer<std::uint32_t>(ctx.device(), static_cast<std::int64_t>(nodes.size()));
  totals_ = Buffer<OwnerTotals>(ctx.device(), kOwners);
  moved_on_ = Buffer<ReactionSums>(ctx.device(), kOwners);
  owner_used_ = Buffer<std::uint32_t>(ctx.device(), kOwners);
  make_blocks(ctx, points, first_part);
  reset(ctx);
  begin_frame(ctx);
  ctx.synchronize();
}

void BodyPoints::make_blocks(ExecContext& ctx, std::span<const EmbeddedPoint> points, Index first_part) {
  const auto n = static_cast<Index>(points.size());
  first_count_ = first_part;
  std::vector<Index> first, first_node{0}, nodes;
  for (Index p = 0; p < n;) {
    const Index part_end = p < first_part ? first_part : n, end = std::min(p + kBlockPoints, part_end);
    first.push_back(p);
    std::set<Index> of_block;
    for (; p < end; ++p) {
      for (int k = 0; k < 8; ++k) {
        if (points[at(p)].weight[k] != 0) of_block.insert(points[at(p)].node[k]);
      }
    }
    nodes.insert(nodes.end(), of_block.begin(), of_block.end());
    first_node.push_back(static_cast<Index>(nodes.size()));
    if (p == first_part) first_blocks_ = static_cast<Index>(first.size());
  }
  const auto blocks = static_cast<std::int64_t>(first.size());
  first.push_back(n);
  block_first_ = to_device(ctx, first);
  block_first_node_ = to_device(ctx, first_node);
  block_nodes_ = to_device(ctx, nodes);
  block_pose_ = Buffer<Index>(ctx.device(), blocks);
  sleep_m_ = Buffer<float>(ctx.device(), n);
  block_x_m_ = Buffer<Vec3f>(ctx.device(), static_cast<std::int64_t>(nodes.size()));
}

/// The surface is another one, so what was found near the old one is no longer.
void BodyPoints::begin_frame(ExecContext& ctx) {
  ctx.fill_bytes(recorded_.view(), 0);
  ctx.fill_bytes(searched_.view(), 0xff);
  ctx.fill_bytes(block_pose_.view(), 0xff);
}

void BodyPoints::reset(ExecContext& ctx) {
  ctx.fill_bytes(touching_.view(), 0);
  ctx.fill_bytes(recorded_.view(), 0);
  ctx.fill_bytes(node_weight_.view(), 0);
  ctx.fill_bytes(moved_on_.view(), 0);
  ctx.fill_bytes(owner_used_.view(), 0);
  ctx.fill_bytes(totals_.view(), 0);
}

void BodyPoints::archive(ExecContext& ctx, StateArchive& a) {
  std::vector<Index> touching = to_host(ctx, touching_.const_view());
  std::vector<PointContact> contact = to_host(ctx, contact_.const_view());
  a.values("touching points", touching);
  a.values("contacts", contact);
  for (std::size_t p = 0; p < touching.size(); ++p)
    a.check(touching[p] == 0 || (contact[p].owner >= 0 && contact[p].owner < kOwners), "contacts");
  a.buffer(ctx, "weights of nodes", node_weight_);
  if (!a.reads()) return;
  ctx.upload(touching, touching_.view());
  ctx.upload(contact, contact_.view());
  ctx.synchronize();
}

void BodyPoints::end_frame(ExecContext& ctx) {
  ctx.parallel_for("contact/totals", kOwners,
                   SumRecords{recorded_.const_view(), records_.const_view(), moved_on_.view(),
                              owner_used_.view(), totals_.view()});
}

PointTable BodyPoints::table() const {
  return {points_.const_view(), nodes_.const_view(), first_.const_view(), incident_.const_view(),
          rows_.const_view(),   own_rows_,           moved_rows_};
}

PointState BodyPoints::state() {
  return {touching_.view(), contact_.view(),  node_weight_.view(), searched_.view(), neighbours_.view(),
          near_.view(),     recorded_.view(), records_.view(),     moved_on_.view(), owner_used_.view()};
}

PointBlocks BodyPoints::blocks() {
  return {block_first_.const_view(), block_first_node_.const_view(),
          block_nodes_.const_view(), block_pose_.view(),
          block_x_m_.view(),         sleep_m_.view()};
}

}  // namespace tactus
