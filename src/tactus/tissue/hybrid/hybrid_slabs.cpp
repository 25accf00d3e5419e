#include "tactus/tissue/hybrid/hybrid_slabs.h"

#include <algorithm>
#include <numeric>

#include "tactus/base/error.h"

namespace tactus {
namespace {

/// What a shape-matched node costs over an element: 8 times as much on an H200, 6 on a CPU.
constexpr double kMatchedCost = 7;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

std::vector<Slab> choose_slabs(const DeviceSet& devices, const CubeLattice& lattice,
                               const ElementMask& elements, int half_width,
                               std::optional<double> least_elements) {
  std::vector<double> cost(static_cast<std::size_t>(lattice.node_dims.z));
  bool has_elements = false, matches = false;
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    const bool element = elements.empty() || elements[c] != 0;
    cost[static_cast<std::size_t>(lattice.cubes[c].z)] += element ? 1 : kMatchedCost;
    (element ? has_elements : matches) = true;
  }
  const double all = std::accumulate(cost.begin(), cost.end(), 0.0);
  const double worthwhile = !matches       ? HybridSlabs::kLeastElements
                            : has_elements ? HybridSlabs::kLeastOfBoth
                                           : kMatchedCost * HybridSlabs::kLeastMatched;
  const double least_cost = least_elements.value_or(devices.is_cuda() ? worthwhile : 0);
  const int count =
      least_cost > 0
          ? static_cast<int>(std::clamp(all / least_cost, 1.0, static_cast<double>(devices.count())))
          : devices.count();
  if (!matches) return split_by_cost(cost, count, 1, 2);
  // Wide enough that neighbours' nodes are the next slab's, at multiples of what sums slide along.
  const Index deepest = FlsmGrid::kChunk + max(2 * half_width, FlsmGrid::kChunk);
  const Index least = ceil_div(deepest, FlsmGrid::kChunk) * FlsmGrid::kChunk;
  return split_by_cost(cost, count, FlsmGrid::kChunk, least);
}

}  // namespace

HybridSlabs::Part::Part(ExecContext& context, Hybrid model, const CubeLattice& lattice,
                        const BoundaryConditions& conditions)
    : ctx(context),
      beside(context.device()),
      tissue(std::move(model)),
      boundary(ctx, lattice, conditions, tissue.window()),
      watch(ctx, tissue.window().own.count()) {
  const std::vector<Vec3f> rest = lattice.rest_positions_m();
  const Slab window = tissue.window().held;
  const std::vector<Vec3f> zero(static_cast<std::size_t>(window.count()));
  state = {to_device(ctx, std::span(rest).subspan(static_cast<std::size_t>(window.begin), zero.size())),
           to_device(ctx, zero), to_device(ctx, zero)};
  stopped = to_device(ctx, std::vector<Index>{0});
}

HybridSlabs::HybridSlabs(DeviceSet& devices, const CubeLattice& lattice, const ElementMask& elements,
                         std::span<const ElasticMaterial> materials,
                         std::span<const std::uint8_t> material_of_cube, const TledOptions& tled,
                         const FlsmMaterial& flsm, std::optional<double> least_elements,
                         const BoundaryConditions& conditions)
    : devices_(devices), motion_count_(conditions.motions.size()), has_boundary_(!conditions.empty()) {
  const std::vector<Slab> slabs = choose_slabs(devices, lattice, elements, flsm.half_width, least_elements);
  for (std::size_t p = 0; p < slabs.size(); ++p) {
    ExecContext& ctx = devices.context(static_cast<int>(p));
    parts_.push_back(std::make_unique<Part>(
        ctx, Hybrid(ctx, lattice, elements, materials, material_of_cube, tled, flsm, slabs[p]), lattice,
        conditions));
  }
  if (parts_.size() > 1) {
    const std::vector<Vec3f> zero(lattice.nodes.size());
    body_.x_m = to_device(devices.context(0), lattice.rest_positions_m());
    body_.v_m_s = to_device(devices.context(0), zero);
  }
  if (!stays_in_cells()) return;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    Part& part = *parts_[p];
    const auto& [window, own] = part.tissue.window();
    if (p > 0) part.ghosts[0] = find_ghosts(p, p - 1, {window.begin, window.begin + own.begin});
    if (p + 1 < parts_.size()) part.ghosts[1] = find_ghosts(p, p + 1, {window.begin + own.end, window.end});
  }
}

