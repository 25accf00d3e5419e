#include "tactus/geom/mesh/mesh_defects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <span>

#include "tactus/base/at.h"
#include "tactus/base/error.h"

namespace tactus {
namespace {

std::string text(Vec3f p) {
  char buffer[96];
  std::snprintf(buffer, sizeof buffer, "(%.6g, %.6g, %.6g)", static_cast<double>(p.x),
                static_cast<double>(p.y), static_cast<double>(p.z));
  return buffer;
}

/// A directed edge as (min, max, direction): sorted, all uses of an edge stand together.
struct EdgeUse {
  Index low, high;
  bool forward;
  bool operator<(const EdgeUse& o) const {
    return low != o.low ? low < o.low : (high != o.high ? high < o.high : forward < o.forward);
  }
};

/// Whether the segment a-b passes through triangle t (Moeller & Trumbore 1997), and where. To touch is not
/// to pass, nor is to lie in its plane.
bool segment_crosses(Vec3d a, Vec3d b, const std::array<Vec3d, 3>& t, Vec3d& where) {
  const Vec3d e1 = t[1] - t[0], e2 = t[2] - t[0], d = b - a, p = cross(d, e2);
  const double det = dot(e1, p);
  if (det == 0) return false;
  const Vec3d s = a - t[0], q = cross(s, e1);
  const double u = dot(s, p) / det, v = dot(d, q) / det, along = dot(e2, q) / det;
  if (!(u >= 0 && v >= 0 && u + v <= 1 && along > 0 && along < 1)) return false;
  where = a + along * d;
  return true;
}

bool triangles_cross(const std::array<Vec3d, 3>& s, const std::array<Vec3d, 3>& t, Vec3d& where) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (segment_crosses(s[k], s[(k + 1) % 3], t, where) || segment_crosses(t[k], t[(k + 1) % 3], s, where))
      return true;
  }
  return false;
}

/// The (y, z) plane in cells, and the triangles over each.
class Columns {
 public:
  Columns(const std::vector<Box3f>& box, const Box3f& all)
      : all_(all),
        side_(std::clamp(static_cast<Index>(std::sqrt(static_cast<double>(box.size())) / 4), 1, 1024)) {
    begin_.assign(at(side_ * side_ + 1), 0);
    const auto for_each_entry = [&](auto&& body) {
      for (std::size_t t = 0; t < box.size(); ++t) {
        const Index low = of(box[t].min), high = of(box[t].max);
        for (Index z = low / side_; z <= high / side_; ++z)
          for (Index y = low % side_; y <= high % side_; ++y) body(z * side_ + y, static_cast<Index>(t));
      }
    };
    for_each_entry([&](Index c, Index) { ++begin_[at(c + 1)]; });
    for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
    triangles_.resize(begin_.back());
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    for_each_entry([&](Index c, Index t) { triangles_[next[at(c)]++] = t; });
  }
  Index count() const { return side_ * side_; }
  Index of(Vec3f p) const {
    const auto cell = [this](float value, float low, float high) {
      const double t = high > low ? (double{value} - low) / (double{high} - low) : 0;
      return std::clamp(static_cast<Index>(t * side_), 0, side_ - 1);
    };
    return cell(p.z, all_.min.z, all_.max.z) * side_ + cell(p.y, all_.min.y, all_.max.y);
  }
  std::span<const Index> sorted_by_x(Index column, const std::vector<Box3f>& box) {
    const auto first = triangles_.begin() + static_cast<std::ptrdiff_t>(begin_[at(column)]),
               last = triangles_.begin() + static_cast<std::ptrdiff_t>(begin_[at(column + 1)]);
    std::sort(first, last, [&](Index a, Index b) {
      return box[at(a)].min.x < box[at(b)].min.x || (box[at(a)].min.x == box[at(b)].min.x && a < b);
    });
    return {first, last};
  }

 private:
  Box3f all_;
  Index side_;
  std::vector<std::size_t> begin_;
  std::vector<Index> triangles_;
};

}  // namespace

std::string defect_text(const EdgeDefect& defect, const std::string& one, const std::string& many) {
  return std::to_string(defect.count) + " " + (defect.count == 1 ? one : many) + ", the first from " +
         text(defect.from_m) + " to " + text(defect.to_m) + " m";
}

