#include "tactus/world/obstacle_watch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "tactus/geom/mesh/point_in_mesh.h"

namespace tactus {
namespace {

/// Whether the way from a to b has a part in the box of half edges h round the origin.
bool meets_box(Vec3d a, Vec3d b, Vec3f h) {
  double enter = 0, leave = 1;
  for (int k = 0; k < 3; ++k) {
    const double way = b[k] - a[k], half = static_cast<double>(h[k]);
    if (way == 0) {
      if (std::abs(a[k]) >= half) return false;
      continue;
    }
    const double one = (-half - a[k]) / way, other = (half - a[k]) / way;
    enter = std::max(enter, std::min(one, other));
    leave = std::min(leave, std::max(one, other));
  }
  return enter <= leave;
}

/// Whether the way from a to b goes through the triangle from its front.
bool enters(const TriangleMesh& mesh, const std::array<Index, 3>& t, Vec3d a, Vec3d b) {
  const auto corner = [&](Index v) {
    return vec_cast<double>(mesh.positions_m[static_cast<std::size_t>(v)]);
  };
  const Vec3d p = corner(t[0]), q = corner(t[1]), r = corner(t[2]), n = cross(q - p, r - p);
  const double before = dot(a - p, n), after = dot(b - p, n);
  if (!(before >= 0 && after < 0)) return false;
  const Vec3d x = a + (before / (before - after)) * (b - a);
  return dot(cross(q - p, x - p), n) >= 0 && dot(cross(r - q, x - q), n) >= 0 &&
         dot(cross(p - r, x - r), n) >= 0;
}

bool is_inside(const ObstacleWatch::Surface& surface, Vec3d p_m) {
  const TriangleMesh mesh = surface();
  return !mesh.triangles.empty() && PointInMesh(mesh, MeshFill::winding).inside(vec_cast<float>(p_m));
}

std::string place_text(Vec3d p_m) {
  char at[96];
  std::snprintf(at, sizeof at, ", at (%.3f, %.3f, %.3f) m", p_m.x, p_m.y, p_m.z);
  return at;
}

}  // namespace

ObstacleWatch::ObstacleWatch(std::vector<ObstacleDescription> obstacles) {
  for (ObstacleDescription& obstacle : obstacles) {
    Watched& watched = watched_.emplace_back(Watched{std::move(obstacle), {}});
    const std::vector<Vec3f>& vertices = watched.obstacle.mesh.positions_m;
    if (vertices.empty()) continue;
    watched.bounds = {vertices.front(), vertices.front()};
    for (const Vec3f& v : vertices) watched.bounds = {min(watched.bounds.min, v), max(watched.bounds.max, v)};
  }
}

bool ObstacleWatch::meets(const Watched& watched, Vec3d from_m, Vec3d to_m) {
  const ObstacleDescription& o = watched.obstacle;
  const auto to_own = [&](Vec3d p_m) {
    return transpose(mat_cast<double>(o.T_world_obstacle.R)) * (p_m - vec_cast<double>(o.T_world_obstacle.t));
  };
  const Vec3d a = to_own(from_m), b = to_own(to_m);
  if (o.kind == ObstacleKind::plane) return b.y < 0;
  if (o.kind == ObstacleKind::box) return meets_box(a, b, o.half_m);
  const Vec3d middle = 0.5 * vec_cast<double>(watched.bounds.min + watched.bounds.max);
  if (!meets_box(a - middle, b - middle, 0.5F * watched.bounds.extent())) return false;
  return std::any_of(o.mesh.triangles.begin(), o.mesh.triangles.end(),
                     [&](const std::array<Index, 3>& t) { return enters(o.mesh, t, a, b); });
}

std::string ObstacleWatch::follow(const std::string& body, Vec3d center_m, const Surface& own) {
  const auto [known, is_new] = way_.try_emplace(body, Way{center_m, center_m});
  const Vec3d before_m = known->second.now_m;
  known->second = {before_m, center_m};
  if (is_new) return "";
  for (const Watched& watched : watched_) {
    bool& reported = reported_[{body, watched.obstacle.name}];
    if (reported || !meets(watched, before_m, center_m) || !is_inside(own, center_m)) continue;
    reported = true;
    return "the centre of body '" + body + "' is in obstacle '" + watched.obstacle.name +
           "' or went through it" + place_text(center_m);
  }
  return "";
}

std::string ObstacleWatch::find_through(const std::string& body, const std::string& other,
                                        const Box3f& bounds, const Surface& there) {
  const auto of = way_.find(body), past = way_.find(other);
  if (of == way_.end() || past == way_.end()) return "";
  const Vec3d from_m = of->second.before_m + (past->second.now_m - past->second.before_m),
              to_m = of->second.now_m;
  const Vec3f extent = bounds.extent();
  const Vec3d middle_m = 0.5 * vec_cast<double>(bounds.min + bounds.max), from = from_m - middle_m,
              to = to_m - middle_m;
  const bool within = meets_box(from, from, 0.5F * extent) || meets_box(to, to, 0.5F * extent);
  if (within || !meets_box(from, to, 0.25F * extent)) return "";
  bool& reported = reported_[{body, "body '" + other + "'"}];
  if (reported) return "";
  const TriangleMesh mesh = there();
  if (!std::any_of(mesh.triangles.begin(), mesh.triangles.end(),
                   [&](const std::array<Index, 3>& t) { return enters(mesh, t, from_m, to_m); }))
    return "";
  reported = true;
  return "the centre of body '" + body + "' went through body '" + other + "' within a frame" +
         place_text(to_m);
}

std::string ObstacleWatch::find_in(const std::string& body, Vec3d center_m, const Surface& own,
                                   const std::string& what, const Surface& there) {
  bool& reported = reported_[{body, what}];
  if (reported || !is_inside(there, center_m) || !is_inside(own, center_m)) return "";
  reported = true;
  return "the centre of body '" + body + "' is in " + what + place_text(center_m);
}

}  // namespace tactus
