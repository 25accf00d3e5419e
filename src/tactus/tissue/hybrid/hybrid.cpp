#include "tactus/tissue/hybrid/hybrid.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "tactus/base/error.h"
#include "tactus/tissue/hybrid/hybrid_kernels.h"

namespace tactus {
namespace {

bool is_element(std::span<const std::uint8_t> elements, std::size_t cube) {
  return elements.empty() || elements[cube] != 0;
}

/// Materials per cube with kNoElement where shapes are matched.
std::vector<std::uint8_t> element_materials(const BodyModel& model) {
  const CubeLattice& lattice = model.lattice;
  const std::span<const std::uint8_t> elements = model.elements, material_of_cube = model.material_of_cube;
  if (!elements.empty() && elements.size() != lattice.cubes.size())
    throw Error(std::to_string(elements.size()) + " element flags for " +
                std::to_string(lattice.cubes.size()) + " cubes");
  std::vector<std::uint8_t> material(lattice.cubes.size());
  for (std::size_t c = 0; c < material.size(); ++c) {
    const std::uint8_t own = material_of_cube.empty() ? std::uint8_t{0} : material_of_cube[c];
    const bool is_capacity = c >= static_cast<std::size_t>(lattice.regular_cubes()) && !lattice.has_cube(c);
    material[c] = is_element(elements, c) && !is_capacity ? own : Tled::kNoElement;
  }
  for (const CubeCopy& copy : lattice.copies) {
    if (copy.of >= 0 && material[static_cast<std::size_t>(copy.of)] == Tled::kNoElement)
      throw Error("cube " + std::to_string(copy.of) + " is cut and shape-matched: only elements can be cut");
  }
  return material;
}

FlsmStep matching_step(const BodyStep& step) {
  return {.dt_s = step.dt_s,
          .substeps = step.matching_every,
          .gravity_m_s2 = step.gravity_m_s2,
          .full_stiffness = step.full_stiffness,
          .frame = step.frame,
          .stopped = step.stopped,
          .spin_rad_s = step.spin_rad_s,
          .in_block = step.in_block};
}

}  // namespace

TledStep elements_step(const BodyStep& step) {
  return {.dt_s = step.dt_s,
          .gravity_m_s2 = step.gravity_m_s2,
          .drag_per_s = step.drag_per_s,
          .frame = step.frame,
          .stopped = step.stopped,
          .spin_rad_s = step.spin_rad_s,
          .in_block = step.in_block};
}

ElementMask split_by_ratio(const CubeLattice& lattice, int axis, double elements, double matched) {
  if (axis < 0 || axis > 2) throw Error("axis " + std::to_string(axis) + ": expected 0 (x), 1 (y) or 2 (z)");
  if (!(elements >= 0 && matched >= 0 && elements + matched > 0))
    throw Error("ratio " + std::to_string(elements) + ":" + std::to_string(matched) +
                ": expected two shares that are not negative and not both 0");
  // Nodes below layer k are elements' alone, those above shape matching's, those on it both sides'.
  std::vector<double> layer(static_cast<std::size_t>(lattice.node_dims[axis]));
  for (const Vec3i p : lattice.nodes) layer[static_cast<std::size_t>(p[axis])] += 1;
  const double wanted = static_cast<double>(lattice.nodes.size()) * elements / (elements + matched);
  Index best = 0;
  double below = 0, least = 1e300;
  for (std::size_t k = 0; k < layer.size(); ++k) {
    const bool first = k == 0, last = k + 1 == layer.size();
    const double share = first ? 0 : (last ? below + layer[k] : below + 0.5 * layer[k]);
    if (std::abs(share - wanted) < least) least = std::abs(share - wanted), best = static_cast<Index>(k);
    below += layer[k];
  }
  ElementMask mask(lattice.cubes.size());
  for (std::size_t c = 0; c < mask.size(); ++c) mask[c] = lattice.cubes[c][axis] < best ? 1 : 0;
  return mask;
}

/// The nodes and cubes that a device holds, and their materials and numbers in the body.
struct Hybrid::Layout {
  Layout(const BodyModel& model, std::optional<Slab> own_layers, Index around);
  NodeWindow window() const;

