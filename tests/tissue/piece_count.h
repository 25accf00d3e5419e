#pragma once
/// How many pieces planes leave of a solid, as a Monte Carlo count that shares no code with cuts.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "tactus/geom/mesh/mesh.h"

namespace tactus::test {

struct CutPlane {
  Vec3d point, normal, along;  ///< along: the way of the blade; unit, in the plane
  double above(Vec3d p) const { return dot(normal, p - point); }
};

/// Random points in a closed mesh. Two points are joined where the segment between them crosses neither the
/// planes nor the mesh.
class PieceCount {
 public:
  PieceCount(const TriangleMesh& mesh_m, std::vector<CutPlane> planes, int points, std::mt19937& random)
      : planes_(std::move(planes)) {
    for (const auto& t : mesh_m.triangles) {
      Face& f = faces_.emplace_back();
      for (std::size_t k = 0; k < 3; ++k)
        f.p[k] = vec_cast<double>(mesh_m.positions_m[static_cast<std::size_t>(t[k])]);
      f.low = min(f.p[0], min(f.p[1], f.p[2]));
      f.high = max(f.p[0], max(f.p[1], f.p[2]));
    }
    const Box3f box = bounds(mesh_m);
    const Vec3d low = vec_cast<double>(box.min), size = vec_cast<double>(box.extent());
    std::uniform_real_distribution<double> uniform(0, 1);
    int tried = 0;
    for (; static_cast<int>(points_.size()) < points; ++tried) {
      const Vec3d p{low.x + size.x * uniform(random), low.y + size.y * uniform(random),
                    low.z + size.z * uniform(random)};
      // A way out that is parallel to nothing.
      const Vec3d out = p + length(size) * Vec3d{1.7312, 0.5173, 0.3391};
      if (crossings(p, out) % 2 == 1) points_.push_back(p);
    }
    const double volume = size.x * size.y * size.z * points / tried;
    join(4 * std::cbrt(volume / points));
  }
  /// Points of each piece with `least` points or more, ascending.
  std::vector<int> pieces(int least) const {
    std::vector<int> count(points_.size()), found;
    for (std::size_t i = 0; i < points_.size(); ++i) ++count[root(i)];
    for (const int n : count)
      if (n >= least) found.push_back(n);
    std::sort(found.begin(), found.end());
    return found;
  }
  const std::vector<Vec3d>& points() const { return points_; }
  /// One point of each piece: of that which a point is in.
  std::size_t piece(std::size_t point) const { return root(point); }

 private:
  struct Face {
    std::array<Vec3d, 3> p;
    Vec3d low, high;
  };
  static double volume6(Vec3d a, Vec3d b, Vec3d c, Vec3d d) { return dot(b - a, cross(c - a, d - a)); }
  int crossings(Vec3d a, Vec3d b) const {
    const Vec3d low = min(a, b), high = max(a, b);
    int count = 0;
    for (const Face& f : faces_) {
      if (f.low.x > high.x || low.x > f.high.x || f.low.y > high.y || low.y > f.high.y || f.low.z > high.z ||
          low.z > f.high.z)
        continue;
      if ((volume6(f.p[0], f.p[1], f.p[2], a) > 0) == (volume6(f.p[0], f.p[1], f.p[2], b) > 0)) continue;
      const bool s = volume6(a, b, f.p[0], f.p[1]) > 0;
      count += (volume6(a, b, f.p[1], f.p[2]) > 0) == s && (volume6(a, b, f.p[2], f.p[0]) > 0) == s ? 1 : 0;
    }
    return count;
  }
  std::size_t root(std::size_t i) const {
    while (parent_[i] != i) i = parent_[i];
    return i;
  }
  bool are_parted(Vec3d p, Vec3d q) const {
    return std::any_of(planes_.begin(), planes_.end(),
                       [&](const CutPlane& plane) { return (plane.above(p) < 0) != (plane.above(q) < 0); });
  }
  /// The nearest first; what hangs together already is not asked.
  void join(double reach) {
    parent_.resize(points_.size());
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
    struct Pair {
      double way2;
      std::size_t a, b;
    };
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < points_.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        if (const Vec3d d = points_[i] - points_[j]; dot(d, d) < reach * reach)
          pairs.push_back({dot(d, d), i, j});
    std::sort(pairs.begin(), pairs.end(), [](const Pair& p, const Pair& q) { return p.way2 < q.way2; });
    const auto short_root = [&](std::size_t i) {
      while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
      return i;
    };
    for (const auto& [way2, i, j] : pairs) {
      const std::size_t a = short_root(i), b = short_root(j);
      if (a == b || are_parted(points_[i], points_[j])) continue;
      if (crossings(points_[i], points_[j]) == 0) parent_[a] = b;
    }
  }

  std::vector<CutPlane> planes_;
  std::vector<Face> faces_;
  std::vector<Vec3d> points_;
  std::vector<std::size_t> parent_;
};

}  // namespace tactus::test