std::string EdgeDefects::text() const {
  std::string all;
  const auto add = [&](const EdgeDefect& defect, const char* one, const char* many) {
    if (defect.count > 0) all += (all.empty() ? "" : "; ") + defect_text(defect, one, many);
  };
  add(open, "open edge", "open edges");
  add(opposed, "edge between triangles that face opposite ways",
      "edges between triangles that face opposite ways");
  add(unpaired, "edge of more than two triangles that don't pair up",
      "edges of more than two triangles that don't pair up");
  return all;
}

EdgeDefects find_edge_defects(const TriangleMesh& mesh) {
  std::vector<EdgeUse> uses;
  uses.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = t[k], b = t[(k + 1) % 3];
      if (a != b) uses.push_back({std::min(a, b), std::max(a, b), a < b});
    }
  }
  std::sort(uses.begin(), uses.end());
  EdgeDefects defects;
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t end = i;
    int net = 0;  // 0: as often forward as backward
    while (end < uses.size() && uses[end].low == uses[i].low && uses[end].high == uses[i].high)
      net += uses[end++].forward ? 1 : -1;
    const std::size_t count = end - i;
    EdgeDefect* kind = nullptr;
    if (net != 0) kind = count == 1 ? &defects.open : (count == 2 ? &defects.opposed : &defects.unpaired);
    if (net == 0 && count > 2) kind = &defects.crowded;
    if (kind != nullptr && kind->count++ == 0) {
      kind->from_m = mesh.positions_m[at(uses[i].low)];
      kind->to_m = mesh.positions_m[at(uses[i].high)];
    }
    i = end;
  }
  return defects;
}

SelfCrossings find_self_crossings(const TriangleMesh& mesh) {
  std::vector<Box3f> box;
  for (const auto& t : mesh.triangles) {
    const Vec3f a = mesh.positions_m[at(t[0])], b = mesh.positions_m[at(t[1])],
                c = mesh.positions_m[at(t[2])];
    box.push_back({min(a, min(b, c)), max(a, max(b, c))});
  }
  const auto corners = [&](Index t) {
    std::array<Vec3d, 3> c;
    for (std::size_t k = 0; k < 3; ++k)
      c[k] = vec_cast<double>(mesh.positions_m[at(mesh.triangles[at(t)][k])]);
    return c;
  };
  // A copied vertex (a seam) joins as well as a shared one.
  const auto touch = [&](Index s, Index t) {
    for (const Index a : mesh.triangles[at(s)])
      for (const Index b : mesh.triangles[at(t)])
        if (a == b || mesh.positions_m[at(a)] == mesh.positions_m[at(b)]) return true;
    return false;
  };
  // Pairs are looked for in columns along x, in the one that holds the low corner of their boxes' overlap.
  Columns columns(box, bounds(mesh));
  SelfCrossings found;
  for (Index column = 0; column < columns.count(); ++column) {
    const std::span<const Index> triangles = columns.sorted_by_x(column, box);
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const Box3f& a = box[at(triangles[i])];
      for (std::size_t j = i + 1; j < triangles.size() && box[at(triangles[j])].min.x <= a.max.x; ++j) {
        const Box3f& b = box[at(triangles[j])];
        if (b.min.y > a.max.y || a.min.y > b.max.y || b.min.z > a.max.z || a.min.z > b.max.z) continue;
        if (columns.of(max(a.min, b.min)) != column || touch(triangles[i], triangles[j])) continue;
        Vec3d where{};
        if (!triangles_cross(corners(triangles[i]), corners(triangles[j]), where)) continue;
        if (found.pairs++ == 0) found.first_m = vec_cast<float>(where);
      }
    }
  }
  return found;
}

void check_finite(const TriangleMesh& mesh, const char* what) {
  if (mesh.triangles.empty()) throw Error(std::string(what) + " has no triangles");
  for (std::size_t v = 0; v < mesh.positions_m.size(); ++v) {
    const Vec3f p = mesh.positions_m[v];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
      throw Error(std::string(what) + ": vertex " + std::to_string(v) + " is not finite: " + text(p));
  }
  const auto vertices = static_cast<Index>(mesh.positions_m.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const Index a : mesh.triangles[t]) {
      if (a < 0 || a >= vertices)
        throw Error(std::string(what) + ": triangle " + std::to_string(t) + " uses vertex " +
                    std::to_string(a) + " of " + std::to_string(vertices));
    }
  }
}

void check_closed(const TriangleMesh& mesh, const char* what) {
  check_finite(mesh, what);
  const EdgeDefects defects = find_edge_defects(mesh);
  if (!defects.bounds_solid()) throw Error(std::string(what) + " does not bound a solid: " + defects.text());
}

}  // namespace tactus
