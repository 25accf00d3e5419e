#include "tactus/tissue/tled/tled.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"
#include "tactus/geom/lattice/lattice_cut.h"
#include "tactus/tissue/lattice_part.h"
#include "tactus/tissue/summary_kernels.h"
#include "tactus/tissue/tled/damped_step.h"
#include "tactus/tissue/tled/tile_plan.h"
#include "tactus/tissue/tled/tled_kernels.h"
#include "tactus/tissue/tled/virtual_element_kernels.h"
#include "tactus/tissue/topology_kernels.h"

namespace tactus {
namespace {

void require(bool ok, const char* field, float value, const char* expected) {
  if (!ok) throw Error(std::string(field) + " is " + number_text(value) + ", expected " + expected);
}

/// E when part of the shear modulus is gone.
float relaxed_young_Pa(const ElasticMaterial& m, float faded_share) {
  const float mu = (1 - faded_share) * m.mu_Pa(), lambda = m.lambda_Pa();
  return mu * (3 * lambda + 2 * mu) / (lambda + mu);
}

/// Stiffness of a cube that swells (3 lambda + 2 mu), is sheared (2 mu, more if lambda < 0) or bends (E / 3,
/// less): times 4 / (rho h^2) it is the largest eigenvalue. Where corners have different masses, that of
/// swelling is `uneven` times as much; that of 2 mu is a fit to single cubes (`LightCorners.*`).
float largest_stiffness_Pa(const ElasticMaterial& m, const TledOptions& options, float uneven) {
  const float at_once = (1 + options.added_share()) * (1 + 2.7F * (uneven - 1));
  const float added = with_law(options, [&](const auto& law) { return law.added_stiffness_Pa(m.mu_Pa()); });
  return uneven * std::max(3 * m.lambda_Pa(), 0.F) + at_once * 2 * m.mu_Pa() + at_once * added;
}

void check_law(const ElasticMaterial& m, const TledOptions& options) {
  const float least = with_law(options, [](const auto& law) { return law.least_poisson; });
  if (m.poisson < least)
    throw Error("Poisson's ratio is " + number_text(m.poisson) +
                ", expected 0 or more with this law, as its " +
                "energy has no least value below; law isochoric_neo_hookean takes -1 to 0.5");
}

/// Cubes of the same material and fill are of one kind; kind 0 is no cube.
struct Kinds {
  std::vector<tled::Stiffness> stiffness;
  std::vector<std::uint16_t> of_cell;

