#include "tactus/tissue/hybrid/body_solver.h"

#include <algorithm>
#include <numeric>

#include "tactus/base/error.h"
#include "tactus/tissue/hybrid/hybrid_kernels.h"
#include "tactus/tissue/summary_kernels.h"
#include "tactus/tissue/topology_kernels.h"

namespace tactus {
namespace {

/// Cost of a shape-matched node over that of an element: 8 on an H200, 6 on a CPU.
constexpr double kMatchedCost = 7;

std::vector<Slab> choose_slabs(const DeviceSet& devices, const BodyModel& model,
                               std::optional<double> least_elements, Index shared) {
  const CubeLattice& lattice = model.lattice;
  std::vector<double> cost(static_cast<std::size_t>(lattice.node_dims.z));
  bool has_elements = false, matches = false;
  for (std::size_t c = 0; c < static_cast<std::size_t>(lattice.regular_cubes()); ++c) {
    const bool element = model.elements.empty() || model.elements[c] != 0;
    cost[static_cast<std::size_t>(lattice.cubes[c].z)] += element ? 1 : kMatchedCost;
    (element ? has_elements : matches) = true;
  }
  const double all = std::accumulate(cost.begin(), cost.end(), 0.0);
  const double worthwhile = !matches       ? BodySolver::kLeastElements
                            : has_elements ? BodySolver::kLeastOfBoth
                                           : kMatchedCost * BodySolver::kLeastMatched;
  const double least_cost = least_elements.value_or(devices.is_cuda() ? worthwhile : 0);
  const int count =
      least_cost > 0
          ? static_cast<int>(std::clamp(all / least_cost, 1.0, static_cast<double>(devices.count())))
          : devices.count();
  // Wide enough that neighbours' nodes are the next slab's.
  if (!matches) return split_by_cost(cost, count, 1, max(1 + shared, Index{2}));
  // Likewise, at multiples of the chunks along which sums slide.
  const Index deepest = FlsmGrid::kChunk + max(2 * model.flsm.half_width + shared, FlsmGrid::kChunk);
  const Index least = ceil_div(deepest, FlsmGrid::kChunk) * FlsmGrid::kChunk;
  return split_by_cost(cost, count, FlsmGrid::kChunk, least);
}

}  // namespace

BodySolver::Part::Part(ExecContext& context, Hybrid of_layers, const BodyModel& model)
    : ctx(context),
      beside(context.device()),
      tissue(std::move(of_layers)),
      boundary(ctx, model.lattice, model.conditions, tissue.window()),
      node_check(ctx, tissue.window().own.count()),
      motion(ctx, model.lattice, {first_own(), first_own() + tissue.window().own.count()}),
      spin_rad_s(to_device(ctx, std::vector<Vec3f>(1))) {
  const std::vector<Vec3f> zero(static_cast<std::size_t>(tissue.window().count()));
  state = {to_device(ctx, held(model.lattice.rest_positions_m())), to_device(ctx, zero),
           to_device(ctx, zero)};
  stopped = to_device(ctx, std::vector<Index>{0});
  if (tissue.window().virtual_nodes.count() > 0)
    virtual_check.emplace(ctx, tissue.window().virtual_nodes.count());
  if (!model.lattice.copies.empty()) change.emplace(ctx, static_cast<Index>(model.lattice.copies.size()));
}

std::vector<Vec3f> BodySolver::Part::held(std::span<const Vec3f> of_body) const {
  std::vector<Vec3f> values(static_cast<std::size_t>(tissue.window().count()));
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = of_body[static_cast<std::size_t>(tissue.window().body_node(static_cast<Index>(i)))];
  return values;
}

BodySolver::BodySolver(DeviceSet& devices, const BodyModel& model, const Settings& settings)
    : devices_(devices),
      motion_count_(model.conditions.motions.size()),
      has_boundary_(!model.conditions.empty() || model.lattice.has_rollers()),
      is_free_(std::all_of(model.lattice.fixed.begin(),
                           model.lattice.fixed.begin() + model.lattice.regular_nodes(),
                           [](auto f) { return f == 0; })),
      changes_(settings.changes) {
  const CubeLattice& lattice = model.lattice;
  const Index shared = kShared * changes_;
  const std::vector<Slab> slabs = choose_slabs(devices, model, settings.least_elements, shared);
  for (std::size_t p = 0; p < slabs.size(); ++p) {
    ExecContext& ctx = devices.context(static_cast<int>(p));
    parts_.push_back(std::make_unique<Part>(ctx, Hybrid(ctx, model, slabs[p], shared), model));
  }
  if (parts_.size() > 1) {
    const std::vector<Vec3f> zero(lattice.nodes.size());
    body_.x_m = to_device(devices.context(0), lattice.rest_positions_m());
    body_.v_m_s = to_device(devices.context(0), zero);
    if (!lattice.virtual_nodes.empty()) virtual_elements_.emplace(devices.context(0), lattice, slabs);
  }
  link_neighbours();
  if (is_changed_in_cells()) keep_places(lattice);
}

BodySolver::VirtualElementsOfAll::VirtualElementsOfAll(ExecContext& ctx, const CubeLattice& lattice,
                                                       const std::vector<Slab>& slabs)
    : first(lattice.regular_nodes()), motion(ctx, lattice, {first, lattice.node_count()}) {
  for (Index node = first; node < lattice.node_count(); ++node) {
    const Index z = lattice.nodes[static_cast<std::size_t>(node)].z;
    Index p = 0;
    while (z >= slabs[static_cast<std::size_t>(p)].end) ++p;
    owner.push_back(p);
  }
  device_owner = to_device(ctx, owner);
  for (Buffer<Vec3f>& from : copy) from = Buffer<Vec3f>(ctx.device(), device_owner.size());
}

/// Copies a part's virtual nodes to `to`, those that it owns.
void BodySolver::VirtualElementsOfAll::take(ExecContext& ctx, Index part, View<const Vec3f> x_m,
                                            View<const Vec3f> v_m_s, BodyState& to) {
  ctx.copy(x_m, copy[0].view());
  ctx.copy(v_m_s, copy[1].view());
  ctx.parallel_for("hybrid/take_virtual", device_owner.size(),
                   hybrid::TakeOwned{device_owner.const_view(), part, copy[0].const_view(),
                                     copy[1].const_view(), to.x_m.view().part(first, device_owner.size()),
                                     to.v_m_s.view().part(first, device_owner.size())});
}

void BodySolver::add_link(const HaloLink& nodes, std::vector<HaloLink>& node_links,
                          std::vector<HaloLink>& cell_links) {
  node_links.push_back(nodes);
  if (!stays_in_cells()) return;
  const auto cells_in = [&](int part, Index first) {
    Part& of = *parts_[static_cast<std::size_t>(part)];
    return to_host(of.ctx, of.tissue.tled().cell().part(first, nodes.count));
  };
  HaloLink cells = nodes;
  cells.there = cells_in(nodes.owner, nodes.first_there);
  cells.here = cells_in(nodes.holder, nodes.first_here);
  cell_links.push_back(std::move(cells));
}

/// Each slab has copies of the nodes before and behind its own.
void BodySolver::link_neighbours() {
  std::vector<HaloLink> node_links, cell_links;
  const auto link = [&](std::size_t holder, std::size_t owner, Slab nodes) {
    const auto first_in = [&](std::size_t p) { return nodes.begin - parts_[p]->tissue.window().held.begin; };
    HaloLink made{.holder = static_cast<int>(holder),
                  .owner = static_cast<int>(owner),
                  .count = nodes.count(),
                  .first_there = first_in(owner),
                  .first_here = first_in(holder)};
    add_link(made, node_links, cell_links);
    // Virtual nodes are linked as a whole region, as a cut may add some at any time.
    const NodeWindow &from = parts_[owner]->tissue.window(), &to = parts_[holder]->tissue.window();
    const bool is_second = owner > holder && to.places == 3 * to.virtual_nodes.count();
    made.count = from.virtual_nodes.count();
    made.first_there = from.virtual_nodes.begin;
    made.first_here = to.virtual_nodes.end + (is_second ? to.virtual_nodes.count() : 0);
    if (made.count > 0) add_link(made, node_links, cell_links);
  };
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const Slab window = parts_[p]->tissue.window().held, own = parts_[p]->tissue.window().own;
    if (p > 0) link(p, p - 1, {window.begin, window.begin + own.begin});
    if (p + 1 < parts_.size()) link(p, p + 1, {window.begin + own.end, window.end});
  }
  node_halo_.emplace(devices_, "hybrid/pull", node_links);
  if (is_changed_in_cells())
    changed_cell_halo_.emplace(devices_, "hybrid/pull_cells", cell_links);
  else
    cell_halo_.emplace(devices_, "hybrid/pull_positions", cell_links);
}

