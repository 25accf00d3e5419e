#include "tactus/sim/body/soft_body.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/sim/body/body_cut.h"
#include "tactus/sim/body/body_progress.h"
#include "tactus/sim/body/default_damping.h"
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

BodySolver make_tissue(DeviceSet& devices, const BodyDescription& body, const BodyShape& shape,
                       const TledOptions& elements, bool on_first_device) {
  const FlsmMaterial matched = matched_material(devices.context(0), body.material, shape);
  const std::optional<double> least =
      on_first_device ? std::optional(std::numeric_limits<double>::infinity()) : std::nullopt;
  // Where bodies touch bodies, that contact changes nodes once more.
  const int changes = !body.contact ? 0 : on_first_device ? 2 : 1;
  report_many_cubes(body, static_cast<double>(shape.lattice.cube_count()),
                    " cubes: making tables of their elements");
  try {
    return BodySolver(
        devices,
        {.lattice = shape.lattice,
         .elements = shape.elements,
         .materials = shape.materials,
         .material_of_cube = shape.material_of_cube,
         .tled = elements,
         .flsm = matched,
         .conditions = {.motions = shape.motions, .loads = shape.loads, .surface = &shape.surface_m}},
        {.least_elements = least, .changes = changes});
  } catch (const Error& e) {
    throw Error("body '" + body.name + "': " + e.what(), e.kind());
  }
}

}  // namespace

SoftBody::SoftBody(DeviceSet& devices, const BodyDescription& body, const BodyAssets& assets,
                   bool on_first_device)
    : SoftBody(devices, body,
               with_cut_capacity(body, make_body_shape(body, assets, memory_bytes(devices.device(0)))),
               on_first_device) {}

SoftBody::SoftBody(DeviceSet& devices, const BodyDescription& body, BodyShape shape, bool on_first_device)
    : description_(body),
      built_young_Pa_(body.material.young_modulus_pa),
      shape_(std::move(shape)),
      built_materials_(shape_.materials),
      element_options_(element_options(body.material, shape_)),
      devices_(devices),
      on_first_device_(on_first_device),
      tissue_(make_tissue(devices, body, shape_, element_options_, on_first_device)),
      frame_begin_x_m_(devices.device(0), shape_.lattice.node_count()),
      surface_(devices.context(0), shape_.lattice, shape_.surface_m, 1,
               surface_capacity(shape_.lattice, shape_.surface_m)),
      full_stiffness_(body.material.kappa == Stiffness::paper) {
  find_largest_energy();
  for (const std::string& warning : shape_.warnings) log_warning("body '" + name() + "': " + warning);
  for (const NodeMotion& motion : shape_.motions) warn_of_fast_motion(motion);
  if (body.cuttable) make_cuttable(devices.context(0));
  report_many_cubes(body, static_cast<double>(shape_.lattice.cube_count()),
                    " cubes: finding their surface's points");
  if (body.contact) make_points();
  report_many_cubes(body, static_cast<double>(shape_.lattice.cube_count()), " cubes: made");
}

void SoftBody::find_largest_energy() {
  float young_Pa = 0;
  for (const ElasticMaterial& m : shape_.materials) young_Pa = std::max(young_Pa, m.young_Pa);
  largest_energy_J_ = 100 * double{young_Pa} * std::pow(double{shape_.lattice.spacing_m}, 3) *
                      static_cast<double>(shape_.lattice.cube_count());
}

void SoftBody::set_young_modulus_Pa(double young_Pa) {
  const auto scale = static_cast<float>(young_Pa / built_young_Pa_);
  tissue_.scale_stiffness(scale);
  description_.material.young_modulus_pa = young_Pa;
  for (std::size_t k = 0; k < shape_.materials.size(); ++k)
    shape_.materials[k].young_Pa = scale * built_materials_[k].young_Pa;
  find_largest_energy();
}

std::string SoftBody::devices_text() const {
  if (device_count() > 1)
    return "stepped by " + std::to_string(device_count()) + " of " + std::to_string(devices_.count()) +
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
  if (fastest.speed_m_s <= wave_m_s() || motion.nodes.size() == shape_.lattice.nodes.size()) return;
  char text[160];
  std::snprintf(text, sizeof text,
                " moves at %.3g m/s on the way to keyframe %zu, faster than waves in the body (%.3g m/s): ",
                fastest.speed_m_s, fastest.key, wave_m_s());
  log_warning("body '" + name() + "': " + motion.name + text +
              "cubes next to it will invert; give it more time, or the body a larger young_modulus_pa");
}