template <class F>
void HybridSlabs::for_neighbours(std::size_t part, F&& body) {
  if (part > 0) body(*parts_[part - 1]);
  if (part + 1 < parts_.size()) body(*parts_[part + 1]);
}

/// Of all parts, once their neighbours have moved.
template <class F>
void HybridSlabs::for_each_pull(F&& pull_part) {
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    for_neighbours(p, [&](Part& neighbour) { parts_[p]->ctx.wait(neighbour.moved); });
    pull_part(p);
    parts_[p]->ctx.record(parts_[p]->pulled);
  }
}

/// @param nodes of the body
hybrid::PullNodes::Neighbour HybridSlabs::nodes_of(std::size_t neighbour, Slab nodes) const {
  const Part& part = *parts_[neighbour];
  const Index first = nodes.begin - part.tissue.window().held.begin;
  return {part.state.x_m.const_view().part(first, nodes.count()),
          part.state.v_m_s.const_view().part(first, nodes.count())};
}

void HybridSlabs::pull(std::size_t index) {
  Part& part = *parts_[index];
  const auto& [window, own] = part.tissue.window();
  hybrid::PullNodes kernel{.below = {},
                           .above = {},
                           .x_m = part.state.x_m.view(),
                           .v_m_s = part.state.v_m_s.view(),
                           .first_above = own.end};
  if (index > 0) kernel.below = nodes_of(index - 1, {window.begin, window.begin + own.begin});
  if (index + 1 < parts_.size()) kernel.above = nodes_of(index + 1, {window.begin + own.end, window.end});
  const auto copy = [&](const hybrid::PullNodes::Neighbour& from, Index to) {
    const Index count = from.x_m.size();
    if (count == 0) return;
    part.ctx.copy(from.x_m, part.state.x_m.view().part(to, count));
    part.ctx.copy(from.v_m_s, part.state.v_m_s.view().part(to, count));
  };
  if (devices_.reads_peers()) {
    part.ctx.parallel_for("hybrid/pull", kernel.below.x_m.size() + kernel.above.x_m.size(), kernel);
  } else {
    copy(kernel.below, 0);
    copy(kernel.above, own.end);
  }
}

/// @param nodes of the body
HybridSlabs::Ghosts HybridSlabs::find_ghosts(std::size_t index, std::size_t neighbour, Slab nodes) {
  Part& part = *parts_[index];
  Part& other = *parts_[neighbour];
  const auto cells_of = [&](Part& p) {
    return p.tissue.tled().cell().part(nodes.begin - p.tissue.window().held.begin, nodes.count());
  };
  std::vector<Index> there = to_host(other.ctx, cells_of(other));
  const auto [least, most] = std::minmax_element(there.begin(), there.end());
  Ghosts ghosts{.of = neighbour, .first_cell = *least, .from_cell = {}, .cell = cells_of(part), .copy_m = {}};
  if (!devices_.reads_peers()) ghosts.copy_m = Buffer<float>(part.ctx.device(), 3 * (*most + 1 - *least));
  for (Index& cell : there) cell -= ghosts.first_cell;
  ghosts.from_cell = to_device(part.ctx, there);
  return ghosts;
}

