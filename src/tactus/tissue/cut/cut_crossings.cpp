// Where a body's surface and the walls of cubes meet.
#include <algorithm>
#include <optional>

#include "tactus/compute/cpu_for.h"
#include "tactus/tissue/cut/cut_geometry.h"
#include "tactus/tissue/cut/cut_surface.h"

namespace tactus::cut {
namespace {

/// Share of the way from a to b at which it goes through cde.
std::optional<double> through(Vec3d a, Vec3d b, Vec3d c, Vec3d d, Vec3d e) {
  const double of_a = volume6(c, d, e, a), of_b = volume6(c, d, e, b);
  if ((of_a > 0) == (of_b > 0) || !turns_round(a, b, c, d, e)) return std::nullopt;
  return of_a / (of_a - of_b);
}

/// Planes between cubes, and between tetrahedra: where one of these is a whole number.
double plane_value(Vec3d p, int family) {
  return family < 3 ? p[family] : p[family - 3] - p[(family - 2) % 3];
}
/// The plane that holds both points, or -1.
int common_plane(Vec3d a, Vec3d b) {
  for (int f = 0; f < 6; ++f)
    if (CutSurface::is_whole(plane_value(a, f)) && plane_value(a, f) == plane_value(b, f)) return f;
  return -1;
}
bool share_plane(Vec3d a, Vec3d b, Vec3d c, Vec3d d, int& family) {
  for (family = 0; family < 6; ++family) {
    const double v = plane_value(a, family);
    if (CutSurface::is_whole(v) && plane_value(b, family) == v && plane_value(c, family) == v &&
        plane_value(d, family) == v)
      return true;
  }
  return false;
}

/// Share of the way from c to d at which it meets ab, all in one plane.
std::optional<double> meet(Vec3d a, Vec3d b, Vec3d c, Vec3d d, int family) {
  // Two axes that the plane is not at right angles to.
  const int w = family < 3 ? (family + 1) % 3 : family - 3,
            v = family < 3 ? (family + 2) % 3 : (family - 1) % 3;
  const auto turn = [&](Vec3d p, Vec3d q, Vec3d r) {
    return (q[w] - p[w]) * (r[v] - p[v]) - (q[v] - p[v]) * (r[w] - p[w]);
  };
  const double of_c = turn(a, b, c), of_d = turn(a, b, d);
  if ((of_c > 0) == (of_d > 0) || (turn(c, d, a) > 0) == (turn(c, d, b) > 0)) return std::nullopt;
  return of_c / (of_c - of_d);
}

}  // namespace

bool CutSurface::is_on(Index point, const std::array<Index, 3>& wall) const {
  const auto has = [&](Index p) { return wall[0] == p || wall[1] == p || wall[2] == p; };
  const auto& on = points_[index(point)].on;
  return has(point) || (on[0] >= 0 && has(on[0]) && has(on[1]));
}

/// Where edges of a triangle go through a wall, and edges of the wall through the triangle. Walls of one
/// tetrahedron have edges in its faces; those meet each other there.
void CutSurface::find_crossings(const Triangle& t, const WallTriangle& wall, const Touching& touching,
                                Crossings& found) const {
  const auto touches = [&](Index p) {
    return std::find(touching.begin(), touching.end(), p) != touching.end();
  };
  const bool is_wall = t.home >= 0;
  const auto& w = wall.point;
  for (std::size_t k = 0; k < 3; ++k) {
    const Index p = std::min(t.corner[k].point, t.corner[(k + 1) % 3].point),
                q = std::max(t.corner[k].point, t.corner[(k + 1) % 3].point);
    if (touches(p) || touches(q)) continue;
    if (is_wall && common_plane(at(p), at(q)) >= 0) {
      for (std::size_t j = 0; j < 3; ++j) {
        const Index u = std::min(w[j], w[(j + 1) % 3]), v = std::max(w[j], w[(j + 1) % 3]);
        int family = 0;
        if (!share_plane(at(p), at(q), at(u), at(v), family)) continue;
        if (const auto s = meet(at(p), at(q), at(u), at(v), family))
          found.push_back({{p, q}, {u, v}, between(at(u), at(v), *s)});
      }
      continue;
    }
    if (const auto s = through(at(p), at(q), at(w[0]), at(w[1]), at(w[2])))
      found.push_back({{p, q}, {-1, -1}, between(at(p), at(q), *s)});
  }
  for (std::size_t j = 0; j < 3; ++j) {
    const Index u = std::min(w[j], w[(j + 1) % 3]), v = std::max(w[j], w[(j + 1) % 3]);
    if (is_wall && common_plane(at(u), at(v)) >= 0) continue;
    const auto is_touched = [&](Index p) {
      const auto& on = points_[index(p)].on;
      return p == u || p == v || (std::min(on[0], on[1]) == u && std::max(on[0], on[1]) == v);
    };
    if (std::any_of(touching.begin(), touching.end(), is_touched)) continue;
    if (const auto s =
            through(at(u), at(v), at(t.corner[0].point), at(t.corner[1].point), at(t.corner[2].point)))
      found.push_back({{-1, -1}, {u, v}, between(at(u), at(v), *s)});
  }
}

/// The same edges meet in one point, whichever triangles they were looked up with.
Index CutSurface::add_crossing(Stage& s, const Crossing& c, Index triangle, std::size_t number) {
  std::array<Index, 4> key{c.surface[0], c.surface[1], c.wall[0], c.wall[1]};
  if (key[0] < 0) key[1] = triangle;
  if (key[2] < 0) key[3] = static_cast<Index>(number);
  const auto [known, is_new] = s.crossings.try_emplace(key, static_cast<Index>(points_.size()));
  const Index point = *known, place = point - s.first_point;
  const Index parent = s.splits[s.walls[number].split].split.parent;
  if (is_new) s.parents.resize(place + 1);
  const auto parents = s.parents.of(place);
  if (std::none_of(parents.begin(), parents.end(), [&](Index p) { return p == parent; }))
    s.parents.push_back(place, parent);
  if (!is_new) return point;
  points_.push_back({c.p, true, c.wall});
  if (c.surface[0] >= 0) s.on_edge.add(edge_key(c.surface[0], c.surface[1]), point);
  if (c.wall[0] >= 0) s.on_edge.add(edge_key(c.wall[0], c.wall[1]), point);
  return point;
}

/// @returns whether the surface at least touches the wall
bool CutSurface::find_meeting(const Stage& s, Index triangle, std::size_t number, Meeting& m) const {
  const Triangle& t = triangles_[index(triangle)];
  const WallTriangle& wall = s.walls[number];
  const Split& split = s.splits[wall.split];
  m.triangle = triangle;
  m.wall = number;
  m.touching.clear();
  m.is_segment = false;
  for (const Corner& corner : t.corner)
    if (is_on(corner.point, wall.point)) m.touching.push_back(corner.point);
  if (m.touching.size() > 1) return true;
  Crossings found;
  find_crossings(t, wall, m.touching, found);
  if (found.size() + m.touching.size() != 2) return !m.touching.empty();
  std::copy(found.begin(), found.end(), m.found.begin());
  const Vec3d first = m.touching.empty() ? found[0].p : at(m.touching[0]);
  m.is_segment = t.home >= 0 || leaf(split.regular, 0.5 * (first + found.back().p)) == split.split.parent;
  return m.is_segment || !m.touching.empty();
}

void CutSurface::add_meeting(Stage& s, const Meeting& m) {
  const WallTriangle& wall = s.walls[m.wall];
  for (const Index point : m.touching) {
    const auto& on = points_[index(point)].on;
    const bool is_vertex = std::find(wall.point.begin(), wall.point.end(), point) != wall.point.end();
    if (s.rim.try_emplace(static_cast<std::uint64_t>(point), is_vertex).second && !is_vertex)
      s.on_edge.add(edge_key(on[0], on[1]), point);
  }
  if (!m.is_segment) return;
  std::array<Index, 2> segment{
      m.touching.empty() ? add_crossing(s, m.found[0], m.triangle, m.wall) : m.touching[0],
      add_crossing(s, m.found[m.touching.empty() ? 1 : 0], m.triangle, m.wall)};
  if (segment[0] == segment[1]) return;
  const auto near = std::lower_bound(s.near.begin(), s.near.end(), m.triangle) - s.near.begin();
  s.segments.push_back(static_cast<Index>(near), {segment, m.wall});
  s.wall_segments.push_back(static_cast<Index>(m.wall), {segment, static_cast<std::size_t>(m.triangle)});
}

void CutSurface::add_meetings(const Stage& s, const Split& split, std::vector<Meeting>& meetings) const {
  Meeting m;
  for (std::size_t w = split.first_wall; w < split.end_wall; ++w) {
    const WallTriangle& wall = s.walls[w];
    const Vec3d a = at(wall.point[0]), b = at(wall.point[1]), c = at(wall.point[2]);
    const Vec3d low = min(a, min(b, c)), high = max(a, max(b, c));
    for (const Face& f : std::span(s.faces).subspan(split.first_face, split.face_count)) {
      if (apart(low, high, f.low, f.high)) continue;
      if (f.is_wall && triangles_[index(f.triangle)].tet != wall.tet) continue;
      if (find_meeting(s, f.triangle, w, m)) meetings.push_back(m);
    }
  }
}

/// Meetings are found on all cores, points get their ids in the order of walls.
void CutSurface::intersect_all(Stage& s) {
  const std::size_t count = at_surface_.size();
  if (meetings_.size() < count) meetings_.resize(count);
  cpu_for(count, 2, [&](std::size_t k) {
    meetings_[k].clear();
    add_meetings(s, s.splits[at_surface_[k]], meetings_[k]);
  });
  for (const auto& of_split : std::span(meetings_).first(count))
    for (const Meeting& m : of_split) add_meeting(s, m);
}

}  // namespace tactus::cut
