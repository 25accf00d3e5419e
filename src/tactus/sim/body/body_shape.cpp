#include "tactus/sim/body/body_shape.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <set>

#include "tactus/base/error.h"
#include "tactus/geom/figures/figures.h"
#include "tactus/geom/lattice/mass_points.h"
#include "tactus/geom/mesh/box_surface.h"
#include "tactus/geom/mesh/mesh_defects.h"
#include "tactus/sim/body/body_progress.h"
#include "tactus/sim/body/body_regions.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/tissue/surface_nets.h"

namespace tactus {
namespace {

struct Solid {
  std::function<float(Vec3f)> distance_m;  ///< body coordinates, negative inside
  Box3f box_m;
};

/// A box with sharp edges, in triangles with legs of `fineness_m` or less: surface nets would round its edges
/// and take some of its mass.
TriangleMesh box_surface(Vec3f half_m, float fineness_m) {
  const Vec3f extent = 2.F * half_m;
  const auto pieces = [&](float length_m) {
    return std::max(1, static_cast<Index>(std::ceil(length_m / fineness_m - 1e-3F)));
  };
  const Vec3i n{pieces(extent.x), pieces(extent.y), pieces(extent.z)};
  return box_surface(half_m, n);
}

/// Sphere and figure as signed distances.
Solid make_solid(const ShapeDescription& shape) {
  if (shape.kind == ShapeKind::sphere) {
    const auto r = static_cast<float>(shape.radius_m);
    return {[r](Vec3f p) { return length(p) - r; }, {{-r, -r, -r}, {r, r, r}}};
  }
  const auto figure = std::make_shared<FigureShape>(make_figure(shape.figure).at(0));
  return {[figure](Vec3f p) { return figure->distance_m(p); }, figure->bounds_m()};
}

/// The labels that are the body. @throws Error for labels that the volume doesn't have.
std::set<VoxelLabel> solid_labels(const ShapeDescription& shape, const LabelVolume& volume) {
  const std::set<VoxelLabel> there(volume.labels.begin(), volume.labels.end());
  if (shape.labels.empty()) {
    std::set<VoxelLabel> solid = there;
    solid.erase(0);
    if (solid.empty()) throw Error("its label volume holds nothing but 0");
    return solid;
  }
  for (const int label : shape.labels) {
    if (!there.contains(static_cast<VoxelLabel>(label)))
      throw usage_error("its label volume has no label " + std::to_string(label) + "; it has " +
                        label_list(there));
  }
  return {shape.labels.begin(), shape.labels.end()};
}

/// "0.4 m", "35 mm".
std::string length_text(float metres) {
  char text[32];
  std::snprintf(text, sizeof text, metres < 0.1F ? "%.3g mm" : "%.3g m",
                static_cast<double>(metres < 0.1F ? 1000 * metres : metres));
  return text;
}

/// "" or why this size is hardly meant.
std::string odd_size(const ShapeDescription& shape, Vec3f extent_m) {
  const float longest = std::max({extent_m.x, extent_m.y, extent_m.z});
  const bool mesh = shape.kind == ShapeKind::mesh;
  if (longest > 10)
    return "it is " + length_text(longest) + " long: " +
           (mesh ? "is its file in millimetres? Then say 'unit_m: 0.001'" : "check its size and 'scale'");
  if (longest < 0.002F)
    return "it is only " + length_text(longest) + " long: check " + (mesh ? "'unit_m'" : "its size") +
           " and 'scale'";
  return "";
}

/// Facets cut corners, and nets of labels are smoothed. Moves a closed surface along its normals until it
/// encloses the shape's volume, by half of the net's `fineness_m` at most.
void grow_to_volume(TriangleMesh& mesh, double volume, float fineness_m) {
  float moved_m = 0;
  for (int k = 0; k < 3; ++k) {
    const auto by_m = static_cast<float>((volume - volume_m3(mesh)) / area_m2(mesh));
    if (std::abs(moved_m + by_m) > 0.5F * fineness_m) return;
    moved_m += by_m;
    compute_normals(mesh);
    for (std::size_t v = 0; v < mesh.positions_m.size(); ++v) mesh.positions_m[v] += by_m * mesh.normals[v];
  }
}

/// The shape's surface in body coordinates; smooth ones are sampled at half the lattice's spacing. Shapes
/// that can't become a lattice are refused before they are sampled.
TriangleMesh body_surface(const BodyDescription& body, const BodyAssets& assets,
                          const LatticeOptions& options, std::string& odd) {
  const ShapeDescription& shape = body.shape;
  const auto scale = static_cast<float>(body.placement.scale);
  const float fineness = 0.5F * options.spacing_m / scale;
  const auto check_size = [&](Vec3f extent_m) {
    odd = odd_size(shape, scale * extent_m);
    check_lattice_size(scale * extent_m, options);
  };
  if (shape.kind == ShapeKind::mesh) {
    const TriangleMesh& mesh = assets.meshes.at(body.name);
    check_finite(mesh, "its mesh");
    check_size(bounds(mesh).extent());
    return mesh;
  }
  if (shape.kind == ShapeKind::labels) {
    const LabelVolume& volume = *assets.labels.at(body.name);
    const Vec3f n = vec_cast<float>(volume.dims), v = volume.voxel_size_m;
    check_size({n.x * v.x, n.y * v.y, n.z * v.z});
    const std::set<VoxelLabel> solid = solid_labels(shape, volume);
    TriangleMesh mesh = surface_of_labels(volume, solid, fineness);
    const auto voxels = std::count_if(volume.labels.begin(), volume.labels.end(),
                                      [&](VoxelLabel label) { return solid.contains(label); });
    grow_to_volume(mesh, static_cast<double>(voxels) * double{v.x} * double{v.y} * double{v.z}, fineness);
    return mesh;
  }
  if (shape.kind == ShapeKind::box) {
    const Vec3f half = vec_cast<float>(0.5 * shape.size_m);
    check_size(2.F * half);
    return box_surface(half, fineness);
  }
  const Solid solid = make_solid(shape);
  check_size(solid.box_m.extent());
  const Vec3f margin{2 * fineness, 2 * fineness, 2 * fineness};
  TriangleMesh mesh =
      surface_nets(solid.distance_m, {solid.box_m.min - margin, solid.box_m.max + margin}, fineness);
  if (shape.kind == ShapeKind::sphere)
    grow_to_volume(mesh, 4.0 / 3 * std::numbers::pi * std::pow(shape.radius_m, 3), fineness);
  return mesh;
}

bool has_thickness(const TriangleMesh& mesh, double spacing_m) {
  return std::abs(volume_m3(mesh)) > 0.01 * spacing_m * 0.5 * area_m2(mesh);
}

/// A closed mesh of a body so thin that its cubes are hardly filled.
void check_thickness(const TriangleMesh& mesh, double spacing_m) {
  if (has_thickness(mesh, spacing_m)) return;
  const double volume = std::abs(volume_m3(mesh)), area = area_m2(mesh);
  char text[200];
  std::snprintf(text, sizeof text,
                "its mesh has no thickness: %.3g m^2 of surface enclose %.3g m^3, a sheet of %.3g m at a "
                "spacing_m of %g; expected a solid",
                area, volume, area > 0 ? 2 * volume / area : 0.0, spacing_m);
  throw Error(text);
}

/// Turns a mesh right side out, and warns of its oddities.
void check_surface(const ShapeDescription& description, double spacing_m, BodyShape& shape) {
  TriangleMesh& mesh = shape.surface_m;
  const EdgeDefects edges = find_edge_defects(mesh);
  if (description.fill == MeshFill::closed && !edges.bounds_solid())
    throw Error("its mesh does not bound a solid: " + edges.text() +
                "; repair it, or say 'fill: winding' to fill it by its winding number");
  if (!edges.bounds_solid())
    shape.warnings.push_back("its mesh does not bound a solid: " + edges.text() +
                             "; it is filled by its winding number");
  if (description.fill == MeshFill::closed) check_thickness(mesh, spacing_m);
  if (volume_m3(mesh) < 0) {
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
    shape.warnings.push_back("its triangles face inwards; they are taken the other way round");
  }
  if (description.kind != ShapeKind::mesh) return;
  if (edges.crowded.count > 0)
    shape.warnings.push_back("its mesh is no manifold: " +
                             defect_text(edges.crowded, "edge belongs to more than two triangles",
                                         "edges belong to more than two triangles") +
                             "; inside is where the winding number is not 0");
  const SelfCrossings crossings = find_self_crossings(mesh);
  if (crossings.pairs == 0) return;
  char where[96];
  std::snprintf(where, sizeof where, "(%.4g, %.4g, %.4g)", static_cast<double>(crossings.first_m.x),
                static_cast<double>(crossings.first_m.y), static_cast<double>(crossings.first_m.z));
  shape.warnings.push_back("its mesh overlaps itself: " + std::to_string(crossings.pairs) +
                           " pairs of triangles cross, the first at " + where +
                           " m; inside is where the winding number is not 0");
}

/// The widest ball inside that touches the surface somewhere [m]: of up to `samples` triangles, the ball
/// inside at the middle.
double thickness_m(const TriangleMesh& mesh, std::size_t samples = 200) {
  const PointInMesh query(mesh);
  const Vec3f extent = bounds(mesh).extent();
  const float most = 0.5F * std::min({extent.x, extent.y, extent.z});
  const std::size_t stride = std::max<std::size_t>(1, mesh.triangles.size() / samples);
  float widest = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += stride) {
    const auto [a, b, c] = mesh.triangles[t];
    const auto x = [&](Index v) { return mesh.positions_m[static_cast<std::size_t>(v)]; };
    const Vec3f n = normalized(cross(x(b) - x(a), x(c) - x(a)), Vec3f{}), middle = (x(a) + x(b) + x(c)) / 3.F;
    const auto fits = [&](float radius) {
      const Vec3f center = middle - radius * n;
      return query.inside(center) && query.distance_m(center) > 0.998F * radius;
    };
    if (n == Vec3f{} || !fits(std::max(widest, 1e-3F * most))) continue;
    float low = std::max(widest, 1e-3F * most), high = most;
    if (fits(high)) low = high;
    for (int k = 0; k < 12 && low < high; ++k) (fits(0.5F * (low + high)) ? low : high) = 0.5F * (low + high);
    widest = low;
  }
  return 2 * double{widest};
}

/// Warns of shapes thinner than a cube, and of a lattice whose volume is not the mesh's.
void check_spacing(const BodyDescription& body, BodyShape& shape) {
  const TriangleMesh& mesh = shape.surface_m;
  const double h = body.spacing_m, volume = volume_m3(mesh);
  char text[300];
  // 2 V / A is the thickness of a plate; everything else is thicker.
  if (const double thickness = h > 2 * volume / area_m2(mesh) ? thickness_m(mesh) : h; h > 1.02 * thickness) {
    std::snprintf(
        text, sizeof text,
        "its 'spacing_m' of %g is larger than its thickness, %.3g m: it neither bends nor is touched as it "
        "should; 'spacing_m: %.2g' has four cubes across it",
        h, thickness, thickness / 4);
    shape.warnings.emplace_back(text);
  }
  double cubes = 0;
  for (const float fill : shape.lattice.cube_fill) cubes += double{fill} * h * h * h;
  if (std::abs(cubes - volume) <= 0.02 * volume) return;
  std::snprintf(
      text, sizeof text,
      "its cubes hold %.4g m^3, its mesh %.4g m^3: where the mesh overlaps itself, its volume counts once",
      cubes, volume);
  shape.warnings.emplace_back(text);
}

ElasticMaterial painted_material(const PaintedRegion& region, ElasticMaterial material) {
  if (region.young_modulus_pa) material.young_Pa = static_cast<float>(*region.young_modulus_pa);
  if (region.poisson_ratio) material.poisson = static_cast<float>(*region.poisson_ratio);
  if (region.density_kg_m3) material.density_kg_m3 = static_cast<float>(*region.density_kg_m3);
  return material;
}

/// Materials and models of the cubes: the body's own, then region after region.
void paint(const BodyDescription& body, const RegionFinder& finder, BodyShape& shape) {
  const MaterialDescription& m = body.material;
  if (body.regions.size() >= Tled::kNoElement - 1U)
    throw usage_error(std::to_string(body.regions.size()) + " regions, expected at most " +
                      std::to_string(Tled::kNoElement - 2));
  shape.materials = {{static_cast<float>(m.young_modulus_pa), static_cast<float>(m.poisson_ratio),
                      static_cast<float>(m.density_kg_m3)}};
  CubeLattice& lattice = shape.lattice;
  shape.material_of_cube.assign(lattice.cubes.size(), 0);
  if (body.bleeding) shape.bleeding_of_cube.assign(lattice.cubes.size(), 1);
  shape.elements.assign(lattice.cubes.size(), m.model == TissueModel::tled ? 1 : 0);
  if (body.ratio)
    shape.elements =
        split_by_ratio(lattice, static_cast<int>(body.ratio->axis), body.ratio->tled, body.ratio->flsm);
  for (std::size_t r = 0; r < body.regions.size(); ++r) {
    const PaintedRegion& region = body.regions[r];
    const ElasticMaterial material = painted_material(region, shape.materials.front());
    const float relative_density = material.density_kg_m3 / shape.materials.front().density_kg_m3;
    shape.materials.push_back(material);
    std::size_t painted = 0, elements = 0;
    for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
      if (!finder.holds_cube(region.where, c)) continue;
      // The mass change by an earlier region is undone.
      const float before = shape.materials[shape.material_of_cube[c]].density_kg_m3;
      lattice.cube_mass_kg[c] *= relative_density * shape.materials.front().density_kg_m3 / before;
      shape.material_of_cube[c] = static_cast<std::uint8_t>(r + 1);
      if (body.bleeding && region.bleeding) shape.bleeding_of_cube[c] = static_cast<float>(*region.bleeding);
      if (region.model != RegionModel::unchanged)
        shape.elements[c] = region.model == RegionModel::tled ? 1 : 0;
      elements += shape.elements[c];
      ++painted;
    }
    const std::string name =
        "region " + std::to_string(r) + (region.name.empty() ? "" : " ('" + region.name + "')");
    if (painted == 0) throw usage_error(name + " holds no cube of the body" + finder.hint(region.where));
    if (elements == 0 && (region.young_modulus_pa || region.poisson_ratio))
      throw usage_error(name +
                        " holds no element, so its 'young_modulus_pa' and 'poisson_ratio' do nothing: shape "
                        "matching has the body's");
  }
  lattice.share_masses();
  const auto elements = std::count(shape.elements.begin(), shape.elements.end(), 1);
  if (m.model == TissueModel::hybrid && (elements == 0 || elements == lattice.cube_count()))
    shape.warnings.push_back(elements == 0 ? "it is hybrid, but no cube is an element"
                                           : "it is hybrid, but every cube is an element");
}