void HybridSlabs::pull_positions(std::size_t index, int k) {
  Part& part = *parts_[index];
  Tled& tled = part.tissue.tled();
  hybrid::PullPositions kernel{.below = {}, .above = {}, .ahead_m = tled.ahead_m(k), .cells = tled.cells()};
  hybrid::PullPositions::Neighbour* to[] = {&kernel.below, &kernel.above};
  for (int side = 0; side < 2; ++side) {
    Ghosts& ghosts = part.ghosts[at(side)];
    if (ghosts.cell.empty()) continue;
    Tled& other = parts_[ghosts.of]->tissue.tled();
    const View<const float> there = other.ahead_m(k);
    View<const float> from = there.part(ghosts.first_cell, there.size() - ghosts.first_cell);
    Index cells = other.cells();
    if (!ghosts.copy_m.empty()) {
      const Index count = ghosts.copy_m.size() / 3;
      for (Index a = 0; a < 3; ++a)
        part.ctx.copy(from.part(a * cells, count), ghosts.copy_m.view().part(a * count, count));
      from = ghosts.copy_m.const_view();
      cells = count;
    }
    *to[side] = {from, cells, ghosts.from_cell.const_view(), ghosts.cell};
  }
  part.ctx.parallel_for("hybrid/pull_positions", kernel.below.cell.size() + kernel.above.cell.size(), kernel);
}

void HybridSlabs::begin_frame() {
  for (auto& part : parts_) {
    part->boundary.begin_frame(part->ctx);
    part->watch.begin_frame(part->ctx);
  }
}

void HybridSlabs::step(const HybridStep& step, int count) {
  for (auto& part : parts_) part->tissue.check_step(step, count);
  begin_substeps();
  for (int k = 0; k < count; ++k) {
    substep(step, k, count);
    if (has_boundary_) watch(k, count);
  }
  end_substeps(count);
}

HybridStep HybridSlabs::on_part(const HybridStep& step, std::size_t part) const {
  HybridStep own = step;
  if (frame_ != nullptr) {
    own.frame = frame_->view(static_cast<int>(part));
    own.stopped = parts_[part]->stopped.const_view();
  }
  return own;
}

void HybridSlabs::begin_substeps() {
  if (!stays_in_cells()) return;
  for (auto& part : parts_) part->tissue.tled().load(part->ctx, part->state);
}

void HybridSlabs::end_substeps(int count) {
  if (!stays_in_cells()) return;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    Part& part = *parts_[p];
    part.tissue.tled().store(part.ctx, part.state, count, on_part({}, p).frame);
  }
}

void HybridSlabs::substep_in_cells(const HybridStep& step, int k, int count) {
  if (parts_.size() == 1) {
    Part& only = *parts_.front();
    return only.tissue.tled().move(only.ctx, elements_step(on_part(step, 0)), k, Tled::Tiles::all);
  }
  if (k == 0) {
    for (auto& part : parts_) {
      part->ctx.record(part->moved);
      part->beside.wait(part->moved);
      part->beside.record(part->interior_moved);
    }
  }
  for_each_pull([&](std::size_t p) { pull_positions(p, k); });
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    Part& part = *parts_[p];
    const TledStep tled = elements_step(on_part(step, p));
    // Each half reads what the other moved in the last substep, and overwrites what it read then.
    part.beside.wait(part.moved);
    part.ctx.wait(part.interior_moved);
    for_neighbours(p, [&](Part& neighbour) { part.ctx.wait(neighbour.pulled); });
    part.tissue.tled().move(part.ctx, tled, k, Tled::Tiles::edges);
    part.ctx.record(part.moved);
    part.tissue.tled().move(part.beside, tled, k, Tled::Tiles::interior);
    part.beside.record(part.interior_moved);
    if (k + 1 == count) part.ctx.wait(part.interior_moved);
  }
}

void HybridSlabs::substep(const HybridStep& step, int k, int count) {
  if (stays_in_cells()) return substep_in_cells(step, k, count);
  if (k == 0)
    for (auto& part : parts_) part->ctx.record(part->moved);
  for_each_pull([&](std::size_t p) { pull(p); });
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    Part& part = *parts_[p];
    const HybridStep own = on_part(step, p);
    part.boundary.load(part.ctx, part.state, own.time());
    part.tissue.sum_forces(part.ctx, part.state, own, k);
    for_neighbours(p, [&](Part& neighbour) { part.ctx.wait(neighbour.pulled); });
    part.tissue.move(part.ctx, part.state, own, k);
    part.boundary.move(part.ctx, part.state, own.time());
    part.ctx.record(part.moved);
  }
}