void BodySolver::begin_frame() {
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    Part& part = *parts_[p];
    part.boundary.begin_frame(part.ctx, on_part({}, p, 0).frame);
    part.node_check.begin_frame(part.ctx);
    if (part.virtual_check) part.virtual_check->begin_frame(part.ctx);
  }
}

void BodySolver::step(const BodyStep& step, int count) {
  for (auto& part : parts_) part->tissue.check_step(step, count);
  begin_substeps();
  for (int k = 0; k < count; ++k) {
    substep(step, k, count);
    if (has_boundary_) check_nodes(k, count);
  }
  end_substeps(count);
}

BodyStep BodySolver::on_part(const BodyStep& step, std::size_t part, int k) const {
  BodyStep own = step;
  own.in_block = k;
  if (frame_ != nullptr) {
    own.frame = frame_->view(static_cast<int>(part));
    own.stopped = parts_[part]->stopped.const_view();
  }
  if (is_free_) own.spin_rad_s = parts_[part]->spin_rad_s.const_view();
  return own;
}

/// At once: for the beginning of a recording, and for readers of the copies that slabs hold of others' nodes.
void BodySolver::pull_nodes() {
  for_each_slab([&](int p) { node_halo_->begin(p, nodes()); });
  node_halo_->finish(nodes());
}