/// Whether the body's own moments of inertia matter. One that is held may be a quarter of another, with
/// planes of symmetry: there its nodes have the halves that mirror images add to. Regions of shape matching
/// are as stiff as their material with nodes of eighths: with others, bars of w = 2 and 3 give way by 15 and
/// 20 %.
bool turns_freely(const BodyDescription& body, const BodyShape& shape) {
  const std::vector<HeldAxes>& held = shape.lattice.fixed;
  return body.moved.empty() &&
         std::all_of(held.begin(), held.end(), [](HeldAxes axes) { return axes == 0; }) &&
         std::all_of(shape.elements.begin(), shape.elements.end(), [](std::uint8_t is) { return is != 0; });
}

}  // namespace

BodyShape make_body_shape(const BodyDescription& body, const BodyAssets& assets, double memory_bytes) {
  // Bytes per cube, with all data made from it: measured at the peak for bodies of 10^6 cubes on the CPU
  // (0.43 and 1.19 GB less the program's 0.08). A term that fades: 12 floats.
  constexpr double kElementBytes = 350, kTermBytes = 48, kMatchedBytes = 1110;
  LatticeOptions options;
  options.spacing_m = static_cast<float>(body.spacing_m);
  options.density_kg_m3 = static_cast<float>(body.material.density_kg_m3);
  options.fill = body.shape.fill;
  options.max_bytes = memory_bytes;
  options.bytes_per_cube = body.material.model == TissueModel::tled ? kElementBytes : kMatchedBytes;
  const MaterialDescription& m = body.material;
  if (m.model != TissueModel::flsm)
    options.bytes_per_cube +=
        kTermBytes *
        static_cast<double>(m.damping ? m.relaxation.size() : std::max<std::size_t>(m.relaxation.size(), 1));
  std::string odd;
  try {
    BodyShape shape;
    shape.surface_m = body_surface(body, assets, options, odd);
    shape.has_creases = body.shape.kind == ShapeKind::box || body.shape.kind == ShapeKind::mesh;
    for (Vec3f& p : shape.surface_m.positions_m)
      p = vec_cast<float>(body.placement.to_world(vec_cast<double>(p)));
    if (!odd.empty()) shape.warnings.push_back(odd);
    check_surface(body.shape, body.spacing_m, shape);
    compute_normals(shape.surface_m);
    const Vec3f e = bounds(shape.surface_m).extent();
    report_many_cubes(body, double{e.x} * double{e.y} * double{e.z} / std::pow(body.spacing_m, 3),
                      " cubes in its box: finding those inside");
    // A mesh that bounds a solid has that solid's mass: only of others do winding numbers alone tell.
    if (find_edge_defects(shape.surface_m).bounds_solid() && has_thickness(shape.surface_m, body.spacing_m))
      options.fill = MeshFill::closed;
    shape.lattice = lattice_from_mesh(shape.surface_m, options);
    report_many_cubes(body, static_cast<double>(shape.lattice.cube_count()),
                      " cubes: painting, fixing and loading their nodes");
    if (options.fill == MeshFill::closed) check_spacing(body, shape);
    const RegionFinder finder(body, assets, shape.lattice,
                              [&](const LabelVolume& volume) { return solid_labels(body.shape, volume); });
    paint(body, finder, shape);
    fix_nodes(body, finder, shape);
    move_nodes(body, finder, shape);
    if (turns_freely(body, shape)) place_masses(shape.lattice);
    load_surface(body, shape);
    return shape;
  } catch (const Error& e) {
    throw Error("body '" + body.name + "': " + e.what() + (odd.empty() ? "" : "; " + odd), e.kind());
  }
}

}  // namespace tactus
