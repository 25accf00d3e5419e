#include "tactus/tissue/hybrid/hybrid.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "tactus/base/error.h"
#include "tactus/tissue/hybrid/hybrid_kernels.h"

namespace tactus {
namespace {

bool is_element(const ElementMask& elements, std::size_t cube) {
  return elements.empty() || elements[cube] != 0;
}

/// Materials per cube with kNoElement where shapes are matched.
std::vector<std::uint8_t> element_materials(const CubeLattice& lattice, const ElementMask& elements,
                                            std::span<const std::uint8_t> material_of_cube) {
  if (!elements.empty() && elements.size() != lattice.cubes.size())
    throw Error(std::to_string(elements.size()) + " element flags for " +
                std::to_string(lattice.cubes.size()) + " cubes");
  std::vector<std::uint8_t> material(lattice.cubes.size());
  for (std::size_t c = 0; c < material.size(); ++c) {
    const std::uint8_t own = material_of_cube.empty() ? std::uint8_t{0} : material_of_cube[c];
    material[c] = is_element(elements, c) ? own : Tled::kNoElement;
  }
  return material;
}

}  // namespace

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

LatticePart lattice_part(const CubeLattice& lattice, const std::function<bool(std::size_t cube)>& keep) {
  LatticePart part;
  part.lattice.spacing_m = lattice.spacing_m;
  part.lattice.origin_m = lattice.origin_m;
  part.lattice.node_dims = lattice.node_dims;
  std::vector<Index> id(lattice.nodes.size(), -1);
  std::vector<std::uint8_t> used(lattice.nodes.size());
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    if (!keep(c)) continue;
    for (const Index i : lattice.cube_nodes[c]) used[static_cast<std::size_t>(i)] = 1;
  }
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i] == 0) continue;
    id[i] = static_cast<Index>(part.node.size());
    part.node.push_back(static_cast<Index>(i));
    part.lattice.nodes.push_back(lattice.nodes[i]);
    part.lattice.fixed.push_back(lattice.fixed[i]);
  }
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    if (!keep(c)) continue;
    part.lattice.cubes.push_back(lattice.cubes[c]);
    part.lattice.cube_mass_kg.push_back(lattice.cube_mass_kg[c]);
    std::array<Index, 8> nodes = lattice.cube_nodes[c];
    for (Index& i : nodes) i = id[static_cast<std::size_t>(i)];
    part.lattice.cube_nodes.push_back(nodes);
  }
  part.lattice.share_masses();
  return part;
}

Hybrid::Hybrid(ExecContext& ctx, const CubeLattice& lattice, const ElementMask& elements,
               std::span<const ElasticMaterial> materials, std::span<const std::uint8_t> material_of_cube,
               const TledOptions& tled, const FlsmMaterial& flsm)
    : tled_(ctx, lattice, materials, element_materials(lattice, elements, material_of_cube), tled),
      has_elements_(elements.empty() ||
                    std::any_of(elements.begin(), elements.end(), [](std::uint8_t e) { return e != 0; })) {
  const LatticePart part = lattice_part(lattice, [&](std::size_t c) { return !is_element(elements, c); });
  std::vector<Index> matched_node(lattice.nodes.size(), -1);
  std::vector<float> share(lattice.nodes.size()), inverse_mass(lattice.nodes.size());
  for (std::size_t i = 0; i < part.node.size(); ++i) {
    const auto node = static_cast<std::size_t>(part.node[i]);
    matched_node[node] = static_cast<Index>(i);
    share[node] = part.lattice.node_mass_kg[i] / lattice.node_mass_kg[node];
  }
  std::transform(lattice.node_mass_kg.begin(), lattice.node_mass_kg.end(), inverse_mass.begin(),
                 [](float m) { return 1 / m; });
  if (!part.node.empty()) {
    flsm_.emplace(ctx, part.lattice, flsm);
    matched_ = rest_state(ctx, part.lattice);
  }
  matched_nodes_ = to_device(ctx, part.node);
  matched_node_ = to_device(ctx, matched_node);
  matched_share_ = to_device(ctx, share);
  inverse_mass_per_kg_ = to_device(ctx, inverse_mass);
  fixed_ = to_device(ctx, std::vector<Index>(lattice.fixed.begin(), lattice.fixed.end()));
}

void Hybrid::step(ExecContext& ctx, BodyState& state, const HybridStep& step) {
  if (has_elements_) {
    tled_.check_step(step.dt_s);
    tled_.compute_forces(ctx, state);
  }
  const FlsmStep matching{.dt_s = step.dt_s, .full_stiffness = step.full_stiffness};
  if (flsm_) {
    ctx.parallel_for(
        "hybrid/gather", matched_nodes_.size(),
        hybrid::GatherNodes{state.x_m.const_view(), state.v_m_s.const_view(), matched_nodes_.const_view(),
                            matched_.x_m.view(), matched_.v_m_s.view()});
    flsm_->compute_goals(ctx, matched_, matching);
  }
  const FlsmGoals goals = flsm_ ? flsm_->goals() : FlsmGoals{};
  ctx.parallel_for(
      "hybrid/integrate", node_count(),
      hybrid::Integrate{state.x_m.view(), state.v_m_s.view(), state.f_ext_N.const_view(),
                        tled_.force_fields_N(), tled_.cell(), matched_node_.const_view(), goals.cell,
                        goals.sum_m, goals.inverse_region_nodes, matched_share_.const_view(),
                        inverse_mass_per_kg_.const_view(), fixed_.const_view(), tled_.cells(), goals.cells,
                        step.gravity_m_s2, step.dt_s, flsm_ ? flsm_->kappa(matching) / step.dt_s : 0,
                        flsm_ ? flsm_->damping_time_s(matching) : 0, 1 / (1 + step.dt_s * step.drag_per_s)});
}

float Hybrid::stable_step_s() const {
  const float elements = has_elements_ ? tled_.stable_step_s() : 1e30F;
  return flsm_ ? std::min(elements, 1 / flsm_->omega_per_s()) : elements;
}

int Hybrid::substeps_for(float dt_frame_s, float speed_ratio) const {
  const int elements = has_elements_ ? tled_.substeps_for(dt_frame_s, speed_ratio) : 1;
  return flsm_ ? std::max(elements, flsm_->substeps_for(dt_frame_s)) : elements;
}

tled::CubeExtremes Hybrid::extremes(ExecContext& ctx, const BodyState& state) {
  return has_elements_ ? tled_.extremes(ctx, state) : tled::CubeExtremes{1, 0, 1, 0, 0};
}

}  // namespace tactus