void BodySolver::begin_substeps() {
  if (changes_ > 0) pull_nodes();
  if (stays_in_cells()) {
    for (auto& part : parts_) part->tissue.tled().load(part->ctx, part->state);
  } else if (changes_ > 0) {
    for_each_slab([&](int p) { node_halo_->await_readers(p, nodes()); });
  }
}

void BodySolver::end_substeps(int count) {
  if (!stays_in_cells()) return;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    Part& part = *parts_[p];
    part.tissue.tled().store(part.ctx, part.state, count, on_part({}, p, 0).frame);
  }
}

void BodySolver::substep_in_cells(const BodyStep& step, int k, int count) {
  if (parts_.size() == 1) {
    Part& only = *parts_.front();
    const TledStep tled = elements_step(on_part(step, 0, k));
    only.tissue.tled().move_virtual(only.ctx, tled, k);
    return only.tissue.tled().move(only.ctx, tled, k, Tled::Tiles::all);
  }
  if (k == 0) {
    for (auto& part : parts_) {
      part->ctx.record(part->moved);
      part->beside.wait(part->moved);
      part->beside.record(part->interior_moved);
    }
    for_each_slab([&](int p) { cell_halo_->begin(p, cells(0)); });
  }
  cell_halo_->finish(cells(k));
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    Part& part = *parts_[p];
    const TledStep tled = elements_step(on_part(step, p, k));
    // Each half reads the nodes that the other moved in the last substep, and overwrites those that the other
    // read then.
    part.beside.wait(part.moved);
    part.ctx.wait(part.interior_moved);
    cell_halo_->await_readers(static_cast<int>(p), cells(k + 1));
    if (virtual_elements_) {  // its forces push nodes of the edges and of the interior
      part.tissue.tled().move_virtual(part.ctx, tled, k);
      part.ctx.record(part.virtual_moved);
      part.beside.wait(part.virtual_moved);
    }
    part.tissue.tled().move(part.ctx, tled, k, Tled::Tiles::edges);
    part.ctx.record(part.moved);
    cell_halo_->begin(static_cast<int>(p), cells(k + 1));
    part.tissue.tled().move(part.beside, tled, k, Tled::Tiles::interior);
    part.beside.record(part.interior_moved);
    if (k + 1 == count) part.ctx.wait(part.interior_moved);
  }
}