/// Nothing looks into the frame of a body on which nothing acts.
int SoftBody::check_every(int substeps) const { return nothing_acts() ? substeps : tissue_.check_every(); }

std::string SoftBody::end_frame(ExecContext& ctx, const Readback& readback, int substeps) {
  if (is_frozen_) return "";
  const tled::CubeExtremes strain_before = strain_;
  const NodeCheckRecord before = node_check_;
  strain_ = tissue_.extremes(&readback);
  node_check_ = tissue_.node_check(&readback);
  motion_ = tissue_.rigid_motion(&readback);
  tissue_.set_spin(motion_.spin_rad_s);
  const std::string impossible = impossible_state();
  if (impossible.empty() && node_check_.bad_substep < 0) return "";
  const NodeCheckRecord bad = node_check_;
  std::string text = "body '" + name() + "' blew up" + (bad.bad_substep < 0 ? impossible : "");
  if (bad.bad_substep >= 0) {
    const int last = bad.bad_substep + 1, every = check_every(substeps),
              first = (last - 1) / every * every + 1;
    text += (first < last ? " in substeps " + std::to_string(first) + " to " : " in substep ") +
            std::to_string(last) + " of " + std::to_string(substeps) + ", first seen at " +
            node_text(bad.bad_node);
    const std::string acting = acting_near(shape_.lattice.rest_m(bad.bad_node));
    if (!acting.empty()) text += ": " + acting;
  }
  const std::vector<Vec3f> x_m = to_host(ctx, frame_begin_x_m_.const_view());
  tissue_.set_state(x_m, std::vector<Vec3f>(x_m.size()));
  tissue_.stop();
  strain_ = strain_before;
  node_check_ = before;
  is_frozen_ = true;
  char state[200];
  std::snprintf(state, sizeof state,
                "; in the frame before, its fastest node went at %.3g m/s, waves at %.3g m/s",
                static_cast<double>(fastest_m_s()), wave_m_s() * static_cast<double>(strain_.speed_ratio));
  text += state;
  if (model().has_elements()) {
    std::snprintf(state, sizeof state, ", and least volume was %.3g of that at rest in ",
                  static_cast<double>(strain_.smallest_J));
    text += state + cube_text(strain_.smallest_cube);
  }
  return text +
         "; it rests from now on: press or move it less, use more substeps, more damping or a finer lattice";
}

std::string SoftBody::impossible_state() const {
  // Kinetic energy without that of flight and turning, which no material limits.
  const double moving_J = motion_.kinetic_J -
                          0.5 * motion_.mass_kg * dot(motion_.velocity_m_s, motion_.velocity_m_s) -
                          0.5 * dot(motion_.spin_rad_s, motion_.angular_momentum_kg_m2_s);
  char text[160];
  // A cube turned inside out by twice its volume: no force of a law makes that.
  if (!(strain_.smallest_J > kLeastJ)) {
    std::snprintf(text, sizeof text, ": the volume of %s is %.3g times that at rest",
                  cube_text(strain_.smallest_cube).c_str(), double{strain_.smallest_J});
    const std::string acting = acting_near(cube_center_m(strain_.smallest_cube));
    return text + (acting.empty() ? "" : " (" + acting + ")");
  }
  if (!(moving_J < largest_energy_J_)) {
    std::snprintf(text, sizeof text,
                  ": its kinetic energy is %.3g J, and a hundred times what strains it wholly is %.3g J",
                  moving_J, largest_energy_J_);
    return text;
  }
  return std::isfinite(strain_.speed_ratio) ? "" : ": its strain is not finite";
}

std::string SoftBody::newly_inverted() {
  const bool before = std::exchange(was_inverted_, !is_frozen_ && strain_.inverted > 0);
  if (before || !was_inverted_) return "";
  char text[160];
  std::snprintf(text, sizeof text, "body '%s': %d cubes are inverted, the most %s, to %.3g times its volume",
                name().c_str(), strain_.inverted, cube_text(strain_.smallest_cube).c_str(),
                double{strain_.smallest_J});
  return text;
}

double SoftBody::fastest_near_m_s(double surface_m_s, double from_s, double to_s) const {
  if (is_frozen_ || nothing_acts()) return 0;
  // A body that touches nothing may step as far as its material allows.
  const double own_m_s =
      description_.contact ? double{fastest_m_s()} : std::sqrt(double{node_check_.fastest_element2_m2_s2});
  double speed = std::max(own_m_s, description_.contact ? surface_m_s : 0);
  for (const NodeMotion& motion : shape_.motions)
    speed = std::max(speed, fastest_move(shape_.lattice, motion, from_s, to_s).speed_m_s);
  return speed;
}