void HybridSlabs::look(int k, int every) {
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    if (frame_ != nullptr)
      parts_[p]->look(frame_->view(static_cast<int>(p)), every);
    else
      parts_[p]->look(k);
  }
}

void HybridSlabs::watch(int k, int count) {
  if (stays_in_cells()) return;
  if (frame_ != nullptr || (k + 1 < count && (k + 1) % watch_every() == 0)) look(k, watch_every());
}

void HybridSlabs::end_frame(int count) {
  look(count - 1, 1);
  for (auto& part : parts_) {
    part->watch.summarise(part->ctx);
    part->ctx.record(part->moved);
  }
  if (model().has_elements()) {
    for_each_pull([&](std::size_t p) { pull(p); });
    for (auto& part : parts_) part->tissue.find_extremes(part->ctx, part->state);
  }
  if (parts_.size() == 1) return;
  ExecContext& first = devices_.context(0);
  for (auto& part : parts_) {
    first.wait(part->moved);
    const auto copy = [&](const Buffer<Vec3f>& from, Buffer<Vec3f>& to) {
      first.copy(part->own(from), to.view().part(part->first_own(), part->tissue.window().own.count()));
    };
    copy(part->state.x_m, body_.x_m);
    copy(part->state.v_m_s, body_.v_m_s);
  }
  // What comes next must not overwrite what is still being copied.
  first.record(stored_);
  for (auto& part : parts_) part->ctx.wait(stored_);
}

void HybridSlabs::add_reports(Readback& readback) {
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    Part& part = *parts_[p];
    part.watch_report = readback.add(part.watch.summary(), static_cast<int>(p));
    part.extremes_report = readback.add(part.tissue.tled().extremes(), static_cast<int>(p));
  }
}

WatchRecord HybridSlabs::watched(const Readback* readback) {
  WatchRecord all;
  for (auto& part : parts_) {
    const WatchRecord own = readback != nullptr ? readback->get<WatchRecord>(part->watch_report)[0]
                                                : to_host(part->ctx, part->watch.summary())[0];
    all.add(own, part->first_own());
  }
  return all;
}

tled::CubeExtremes HybridSlabs::extremes(const Readback* readback) {
  tled::CubeExtremes worst = tled::FindExtremes::kNone;
  for (auto& part : parts_) {
    const auto own = readback != nullptr ? readback->get<tled::CubeExtremes>(part->extremes_report)[0]
                                         : to_host(part->ctx, part->tissue.tled().extremes())[0];
    worst = tled::FindExtremes::worse(worst, part->tissue.in_body(own));
  }
  return worst;
}

void HybridSlabs::stop() {
  const Index yes = 1;
  for (auto& part : parts_) {
    part->ctx.upload({&yes, 1}, part->stopped.view());
    part->ctx.synchronize();
  }
}

std::vector<Vec3d> HybridSlabs::motion_forces_N(double dt_frame_s) {
  std::vector<Vec3d> forces(motion_count_);
  for (auto& part : parts_) part->boundary.driven().add_mean_forces_N(part->ctx, dt_frame_s, forces);
  return forces;
}

void HybridSlabs::set_state(std::span<const Vec3f> x_m, std::span<const Vec3f> v_m_s) {
  for (auto& part : parts_) {
    const Slab window = part->tissue.window().held;
    const auto first = static_cast<std::size_t>(window.begin),
               count = static_cast<std::size_t>(window.count());
    part->ctx.upload(x_m.subspan(first, count), part->state.x_m.view());
    part->ctx.upload(v_m_s.subspan(first, count), part->state.v_m_s.view());
  }
  for (auto& part : parts_) part->ctx.synchronize();
}

std::vector<Vec3f> HybridSlabs::all_of(Buffer<Vec3f> BodyState::*field) {
  std::vector<Vec3f> all;
  for (auto& part : parts_) {
    const std::vector<Vec3f> some = to_host(part->ctx, part->own(part->state.*field));
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

std::vector<Vec3f> HybridSlabs::positions_m() { return all_of(&BodyState::x_m); }
std::vector<Vec3f> HybridSlabs::velocities_m_s() { return all_of(&BodyState::v_m_s); }

}  // namespace tactus
