#include "tactus/sim/body/soft_body.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/sim/body/body_cuts.h"
#include "tactus/sim/body/body_measures.h"
#include "tactus/sim/body/body_places.h"
#include "tactus/sim/body/body_progress.h"
#include "tactus/sim/body/body_pull.h"
#include "tactus/sim/body/body_steps.h"
#include "tactus/sim/body/cut_capacity.h"
#include "tactus/sim/body/default_damping.h"
#include "tactus/sim/body/slab_points.h"
#include "tactus/tissue/hybrid/body_solver.h"
#include "tactus/tissue/hybrid/deflection_match.h"

namespace tactus {
namespace {

/// Least volume of a cube over that at rest.
constexpr float kLeastJ = -2;

double memory_bytes(const Device& device) {
  double bytes = 0;
  for (const DeviceInfo& info : list_devices()) {
    if ((info.spec.kind == DeviceKind::cuda) == device.is_cuda()) bytes = std::max(bytes, info.memory_bytes);
  }
  return bytes;
}

double volume_m3(const CubeLattice& lattice) {
  double cubes = 0;
  for (Index c = 0; c < lattice.regular_cubes(); ++c)
    cubes += lattice.cube_fill.empty() ? 1 : double{lattice.cube_fill[static_cast<std::size_t>(c)]};
  return cubes * std::pow(double{lattice.spacing_m}, 3);
}

TledOptions element_options(const MaterialDescription& m, const BodyShape& shape) {
  TledOptions options{
      .law = m.law, .fibre = vec_cast<float>(m.fibre), .fibre_ratio = static_cast<float>(m.fibre_ratio)};
  set_damping(options, m, volume_m3(shape.lattice));
  for (std::size_t n = 0; n < m.relaxation.size(); ++n)
    options.relaxation.at(n) = {static_cast<float>(m.relaxation[n].share),
                                static_cast<float>(m.relaxation[n].time_s)};
  return options;
}

FlsmMaterial matched_material(ExecContext& ctx, const MaterialDescription& m, const BodyShape& shape) {
  FlsmMaterial material{.young_Pa = static_cast<float>(m.young_modulus_pa),
                        .density_kg_m3 = static_cast<float>(m.density_kg_m3),
                        .half_width = m.half_width};
  set_damping(material, m, volume_m3(shape.lattice));
  if (!m.deflection_test) return material;
  TledOptions at_once = element_options(m, shape);
  at_once.relaxation = {};
  CubeLattice held = shape.lattice;
  for (const NodeMotion& motion : shape.motions) {
    for (const Index node : motion.nodes) held.fixed[static_cast<std::size_t>(node)] = kAllAxes;
  }
  material.stiffness_scale = match_deflection(ctx, {.lattice = held,
                                                    .elements = shape.elements,
                                                    .materials = shape.materials,
                                                    .material_of_cube = shape.material_of_cube,
                                                    .tled = at_once,
                                                    .flsm = material});
  return material;
}

std::unique_ptr<BodySolver> make_tissue(DeviceSet& devices, const BodyDescription& body,
                                        const BodyShape& shape, const TledOptions& elements,
                                        bool on_first_device) {
  const FlsmMaterial matched = matched_material(devices.context(0), body.material, shape);
  const std::optional<double> least =
      on_first_device ? std::optional(std::numeric_limits<double>::infinity()) : std::nullopt;
  // Where bodies touch bodies, that contact changes nodes once more.
  const int changes = !body.contact ? 0 : on_first_device ? 2 : 1;
  report_many_cubes(body, static_cast<double>(shape.lattice.cube_count()),
                    " cubes: making tables of their elements");
  return std::make_unique<BodySolver>(
      devices,
      BodyModel{.lattice = shape.lattice,
                .elements = shape.elements,
                .materials = shape.materials,
                .material_of_cube = shape.material_of_cube,
                .tled = elements,
                .flsm = matched,
                .conditions = {.motions = shape.motions, .loads = shape.loads, .surface = &shape.surface_m}},
      BodySolver::Settings{.least_elements = least, .changes = changes});
}

}  // namespace

SoftBody::SoftBody(DeviceSet& devices, const BodyDescription& body, const BodyAssets& assets,
                   bool on_first_device)
    : SoftBody(devices, body, make_body_shape(body, assets, memory_bytes(devices.device(0))),
               on_first_device) {}

SoftBody::SoftBody(DeviceSet& devices, const BodyDescription& body, BodyShape shape, bool on_first_device)
    : description_(body),
      built_young_Pa_(body.material.young_modulus_pa),
      uncut_(body.cuttable ? shape : BodyShape{}),
      shape_(with_cut_capacity(std::move(shape), first_cut_capacity(body, uncut_))),
      built_materials_(shape_.materials),
      devices_(devices),
      on_first_device_(on_first_device) {
  make_parts();
  for (const std::string& warning : shape_.warnings) log_warning("body '" + name() + "': " + warning);
  for (const NodeMotion& motion : shape_.motions) warn_of_fast_motion(motion);
}

void SoftBody::make_parts() {
  try {
    build_parts();
  } catch (const Error& e) {
    std::string text = "body '" + name() + "': " + e.what();
    for (const std::string& odd : shape_.warnings) text += "; " + odd;
    throw Error(text, e.kind());
  }
}

void SoftBody::build_parts() {
  BodyDescription built = description_;
  built.material.young_modulus_pa = built_young_Pa_;
  const TledOptions elements = element_options(built.material, shape_);
  tissue_ = make_tissue(devices_, built, shape_, elements, on_first_device_);
  frame_begin_x_m_ = Buffer<Vec3f>(devices_.device(0), shape_.lattice.node_count());
  surface_ = std::make_unique<EmbeddedSurface>(devices_.context(0), shape_.lattice, shape_.surface_m, 1.F,
                                               surface_capacity(shape_.lattice, shape_.surface_m));
  points_ = std::make_unique<SlabPoints>();
  pull_ = std::make_unique<BodyPull>();
  measures_ = std::make_unique<BodyMeasures>(shape_, elements, *tissue_);
  places_ = std::make_unique<BodyPlaces>(description_, shape_, *tissue_, *points_);
  steps_ = std::make_unique<BodySteps>(description_, shape_, *tissue_, status_, *places_);
  find_largest_energy();
  make_points_and_cuts();
}

bool SoftBody::may_grow() const {
  constexpr Index kMostCopies = 10'000'000;  // as of the scene's key
  return cuts_ != nullptr && !description_.cut_capacity && cuts_->can_grow() &&
         static_cast<Index>(shape_.lattice.copies.size()) <= kMostCopies / 2;
}

void SoftBody::rebuild(Index copies) {
  const double young_Pa = description_.material.young_modulus_pa;
  cuts_.reset();  // the old parts go first: there may be no memory for both
  steps_.reset();
  places_.reset();
  measures_.reset();
  pull_.reset();
  points_.reset();
  surface_.reset();
  tissue_.reset();
  shape_ = with_cut_capacity(uncut_, copies);
  make_parts();
  if (young_Pa != built_young_Pa_) set_young_modulus_Pa(young_Pa);
}

SoftBody::~SoftBody() = default;

void SoftBody::make_points_and_cuts() {
  const auto cubes = static_cast<double>(shape_.lattice.cube_count());
  report_many_cubes(description_, cubes, " cubes: finding their surface's points");
  std::optional<BodyBoundary> boundary;
  if (description_.contact) {
    boundary = body_boundary(shape_.lattice, shape_.surface_m, shape_.elements);
    *points_ = SlabPoints(*tissue_, shape_.lattice, *boundary, point_capacity(shape_.lattice));
    *pull_ = BodyPull(*tissue_);
  }
  if (description_.cuttable)
    cuts_ = std::make_unique<BodyCuts>(
        devices_.context(0), CutTargets{description_, status_, shape_, *tissue_, *surface_, *points_},
        boundary ? &*boundary : nullptr);
  report_many_cubes(description_, cubes, " cubes: made");
}

BodyResources SoftBody::resources() const {
  return {stage("nodes"), stage("surface"), stage("report"), stage("contact report")};
}

std::vector<Vec3f> SoftBody::positions_m(ExecContext& ctx) const {
  return to_host(ctx, tissue_->body().x_m.const_view());
}

std::vector<Vec3f> SoftBody::velocities_m_s(ExecContext& ctx) const {
  return to_host(ctx, tissue_->body().v_m_s.const_view());
}

void SoftBody::set_nodes(std::span<const Vec3f> x_m, std::span<const Vec3f> v_m_s) {
  tissue_->set_state(x_m, v_m_s);
}

void SoftBody::update_surface(ExecContext& ctx) { surface_->update(ctx, tissue_->body()); }

void SoftBody::find_largest_energy() {
  float young_Pa = 0;
  for (const ElasticMaterial& m : shape_.materials) young_Pa = std::max(young_Pa, m.young_Pa);
  largest_energy_J_ = 100 * double{young_Pa} * std::pow(double{shape_.lattice.spacing_m}, 3) *
                      static_cast<double>(shape_.lattice.cube_count());
}

void SoftBody::set_young_modulus_Pa(double young_Pa) {
  const auto scale = static_cast<float>(young_Pa / built_young_Pa_);
  tissue_->scale_stiffness(scale);
  description_.material.young_modulus_pa = young_Pa;
  for (std::size_t k = 0; k < shape_.materials.size(); ++k)
    shape_.materials[k].young_Pa = scale * built_materials_[k].young_Pa;
  find_largest_energy();
}

std::string SoftBody::devices_text() const {
  if (tissue_->slab_count() > 1)
    return "stepped by " + std::to_string(tissue_->slab_count()) + " of " + std::to_string(devices_.count()) +
           " devices";
  std::string one = "on one device of " + std::to_string(devices_.count());
  if (devices_.count() == 1) return one;
  if (on_first_device_)
    return one + ", as it may touch bodies ('contact.bodies', 'contact.self', 'contact.cut_walls')";
  return one + ", as it is too small to be cut, or for more to pay";
}

/// A body that is torn faster than its waves can follow inverts its cubes.
void SoftBody::warn_of_fast_motion(const NodeMotion& motion) const {
  const FastestMove fastest = fastest_move(shape_.lattice, motion);
  if (fastest.speed_m_s <= steps_->wave_m_s() || motion.nodes.size() == shape_.lattice.nodes.size()) return;
  char text[160];
  std::snprintf(text, sizeof text,
                " moves at %.3g m/s on the way to keyframe %zu, faster than waves in the body (%.3g m/s): ",
                fastest.speed_m_s, fastest.key, steps_->wave_m_s());
  log_warning("body '" + name() + "': " + motion.name + text +
              "cubes next to it will invert; give it more time, or the body a larger young_modulus_pa");
}

std::string SoftBody::end_frame(ExecContext& ctx, const Readback& readback, int substeps) {
  if (status_.is_frozen) return "";
  const tled::CubeExtremes strain_before = status_.strain;
  const NodeCheckRecord before = status_.node_check;
  status_.strain = tissue_->extremes(&readback);
  status_.node_check = tissue_->node_check(&readback);
  status_.motion = tissue_->rigid_motion(&readback);
  tissue_->set_spin(status_.motion.spin_rad_s);
  const std::string impossible = impossible_state();
  if (impossible.empty() && status_.node_check.bad_substep < 0) return "";
  const NodeCheckRecord bad = status_.node_check;
  std::string text = "body '" + name() + "' blew up" + (bad.bad_substep < 0 ? impossible : "");
  if (bad.bad_substep >= 0) {
    const int last = bad.bad_substep + 1, every = steps_->check_every(substeps),
              first = (last - 1) / every * every + 1;
    text += (first < last ? " in substeps " + std::to_string(first) + " to " : " in substep ") +
            std::to_string(last) + " of " + std::to_string(substeps) + ", first seen at " +
            places_->node_text(bad.bad_node);
    const std::string acting = places_->acting_near(shape_.lattice.rest_m(bad.bad_node));
    if (!acting.empty()) text += ": " + acting;
  }
  const std::vector<Vec3f> x_m = to_host(ctx, frame_begin_x_m_.const_view());
  tissue_->set_state(x_m, std::vector<Vec3f>(x_m.size()));
  tissue_->stop();
  update_surface(ctx);
  status_.strain = strain_before;
  status_.node_check = before;
  status_.is_frozen = true;
  char state[200];
  std::snprintf(state, sizeof state,
                "; in the frame before, its fastest node went at %.3g m/s, waves at %.3g m/s",
                static_cast<double>(status_.fastest_m_s()),
                steps_->wave_m_s() * static_cast<double>(status_.strain.speed_ratio));
  text += state;
  if (tissue_->model().has_elements()) {
    std::snprintf(state, sizeof state, ", and least volume was %.3g of that at rest in ",
                  static_cast<double>(status_.strain.smallest_J));
    text += state + places_->cube_text(status_.strain.smallest_cube);
  }
  return text +
         "; it rests from now on: press or move it less, use more substeps, more damping or a finer lattice";
}

std::string SoftBody::impossible_state() const {
  // Kinetic energy without that of flight and turning, which no material limits.
  const double moving_J =
      status_.motion.kinetic_J -
      0.5 * status_.motion.mass_kg * dot(status_.motion.velocity_m_s, status_.motion.velocity_m_s) -
      0.5 * dot(status_.motion.spin_rad_s, status_.motion.angular_momentum_kg_m2_s);
  char text[160];
  // A cube turned inside out by twice its volume: no force of a law makes that.
  if (!(status_.strain.smallest_J > kLeastJ)) {
    std::snprintf(text, sizeof text, ": the volume of %s is %.3g times that at rest",
                  places_->cube_text(status_.strain.smallest_cube).c_str(),
                  double{status_.strain.smallest_J});
    const std::string acting = places_->acting_near(places_->cube_center_m(status_.strain.smallest_cube));
    return text + (acting.empty() ? "" : " (" + acting + ")");
  }
  if (!(moving_J < largest_energy_J_)) {
    std::snprintf(text, sizeof text,
                  ": its kinetic energy is %.3g J, and a hundred times what strains it wholly is %.3g J",
                  moving_J, largest_energy_J_);
    return text;
  }
  return std::isfinite(status_.strain.speed_ratio) ? "" : ": its strain is not finite";
}

std::string SoftBody::newly_inverted() {
  const bool before = std::exchange(was_inverted_, !status_.is_frozen && status_.strain.inverted > 0);
  if (before || !was_inverted_) return "";
  char text[160];
  std::snprintf(text, sizeof text, "body '%s': %d cubes are inverted, the most %s, to %.3g times its volume",
                name().c_str(), status_.strain.inverted,
                places_->cube_text(status_.strain.smallest_cube).c_str(), double{status_.strain.smallest_J});
  return text;
}

}  // namespace tactus
