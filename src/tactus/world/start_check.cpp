#include "tactus/world/start_check.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "tactus/base/error.h"
#include "tactus/geom/mesh/point_in_mesh.h"
#include "tactus/sim/body/body_point.h"

namespace tactus {
namespace {

/// Tolerated share of a body's free mass inside; rounding and the nodes that stand out of a surface are far
/// less.
constexpr double kShare = 0.05;
/// Nodes that are looked at: 5 % of them is a number that chance changes little.
constexpr Index kMostNodes = 20000;

bool overlap(const Box3f& a, const Box3f& b) {
  const Vec3f apart = max(a.min - b.max, b.min - a.max);
  return std::max({apart.x, apart.y, apart.z}) < 0;
}

/// Signed distance to the surface of an obstacle; < 0: inside.
using Distance = std::function<float(Vec3f)>;

float box_distance_m(Vec3f p, Vec3f half_m) {
  const Vec3f out = Vec3f{std::abs(p.x), std::abs(p.y), std::abs(p.z)} - half_m;
  return std::max({out.x, out.y, out.z});  // right inside; outside only its sign counts
}

Distance distance_to(const ObstacleDescription& o) {
  const Rigidf back = inverse(o.T_world_obstacle);
  if (o.kind == ObstacleKind::plane) return [back](Vec3f p_m) { return (back * p_m).y; };
  if (o.kind == ObstacleKind::box)
    return [back, half_m = o.half_m](Vec3f p_m) { return box_distance_m(back * p_m, half_m); };
  // (Sheets have no inside: their winding number is nowhere a half.)
  const auto mesh = std::make_shared<PointInMesh>(o.mesh, MeshFill::winding);
  return [back, mesh](Vec3f p_m) { return mesh->signed_distance_m(back * p_m); };
}

struct Overlap {
  double share = 0, deepest_m = 0;
};

Overlap overlap_of(const SoftBody& body, const Distance& distance_m) {
  const CubeLattice& lattice = body.shape().lattice;
  std::vector<std::uint8_t> is_held(static_cast<std::size_t>(lattice.node_count()), 0);
  for (std::size_t n = 0; n < is_held.size(); ++n) is_held[n] = lattice.fixed[n] != HeldAxes{} ? 1 : 0;
  for (const NodeMotion& motion : body.shape().motions)
    for (const Index n : motion.nodes) is_held[static_cast<std::size_t>(n)] = 1;
  const Index step = std::max(Index{1}, lattice.regular_nodes() / kMostNodes);
  double mass_kg = 0, inside_kg = 0;
  Overlap found;
  for (Index n = 0; n < lattice.regular_nodes(); n += step) {
    const auto i = static_cast<std::size_t>(n);
    if (is_held[i] != 0) continue;
    mass_kg += double{lattice.node_mass_kg[i]};
    const auto d = static_cast<double>(distance_m(lattice.rest_m(n)));
    if (!(d < 0)) continue;
    inside_kg += double{lattice.node_mass_kg[i]};
    found.deepest_m = std::max(found.deepest_m, -d);
  }
  found.share = mass_kg > 0 ? inside_kg / mass_kg : 0;
  return found;
}

void report(const SoftBody& body, const std::string& in, const Overlap& found, std::vector<Notice>& notices) {
  if (found.share <= kShare) return;
  notices.push_back({"body.overlap", Severity::warning,
                     number_text(std::round(100 * found.share)) + " % of body '" + body.name() +
                         "' lies in " + in + " at the start, up to " +
                         number_text(std::round(1e4 * found.deepest_m) / 1e4) +
                         " m deep; contact pushes it out at once",
                     "change their 'placement', or 'contact: false' of the body"});
}

}  // namespace

std::optional<Box3f> box_of(const ObstacleDescription& o) {
  if (o.kind == ObstacleKind::plane) return {};
  const TriangleMesh& mesh = o.mesh;
  Box3f box{{1e30F, 1e30F, 1e30F}, {-1e30F, -1e30F, -1e30F}};
  const auto add = [&](Vec3f p) {
    const Vec3f q = o.T_world_obstacle * p;
    box = {min(box.min, q), max(box.max, q)};
  };
  if (o.kind == ObstacleKind::mesh)
    for (const Vec3f p : mesh.positions_m) add(p);
  else
    for (int corner = 0; corner < 8; ++corner)
      add({(corner & 1) != 0 ? o.half_m.x : -o.half_m.x, (corner & 2) != 0 ? o.half_m.y : -o.half_m.y,
           (corner & 4) != 0 ? o.half_m.z : -o.half_m.z});
  return box;
}

const Scene& checked(const Scene& scene, const BodyAssets& assets) {
  const auto at_least_1 = [](const std::string& field, int value) {
    if (value < 1) throw usage_error("'" + field + "' is " + std::to_string(value) + ", expected at least 1");
  };
  const auto finite = [](const std::string& field, Vec3d p) {
    if (!std::isfinite(p.x + p.y + p.z))
      throw usage_error("'" + field + "' is " + point_text(p) + ", expected to be finite");
  };
  std::set<std::string> names;
  const auto begin = [&](const std::string& list, const auto& item) {
    if (!names.insert(item.name).second)
      throw usage_error("'" + list + "': '" + item.name + "' is the name of two things, names must differ");
    finite(list + "." + item.name + ".placement.position_m", item.placement.position_m);
    finite(list + "." + item.name + ".placement.rotation_deg", item.placement.rotation_deg);
  };
  const auto has = [](const auto& assets_of, const std::string& thing, const std::string& name) {
    if (!assets_of.contains(name))
      throw usage_error(thing + " '" + name +
                        "': its file isn't among the assets; expected load_body_assets(scene)");
  };
  at_least_1("frame.substeps", scene.frame.substeps.value_or(1));
  at_least_1("frame.max_substeps", scene.frame.max_substeps);
  at_least_1("contact.every", scene.contact.every);
  finite("gravity_m_s2", scene.gravity_m_s2);
  for (const BodyDescription& body : scene.bodies) {
    begin("bodies", body);
    at_least_1("bodies." + body.name + ".matching_every", body.matching_every);
    if (!(body.material.young_modulus_pa > 0))
      throw usage_error("'bodies." + body.name + ".material.young_modulus_pa' is " +
                        number_text(body.material.young_modulus_pa) + ", expected > 0 Pa");
    if (body.shape.kind == ShapeKind::mesh) has(assets.meshes, "body", body.name);
    if (body.shape.kind == ShapeKind::labels) has(assets.labels, "body", body.name);
  }
  for (const ObstacleSetting& obstacle : scene.obstacles) {
    begin("obstacles", obstacle);
    if (obstacle.kind == ObstacleShape::mesh) has(assets.obstacle_meshes, "obstacle", obstacle.name);
  }
  return scene;
}

void report_tiny_obstacles(std::span<const ObstacleDescription> obstacles, std::vector<Notice>& notices) {
  constexpr float kTiny_m = 0.002F;  // as of bodies
  for (const ObstacleDescription& o : obstacles) {
    if (o.kind != ObstacleKind::mesh) continue;
    const Vec3f edge_m = bounds(o.mesh).extent();
    const float longest_m = std::max({edge_m.x, edge_m.y, edge_m.z});
    if (longest_m >= kTiny_m) continue;
    notices.push_back(
        {"obstacle.tiny", Severity::warning,
         "obstacle '" + o.name + "' is only " + number_text(1000 * double{longest_m}) + " mm long",
         "check its 'unit_m' and 'scale'"});
  }
}

std::vector<Notice> overlaps_at_start(const Scene& scene, std::span<const std::unique_ptr<SoftBody>> bodies,
                                      std::span<const ObstacleDescription> obstacles) {
  std::vector<Notice> notices;
  const auto touches = [&](std::size_t b) { return scene.bodies[b].contact; };
  for (const ObstacleDescription& o : obstacles) {
    const std::optional<Box3f> box = box_of(o);
    std::optional<Distance> distance_m;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      if (!touches(b) || (box && !overlap(*box, bounds(bodies[b]->shape().surface_m)))) continue;
      if (!distance_m) distance_m = distance_to(o);
      report(*bodies[b], "obstacle '" + o.name + "'", overlap_of(*bodies[b], *distance_m), notices);
    }
  }
  if (!scene.contact.bodies) return notices;
  for (std::size_t other = 0; other < bodies.size(); ++other) {
    const TriangleMesh& surface = bodies[other]->shape().surface_m;
    std::optional<PointInMesh> inside;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      const bool near = b != other && touches(b) && touches(other) &&
                        overlap(bounds(surface), bounds(bodies[b]->shape().surface_m));
      if (!near) continue;
      if (!inside) inside.emplace(surface, MeshFill::winding);
      report(*bodies[b], "body '" + bodies[other]->name() + "'",
             overlap_of(*bodies[b], [&](Vec3f p_m) { return inside->signed_distance_m(p_m); }), notices);
    }
  }
  return notices;
}

void report_far_bodies(const Scene& scene, std::span<const std::unique_ptr<SoftBody>> bodies,
                       const Box3f& workspace_m, std::vector<Notice>& notices) {
  const Vec3f e = workspace_m.extent();
  const float longest_m = std::max({e.x, e.y, e.z});
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const Box3f box = bounds(bodies[b]->shape().surface_m);
    const Vec3f apart = max(max(box.min - workspace_m.max, workspace_m.min - box.max), Vec3f{});
    if (!scene.bodies[b].contact || !(length(apart) > longest_m)) continue;
    notices.push_back({"body.far", Severity::warning,
                       "body '" + bodies[b]->name() + "' lies " +
                           number_text(std::round(1e2 * static_cast<double>(length(apart))) / 1e2) +
                           " m outside of the workspace, where cameras see nothing that could touch it",
                       "check 'placement' and its unit, or the workspace"});
  }
}

}  // namespace tactus
