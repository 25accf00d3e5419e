#include "tactus/sim/body_shape.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <set>

#include "tactus/base/error.h"
#include "tactus/geom/figures.h"
#include "tactus/tissue/embedded_surface.h"
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

/// "0.4 m", "35 mm".
std::string length_text(float metres) {
  char text[32];
  std::snprintf(text, sizeof text, metres < 0.1F ? "%.3g mm" : "%.3g m",
                static_cast<double>(metres < 0.1F ? 1000 * metres : metres));
  return text;
}

/// Turns a mesh right side out, and notes what is odd about it.
void check_surface(BodyShape& shape) {
  TriangleMesh& mesh = shape.surface_m;
  const MeshTopology t = topology(mesh);
  if (t.boundary_edges == 0 && volume_m3(mesh) < 0) {
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
    shape.warnings.push_back("its triangles face inwards; they are taken the other way round");
  }
  if (t.boundary_edges == 0 && t.nonmanifold_edges > 0)
    shape.warnings.push_back(
        std::to_string(t.nonmanifold_edges) +
        " edges of its mesh belong to more than two triangles; inside is where the winding "
        "number is not 0");
  const Vec3f extent = bounds(mesh).extent();
  const float longest = std::max({extent.x, extent.y, extent.z});
  if (longest > 10)
    shape.warnings.push_back("it is " + length_text(longest) +
                             " long: is its file in millimetres? Then say 'unit_m: 0.001'");
  if (longest < 0.002F)
    shape.warnings.push_back("it is only " + length_text(longest) + " long: check 'unit_m' and 'scale'");
}

}  // namespace

BodyShape make_body_shape(const BodyDescription& body, const BodyAssets& assets) {
  try {
    BodyShape shape;
    shape.surface_m = body_surface(body, assets);
    for (Vec3f& p : shape.surface_m.positions_m)
      p = vec_cast<float>(body.placement.to_world(vec_cast<double>(p)));
    check_surface(shape);
    compute_normals(shape.surface_m);
    LatticeOptions options;
    options.spacing_m = static_cast<float>(body.spacing_m);
    options.density_kg_m3 = static_cast<float>(body.material.density_kg_m3);
    shape.lattice = lattice_from_mesh(shape.surface_m, options);
    shape.node_outside_m = node_outside_m(shape.lattice, shape.surface_m);
    shape.lattice.fill_by_distance(shape.node_outside_m);
    paint(body, shape);
    const Index fixed = shape.lattice.fix_where([&](Vec3f p) { return body.holds(vec_cast<double>(p)); });
    if (!body.fixed.empty() && fixed == 0)
      shape.warnings.push_back("its 'fixed' regions hold no node: it is free");
    return shape;
  } catch (const Error& e) {
    throw Error("body '" + body.name + "': " + e.what(), e.kind());
  }
}

}  // namespace tactus
