#include "tactus/io/mesh/mesh_import.h"

#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>
#include <cstdio>

#include "tactus/base/at.h"
#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/geom/mesh/point_box.h"
#include "tactus/geom/mesh/polygon_triangles.h"

namespace tactus::mesh_reading {
namespace {

/// Vertices nearer than this share of the mesh's longest edge along an axis are one: exporters round one
/// position in different ways.
constexpr double kWeld = 1e-6;
/// A mesh farther from the origin of its file than both is moved there: in metres, and in its own sizes. At
/// 100 m float steps by 8 micrometres.
constexpr double kFar_m = 100, kFarSizes = 10;
/// Tests of corners against ears in all faces of a file: a few seconds.
constexpr std::int64_t kMaxEarTests = 1000000000;

std::string position_text(Vec3d p) {
  char text[96];
  std::snprintf(text, sizeof text, "(%g, %g, %g)", p.x, p.y, p.z);
  return text;
}

void check_indices(const std::string& path, const RawMesh& raw) {
  const auto count = static_cast<std::int64_t>(raw.positions.size());
  for (std::size_t t = 0; t < raw.triangles.size(); ++t) {
    for (const std::int64_t v : raw.triangles[t]) {
      if (v >= 0 && v < count) continue;
      throw Error(raw.face_text(path, t) + " refers to vertex " + std::to_string(v) + ", but there are " +
                  std::to_string(count) + " (counted from 0)");
    }
  }
  if (raw.triangles.empty()) throw Error(path + ": no triangles in it, expected a surface");
}

/// Per vertex: whether a face uses it.
std::vector<char> vertices_in_use(const RawMesh& raw) {
  std::vector<char> used(raw.positions.size(), 0);
  for (const auto& triangle : raw.triangles) {
    for (const std::int64_t v : triangle) used[at(v)] = 1;
  }
  return used;
}

void check_positions(const std::string& path, const RawMesh& raw, const std::vector<char>& used,
                     double unit_m) {
  // So that squares of lengths are finite as floats, too.
  constexpr double kMost_m = 1e18;
  for (std::size_t i = 0; i < raw.positions.size(); ++i) {
    const Vec3d p = raw.positions[i];
    const double most = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}), sum = p.x + p.y + p.z;
    if (used[i] == 0 || (std::isfinite(sum) && most * unit_m <= kMost_m)) continue;
    const std::string place = raw.lines.empty() ? "" : ":" + std::to_string(raw.lines[i]);
    throw Error(path + place + ": vertex " + std::to_string(i) + " is " + position_text(p) +
                (std::isfinite(sum) ? ", expected at most 1e18 m" : ", expected finite numbers"));
  }
}

/// Makes triangles of the faces that fans would fold.
void triangulate(const std::string& path, RawMesh& raw) {
  std::int64_t tests = kMaxEarTests;
  std::vector<std::int64_t> corners;
  std::vector<Vec3d> places;
  std::vector<std::array<Index, 3>> triangles;
  for (const RawMesh::Polygon& polygon : raw.polygons) {
    const auto fan = raw.triangles.begin() + static_cast<std::ptrdiff_t>(polygon.first);
    corners = {(*fan)[0], (*fan)[1]};
    for (std::size_t k = 0; k + 2 < polygon.corners; ++k)
      corners.push_back(fan[static_cast<std::ptrdiff_t>(k)][2]);
    places.clear();
    for (const std::int64_t v : corners) places.push_back(raw.positions[at(v)]);
    triangles.clear();
    if (!triangulate_polygon(places, tests, triangles))
      throw Error(raw.face_text(path, polygon.first) + " has " + std::to_string(polygon.corners) +
                  " corners and too many of them turn inwards, expected faces that are split");
    for (std::size_t k = 0; k < triangles.size(); ++k) {
      const auto& [a, b, c] = triangles[k];
      fan[static_cast<std::ptrdiff_t>(k)] = {corners[at(a)], corners[at(b)], corners[at(c)]};
    }
  }
}

/// The vertices so far, by cells of four weld distances: a vertex looks into few, and few fit into one.
class Welder {
 public:
  Welder(std::size_t count, double distance) : near_(distance), heads_(std::bit_ceil(count + 1), -1) {}

