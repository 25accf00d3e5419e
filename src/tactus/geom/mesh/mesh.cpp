#include "tactus/geom/mesh/mesh.h"

#include <algorithm>
#include <numeric>
#include <string>

#include "tactus/base/error.h"

namespace tactus {
namespace {

Index find_root(std::vector<Index>& parent, Index i) {
  while (parent[static_cast<std::size_t>(i)] != i) {
    Index& p = parent[static_cast<std::size_t>(i)];
    p = parent[static_cast<std::size_t>(p)];
    i = p;
  }
  return i;
}

/// Programs make meshes, and a wrong corner would be read anywhere.
void check_corners(const TriangleMesh& mesh) {
  const auto vertices = static_cast<Index>(mesh.positions_m.size());
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k)
    for (const Index v : mesh.triangles[k])
      if (v < 0 || v >= vertices)
        throw Error("triangle " + std::to_string(k) + " of a mesh names vertex " + std::to_string(v) +
                    ", expected 0 to " + std::to_string(vertices - 1));
}

template <class F>
void for_each_triangle(const TriangleMesh& mesh, F&& body) {
  check_corners(mesh);
  for (const auto& t : mesh.triangles) {
    body(mesh.positions_m[static_cast<std::size_t>(t[0])], mesh.positions_m[static_cast<std::size_t>(t[1])],
         mesh.positions_m[static_cast<std::size_t>(t[2])]);
  }
}

}  // namespace

MeshTopology topology(const TriangleMesh& mesh) {
  check_corners(mesh);
  // A directed edge a->b as (min, max, direction), sorted so that all uses of an edge stand together.
  struct Use {
    Index low, high;
    bool forward;
    bool operator<(const Use& o) const {
      return low != o.low ? low < o.low : (high != o.high ? high < o.high : forward < o.forward);
    }
  };
  std::vector<Use> uses;
  uses.reserve(mesh.triangles.size() * 3);
  std::vector<Index> parent(mesh.positions_m.size());
  std::iota(parent.begin(), parent.end(), 0);
  std::vector<bool> used(mesh.positions_m.size());
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = t[k], b = t[(k + 1) % 3];
      uses.push_back({std::min(a, b), std::max(a, b), a < b});
      used[static_cast<std::size_t>(a)] = true;
      parent[static_cast<std::size_t>(find_root(parent, a))] = find_root(parent, b);
    }
  }
  std::sort(uses.begin(), uses.end());
  MeshTopology result;
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t end = i;
    while (end < uses.size() && uses[end].low == uses[i].low && uses[end].high == uses[i].high) ++end;
    ++result.edges;
    if (end - i == 1)
      ++result.boundary_edges;
    else if (end - i > 2 || uses[i].forward == uses[i + 1].forward)
      ++result.nonmanifold_edges;
    i = end;
  }
  std::int64_t vertices = 0;
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (!used[v]) continue;
    ++vertices;
    if (find_root(parent, static_cast<Index>(v)) == static_cast<Index>(v)) ++result.components;
  }
  result.euler = vertices - result.edges + static_cast<std::int64_t>(mesh.triangles.size());
  return result;
}

double volume_m3(const TriangleMesh& mesh) {
  if (mesh.positions_m.empty()) return 0;
  const Vec3d origin = vec_cast<double>(mesh.positions_m.front());
  double six_volumes = 0;
  for_each_triangle(mesh, [&](Vec3f a, Vec3f b, Vec3f c) {
    six_volumes +=
        dot(vec_cast<double>(a) - origin, cross(vec_cast<double>(b) - origin, vec_cast<double>(c) - origin));
  });
  return six_volumes / 6;
}

double area_m2(const TriangleMesh& mesh) {
  double twice = 0;
  for_each_triangle(mesh, [&](Vec3f a, Vec3f b, Vec3f c) {
    twice += length(cross(vec_cast<double>(b - a), vec_cast<double>(c - a)));
  });
  return twice / 2;
}

Box3f bounds(const TriangleMesh& mesh) {
  if (mesh.positions_m.empty()) return {};
  Box3f box{mesh.positions_m.front(), mesh.positions_m.front()};
  for (const Vec3f p : mesh.positions_m) box = {min(box.min, p), max(box.max, p)};
  return box;
}

void compute_normals(TriangleMesh& mesh) {
  check_corners(mesh);
  std::vector<Vec3f> sum(mesh.positions_m.size());
  for (const auto& t : mesh.triangles) {
    const Vec3f a = mesh.positions_m[static_cast<std::size_t>(t[0])];
    const Vec3f n = cross(mesh.positions_m[static_cast<std::size_t>(t[1])] - a,
                          mesh.positions_m[static_cast<std::size_t>(t[2])] - a);
    for (const Index v : t) sum[static_cast<std::size_t>(v)] += n;
  }
  for (Vec3f& n : sum) n = normalized(n, Vec3f{0, 1, 0});
  mesh.normals = std::move(sum);
}

}  // namespace tactus
