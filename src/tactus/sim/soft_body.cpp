#include "tactus/sim/soft_body.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "tactus/geom/figures.h"
#include "tactus/tissue/surface_nets.h"

namespace tactus {
namespace {

struct Solid {
  std::function<float(Vec3f)> distance_m;  ///< body coordinates, negative inside
  Box3f box_m;
};

float box_distance_m(Vec3f p, Vec3f half) {
  const Vec3f q{std::abs(p.x) - half.x, std::abs(p.y) - half.y, std::abs(p.z) - half.z};
  return length(max(q, Vec3f{})) + std::min(std::max({q.x, q.y, q.z}), 0.F);
}

/// Box, sphere and figure as signed distances.
Solid make_solid(const ShapeDescription& shape) {
  if (shape.kind == ShapeKind::box) {
    const Vec3f half = vec_cast<float>(0.5 * shape.size_m);
    return {[half](Vec3f p) { return box_distance_m(p, half); }, {-half, half}};
  }
  if (shape.kind == ShapeKind::sphere) {
    const auto r = static_cast<float>(shape.radius_m);
    return {[r](Vec3f p) { return length(p) - r; }, {{-r, -r, -r}, {r, r, r}}};
  }
  const auto figure = std::make_shared<FigureShape>(make_figure(shape.figure).at(0));
  return {[figure](Vec3f p) { return figure->distance_m(p); }, figure->bounds_m()};
}

/// The shape's closed surface in body coordinates; smooth ones are sampled at half the lattice's spacing.
TriangleMesh body_surface(const BodyDescription& body, const BodyAssets& assets) {
  const ShapeDescription& shape = body.shape;
  const auto fineness = static_cast<float>(0.5 * body.spacing_m / body.placement.scale);
  if (shape.kind == ShapeKind::mesh) return assets.meshes.at(body.name);
  if (shape.kind == ShapeKind::labels) {
    std::set<std::uint8_t> solid(shape.labels.begin(), shape.labels.end());
    const LabelVolume& volume = assets.labels.at(body.name);
    if (solid.empty()) solid.insert(volume.labels.begin(), volume.labels.end());
    solid.erase(0);
    return surface_of_labels(volume, solid, fineness);
  }
  const Solid solid = make_solid(shape);
  const Vec3f margin{2 * fineness, 2 * fineness, 2 * fineness};
  return surface_nets(solid.distance_m, {solid.box_m.min - margin, solid.box_m.max + margin}, fineness);
}

/// Materials and models of the cubes: the body's own, then region after region.
void paint(const BodyDescription& body, BodyShape& shape) {
  const MaterialDescription& m = body.material;
  shape.materials = {{static_cast<float>(m.young_modulus_pa), static_cast<float>(m.poisson_ratio),
                      static_cast<float>(m.density_kg_m3)}};
  CubeLattice& lattice = shape.lattice;
  shape.material_of_cube.assign(lattice.cubes.size(), 0);
  shape.elements.assign(lattice.cubes.size(), m.model == TissueModel::tled ? 1 : 0);
  if (body.ratio)
    shape.elements =
        split_by_ratio(lattice, static_cast<int>(body.ratio->axis), body.ratio->tled, body.ratio->flsm);
  for (std::size_t r = 0; r < body.regions.size(); ++r) {
    const PaintedRegion& region = body.regions[r];
    ElasticMaterial material = shape.materials.front();
    if (region.young_modulus_pa) material.young_Pa = static_cast<float>(*region.young_modulus_pa);
    if (region.poisson_ratio) material.poisson = static_cast<float>(*region.poisson_ratio);
    if (region.density_kg_m3) material.density_kg_m3 = static_cast<float>(*region.density_kg_m3);
    shape.materials.push_back(material);
    std::size_t painted = 0;
    for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
      const Vec3f center =
          lattice.origin_m + lattice.spacing_m * (vec_cast<float>(lattice.cubes[c]) + Vec3f{.5F, .5F, .5F});
      if (!body.in(region.where, vec_cast<double>(center))) continue;
      shape.material_of_cube[c] = static_cast<std::uint8_t>(r + 1);
      if (region.model != RegionModel::unchanged)
        shape.elements[c] = region.model == RegionModel::tled ? 1 : 0;
      lattice.cube_mass_kg[c] *= material.density_kg_m3 / shape.materials.front().density_kg_m3;
      ++painted;
    }
    if (painted == 0)
      throw usage_error("region " + std::to_string(r) +
                        (region.name.empty() ? "" : " ('" + region.name + "')") +
                        " holds no cube of the body");
  }
  lattice.share_masses();
}

}  // namespace

BodyShape make_body_shape(const BodyDescription& body, const BodyAssets& assets) {
  try {
    BodyShape shape;
    shape.surface_m = body_surface(body, assets);
    for (Vec3f& p : shape.surface_m.positions_m)
      p = vec_cast<float>(body.placement.to_world(vec_cast<double>(p)));
    compute_normals(shape.surface_m);
    LatticeOptions options;
    options.spacing_m = static_cast<float>(body.spacing_m);
    options.density_kg_m3 = static_cast<float>(body.material.density_kg_m3);
    shape.lattice = lattice_from_mesh(shape.surface_m, options);
    shape.node_outside_m = node_outside_m(shape.lattice, shape.surface_m);
    shape.lattice.fill_by_distance(shape.node_outside_m);
    paint(body, shape);
    shape.lattice.fix_where([&](Vec3f p) { return body.holds(vec_cast<double>(p)); });
    return shape;
  } catch (const Error& e) {
    throw Error("body '" + body.name + "': " + e.what(), e.kind());
  }
}

