#include "tactus/geom/mesh/point_in_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "tactus/base/at.h"
#include "tactus/geom/mesh/closest_point.h"
#include "tactus/geom/mesh/mesh_defects.h"

namespace tactus {
namespace {

/// Side of p against the projected edge a-b in the (y, z) plane: > 0 left, < 0 right, 0 only for an edge
/// without extent. A tie is decided as if p were moved by (e, e^2), e -> 0.
int side(Vec3d a, Vec3d b, Vec3d p) {
  const double dy = b.y - a.y, dz = b.z - a.z;
  const double s = dy * (p.z - a.z) - dz * (p.y - a.y);
  if (s != 0) return s > 0 ? 1 : -1;
  if (dz != 0) return dz < 0 ? 1 : -1;
  if (dy != 0) return dy > 0 ? 1 : -1;
  return 0;
}
/// The same, evaluated in one order of the two ends, so that both triangles at an edge agree.
int edge_side(const std::vector<Vec3f>& x, Index a, Index b, Vec3d p) {
  const auto v = [&](Index i) { return vec_cast<double>(x[at(i)]); };
  return a < b ? side(v(a), v(b), p) : -side(v(b), v(a), p);
}

float squared_distance_to_box(Vec3f p, const Box3f& box) {
  const Vec3f d = max(max(box.min - p, p - box.max), Vec3f{});
  return dot(d, d);
}

}  // namespace

float squared_distance_to_triangle(Vec3f p, Vec3f a, Vec3f b, Vec3f c) {
  const Vec3f d = p - closest_point_on_triangle(p, a, b, c);
  return dot(d, d);
}

PointInMesh::PointInMesh(const TriangleMesh& mesh, MeshFill fill)
    : fill_(fill), positions_(mesh.positions_m), triangles_(mesh.triangles) {
  if (fill == MeshFill::closed)
    check_closed(mesh, "mesh");
  else
    check_finite(mesh, "mesh");
  bounds_ = bounds(mesh);
  order_.resize(triangles_.size());
  std::iota(order_.begin(), order_.end(), 0);
  tree_.reserve(triangles_.size());
  build_tree(order_, 0, static_cast<Index>(order_.size()));
  build_columns();
  if (fill == MeshFill::winding) build_dipoles();
}

Index PointInMesh::build_tree(std::vector<Index>& order, Index first, Index count) {
  const float inf = std::numeric_limits<float>::infinity();
  Box3f box{{inf, inf, inf}, {-inf, -inf, -inf}};
  for (Index i = first; i < first + count; ++i) {
    for (const Index v : triangles_[at(order[at(i)])])
      box = {min(box.min, positions_[at(v)]), max(box.max, positions_[at(v)])};
  }
  const auto self = static_cast<Index>(tree_.size());
  tree_.push_back({box, first, count <= 4 ? count : 0, 0});
  if (count <= 4) return self;
  const Vec3f e = box.extent();
  const int axis = e.x >= e.y && e.x >= e.z ? 0 : (e.y >= e.z ? 1 : 2);
  const auto center = [&](Index t) {
    const auto& v = triangles_[at(t)];
    return positions_[at(v[0])][axis] + positions_[at(v[1])][axis] + positions_[at(v[2])][axis];
  };
  const Index half = count / 2;
  std::nth_element(
      order.begin() + first, order.begin() + first + half, order.begin() + first + count,
      [&](Index a, Index b) { return center(a) < center(b) || (center(a) == center(b) && a < b); });
  build_tree(order, first, half);
  tree_[at(self)].right = build_tree(order, first + half, count - half);
  return self;
}

void PointInMesh::build_columns() {
  columns_ = std::clamp(static_cast<Index>(std::sqrt(static_cast<double>(triangles_.size()))), 1, 1024);
  const auto column = [&](float value, float low, float high) {
    const double t = high > low ? (double{value} - low) / (double{high} - low) : 0;
    return std::clamp(static_cast<Index>(t * columns_), 0, columns_ - 1);
  };
  column_begin_.assign(at(columns_ * columns_ + 1), 0);
  const auto for_each_entry = [&](auto&& body) {
    for (Index t = 0; t < static_cast<Index>(triangles_.size()); ++t) {
      const auto& v = triangles_[at(t)];
      const Vec3f a = positions_[at(v[0])], b = positions_[at(v[1])], c = positions_[at(v[2])];
      const Vec3f low = min(a, min(b, c)), high = max(a, max(b, c));
      const Index y1 = column(high.y, bounds_.min.y, bounds_.max.y),
                  z1 = column(high.z, bounds_.min.z, bounds_.max.z);
      for (Index z = column(low.z, bounds_.min.z, bounds_.max.z); z <= z1; ++z)
        for (Index y = column(low.y, bounds_.min.y, bounds_.max.y); y <= y1; ++y) body(z * columns_ + y, t);
    }
  };
  for_each_entry([&](Index c, Index) { ++column_begin_[at(c + 1)]; });
  std::partial_sum(column_begin_.begin(), column_begin_.end(), column_begin_.begin());
  column_triangles_.resize(at(column_begin_.back()));
  std::vector<Index> next(column_begin_.begin(), column_begin_.end() - 1);
  for_each_entry([&](Index c, Index t) { column_triangles_[at(next[at(c)]++)] = t; });
}

int PointInMesh::winding(Vec3f p_m) const {
  if (p_m.y < bounds_.min.y || p_m.y > bounds_.max.y || p_m.z < bounds_.min.z || p_m.z > bounds_.max.z ||
      p_m.x > bounds_.max.x || p_m.x < bounds_.min.x)
    return 0;
  const auto column = [&](float value, float low, float high) {
    const double t = high > low ? (double{value} - low) / (double{high} - low) : 0;
    return std::clamp(static_cast<Index>(t * columns_), 0, columns_ - 1);
  };
  const Index c =
      column(p_m.z, bounds_.min.z, bounds_.max.z) * columns_ + column(p_m.y, bounds_.min.y, bounds_.max.y);
  const Vec3d p = vec_cast<double>(p_m);
  int sum = 0;
  for (Index e = column_begin_[at(c)]; e < column_begin_[at(c + 1)]; ++e) {
    const auto& v = triangles_[at(column_triangles_[at(e)])];
    const int s = edge_side(positions_, v[0], v[1], p);
    if (s == 0 || edge_side(positions_, v[1], v[2], p) != s || edge_side(positions_, v[2], v[0], p) != s)
      continue;
    const Vec3d a = vec_cast<double>(positions_[at(v[0])]);
    const Vec3d n =
        cross(vec_cast<double>(positions_[at(v[1])]) - a, vec_cast<double>(positions_[at(v[2])]) - a);
    if (n.x == 0) continue;
    const double x = a.x - (n.y * (p.y - a.y) + n.z * (p.z - a.z)) / n.x;
    if (x > p.x) sum += s;
  }
  return sum;
}

void PointInMesh::build_dipoles() {
  dipoles_.resize(tree_.size());
  // Children follow their parent: from the end, they are ready when it is summed.
  for (std::size_t i = tree_.size(); i-- > 0;) {
    const Node& node = tree_[i];
    Dipole d{};
    Vec3d weighted{};
    const auto add = [&](Vec3d area, double size, Vec3d center) {
      d.area_m2 += area;
      d.size_m2 += size;
      weighted += size * center;
    };
    for (Index k = node.first; k < node.first + node.count; ++k) {
      const auto& v = triangles_[at(order_[at(k)])];
      const Vec3d a = vec_cast<double>(positions_[at(v[0])]), b = vec_cast<double>(positions_[at(v[1])]),
                  c = vec_cast<double>(positions_[at(v[2])]), area = 0.5 * cross(b - a, c - a);
      add(area, length(area), (a + b + c) / 3.0);
    }
    if (node.count == 0) {
      for (const std::size_t child : {i + 1, at(node.right)}) {
        const Dipole& part = dipoles_[child];
        add(part.area_m2, part.size_m2, part.center_m);
      }
    }
    d.center_m = d.size_m2 > 0 ? weighted / d.size_m2 : vec_cast<double>(node.box.center());
    const Vec3d reach =
        max(vec_cast<double>(node.box.max) - d.center_m, d.center_m - vec_cast<double>(node.box.min));
    d.radius_m = length(reach);
    dipoles_[i] = d;
  }
}

double PointInMesh::generalized_winding(Vec3f p_m) const {
  constexpr double kFar = 3;  // in radii: an error of some 1e-2, seldom (2 gives 3e-2)
  const Vec3d p = vec_cast<double>(p_m);
  double solid_angle = 0;
  std::array<Index, 64> stack;
  std::size_t top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const Index i = stack[--top];
    const Node& node = tree_[at(i)];
    const Dipole& d = dipoles_[at(i)];
    const Vec3d away = d.center_m - p;
    const double distance = length(away);
    if (distance > kFar * d.radius_m) {
      solid_angle += dot(d.area_m2, away) / (distance * distance * distance);
      continue;
    }
    for (Index k = node.first; k < node.first + node.count; ++k) {
      const auto& v = triangles_[at(order_[at(k)])];
      const Vec3d a = vec_cast<double>(positions_[at(v[0])]) - p,
                  b = vec_cast<double>(positions_[at(v[1])]) - p,
                  c = vec_cast<double>(positions_[at(v[2])]) - p;
      const double la = length(a), lb = length(b), lc = length(c);  // Van Oosterom & Strackee 1983
      solid_angle += 2 * std::atan2(dot(a, cross(b, c)),
                                    la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    if (node.count > 0) continue;
    stack[top++] = i + 1;
    stack[top++] = node.right;
  }
  return solid_angle / (4 * std::numbers::pi);
}

bool PointInMesh::inside(Vec3f p_m) const {
  return fill_ == MeshFill::closed ? winding(p_m) != 0 : std::abs(generalized_winding(p_m)) >= 0.5;
}

float PointInMesh::distance_m(Vec3f p_m) const {
  float best = std::numeric_limits<float>::infinity();
  std::array<Index, 64> stack;
  std::size_t top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const Node& node = tree_[at(stack[--top])];
    if (squared_distance_to_box(p_m, node.box) >= best) continue;
    for (Index i = node.first; i < node.first + node.count; ++i) {
      const auto& v = triangles_[at(order_[at(i)])];
      best = min(best, squared_distance_to_triangle(p_m, positions_[at(v[0])], positions_[at(v[1])],
                                                    positions_[at(v[2])]));
    }
    if (node.count > 0) continue;
    Index near = static_cast<Index>(&node - tree_.data()) + 1, far = node.right;
    if (squared_distance_to_box(p_m, tree_[at(far)].box) < squared_distance_to_box(p_m, tree_[at(near)].box))
      std::swap(near, far);
    stack[top++] = far;
    stack[top++] = near;
  }
  return sqrt(best);
}

}  // namespace tactus