  std::vector<float> fields() const {  ///< tled::StiffnessFields
    const std::size_t cells = of_cell.size();
    std::vector<float> all(3 * cells);
    for (std::size_t i = 0; i < cells; ++i) {
      const tled::Stiffness& k = stiffness[of_cell[i]];
      all[i] = k.mu_Pa;
      all[cells + i] = k.lambda_Pa;
      all[2 * cells + i] = k.hourglass_N_m;
    }
    return all;
  }
};

/// Stiffness of a cube. The hourglass stiffness k = h E / 6 is the bending stiffness of a cube exactly (the
/// often used part of (lambda + 2 mu) h depends on Poisson's ratio). It does not relax, so it is that of the
/// relaxed material: the lasting force is right.
tled::Stiffness stiffness_of(float exact_fill, float spacing_m, const ElasticMaterial& m, float faded_share) {
  // Every cube at a surface has a fill of its own. Ten bits of it make some thousand kinds at most, which a
  // GPU's caches hold.
  int exponent = 0;
  const float mantissa = std::frexp(exact_fill, &exponent);
  const float fill = std::ldexp(std::round(1024 * mantissa) / 1024, exponent);
  return {fill * m.mu_Pa(), fill * m.lambda_Pa(), fill * spacing_m * relaxed_young_Pa(m, faded_share) / 6};
}

float fill_of(const CubeLattice& lattice, std::size_t c) {
  return lattice.cube_fill.empty() ? 1.F : lattice.cube_fill[c];
}

Kinds find_kinds(const CubeLattice& lattice, const tled::TilePlan& plan,
                 std::span<const ElasticMaterial> materials,
                 const std::vector<std::uint8_t>& material_of_cube, float faded_share) {
  Kinds kinds{{tled::Stiffness{}}, std::vector<std::uint16_t>(static_cast<std::size_t>(plan.grid.cells))};
  std::map<std::array<float, 3>, std::uint16_t> known;
  for (std::size_t c = 0; c < plan.cube_cell.size(); ++c) {
    if (material_of_cube[c] == Tled::kNoElement || !lattice.has_cube(c)) continue;
    const tled::Stiffness stiffness =
        stiffness_of(fill_of(lattice, c), lattice.spacing_m, materials[material_of_cube[c]], faded_share);
    const auto [at, is_new] =
        known.try_emplace({stiffness.mu_Pa, stiffness.lambda_Pa, stiffness.hourglass_N_m},
                          static_cast<std::uint16_t>(kinds.stiffness.size()));
    if (is_new) kinds.stiffness.push_back(stiffness);
    if (kinds.stiffness.size() > 65536)
      throw Error("a body's cubes have more than 65535 different stiffnesses; use fewer materials");
    kinds.of_cell[static_cast<std::size_t>(plan.cube_cell[c])] = at->second;
  }
  return kinds;
}

template <class Tiles>
tled::TileLimits limits_of(Index processors) {
  return {.groups = Tiles::kGroups,
          .groups_x = Tiles::kGroupsX,
          .segments = Tiles::kSegments,
          .layers = tled::kMostLayers,
          .processors = processors};
}

}  // namespace

void check_material(const ElasticMaterial& m) {
  require(m.young_Pa > 0 && std::isfinite(m.young_Pa), "Young's modulus [Pa]", m.young_Pa,
          "a positive number");
  require(m.poisson > -1 && m.poisson < 0.5F, "Poisson's ratio", m.poisson, "more than -1 and less than 0.5");
  require(m.density_kg_m3 > 0 && std::isfinite(m.density_kg_m3), "density [kg/m^3]", m.density_kg_m3,
          "a positive number");
}

namespace {

void check_options(const TledOptions& options) {
  require(options.damping_ratio >= 0 && options.damping_ratio <= 0.7F, "damping ratio", options.damping_ratio,
          "0 to 0.7");
  require(options.fibre_ratio >= 0, "fibre ratio", options.fibre_ratio, "0 or more");
  for (const RelaxationTerm& term : options.relaxation) {
    require(term.share >= 0, "relaxation share", term.share, "0 or more");
    require(term.time_s > 0 && std::isfinite(term.time_s), "relaxation time [s]", term.time_s,
            "a positive number");
  }
  require(options.faded_share() < 1, "sum of relaxation shares", options.faded_share(), "less than 1");
  if (options.full_integration && options.relaxing_terms() > 0)
    throw Error("stresses that relax need one integration point, not full integration");
}

}  // namespace

Tled::Tled(ExecContext& ctx, const CubeLattice& lattice, std::span<const ElasticMaterial> materials,
           std::span<const std::uint8_t> material_of_cube, const TledOptions& options,
           std::optional<Slab> own)
    : options_(options), has_rollers_(lattice.has_rollers()), spacing_m_(lattice.spacing_m) {
  check_options(options);
  std::vector<std::uint8_t> material(material_of_cube.begin(), material_of_cube.end());
  if (material.empty()) material.assign(lattice.cubes.size(), 0);
  if (material.size() != lattice.cubes.size())
    throw Error(std::to_string(material.size()) + " materials of cubes for " +
                std::to_string(lattice.cubes.size()) + " cubes");
  std::vector<std::uint8_t> in_use(material.size());
  float undamped_step_s = 1e30F;
  for (std::size_t c = 0; c < material.size(); ++c) {
    if (material[c] == kNoElement) continue;
    if (material[c] >= materials.size())
      throw Error("cube " + std::to_string(c) + " has material " + std::to_string(material[c]) + " of " +
                  std::to_string(materials.size()));
    in_use[c] = 1;
  }
  for (const ElasticMaterial& m : materials) {
    check_material(m);
    undamped_step_s = std::min(
        undamped_step_s,
        lattice.spacing_m * std::sqrt(m.density_kg_m3 / largest_stiffness_Pa(m, options, lattice.uneven)));
  }
  for (std::size_t c = 0; c < material.size(); ++c)
    if (material[c] != kNoElement) check_law(materials[material[c]], options);
  damping_time_s_ = options.damping_ratio * undamped_step_s;
  stable_step_s_ = damped_step_s(undamped_step_s, damping_time_s_);

  const Slab own_layers = own.value_or(Slab{0, lattice.node_dims.z});
  const tled::TilePlan plan =
      tled::plan_tiles(lattice, in_use,
                       ctx.device().is_cuda() ? limits_of<tled::TilesOnGpu>(ctx.device().multiprocessors())
                                              : limits_of<tled::TilesOnCpu>(0),
                       own_layers);
  grid_ = plan.grid;
  edge_tiles_ = plan.edge_tiles;
  tiles_ = to_device(ctx, plan.tiles);
  active_ = to_device(ctx, plan.active);
  cell_ = to_device(ctx, plan.node_cell);
  cube_cell_ = to_device(ctx, plan.cube_cell);
  const auto first_cube_at = [&](Index z) {
    const auto below = [z](Vec3i cube) { return cube.z < z; };
    const auto regular_end = lattice.cubes.begin() + lattice.regular_cubes();
    return static_cast<Index>(std::partition_point(lattice.cubes.begin(), regular_end, below) -
                              lattice.cubes.begin());
  };
  own_cubes_ = {first_cube_at(own_layers.begin), first_cube_at(own_layers.end)};
  extremes_ = Buffer<tled::CubeExtremes>(
      ctx.device(), ceil_div(own_cubes_.count(), tled::FindExtremes::kThreads) +
                        ceil_div(static_cast<Index>(lattice.copies.size()), tled::FindExtremes::kThreads));
  worst_ = to_device(ctx, std::vector<tled::CubeExtremes>{tled::FindExtremes::kNone});
  std::vector<float> inverse_mass(static_cast<std::size_t>(grid_.cells));
  for (std::size_t i = 0; i < plan.node_cell.size(); ++i) {
    if (lattice.fixed[i] != kAllAxes)
      inverse_mass[static_cast<std::size_t>(plan.node_cell[i])] = 1 / lattice.node_mass_kg[i];
  }
  inverse_mass_per_kg_ = to_device(ctx, inverse_mass);
  const Kinds kinds = find_kinds(lattice, plan, materials, material, options.faded_share());
  kind_ = to_device(ctx, kinds.of_cell);
  kinds_ = to_device(ctx, kinds.stiffness);
  if (!ctx.device().is_cuda()) stiffness_ = to_device(ctx, kinds.fields());
  const std::vector<float> zero(3 * static_cast<std::size_t>(grid_.cells));
  for (Buffer<float>* fields : {&predicted_m_[0], &predicted_m_[1], &v_m_s_, &external_m_s2_, &f_N_})
    *fields = to_device(ctx, zero);
  for (Buffer<float>& history : history_Pa_) {
    if (relaxes())
      history =
          to_device(ctx, std::vector<float>(static_cast<std::size_t>(history_fields()) * zero.size() / 3));
  }
  std::vector<tled::Stiffness> of_copies(lattice.copies.size());
  for (std::size_t k = 0; k < of_copies.size(); ++k) {
    const std::size_t c = static_cast<std::size_t>(lattice.regular_cubes()) + k;
    if (material[c] != kNoElement && lattice.has_cube(c))
      of_copies[k] =
          stiffness_of(fill_of(lattice, c), spacing_m_, materials[material[c]], options.faded_share());
  }
  if (!of_copies.empty()) {
    materials_.assign(materials.begin(), materials.end());
    material_ = std::move(material);
  }
  make_virtual(ctx, lattice, of_copies, own_layers, plan.first_virtual_cell);
}

/// Where a device has all of a body, virtual nodes that are not in use come last.
Index Tled::used_nodes(const CubeLattice& lattice, Slab own_layers) {
  if (own_layers.count() < lattice.node_dims.z) return lattice.node_count();
  return tactus::nodes_in_use(lattice);
}

void Tled::make_virtual(ExecContext& ctx, const CubeLattice& lattice,
                        std::span<const tled::Stiffness> stiffness, Slab own_layers,
                        Index first_virtual_cell) {
  std::vector<embed::CubeNodes> copies(stiffness.size());
  for (std::size_t k = 0; k < copies.size(); ++k) {
    const auto& nodes = lattice.cube_nodes[static_cast<std::size_t>(lattice.regular_cubes()) + k];
    std::copy(nodes.begin(), nodes.end(), copies[k].node);
  }
  const LatticeLayers own = lattice_layers(lattice, own_layers);
  const Slab of_virtual = virtual_regions(lattice, own_layers).own();
  virtual_elements_ = tled::VirtualElements(
      ctx, copies, stiffness, cell_.const_view(),
      {own.first_node, own.first_node + own.lattice.node_count(), of_virtual.begin, of_virtual.end},
      used_nodes(lattice, own_layers), first_virtual_cell, history_fields());
}

tled::Stiffness Tled::copy_stiffness(Index of_cube, float fill) const {
  const std::uint8_t material = material_.at(static_cast<std::size_t>(of_cube));
  if (material == kNoElement)
    throw Error("cube " + std::to_string(of_cube) + " is shape-matched: only elements can be cut");
  return stiffness_of(fill, spacing_m_, materials_[material], options_.faded_share());
}

void Tled::scale_stiffness(float scale) {
  require(scale > 0 && std::isfinite(scale), "stiffness scale", scale, "a positive number");
  const float longer = std::sqrt(stiffness_scale_ / scale);
  stable_step_s_ *= longer;
  damping_time_s_ *= longer;
  stiffness_scale_ = scale;
}

void Tled::apply(ExecContext& ctx, const ChangeLists& change) {
  ctx.parallel_for("tled/add_copies", change.copies.size(),
                   cut::AddCopies{.copies = change.copies,
                                  .cube_cell = cube_cell_.const_view(),
                                  .of_cells = kinds(),
                                  .history_Pa = history_Pa_[0].const_view(),
                                  .nodes = virtual_elements_.copies(),
                                  .stiffness = virtual_elements_.stiffness(),
                                  .virtual_history_Pa = virtual_elements_.history(),
                                  .cells = grid_.cells});
  ctx.parallel_for("tled/clear_cubes", change.cubes.size(),
                   cut::ClearCubes{.cubes = change.cubes,
                                   .cube_cell = cube_cell_.const_view(),
                                   .kind = kind_.view(),
                                   .stiffness_fields = stiffness_.view(),
                                   .history_Pa = history_Pa_[0].view(),
                                   .virtual_history_Pa = virtual_elements_.history(),
                                   .of_copies = virtual_elements_.stiffness(),
                                   .cells = grid_.cells});
  ctx.parallel_for("tled/set_masses", change.nodes.size(),
                   cut::SetCellMasses{change.nodes, cell_.const_view(), inverse_mass_per_kg_.view()});
  virtual_elements_.rebuild(ctx, change.copies_end, change.nodes_end);
}

template <class Cube>
void tled::VirtualElements::find_forces(ExecContext& ctx, const Cube& cube, View<const float> x_m,
                                        Index cells) {
  using Kernel = CopyForces<Cube>;
  const View<const Index> used = used_on_device_.const_view();
  ctx.parallel_for(
      "tled/copy_forces", Count(used.part(1, 1), copy_blocks(capacity())),
      Kernel{corners_.const_view(), stiffness_.const_view(), x_m, f_N_.view(), used, cells, cube});
}

template <class Cube, class Sink>
void Tled::launch_forces(ExecContext& ctx, Tiles which, int k, const Cube& cube, const Sink& sink) {
  const Index begin = which == Tiles::interior ? edge_tiles_ : 0;
  const Index end = which == Tiles::edges ? edge_tiles_ : tiles_.size();
  const View<const tled::Tile> tiles = tiles_.const_view().part(begin, end - begin);
  const auto launch = [&]<class Shape>(Shape, const typename Shape::Stiffnesses& stiffness) {
    using Kernel = tled::ElementForces<Cube, Shape, Sink>;
    ctx.parallel_for("tled/element_forces", tiles.size(),
                     Kernel{tiles, active_.const_view(), predicted_m(k), stiffness, grid_, cube, sink});
  };
#if defined(TACTUS_WITH_CUDA)  // else two dozen kernels are compiled that nobody can run
  if (ctx.device().is_cuda()) return launch(tled::TilesOnGpu{}, kinds());
#endif
  launch(tled::TilesOnCpu{}, tled::StiffnessFields{stiffness_.const_view(), grid_.cells});
}

void Tled::compute_forces(ExecContext& ctx, const BodyState& state, const StepTime& time) {
  find_forces(ctx, state, time);
  if (virtual_elements_.has_capacity()) virtual_elements_.add_to(ctx, f_N_.view(), grid_.cells);
}

void Tled::find_forces(ExecContext& ctx, const BodyState& state, const StepTime& time) {
  ctx.parallel_for("tled/load_positions", nodes_in_use(), load_positions(state));
  sum_forces(ctx, Tiles::all, 0, time, tled::StoreForces{f_N_.view(), grid_.cells});
  find_virtual_forces(ctx, 0, time);
  if (time.dt_s > 0 || !time.frame.empty()) keep_history(ctx, 1);
}

tled::LoadPositions Tled::load_positions(const BodyState& state) {
  return {state.x_m.const_view(), state.v_m_s.const_view(), cell_.const_view(), predicted_m(0), grid_.cells,
          damping_time_s_};
}

void Tled::load(ExecContext& ctx, const BodyState& state) {
  ctx.parallel_for(
      "tled/load", node_count(),
      tled::LoadNodes{load_positions(state), state.f_ext_N.const_view(), inverse_mass_per_kg_.const_view(),
                      predicted_m(1), v_m_s_.view(), external_m_s2_.view()});
  if (virtual_elements_.has_capacity()) virtual_elements_.load(ctx, external_m_s2_.const_view(), grid_.cells);
}

template <class F>
void Tled::with_cube(const StepTime& time, View<const float> before, View<float> after, Index stride,
                     F&& use) {
  // Scaled where forces are made, so that copies, history and archives stay those of the material as built.
  const float gradient = 1 / (4 * spacing_m_), area = stiffness_scale_ * (spacing_m_ * spacing_m_ / 4);
  with_law(options_, [&]<class Law>(const Law& law) {
    const float twist_m = stiffness_scale_ * (tled::HourglassControl::kTwist * spacing_m_ *
                                              (1 - options_.faded_share()) / (6 * 8));
    const tled::OnePointCube<Law> elastic{law, gradient, area, twist_m, 0.125F * stiffness_scale_};
    const auto use_relaxing = [&]<int Terms>(std::integral_constant<int, Terms>) {
      tled::RelaxingCube<Law, Terms> cube{.elastic = elastic,
                                          .before = before,
                                          .after = after,
                                          .cells = stride,
                                          .time = time,
                                          .share = {},
                                          .rate_per_s = {},
                                          .added_share = options_.added_share()};
      for (std::size_t n = 0; n < Terms; ++n) {
        cube.share[n] = options_.relaxation[n].share;
        cube.rate_per_s[n] = 1 / options_.relaxation[n].time_s;
        if (options_.relaxation[n].is_added) cube.rate_per_s[n] *= std::sqrt(stiffness_scale_);
      }
      use(cube);
    };
    if (options_.relaxing_terms() == 1) return use_relaxing(std::integral_constant<int, 1>{});
    if (options_.relaxing_terms() == 2) return use_relaxing(std::integral_constant<int, 2>{});
    if (options_.full_integration) return use(tled::EightPointCube<Law>{law, gradient, area});
    use(elastic);
  });
}

template <class Sink>
void Tled::sum_forces(ExecContext& ctx, Tiles which, int k, const StepTime& time, const Sink& sink) {
  with_cube(time, history_Pa_[static_cast<std::size_t>(k % 2)].const_view(),
            history_Pa_[static_cast<std::size_t>((k + 1) % 2)].view(), grid_.cells,
            [&](const auto& cube) { launch_forces(ctx, which, k, cube, sink); });
}

void Tled::find_virtual_forces(ExecContext& ctx, int k, const StepTime& time) {
  if (!virtual_elements_.has_capacity()) return;
  with_cube(time, virtual_elements_.history_before(k), virtual_elements_.history_after(k),
            virtual_elements_.capacity(),
            [&](const auto& cube) { virtual_elements_.find_forces(ctx, cube, predicted_m(k), grid_.cells); });
}

void Tled::keep_history(ExecContext& ctx, int count, View<const FrameParams> frame) {
  if (relaxes() && (count % 2 == 1 || !frame.empty()))
    ctx.parallel_for("tled/keep_history", history_Pa_[0].size(),
                     tled::KeepHistory{history_Pa_[1].const_view(), history_Pa_[0].view(), {count, frame}});
  if (relaxes() && virtual_elements_.has_capacity()) virtual_elements_.keep_history(ctx, {count, frame});
}

void Tled::check_step(float dt_s) const {
  if (!(dt_s > 0 && dt_s <= stable_step_s_ * 1.0001F))
    throw Error("a substep of " + number_text(dt_s, stable_step_s_) +
                " s is not stable: expected more than 0 and at most " + number_text(stable_step_s_) +
                " s for this body");
}

void Tled::step(ExecContext& ctx, BodyState& state, const TledStep& step, int count) {
  require(step.drag_per_s >= 0, "drag [1/s]", step.drag_per_s, "0 or more");
  check_step(step.dt_s);
  if (has_rollers_)
    throw Error("nodes are held along some axes only, which elements alone can't; use Hybrid");
  if (state.x_m.size() != node_count())
    throw Error("body state has " + std::to_string(state.x_m.size()) + " nodes, the model " +
                std::to_string(node_count()));
  load(ctx, state);
  for (int k = 0; k < count; ++k) {
    move_virtual(ctx, step, k);
    move(ctx, step, k, Tiles::all);
  }
  store(ctx, state, count);
}

tled::MoveNodes Tled::move_nodes(const TledStep& step, int k) {
  return {.predicted_m = predicted_m(k),
          .external_m_s2 = external_m_s2_.const_view(),
          .inverse_mass_per_kg = inverse_mass_per_kg_.const_view(),
          .v_m_s = v_m_s_.view(),
          .next_predicted_m = predicted_m(k + 1),
          .cells = grid_.cells,
          .time = step.time(),
          .drag_per_s = step.drag_per_s,
          .damping_time_s = damping_time_s_};
}

void Tled::move_virtual(ExecContext& ctx, const TledStep& step, int k) {
  if (!virtual_elements_.has_capacity()) return;
  find_virtual_forces(ctx, k, step.time());
  virtual_elements_.move(ctx, move_nodes(step, k), external_m_s2_.view());
}

void Tled::move(ExecContext& ctx, const TledStep& step, int k, Tiles which) {
  sum_forces(ctx, which, k, step.time(), move_nodes(step, k));
}

void Tled::store(ExecContext& ctx, BodyState& state, int count, View<const FrameParams> frame) {
  ctx.parallel_for("tled/store", node_count(),
                   tled::StoreNodes{predicted_m(0),
                                    predicted_m(1),
                                    {count, frame},
                                    v_m_s_.const_view(),
                                    cell_.const_view(),
                                    state.x_m.view(),
                                    state.v_m_s.view(),
                                    grid_.cells,
                                    damping_time_s_});
  keep_history(ctx, count, frame);
}

void Tled::find_extremes(ExecContext& ctx, const BodyState& state) {
  ctx.parallel_for("tled/load_positions", nodes_in_use(), load_positions(state));
  const Index tiled = ceil_div(own_cubes_.count(), tled::FindExtremes::kThreads);
  const float gradient = 1 / (4 * spacing_m_);
  ctx.parallel_for(
      "tled/extremes", tiled,
      tled::FindExtremes{cube_cell_.const_view().part(own_cubes_.begin, own_cubes_.count()),
                         predicted_m_[0].const_view(), kinds(), extremes_.view(), grid_, gradient});
  virtual_elements_.find_extremes(ctx, predicted_m_[0].const_view(), grid_.cells,
                                  cube_cell_.size() - own_cubes_.begin, gradient,
                                  extremes_.view().part(tiled, extremes_.size() - tiled));
  ctx.parallel_for("tled/worst_extremes", 1, SummariseExtremes{extremes_.const_view(), worst_.view()});
}

int Tled::substeps_for(float dt_frame_s, float speed_ratio) const {
  require(dt_frame_s > 0, "frame time [s]", dt_frame_s, "a positive number");
  const float needed = std::ceil(dt_frame_s / stable_step_s_ * std::max(1.F, speed_ratio));
  return static_cast<int>(std::clamp(needed, 1.F, 1e9F));
}

std::vector<Vec3f> Tled::forces_N(ExecContext& ctx) const {
  const std::vector<float> fields = to_host(ctx, f_N_.const_view());
  const std::vector<Index> cell = to_host(ctx, cell_.const_view());
  std::vector<Vec3f> forces(cell.size());
  const auto cells = static_cast<std::size_t>(grid_.cells);
  for (std::size_t i = 0; i < cell.size(); ++i) {
    const auto c = static_cast<std::size_t>(cell[i]);
    forces[i] = {fields[c], fields[cells + c], fields[2 * cells + c]};
  }
  return forces;
}

}  // namespace tactus