  LatticeLayers part;                            ///< nodes and cubes of the window
  Index first_virtual = 0;                       ///< node of the body
  Index first_copy = 0;                          ///< cube of the body
  Slab own_of_body, read_of_body, held_of_body;  ///< layers
  Slab own;                                      ///< layers of the part
  std::vector<std::uint8_t> material;            ///< per cube of the part
  bool has_elements = false;                     ///< the body has, here or elsewhere
  // shape matching; empty regions without
  LatticeLayers matched;
  std::optional<FlsmRegions> regions;
  std::vector<Index> matched_nodes;  ///< of the part, per node of matched
  std::vector<Index> matched_node;   ///< of matched, per node of the part; -1: none
  std::vector<float> share, inverse_mass_per_kg, matched_mass_kg, held;
  std::vector<Index> only_matched;
};

Hybrid::Layout::Layout(const BodyModel& model, std::optional<Slab> own_layers, Index around) {
  const CubeLattice& lattice = model.lattice;
  const int half_width = model.flsm.half_width;
  const std::vector<std::uint8_t> all_materials = element_materials(model);
  has_elements = std::any_of(all_materials.begin(), all_materials.end(),
                             [](std::uint8_t m) { return m != Tled::kNoElement; });
  const LatticePart others =
      lattice_part(lattice, [&](std::size_t c) { return !is_element(model.elements, c); });
  const Index layers = lattice.node_dims.z;
  own = own_layers.value_or(Slab{0, layers});
  first_virtual = lattice.regular_nodes();
  first_copy = lattice.regular_cubes();
  own_of_body = own;
  const auto widened = [&](Slab s, Index by) {
    return Slab{std::max(s.begin - by, 0), std::min(s.end + by, layers)};
  };
  read_of_body = others.node.empty() ? widened(own, 1) : flsm_window(own, half_width, layers);
  const Slab window = widened(read_of_body, around);
  part = lattice_window(lattice, window, own);
  held_of_body = window;
  const auto first_cube = all_materials.begin() + part.first_cube;
  material.assign(first_cube, first_cube + part.lattice.regular_cubes());
  material.insert(material.end(), all_materials.begin() + lattice.regular_cubes(), all_materials.end());

  const std::size_t nodes = part.lattice.nodes.size();
  matched_node.assign(nodes, -1);
  share.resize(nodes);
  matched_mass_kg.resize(nodes);
  held.assign(nodes, 1);
  inverse_mass_per_kg.resize(nodes);
  for (std::size_t i = 0; i < nodes; ++i) {
    const float mass_kg = part.lattice.node_mass_kg[i];
    inverse_mass_per_kg[i] = mass_kg > 0 ? 1 / mass_kg : 0;
  }
  matched = lattice_layers(others.lattice, read_of_body);
  for (std::size_t i = 0; i < matched.lattice.nodes.size(); ++i) {
    const Index node = others.node[static_cast<std::size_t>(matched.first_node) + i] - part.first_node;
    matched_nodes.push_back(node);
    matched_node[static_cast<std::size_t>(node)] = static_cast<Index>(i);
    matched_mass_kg[static_cast<std::size_t>(node)] = matched.lattice.node_mass_kg[i];
    share[static_cast<std::size_t>(node)] =
        matched.lattice.node_mass_kg[i] / part.lattice.node_mass_kg[static_cast<std::size_t>(node)];
  }
  only_matched.assign(nodes, 0);
  std::fill_n(only_matched.begin(), part.lattice.regular_nodes(), 1);
  for (std::size_t c = 0; c < material.size(); ++c) {
    if (material[c] == Tled::kNoElement || !part.lattice.has_cube(c)) continue;
    for (const Index i : part.lattice.cube_nodes[c]) only_matched[static_cast<std::size_t>(i)] = 0;
  }
  if (!others.node.empty()) {
    regions = flsm_layers(make_flsm_regions(others.lattice, half_width), others.lattice, own);
    for (std::size_t i = 0; i < matched_nodes.size(); ++i) {
      held[static_cast<std::size_t>(matched_nodes[i])] = regions->held[i];
      share[static_cast<std::size_t>(matched_nodes[i])] *= regions->held[i];
    }
  }
  own = {own.begin - window.begin, own.end - window.begin};
}

NodeWindow Hybrid::Layout::window() const {
  const CubeLattice& nodes = part.lattice;
  const VirtualRegions places = virtual_regions(nodes, own);
  if (places.count() == 1) return all_nodes(nodes);
  const LatticeLayers of_own = lattice_layers(nodes, own);
  return {.held = {part.first_node, part.first_node + nodes.regular_nodes()},
          .own = {of_own.first_node, of_own.first_node + of_own.lattice.node_count()},
          .virtual_nodes = places.own(),
          .places = places.count() * places.capacity,
          .first_virtual = first_virtual};
}

Hybrid::Hybrid(ExecContext& ctx, const BodyModel& model, std::optional<Slab> own, Index around)
    : Hybrid(ctx, Layout(model, own, around), model) {}

Hybrid::Hybrid(ExecContext& ctx, const Layout& layout, const BodyModel& model)
    : tled_(ctx, layout.part.lattice, model.materials, layout.material, model.tled, layout.own),
      window_(layout.window()),
      own_layers_(layout.own_of_body),
      read_layers_(layout.read_of_body),
      held_layers_(layout.held_of_body),
      first_cube_(layout.part.first_cube),
      regular_cubes_(layout.part.lattice.regular_cubes()),
      first_copy_(layout.first_copy),
      has_elements_(layout.has_elements),
      has_rollers_(layout.part.lattice.has_rollers()) {
  if (layout.regions) {
    flsm_.emplace(ctx, layout.matched.lattice, *layout.regions, model.flsm);
    if (has_elements_) side_stream_ = std::make_unique<SideStream>(ctx.device());
  }
  matched_nodes_ = to_device(ctx, layout.matched_nodes);
  matched_node_ = to_device(ctx, layout.matched_node);
  matched_share_ = to_device(ctx, layout.share);
  inverse_mass_per_kg_ = to_device(ctx, layout.inverse_mass_per_kg);
  const std::vector<std::uint8_t>& fixed = layout.part.lattice.fixed;
  fixed_ = to_device(ctx, std::vector<Index>(fixed.begin(), fixed.end()));
  only_matched_ = to_device(ctx, layout.only_matched);
  if (layout.part.lattice.copies.empty()) return;
  matched_mass_kg_ = to_device(ctx, layout.matched_mass_kg);
  held_ = to_device(ctx, layout.held);
}

void Hybrid::check_step(const BodyStep& step, int count) const {
  if (has_elements_) tled_.check_step(step.dt_s);
  if (step.matching_every < 1 || count % step.matching_every != 0)
    throw Error("shape matching every " + std::to_string(step.matching_every) + " of " +
                std::to_string(count) + " substeps: expected a positive number that divides them");
}

int Hybrid::most_matching_every(float dt_s) const {
  return flsm_ ? std::max(1, static_cast<int>(1 / (flsm_->omega_per_s() * dt_s))) : 1;
}

void Hybrid::step(ExecContext& ctx, BodyState& state, const BodyStep& step, int count) {
  check_step(step, count);
  if (!flsm_ && !has_rollers_) return tled_.step(ctx, state, elements_step(step), count);
  for (int k = 0; k < count; ++k) {
    sum_forces(ctx, state, step, k);
    move(ctx, state, step, k);
  }
}

void Hybrid::sum_forces(ExecContext& ctx, const BodyState& state, const BodyStep& step, int k) {
  const bool matches = flsm_ && k % step.matching_every == 0;
  if (matches)
    flsm_->compute_goals(side_stream_ ? side_stream_->follow(ctx) : ctx, state, matching_step(step),
                         matched_nodes_.const_view());
  if (has_elements_) tled_.find_forces(ctx, state, step.time());
  if (matches && side_stream_) side_stream_->join(ctx);
}

void Hybrid::move(ExecContext& ctx, BodyState& state, const BodyStep& step, int k) {
  move_nodes(ctx, state, step, k, window_.own, own_in_use());
  if (window_.virtual_nodes.count() > 0)
    move_nodes(ctx, state, step, k, window_.virtual_nodes, window_.virtual_nodes.count());
}

void Hybrid::move_nodes(ExecContext& ctx, BodyState& state, const BodyStep& step, int k, Slab nodes,
                        const Count& used) {
  const FlsmGoals goals = flsm_ ? flsm_->goals() : FlsmGoals{};
  const auto own = [&](auto view) { return view.part(nodes.begin, nodes.count()); };
  tled::SummedForces internal = tled_.forces();
  if (!internal.first_of_node.empty()) internal.first_of_node = own(internal.first_of_node);
  ctx.parallel_for(
      "hybrid/integrate", used,
      hybrid::Integrate{.x_m = own(state.x_m.view()),
                        .v_m_s = own(state.v_m_s.view()),
                        .f_ext_N = own(state.f_ext_N.const_view()),
                        .f_int = internal,
                        .element_cell = own(tled_.cell()),
                        .matched_node = own(matched_node_.const_view()),
                        .matched_cell = goals.cell,
                        .goal_sum_m = goals.sum_m,
                        .inverse_weight = goals.inverse_weight,
                        .matched_share = own(matched_share_.const_view()),
                        .inverse_mass_per_kg = own(inverse_mass_per_kg_.const_view()),
                        .fixed = own(fixed_.const_view()),
                        .only_matched = own(only_matched_.const_view()),
                        .matched_cells = goals.cells,
                        .time = step.time(),
                        .step = flsm_ ? flsm_->pace(matching_step(step)) : flsm::StepParameters{0, 0, 1, 1},
                        .drag_per_s = step.drag_per_s,
                        .elements_damping_time_s = tled_.damping_time_s(),
                        .new_goals = k % step.matching_every == 0});
}

float Hybrid::stable_step_s() const {
  const float elements = has_elements_ ? tled_.stable_step_s() : 1e30F;
  return flsm_ ? std::min(elements, 1 / flsm_->omega_per_s()) : elements;
}

int Hybrid::substeps_for(float dt_frame_s, float speed_ratio) const {
  const int elements = has_elements_ ? tled_.substeps_for(dt_frame_s, speed_ratio) : 1;
  return flsm_ ? std::max(elements, flsm_->substeps_for(dt_frame_s)) : elements;
}

void Hybrid::find_extremes(ExecContext& ctx, const BodyState& state) {
  if (has_elements_) tled_.find_extremes(ctx, state);
}

tled::CubeExtremes Hybrid::in_body(const tled::CubeExtremes& found) const {
  if (!has_elements_) return {1, 0, 1, 0, 0};
  tled::CubeExtremes of_body = found.counted_from(tled_.first_own_cube());
  for (Index* cube : {&of_body.fastest_cube, &of_body.smallest_cube})
    *cube += *cube < regular_cubes_ ? first_cube_ : first_copy_ - regular_cubes_;
  return of_body;
}

}  // namespace tactus