SoftBody::SoftBody(ExecContext& ctx, const BodyDescription& body, const BodyAssets& assets,
                   float sample_spacing_m)
    : SoftBody(ctx, body, make_body_shape(body, assets), sample_spacing_m) {}

SoftBody::SoftBody(ExecContext& ctx, const BodyDescription& body, BodyShape shape, float sample_spacing_m)
    : description_(body),
      shape_(std::move(shape)),
      element_options_({.law = body.material.law,
                        .fibre = vec_cast<float>(body.material.fibre),
                        .fibre_ratio = static_cast<float>(body.material.fibre_ratio),
                        .damping_ratio = static_cast<float>(body.material.damping)}),
      tissue_(ctx, shape_.lattice, shape_.elements, shape_.materials, shape_.material_of_cube,
              element_options_,
              {.young_Pa = static_cast<float>(body.material.young_modulus_pa),
               .density_kg_m3 = static_cast<float>(body.material.density_kg_m3),
               .half_width = body.material.half_width,
               .damping_ratio = static_cast<float>(body.material.damping)}),
      state_(rest_state(ctx, shape_.lattice)),
      frame_begin_x_m_(ctx.device(), state_.x_m.size()),
      surface_(ctx, shape_.lattice, shape_.surface_m),
      full_stiffness_(body.material.kappa == Stiffness::paper),
      mass_kg_(to_device(ctx, shape_.lattice.node_mass_kg)) {
  // A node that lies outside the seen surface may come nearer by that much, one below it keeps its distance:
  // what touches is what is seen (method, "Contact").
  std::vector<float> gap_m = shape_.node_outside_m;
  std::vector<Index> near, fixed(shape_.lattice.fixed.begin(), shape_.lattice.fixed.end());
  for (std::size_t i = 0; i < gap_m.size(); ++i) {
    gap_m[i] = -gap_m[i];
    if (gap_m[i] < 1.5F * sample_spacing_m) near.push_back(static_cast<Index>(i));
  }
  rest_gap_m_ = to_device(ctx, gap_m);
  contact_nodes_ = to_device(ctx, near);
  memory_ = to_device(ctx, std::vector<ContactMemory>(near.size()));
  fixed_ = to_device(ctx, fixed);
}

void SoftBody::begin_frame(ExecContext& ctx) { ctx.copy(state_.x_m.const_view(), frame_begin_x_m_.view()); }

std::string SoftBody::end_frame(ExecContext& ctx) {
  if (at_rest_) return "";
  const tled::CubeExtremes before = strain_;
  strain_ = tissue_.extremes(ctx);
  if (std::isfinite(strain_.speed_ratio) && std::isfinite(strain_.smallest_J)) return "";
  ctx.copy(frame_begin_x_m_.const_view(), state_.x_m.view());
  ctx.fill_bytes(state_.v_m_s.view(), 0);
  ctx.synchronize();
  strain_ = before;
  at_rest_ = true;
  char text[160];
  std::snprintf(text, sizeof text, "J was down to %.3g there, waves up to %.3g times as fast as at rest",
                static_cast<double>(before.smallest_J), static_cast<double>(before.speed_ratio));
  return "body '" + name() + "' blew up, first seen in " + cube_text(before.smallest_cube) + " (" + text +
         "); it rests from now on: press it less, use more substeps, more damping or a finer lattice";
}

std::string SoftBody::cube_text(Index cube) const {
  const CubeLattice& lattice = shape_.lattice;
  const auto c = static_cast<std::size_t>(cube);
  const Vec3f p =
      lattice.origin_m + lattice.spacing_m * (vec_cast<float>(lattice.cubes[c]) + Vec3f{0.5F, 0.5F, 0.5F});
  char text[96];
  std::snprintf(text, sizeof text, "cube %d, at rest round (%.3f, %.3f, %.3f) m", cube,
                static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z));
  const std::uint8_t material = shape_.material_of_cube[c];
  const std::string region = material == 0 ? "" : description_.regions[material - 1U].name;
  return text + (region.empty() ? "" : " in region '" + region + "'");
}

BodyMonitors SoftBody::monitors(ExecContext& ctx) const {
  return measure_body(shape_.lattice, shape_.elements, shape_.materials, shape_.material_of_cube,
                      element_options_, to_host(ctx, state_.x_m.const_view()),
                      to_host(ctx, state_.v_m_s.const_view()));
}

void SoftBody::step(ExecContext& ctx, float dt_s, Vec3f gravity_m_s2) {
  if (at_rest_) return;
  tissue_.step(ctx, state_, {.dt_s = dt_s, .gravity_m_s2 = gravity_m_s2, .full_stiffness = full_stiffness_});
}

ContactNodes SoftBody::contact_nodes() {
  return {state_.x_m.view(),           state_.v_m_s.view(), mass_kg_.const_view(), rest_gap_m_.const_view(),
          contact_nodes_.const_view(), fixed_.const_view(), memory_.view()};
}

Index SoftBody::nearest_node(Vec3f rest_m) const {
  const auto nearer = [rest_m](Vec3f a, Vec3f b) { return length(a - rest_m) < length(b - rest_m); };
  const std::vector<Vec3f> rest = shape_.lattice.rest_positions_m();
  return static_cast<Index>(std::min_element(rest.begin(), rest.end(), nearer) - rest.begin());
}

}  // namespace tactus