void SoftBody::stop_nodes(ExecContext& ctx, double ago_s) {
  std::vector<Vec3f> x_m = positions_m(ctx), v_m_s = velocities_m_s(ctx);
  for (std::size_t i = 0; i < x_m.size(); ++i)
    x_m[i] = x_m[i] - static_cast<float>(ago_s) * std::exchange(v_m_s[i], Vec3f{});
  tissue_.set_state(x_m, v_m_s);
}

void SoftBody::slow_nodes(ExecContext& ctx, std::span<const Vec3d> by_m_s) {
  std::vector<Vec3f> v_m_s = velocities_m_s(ctx);
  for (std::size_t i = 0; i < v_m_s.size(); ++i) v_m_s[i] -= vec_cast<float>(by_m_s[i]);
  tissue_.set_state(positions_m(ctx), v_m_s);
}

float SoftBody::fastest_m_s() const { return std::sqrt(node_check_.fastest2_m2_s2); }

double SoftBody::wave_m_s() const {
  const MaterialDescription& m = description_.material;
  const double bar = std::sqrt(m.young_modulus_pa / m.density_kg_m3);
  return model().has_elements()
             ? std::max(bar, description_.spacing_m / static_cast<double>(model().stable_step_s()))
             : bar;
}

std::string SoftBody::acting_near(Vec3f p_m) const {
  const CubeLattice& lattice = shape_.lattice;
  float nearest_m = std::numeric_limits<float>::infinity();
  std::string text;
  // Names all causes that are equally near.
  const auto add = [&](const std::vector<Index>& nodes, const std::string& what) {
    float least_m = std::numeric_limits<float>::infinity();
    for (const Index node : nodes) least_m = std::min(least_m, length(lattice.rest_m(node) - p_m));
    if (nodes.empty() || least_m > nearest_m) return;
    text = (least_m < nearest_m || text.empty() ? "" : text + ", ") + what;
    nearest_m = least_m;
  };
  for (const NodeMotion& motion : shape_.motions) {
    char speed[48];
    std::snprintf(speed, sizeof speed, " moves it, at up to %.3g m/s",
                  fastest_move(lattice, motion).speed_m_s);
    add(motion.nodes, motion.name + speed);
  }
  for (std::size_t k = 0; k < shape_.loads.size(); ++k)
    add(tissue_.boundary().loads().nodes_of(k), shape_.loads[k].name + " acts on it");
  // Fixed nodes far away are no cause of an event here.
  std::vector<Index> fixed;
  for (Index i = 0; i < lattice.node_count(); ++i)
    if (lattice.fixed[static_cast<std::size_t>(i)] != 0 &&
        length(lattice.rest_m(i) - p_m) < 3.5F * lattice.spacing_m)
      fixed.push_back(i);
  add(fixed, "'fixed' holds it");
  add(points_.touched(), "the real surface or an obstacle touches it");
  if (text.empty() || nearest_m < 0.9F * lattice.spacing_m) return text;
  char distance[48];
  std::snprintf(distance, sizeof distance, ", %.3g m from there", static_cast<double>(nearest_m));
  return text + distance;
}

Vec3f SoftBody::cube_center_m(Index cube) const {
  const CubeLattice& lattice = shape_.lattice;
  return lattice.origin_m +
         lattice.spacing_m *
             (vec_cast<float>(lattice.cubes[static_cast<std::size_t>(cube)]) + Vec3f{0.5F, 0.5F, 0.5F});
}

void SoftBody::warn_of_many_substeps(float dt_s, int substeps, int most) {
  const int unstrained = model().substeps_for(dt_s), needed = substeps_for(dt_s);
  if (warned_of_substeps_ || is_frozen_ || needed <= most || (unstrained <= most && needed <= substeps))
    return;
  const MaterialDescription& m = description_.material;
  char text[320];
  if (unstrained > most) {
    std::snprintf(
        text, sizeof text,
        "': a frame of %.3g s takes %d substeps, as it is stable up to %.3g s: young_modulus_pa %.3g, "
        "density_kg_m3 %.3g and spacing_m %.3g make waves that fast; a coarser lattice, a softer or "
        "a heavier material takes fewer",
        double{dt_s}, unstrained, double{model().stable_step_s()}, m.young_modulus_pa, m.density_kg_m3,
        description_.spacing_m);
  } else {
    std::snprintf(
        text, sizeof text,
        "' is crushed: waves are %.3g times as fast as at rest in %s, which asks for %d substeps; it "
        "gets %d: press it less or slower, or make it stiffer",
        double{strain_.speed_ratio}, cube_text(strain_.fastest_cube).c_str(), needed, substeps);
  }
  log_warning("body '" + name() + text);
  warned_of_substeps_ = true;
}