void BodySolver::substep(const BodyStep& step, int k, int count) {
  matching_every_ = step.matching_every;
  if (is_changed_in_cells()) return changed_substep_in_cells(step, k);
  if (stays_in_cells()) return substep_in_cells(step, k, count);
  if (k == 0)
    pull_nodes();
  else if (changes_ == 0)
    node_halo_->finish(nodes());
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    Part& part = *parts_[p];
    const BodyStep own = on_part(step, p, k);
    part.boundary.load(part.ctx, part.state, own.time());
    part.tissue.sum_forces(part.ctx, part.state, own, k);
    node_halo_->await_readers(static_cast<int>(p), nodes());
    part.tissue.move(part.ctx, part.state, own, k);
    part.boundary.move(part.ctx, part.state, own.time());
    node_halo_->begin(static_cast<int>(p), nodes());
  }
  if (changes_ == 0) return;
  node_halo_->finish(nodes());
  for_each_slab([&](int p) { node_halo_->await_readers(p, nodes()); });
}

void BodySolver::check_now(int k, int every) {
  for (std::size_t p = 0; p < parts_.size(); ++p) parts_[p]->check_now(k, frame_of(p), every);
}

void BodySolver::check_nodes(int k, int count) {
  if (stays_in_cells() && changes_ == 0) return;
  // Blocks begin at a multiple of their own length, the longest first: in most it is known which substep
  // checks.
  const bool checks = (k + 1) % check_every() == 0;
  if (frame_ == nullptr ? k + 1 == count || !checks : count % check_every() == 0 && !checks) return;
  if (!stays_in_cells()) return check_now(k, check_every());
  for (std::size_t p = 0; p < parts_.size(); ++p) parts_[p]->check_in_cells(k, frame_of(p), check_every());
}

void BodySolver::end_frame(int count) {
  check_now(frame_ != nullptr ? 0 : count - 1, 1);
  for (auto& part : parts_) {
    part->motion.measure(part->ctx, part->own(part->state.x_m), part->own(part->state.v_m_s));
    part->node_check.summarise(part->ctx);
    if (part->virtual_check) part->virtual_check->summarise(part->ctx);
    part->ctx.record(part->moved);
  }
  if (model().has_elements()) {
    pull_nodes();
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
  if (virtual_elements_) {
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      const Slab region = parts_[p]->tissue.window().virtual_nodes;
      const BodyState& from = parts_[p]->state;
      virtual_elements_->take(first, static_cast<Index>(p),
                              from.x_m.const_view().part(region.begin, region.count()),
                              from.v_m_s.const_view().part(region.begin, region.count()), body_);
    }
    const auto nodes = [&](const Buffer<Vec3f>& of) {
      return of.const_view().part(virtual_elements_->first,
                                  static_cast<Index>(virtual_elements_->owner.size()));
    };
    virtual_elements_->motion.measure(first, nodes(body_.x_m), nodes(body_.v_m_s));
  }
  // The next work must not overwrite nodes that are still being copied.
  first.record(stored_);
  for (auto& part : parts_) part->ctx.wait(stored_);
}

void BodySolver::add_reports(Readback& readback) {
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    Part& part = *parts_[p];
    part.check_report = readback.add(part.node_check.summary(), static_cast<int>(p));
    if (part.virtual_check)
      part.virtual_check_report = readback.add(part.virtual_check->summary(), static_cast<int>(p));
    part.motion_report = readback.add(part.motion.sums(), static_cast<int>(p));
    part.extremes_report = readback.add(part.tissue.tled().extremes(), static_cast<int>(p));
  }
  if (virtual_elements_) virtual_elements_->motion_report = readback.add(virtual_elements_->motion.sums(), 0);
}

NodeCheckRecord BodySolver::node_check(const Readback* readback) {
  NodeCheckRecord all;
  const auto found = [&](Part& part, const NodeCheck& check, const Readback::Place& report) {
    return readback != nullptr ? readback->get<NodeCheckRecord>(report)[0]
                               : to_host(part.ctx, check.summary())[0];
  };
  for (auto& part : parts_) all.add(found(*part, part->node_check, part->check_report), part->first_own());
  // Parts share the virtual elements's numbers: among the nodes that were bad after the same substep, the
  // lowest comes first.
  std::vector<NodeCheckRecord> of_virtual;
  for (auto& part : parts_)
    if (part->virtual_check)
      of_virtual.push_back(found(*part, *part->virtual_check, part->virtual_check_report));
  std::stable_sort(
      of_virtual.begin(), of_virtual.end(),
      [](const NodeCheckRecord& a, const NodeCheckRecord& b) { return a.bad_node < b.bad_node; });
  for (const NodeCheckRecord& record : of_virtual) all.add(record, virtual_elements_->first);
  return all;
}

