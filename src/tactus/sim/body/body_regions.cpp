#include "tactus/sim/body/body_regions.h"

#include <algorithm>

#include "tactus/base/error.h"

namespace tactus {
namespace {

constexpr double kRadiansPerDegree = 3.14159265358979323846 / 180;

bool by_label(const SpaceRegion& region) { return region.kind == RegionKind::label; }

/// "'moved[0]' (grip)".
std::string region_text(const char* key, std::size_t index, const std::string& name) {
  return "'" + std::string(key) + "[" + std::to_string(index) + "]'" +
         (name.empty() ? "" : " (" + name + ")");
}

}  // namespace

std::string label_list(const std::set<VoxelLabel>& labels) {
  std::string text;
  for (const VoxelLabel label : labels) text += (text.empty() ? "" : ", ") + std::to_string(label);
  return text;
}

RegionFinder::RegionFinder(const BodyDescription& body, const BodyAssets& assets, const CubeLattice& lattice,
                           const std::function<std::set<VoxelLabel>(const LabelVolume&)>& solid)
    : body_(body), lattice_(lattice) {
  const auto region_by_label = [](const auto& r) { return by_label(r.where); };
  if (std::none_of(body.fixed.begin(), body.fixed.end(), region_by_label) &&
      std::none_of(body.moved.begin(), body.moved.end(), region_by_label) &&
      std::none_of(body.regions.begin(), body.regions.end(), region_by_label))
    return;
  const LabelVolume& volume = *assets.labels.at(body.name);
  labels_ =
      labels_of_cubes(lattice, volume, solid(volume), [&](Vec3d p) { return body.placement.to_body(p); });
}

bool RegionFinder::holds_cube(const SpaceRegion& region, std::size_t c) const {
  if (by_label(region))
    return std::find(region.labels.begin(), region.labels.end(), labels_[c]) != region.labels.end();
  const Vec3f center =
      lattice_.origin_m + lattice_.spacing_m * (vec_cast<float>(lattice_.cubes[c]) + Vec3f{.5F, .5F, .5F});
  return body_.in(region, vec_cast<double>(center));
}

std::vector<Index> RegionFinder::nodes_in(const SpaceRegion& region) const {
  std::vector<std::uint8_t> chosen(lattice_.nodes.size());
  if (by_label(region)) {
    for (std::size_t c = 0; c < lattice_.cubes.size(); ++c) {
      if (!holds_cube(region, c)) continue;
      for (const Index node : lattice_.cube_nodes[c]) chosen[static_cast<std::size_t>(node)] = 1;
    }
  }
  std::vector<Index> nodes;
  for (Index i = 0; i < lattice_.node_count(); ++i) {
    if (by_label(region) ? chosen[static_cast<std::size_t>(i)] != 0
                         : body_.in(region, vec_cast<double>(lattice_.rest_m(i))))
      nodes.push_back(i);
  }
  return nodes;
}

std::string RegionFinder::hint(const SpaceRegion& region) const {
  if (!by_label(region)) return "";
  return "; they have label " + label_list({labels_.begin(), labels_.end()});
}

void fix_nodes(const BodyDescription& body, const RegionFinder& finder, BodyShape& shape) {
  std::size_t fixed = 0;
  for (const FixedRegion& region : body.fixed) {
    const std::vector<Index> nodes = finder.nodes_in(region.where);
    for (const Index node : nodes) shape.lattice.fixed[static_cast<std::size_t>(node)] |= region.axes;
    fixed += nodes.size();
  }
  if (!body.fixed.empty() && fixed == 0)
    shape.warnings.push_back("its 'fixed' regions hold no node: it is free");
}

void move_nodes(const BodyDescription& body, const RegionFinder& finder, BodyShape& shape) {
  for (std::size_t k = 0; k < body.moved.size(); ++k) {
    const MovedRegion& region = body.moved[k];
    NodeMotion motion;
    motion.name = region_text("moved", k, region.name);
    motion.axis = region.axis;
    motion.nodes = finder.nodes_in(region.where);
    if (motion.nodes.empty())
      throw usage_error(motion.name + " holds no node of the body" + finder.hint(region.where));
    for (const MotionKeyDescription& key : region.path)
      motion.keys.push_back({key.time_s, key.displacement_m, kRadiansPerDegree * key.angle_deg});
    if (region.release_s) motion.release_s = *region.release_s;
    if (region.pivot_m) {
      motion.pivot_m = region.where.frame == CoordinateFrame::body ? body.placement.to_world(*region.pivot_m)
                                                                   : *region.pivot_m;
    } else {
      for (const Index node : motion.nodes) motion.pivot_m += vec_cast<double>(shape.lattice.rest_m(node));
      motion.pivot_m = (1.0 / static_cast<double>(motion.nodes.size())) * motion.pivot_m;
    }
    shape.motions.push_back(std::move(motion));
  }
}

void load_surface(const BodyDescription& body, BodyShape& shape) {
  const TriangleMesh& surface = shape.surface_m;
  for (std::size_t k = 0; k < body.loads.size(); ++k) {
    const LoadedRegion& region = body.loads[k];
    SurfaceLoad load;
    load.name = region_text("loads", k, region.name);
    load.traction_Pa = region.traction_pa.value_or(Vec3d{});
    load.pressure_Pa = region.pressure_pa.value_or(0);
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
      Vec3d center;
      for (const Index v : surface.triangles[t])
        center += (1.0 / 3) * vec_cast<double>(surface.positions_m[static_cast<std::size_t>(v)]);
      if (body.in(region.where, center)) load.triangles.push_back(static_cast<Index>(t));
    }
    if (load.triangles.empty()) throw usage_error(load.name + " holds no component of the body's surface");
    if (region.force_n) load.traction_Pa = (1 / area_m2(surface, load.triangles)) * *region.force_n;
    for (const LoadKeyDescription& key : region.over_time) load.keys.push_back({key.time_s, key.factor});
    shape.loads.push_back(std::move(load));
  }
}

}  // namespace tactus
