#include "tactus/reconstruct/components.h"

#include <algorithm>
#include <numeric>
#include <string>

#include "tactus/base/error.h"
#include "tactus/geom/maths/symmetric_eigen.h"

namespace tactus {
namespace {

Index root_of(std::vector<Index>& parent, Index i) {
  while (parent[static_cast<std::size_t>(i)] != i) {
    Index& p = parent[static_cast<std::size_t>(i)];
    p = parent[static_cast<std::size_t>(p)];
    i = p;
  }
  return i;
}

/// Sums over the tetrahedra between an origin and each triangle.
struct Moments {
  double volume = 0, area = 0;
  Vec3d first{}, area_first{};
  Mat3d second = Mat3d::zero();
  void add(Vec3d a, Vec3d b, Vec3d c) {
    const Vec3d normal = cross(b - a, c - a);
    const double v = dot(a, cross(b, c)) / 6, s = length(normal) / 2;
    const Vec3d sum = a + b + c;
    volume += v;
    first += v / 4 * sum;
    // Integral of x x^T over a tetrahedron with a corner at the origin.
    second = second + v / 20 * (outer(a, a) + outer(b, b) + outer(c, c) + outer(sum, sum));
    area += s;
    area_first += s / 3 * sum;
  }
};

void describe(MeshComponent& component, const Moments& m, Vec3d origin_m) {
  component.volume_m3 = m.volume;
  component.area_m2 = m.area;
  // An open or flat component has no volume to speak of: less than a thousandth of a ball's of the same area.
  const bool solid = std::abs(m.volume) > 1e-3 * 0.094 * m.area * std::sqrt(m.area);
  const Vec3d center = solid ? m.first / m.volume : (m.area > 0 ? m.area_first / m.area : Vec3d{});
  component.centroid_m = origin_m + center;
  component.axes = Mat3d::identity();
  if (!solid) return;
  const Mat3d covariance = 1 / m.volume * m.second - outer(center, center);
  const SymmetricEigen eigen = symmetric_eigen(covariance);
  component.axes = eigen.vectors;
  for (int i = 0; i < 3; ++i) component.extent_m[i] = std::sqrt(std::max(eigen.values[i], 0.0));
}

void check_triangles(const TriangleMesh& mesh) {
  const auto count = static_cast<Index>(mesh.positions_m.size());
  for (const auto& t : mesh.triangles) {
    for (const Index v : t) {
      if (v < 0 || v >= count)
        throw Error("components: a triangle has vertex " + std::to_string(v) + ", expected 0 to " +
                    std::to_string(count - 1));
    }
  }
}

}  // namespace

MeshComponents find_components(const TriangleMesh& mesh) {
  check_triangles(mesh);
  MeshComponents result;
  const std::size_t count = mesh.positions_m.size();
  std::vector<Index> parent(count);
  std::iota(parent.begin(), parent.end(), 0);
  for (const auto& t : mesh.triangles) {
    const Index a = root_of(parent, t[0]), b = root_of(parent, t[1]);
    parent[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    const Index c = root_of(parent, t[2]), d = root_of(parent, t[0]);
    parent[static_cast<std::size_t>(std::max(c, d))] = std::min(c, d);
  }
  std::vector<Index> component_of_root(count, -1);
  std::vector<Moments> moments;
  const auto at = [&](Index v) { return vec_cast<double>(mesh.positions_m[static_cast<std::size_t>(v)]); };
  const Vec3d origin_m = mesh.positions_m.empty() ? Vec3d{} : at(0);
  result.of_vertex.assign(count, -1);
  for (const auto& t : mesh.triangles) {
    Index& component = component_of_root[static_cast<std::size_t>(root_of(parent, t[0]))];
    if (component < 0) {
      component = static_cast<Index>(result.components.size());
      result.components.emplace_back();
      moments.emplace_back();
    }
    MeshComponent& p = result.components[static_cast<std::size_t>(component)];
    ++p.triangles;
    moments[static_cast<std::size_t>(component)].add(at(t[0]) - origin_m, at(t[1]) - origin_m,
                                                     at(t[2]) - origin_m);
    for (const Index v : t) {
      Index& owner = result.of_vertex[static_cast<std::size_t>(v)];
      if (owner < 0) ++p.vertices;
      owner = component;
    }
  }
  for (std::size_t i = 0; i < moments.size(); ++i) describe(result.components[i], moments[i], origin_m);
  // Largest first; the order of first triangles decides between equals.
  std::vector<Index> order(result.components.size()), rank(result.components.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) {
    return result.components[static_cast<std::size_t>(a)].volume_m3 >
           result.components[static_cast<std::size_t>(b)].volume_m3;
  });
  std::vector<MeshComponent> sorted;
  for (std::size_t i = 0; i < order.size(); ++i) {
    sorted.push_back(result.components[static_cast<std::size_t>(order[i])]);
    rank[static_cast<std::size_t>(order[i])] = static_cast<Index>(i);
  }
  result.components = std::move(sorted);
  for (Index& component : result.of_vertex) {
    if (component >= 0) component = rank[static_cast<std::size_t>(component)];
  }
  return result;
}

Mat3d with_signs_of(const Mat3d& before, Mat3d axes) {
  for (int i = 0; i < 2; ++i) {
    if (dot(axes.row[i], before.row[i]) < 0) axes.row[i] = -axes.row[i];
  }
  axes.row[2] = cross(axes.row[0], axes.row[1]);
  return axes;
}

}  // namespace tactus