void SoftBody::check_substeps(float dt_frame_s, int substeps, int most_of_frame) {
  warn_of_many_substeps(dt_frame_s, substeps, most_of_frame);
  const float dt_s = dt_frame_s / static_cast<float>(substeps);
  char text[256];
  if (model().has_elements() && dt_s > 1.0001F * model().tled().stable_step_s()) {
    const double stable_s = model().tled().stable_step_s();
    throw usage_error("body '" + name() + "': 'frame.substeps' is " + std::to_string(substeps) +
                      ", steps of " + number_text(dt_s, stable_s) + " s, but its elements are stable up to " +
                      number_text(stable_s) + " s; expected at least " +
                      std::to_string(model().tled().substeps_for(dt_frame_s)) + ", or auto");
  }
  if (matching_every() > 1 && substeps % matching_every() != 0) {
    std::snprintf(text, sizeof text,
                  "': 'frame.substeps' is %d, expected a multiple of its 'matching_every', %d", substeps,
                  matching_every());
    throw usage_error("body '" + name() + text);
  }
  if (const int most = model().most_matching_every(dt_s); matching_every() > most) {
    std::snprintf(
        text, sizeof text,
        "': 'matching_every' is %d, but after more than %d substeps of %.3g s at once its shape matching "
        "would be softer than its material; expected at most %d",
        matching_every(), most, static_cast<double>(dt_s), most);
    throw usage_error("body '" + name() + text);
  }
  if (!model().flsm() || full_stiffness_ || warned_of_softness_) return;
  const double young_Pa = static_cast<double>(model().flsm()->effective_young_Pa(dt_s));
  if (young_Pa > 0.99 * description_.material.young_modulus_pa) return;
  std::snprintf(text, sizeof text,
                "': 'frame.substeps' is %d, so its shape matching is as soft as a young_modulus_pa of %.3g; "
                "expected at least %d, or auto",
                substeps, young_Pa, model().flsm()->substeps_for(dt_frame_s));
  log_warning("body '" + name() + text);
  warned_of_softness_ = true;
}

std::string SoftBody::node_text(Index node) const {
  const Vec3f p = shape_.lattice.rest_m(node);
  char text[96];
  std::snprintf(text, sizeof text, "node %d, at rest at (%.3f, %.3f, %.3f) m", node, static_cast<double>(p.x),
                static_cast<double>(p.y), static_cast<double>(p.z));
  return text;
}

std::string SoftBody::cube_text(Index cube) const {
  const Vec3f p = cube_center_m(cube);
  char text[96];
  std::snprintf(text, sizeof text, "cube %d, at rest round (%.3f, %.3f, %.3f) m", cube,
                static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z));
  const std::uint8_t material = shape_.material_of_cube[static_cast<std::size_t>(cube)];
  const std::string region = material == 0 ? "" : description_.regions[material - 1U].name;
  return text + (region.empty() ? "" : " in region '" + region + "'");
}

BodyMonitors SoftBody::monitors(ExecContext& ctx, double step_s) const {
  return measure_body(shape_.lattice, shape_.elements, shape_.materials, shape_.material_of_cube,
                      element_options_, to_host(ctx, tissue_.body().x_m.const_view()),
                      to_host(ctx, tissue_.body().v_m_s.const_view()), step_s);
}

std::vector<CubeStrain> SoftBody::strains(ExecContext& ctx) const {
  return cube_strains(shape_.lattice, shape_.elements, shape_.materials, shape_.material_of_cube,
                      element_options_, positions_m(ctx));
}

std::vector<CubeStrain> SoftBody::strains(std::span<const Vec3f> x_m, std::span<const Index> cubes) const {
  return cube_strains(shape_.lattice, shape_.elements, shape_.materials, shape_.material_of_cube,
                      element_options_, x_m, cubes);
}

std::vector<std::uint8_t> SoftBody::element_triangles(ExecContext& ctx) const {
  const std::vector<embed::Anchor> anchors = to_host(ctx, surface_.anchors());
  const std::vector<Index> corners = to_host(ctx, surface_.triangles());
  std::vector<std::uint8_t> is_element;
  for (std::size_t t = 0; t < corners.size(); t += 3) {
    const auto cube = static_cast<std::size_t>(anchors[static_cast<std::size_t>(corners[t])].cube);
    is_element.push_back(shape_.elements[cube]);
  }
  return is_element;
}

}  // namespace tactus