  /// The first vertex within the distance, or a new one. Equal positions always find the same.
  Index add(Vec3d p) {
    std::int64_t low[3], high[3];
    for (int k = 0; k < 3; ++k) {
      low[k] = cell(p[k] - near_);
      high[k] = cell(p[k] + near_);
    }
    Index found = -1;
    for (std::int64_t z = low[2]; z <= high[2]; ++z) {
      for (std::int64_t y = low[1]; y <= high[1]; ++y) {
        for (std::int64_t x = low[0]; x <= high[0]; ++x) look(bucket(x, y, z), p, found);
      }
    }
    if (found >= 0) return found;
    const auto i = static_cast<Index>(places_.size());
    Index& head = heads_[bucket(cell(p.x), cell(p.y), cell(p.z))];
    places_.push_back(p);
    next_.push_back(head);
    return head = i;
  }
  const std::vector<Vec3d>& places() const { return places_; }

 private:
  /// Numbers wrap around far out, where all of a mesh without size is one place anyway.
  std::int64_t cell(double x) const {
    return near_ > 0 ? static_cast<std::int64_t>(std::floor(std::clamp(x / (4 * near_), -9e15, 9e15))) : 0;
  }
  std::size_t bucket(std::int64_t x, std::int64_t y, std::int64_t z) const {
    std::uint64_t h = 0;
    for (const std::int64_t v : {x, y, z}) h = (h ^ static_cast<std::uint64_t>(v)) * 0x9e3779b97f4a7c15ULL;
    return (h ^ (h >> 29)) & (heads_.size() - 1);
  }
  void look(std::size_t bucket, Vec3d p, Index& found) const {
    for (Index i = heads_[bucket]; i >= 0; i = next_[at(i)]) {
      const Vec3d d = places_[at(i)] - p;
      if (dot(d, d) <= near_ * near_ && (found < 0 || i < found)) found = i;
    }
  }
  double near_;
  std::vector<Index> heads_, next_;
  std::vector<Vec3d> places_;
};

/// The same corners in the same sense, the smallest first.
std::array<Index, 3> turned(std::array<Index, 3> t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

/// Drops faces that stand there a second time: three triangles at an edge bound no solid. Faces that look the
/// other way stay, as a sheet may have two sides. @returns how many went
std::size_t drop_repeated(std::vector<std::array<Index, 3>>& triangles) {
  std::vector<Index> table(std::bit_ceil(2 * triangles.size() + 1), -1);
  std::size_t kept = 0;
  for (const std::array<Index, 3>& t : triangles) {
    const std::array<Index, 3> key = turned(t);
    std::uint64_t h = 0;
    for (const Index v : key) h = (h ^ static_cast<std::uint64_t>(v)) * 0x9e3779b97f4a7c15ULL;
    std::size_t slot = (h ^ (h >> 29)) & (table.size() - 1);
    while (table[slot] >= 0 && turned(triangles[at(table[slot])]) != key)
      slot = (slot + 1) & (table.size() - 1);
    if (table[slot] >= 0) continue;
    table[slot] = static_cast<Index>(kept);
    triangles[kept++] = t;
  }
  const std::size_t dropped = triangles.size() - kept;
  triangles.resize(kept);
  return dropped;
}

}  // namespace

ImportedMesh import_raw(const std::string& path, RawMesh&& raw, double unit_m) {
  check_indices(path, raw);
  const std::vector<char> used = vertices_in_use(raw);
  check_positions(path, raw, used, unit_m);
  triangulate(path, raw);
  PointBox box;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]) box.add(raw.positions[i]);
  }
  const double off = length(box.center());
  ImportedMesh imported;
  const bool moves = off * unit_m > kFar_m && off > kFarSizes * box.size();
  const Vec3d origin = moves ? box.center() : Vec3d{};
  imported.origin_m = unit_m * origin;

  Welder welder(raw.positions.size(), kWeld * box.size());
  std::vector<Index> target(used.size(), -1);
  const bool normals = raw.normals.size() == used.size();
  TriangleMesh& mesh = imported.mesh;
  bool merged = false;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    const std::size_t before = welder.places().size();
    target[i] = welder.add(raw.positions[i] - origin);
    merged = merged || welder.places().size() == before;
    if (normals && !merged) mesh.normals.push_back(raw.normals[i]);
  }
  if (merged) mesh.normals.clear();  // they may have differed
  mesh.positions_m.reserve(welder.places().size());
  for (const Vec3d p : welder.places()) mesh.positions_m.push_back(vec_cast<float>(unit_m * p));
  for (const auto& [a, b, c] : raw.triangles) {
    const std::array<Index, 3> t = {target[at(a)], target[at(b)], target[at(c)]};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh.triangles.push_back(t);
  }
  if (const std::size_t repeated = drop_repeated(mesh.triangles); repeated > 0)
    log_warning(path + ": " + std::to_string(repeated) + " faces stand there a second time and are left out");
  if (mesh.triangles.empty())
    throw Error(path + ": all its triangles are points or lines, expected a surface");
  return imported;
}

}  // namespace tactus::mesh_reading
