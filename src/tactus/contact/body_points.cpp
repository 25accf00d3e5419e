#include "tactus/contact/body_points.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>

#include "tactus/base/at.h"
#include "tactus/contact/response_kernels.h"

namespace tactus {
namespace {

void check_node(Index point, Index node, Index count) {
  if (node < 0 || node >= count)
    throw Error("contact: point " + std::to_string(point) + " moves with node " + std::to_string(node) +
                ", the body has " + std::to_string(count));
}

/// That move points, ascending.
std::vector<Index> nodes_of(std::span<const EmbeddedPoint> points) {
  std::vector<Index> nodes;
  for (const EmbeddedPoint& point : points)
    for (int k = 0; k < 8; ++k)
      if (point.weight[k] != 0) nodes.push_back(point.node[k]);
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

}  // namespace

BodyPoints::BodyPoints(ExecContext& ctx, std::span<const EmbeddedPoint> points, Index node_count,
                       float lattice_spacing_m, Index first_part, std::span<const NodeShare> share,
                       Index capacity)
    : lattice_spacing_m_(lattice_spacing_m),
      node_count_(node_count),
      first_count_(first_part),
      capacity_(capacity) {
  for (std::size_t p = 0; p < points.size(); ++p)
    for (const Index node : points[p].node) check_node(static_cast<Index>(p), node, node_count);
  make_rows(ctx, points, share);
  points_ = to_device(ctx, points);
  const auto n = static_cast<std::int64_t>(points.size());
  touching_ = Buffer<Index>(ctx.device(), n);
  recorded_ = Buffer<Index>(ctx.device(), n);
  searched_ = Buffer<Index>(ctx.device(), n);
  awake_ = Buffer<Index>(ctx.device(), n);
  awake_count_ = Buffer<Index>(ctx.device(), 1);
  mass_kg_ = Buffer<float>(ctx.device(), n);
  neighbours_ = Buffer<PointNeighbours>(ctx.device(), n);
  near_ = Buffer<std::uint32_t>(ctx.device(), n * kNearTriangles);
  contact_ = Buffer<PointContact>(ctx.device(), n);
  records_ = Buffer<ContactRecord>(ctx.device(), n);
  node_weight_ = Buffer<std::uint32_t>(ctx.device(), nodes_.size());
  totals_ = Buffer<ColliderTotals>(ctx.device(), kColliders);
  moved_on_ = Buffer<ReactionSums>(ctx.device(), kColliders);
  collider_used_ = Buffer<std::uint32_t>(ctx.device(), kColliders);
  make_blocks(ctx, points);
  if (capacity > 0) {
    host_points_.assign(points.begin(), points.end());
    changes_ = Buffer<SetPoints::Change>(ctx.device(), n);
    sides_ = Buffer<WallSide>(ctx.device(), n);
    ctx.fill_bytes(sides_.view(), 0);
    make_used(ctx);
  }
  reset(ctx);
  begin_frame(ctx);
  ctx.synchronize();
}

/// Where points may come, every node has a row.
void BodyPoints::make_rows(ExecContext& ctx, std::span<const EmbeddedPoint> points,
                           std::span<const NodeShare> share) {
  std::vector<std::vector<Index>> of_node(at(node_count_)), lists;
  for (std::size_t p = 0; p < points.size(); ++p)
    for (int k = 0; k < 8; ++k)
      if (points[p].weight[k] != 0) of_node[at(points[p].node[k])].push_back(8 * static_cast<Index>(p) + k);
  std::vector<Index> nodes, rows;
  row_of_.assign(at(node_count_), 0);
  const auto add_rows = [&](NodeShare wanted) {
    for (Index i = 0; i < node_count_; ++i) {
      if ((capacity_ == 0 && of_node[at(i)].empty()) ||
          (share.empty() ? NodeShare::own : share[at(i)]) != wanted)
        continue;
      row_of_[at(i)] = static_cast<Index>(nodes.size());
      nodes.push_back(i);
      lists.push_back(std::move(of_node[at(i)]));
    }
    return static_cast<Index>(nodes.size());
  };
  own_rows_ = add_rows(NodeShare::own);
  moved_rows_ = add_rows(NodeShare::copy);
  add_rows(NodeShare::outside);
  for (const EmbeddedPoint& point : points)
    for (const Index node : point.node) rows.push_back(row_of_[at(node)]);
  nodes_ = to_device(ctx, nodes);
  rows_ = to_device(ctx, rows);
  incident_ = IndexLists(ctx, lists, capacity_ > 0 ? 8 * static_cast<Index>(points.size()) : 0);
}

void BodyPoints::make_blocks(ExecContext& ctx, std::span<const EmbeddedPoint> points) {
  const auto n = static_cast<Index>(points.size());
  std::vector<std::vector<Index>> lists;
  for (Index p = 0; p < n;) {
    if (p == first_count_) first_blocks_ = static_cast<Index>(host_blocks_.size());
    const Index part_end = p < first_count_ ? first_count_ : n, end = std::min(p + kBlockPoints, part_end),
                used = p < first_count_ ? std::clamp(first_count_ - capacity_, p, end) : end;
    host_blocks_.push_back({p, used});
    lists.push_back(nodes_of(points.subspan(at(p), at(used - p))));
    p = end;
  }
  if (first_count_ == n) first_blocks_ = static_cast<Index>(host_blocks_.size());
  blocks_ = to_device(ctx, host_blocks_);
  block_nodes_ = IndexLists(ctx, lists, capacity_ > 0 ? 8 * n : 0);
  block_pose_ = Buffer<Index>(ctx.device(), blocks_.size());
  sleep_m_ = Buffer<float>(ctx.device(), n);
  block_x_m_ = Buffer<Vec3f>(ctx.device(), block_nodes_.capacity());
}

void BodyPoints::make_used(ExecContext& ctx) {
  std::vector<bool> blocks, rows(at(ceil_div(nodes_.size(), kRowGroup)));
  for (const IndexRange& points : host_blocks_) blocks.push_back(points.begin < points.end);
  for (Index row = 0; row < nodes_.size(); ++row)
    if (!incident_[row].empty()) rows[at(row / kRowGroup)] = true;
  used_blocks_ = UsedList(ctx, blocks, first_blocks_, kBlockPoints);
  used_rows_ = UsedList(ctx, rows, 0, kRowGroup);
}

void BodyPoints::apply(ExecContext& ctx, std::span<const PointChange> changes) {
  if (changes.empty()) return;
  searched_in_ = -1;
  check(changes);
  change_rows(changes);
  std::vector<SetPoints::Change> set;
  for (const PointChange& change : changes) {
    host_points_[at(change.point)] = change.to;
    set.push_back({change.point, change.to, {}, change.side});
    for (std::size_t k = 0; k < 8; ++k) set.back().rows[k] = row_of_[at(change.to.node[k])];
  }
  change_blocks(changes);
  const View<SetPoints::Change> staged = changes_.view().part(0, static_cast<Index>(set.size()));
  ctx.upload(set, staged);
  ctx.parallel_for(
      "contact/set_points", staged.size(),
      SetPoints{View<const SetPoints::Change>(staged), points_.view(), rows_.view(), sides_.view()});
  incident_.upload(ctx);
  block_nodes_.upload(ctx);
  ctx.upload(host_blocks_, blocks_.view());
  used_blocks_.upload(ctx);
  used_rows_.upload(ctx);
  weigh_rows(ctx);
  ctx.synchronize();
}

void BodyPoints::weigh_rows(ExecContext& ctx) {
  ctx.parallel_for("contact/weigh_rows", used_rows_.member_count(0),
                   WeighRows{used_rows_.view(), incident_.ranges(), incident_.values(), points_.const_view(),
                             touching_.const_view(), node_weight_.view()});
}

void BodyPoints::check(std::span<const PointChange> changes) const {
  Index next = first_count_ - capacity_;
  for (const PointChange& change : changes) {
    for (const Index node : change.to.node) check_node(change.point, node, node_count_);
    const bool is_known = change.point >= 0 && change.point < static_cast<Index>(host_points_.size()) &&
                          (change.point < next || change.point >= first_count_);
    if (!is_known && (change.point != next || next >= first_count_))
      throw Error("contact: point " + std::to_string(change.point) + " is not there, and not the next of " +
                  std::to_string(first_count_) + " that there is capacity for");
    next += is_known ? 0 : 1;
  }
}

/// Entries stay ascending, so sums over points keep their order.
void BodyPoints::change_rows(std::span<const PointChange> changes) {
  std::map<Index, std::vector<Index>> lists;
  const auto list = [&](Index row) -> std::vector<Index>& {
    const auto [place, is_new] = lists.try_emplace(row);
    if (is_new) place->second.assign(incident_[row].begin(), incident_[row].end());
    return place->second;
  };
  for (const PointChange& change : changes) {
    const EmbeddedPoint& before = host_points_[at(change.point)];
    for (int k = 0; k < 8; ++k)
      if (before.weight[k] != 0) std::erase(list(row_of_[at(before.node[k])]), 8 * change.point + k);
    for (int k = 0; k < 8; ++k)
      if (change.to.weight[k] != 0) list(row_of_[at(change.to.node[k])]).push_back(8 * change.point + k);
  }
  for (auto& [row, entries] : lists) {
    std::sort(entries.begin(), entries.end());
    incident_.set(row, entries);
    if (!entries.empty()) used_rows_.add(row / kRowGroup);
  }
}

void BodyPoints::change_blocks(std::span<const PointChange> changes) {
  std::set<Index> blocks;
  for (const PointChange& change : changes) {
    const Index block = change.point < first_count_
                            ? change.point / kBlockPoints
                            : first_blocks_ + (change.point - first_count_) / kBlockPoints;
    blocks.insert(block);
    IndexRange& points = host_blocks_[at(block)];
    used_blocks_.add(block);
    if (change.point < points.end) continue;
    points.end = change.point + 1;
    --capacity_;
  }
  for (const Index block : blocks) {
    const IndexRange points = host_blocks_[at(block)];
    block_nodes_.set(
        block, nodes_of(std::span(host_points_).subspan(at(points.begin), at(points.end - points.begin))));
  }
}

void BodyPoints::begin_frame(ExecContext& ctx, ContactFrame frame) {
  ctx.fill_bytes(recorded_.view(), 0);
  const bool was_searched = searched_in_ >= 0 && searched_in_ == frame.number - 1;
  searched_in_ = frame.number;
  if (was_searched && !frame.is_new) return;
  ctx.fill_bytes(searched_.view(), 0xff);
  ctx.fill_bytes(block_pose_.view(), 0xff);
}

void BodyPoints::reset(ExecContext& ctx) {
  searched_in_ = -1;
  ctx.fill_bytes(touching_.view(), 0);
  ctx.fill_bytes(recorded_.view(), 0);
  ctx.fill_bytes(node_weight_.view(), 0);
  ctx.fill_bytes(moved_on_.view(), 0);
  ctx.fill_bytes(collider_used_.view(), 0);
  ctx.fill_bytes(awake_count_.view(), 0);
  ctx.fill_bytes(totals_.view(), 0);
}

/// For the points that there are: another body may have another capacity for more. Where there is some,
/// places of nodes follow it, too, so weights are worked out anew.
void BodyPoints::archive(ExecContext& ctx, StateArchive& a) {
  std::vector<Index> touching = to_host(ctx, touching_.const_view());
  std::vector<PointContact> contact = to_host(ctx, contact_.const_view());
  const auto archive_used = [&](const char* name, auto& of_points) {
    const auto free_begin = of_points.begin() + (first_count_ - capacity_), free_end = free_begin + capacity_;
    auto used = of_points;
    used.erase(used.begin() + (first_count_ - capacity_), used.begin() + first_count_);
    a.values(name, used);
    std::copy_n(used.begin(), first_count_ - capacity_, of_points.begin());
    std::copy(used.begin() + (free_begin - of_points.begin()), used.end(), free_end);
  };
  archive_used("touching points", touching);
  archive_used("contacts", contact);
  for (std::size_t p = 0; p < touching.size(); ++p)
    a.check(touching[p] == 0 || (contact[p].collider >= 0 && contact[p].collider < kColliders), "contacts");
  const bool may_be_cut = !host_points_.empty();
  if (!may_be_cut) a.buffer(ctx, "weights of nodes", node_weight_);
  if (!a.reads()) return;
  searched_in_ = -1;
  ctx.upload(touching, touching_.view());
  ctx.upload(contact, contact_.view());
  if (may_be_cut) weigh_rows(ctx);
  ctx.synchronize();
}

void BodyPoints::end_frame(ExecContext& ctx) {
  ctx.parallel_for("contact/totals", kColliders,
                   SumRecords{used_points(), recorded_.const_view(), records_.const_view(), moved_on_.view(),
                              collider_used_.view(), totals_.view()});
}

PointTable BodyPoints::table() const {
  return {points_.const_view(), nodes_.const_view(), incident_.ranges(), incident_.values(),
          rows_.const_view(),   sides_.const_view(), own_rows_,          moved_rows_,
          used_rows_.view()};
}

PointState BodyPoints::state() {
  return {touching_.view(),      contact_.view(),    node_weight_.view(),
          searched_.view(),      neighbours_.view(), near_.view(),
          recorded_.view(),      records_.view(),    moved_on_.view(),
          collider_used_.view(), mass_kg_.view(),    {awake_.view(), awake_count_.view()}};
}

PointBlocks BodyPoints::blocks() {
  return {used_blocks_.view(), blocks_.const_view(), block_nodes_.ranges(), block_nodes_.values(),
          block_pose_.view(),  block_x_m_.view(),    sleep_m_.view()};
}

}  // namespace tactus