tled::CubeExtremes BodySolver::extremes(const Readback* readback) {
  tled::CubeExtremes worst = tled::FindExtremes::kNone;
  for (auto& part : parts_) {
    const auto own = readback != nullptr ? readback->get<tled::CubeExtremes>(part->extremes_report)[0]
                                         : to_host(part->ctx, part->tissue.tled().extremes())[0];
    worst = tled::FindExtremes::worse(worst, part->tissue.in_body(own));
  }
  return worst;
}

RigidMotion BodySolver::rigid_motion(const Readback* readback) {
  std::vector<MotionSums> sums;
  const auto add = [&](ExecContext& ctx, const MotionMeter& meter, const Readback::Place& report) {
    const std::vector<MotionSums> own =
        readback != nullptr ? readback->get<MotionSums>(report) : to_host(ctx, meter.sums());
    sums.insert(sums.end(), own.begin(), own.end());
  };
  for (auto& part : parts_) add(part->ctx, part->motion, part->motion_report);
  if (virtual_elements_)
    add(devices_.context(0), virtual_elements_->motion, virtual_elements_->motion_report);
  return tactus::rigid_motion(sums);
}

void BodySolver::set_spin(Vec3d spin_rad_s) {
  if (!is_free_) return;
  spin_rad_s_ = {vec_cast<float>(spin_rad_s)};
  for (auto& part : parts_) part->ctx.upload(std::span<const Vec3f>(spin_rad_s_), part->spin_rad_s.view());
}

void BodySolver::stop() {
  const Index yes = 1;
  for (auto& part : parts_) {
    part->ctx.upload({&yes, 1}, part->stopped.view());
    part->ctx.synchronize();
  }
}

BodySolver::MotionForces BodySolver::motion_forces(double dt_frame_s) const {
  MotionForces all{std::vector<Vec3d>(motion_count_), std::vector<Vec3d>(motion_count_)};
  for (auto& part : parts_) {
    part->boundary.driven().add_mean_forces_N(part->ctx, dt_frame_s, all.forces_N);
    part->boundary.driven().add_mean_torques_N_m(part->ctx, dt_frame_s, all.torques_N_m);
  }
  return all;
}

void BodySolver::set_state(std::span<const Vec3f> x_m, std::span<const Vec3f> v_m_s) {
  for (auto& part : parts_) {
    const std::vector<Vec3f> x = part->held(x_m), v = part->held(v_m_s);
    part->ctx.upload(x, part->state.x_m.view());
    part->ctx.upload(v, part->state.v_m_s.view());
    part->ctx.synchronize();
  }
  if (parts_.size() == 1) return;
  ExecContext& first = devices_.context(0);
  first.upload(x_m, body_.x_m.view());
  first.upload(v_m_s, body_.v_m_s.view());
  first.synchronize();
}

std::vector<Vec3f> BodySolver::all_of(Buffer<Vec3f> BodyState::*field) {
  std::vector<Vec3f> all;
  for (auto& part : parts_) {
    const std::vector<Vec3f> some = to_host(part->ctx, part->own(part->state.*field));
    all.insert(all.end(), some.begin(), some.end());
  }
  if (!virtual_elements_) return all;
  const std::size_t first = all.size();
  all.resize(first + virtual_elements_->owner.size());
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const Slab region = parts_[p]->tissue.window().virtual_nodes;
    const std::vector<Vec3f> some =
        to_host(parts_[p]->ctx, (parts_[p]->state.*field).const_view().part(region.begin, region.count()));
    for (std::size_t k = 0; k < some.size(); ++k)
      if (virtual_elements_->owner[k] == static_cast<Index>(p)) all[first + k] = some[k];
  }
  return all;
}

void BodySolver::archive(StateArchive& a) {
  std::vector<Vec3f> x_m = positions_m(), v_m_s = velocities_m_s();
  a.values("positions", x_m);
  a.values("velocities", v_m_s);
  if (a.reads()) set_state(x_m, v_m_s);
  for (auto& part : parts_) {
    part->tissue.archive(part->ctx, a);
    part->boundary.archive(part->ctx, a);
  }
}

std::vector<Vec3f> BodySolver::positions_m() { return all_of(&BodyState::x_m); }
std::vector<Vec3f> BodySolver::velocities_m_s() { return all_of(&BodyState::v_m_s); }

}  // namespace tactus
