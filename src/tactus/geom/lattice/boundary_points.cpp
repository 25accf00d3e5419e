#include "tactus/geom/lattice/boundary_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <unordered_map>

#include "tactus/base/at.h"
#include "tactus/base/error.h"

namespace tactus {
namespace {

struct Candidate {
  Vec3f x_m, n;
  float area_m2;
};

/// The vertices of a mesh, then the points that cut its longer edges.
std::vector<Candidate> candidates(const TriangleMesh& mesh, float spacing_m) {
  std::vector<Candidate> all;
  for (const Vec3f& p : mesh.positions_m) all.push_back({p, {}, 0});
  std::vector<Candidate> inner;
  for (const auto& t : mesh.triangles) {
    const Vec3f a = mesh.positions_m[at(t[0])], ab = mesh.positions_m[at(t[1])] - a,
                ac = mesh.positions_m[at(t[2])] - a;
    const Vec3f twice = cross(ab, ac);
    const float area = 0.5F * length(twice);
    if (!(area > 0)) continue;
    const float longest = std::max({length(ab), length(ac), length(ac - ab)});
    const auto k = std::max(1, static_cast<int>(std::ceil(longest / spacing_m - 1e-3F)));
    const float share = area / static_cast<float>(3 * k * k);  // a corner's of one of the k² pieces
    for (int i = 0; i <= k; ++i) {
      for (int j = 0; i + j <= k; ++j) {
        const int outer = (i == 0 ? 1 : 0) + (j == 0 ? 1 : 0) + (i + j == k ? 1 : 0);
        const float pieces = outer == 2 ? 1.F : outer == 1 ? 3.F : 6.F;
        if (outer == 2) {
          Candidate& corner = all[at(i == k ? t[1] : j == k ? t[2] : t[0])];
          corner.area_m2 += share;
          corner.n += twice;
        } else {
          const float u = static_cast<float>(i) / static_cast<float>(k),
                      v = static_cast<float>(j) / static_cast<float>(k);
          inner.push_back({a + u * ab + v * ac, twice, pieces * share});
        }
      }
    }
  }
  std::erase_if(all, [](const Candidate& c) { return !(c.area_m2 > 0); });
  all.insert(all.end(), inner.begin(), inner.end());
  return all;
}

}  // namespace

std::vector<SpreadPoint> spread_points(const TriangleMesh& mesh, float spacing_m) {
  if (!(spacing_m > 0) || !std::isfinite(spacing_m))
    throw Error("surface points: their spacing is " + std::to_string(spacing_m) + " m, must be > 0");
  const float apart = 0.6F * spacing_m;
  std::vector<SpreadPoint> points;
  std::vector<Vec3f> normals;
  std::unordered_map<std::int64_t, std::vector<Index>> cells;  // of edge `apart`
  const auto key = [](std::int64_t x, std::int64_t y, std::int64_t z) {
    constexpr std::int64_t kMask = (1 << 21) - 1;
    return (x & kMask) | (y & kMask) << 21 | (z & kMask) << 42;
  };
  for (const Candidate& c : candidates(mesh, spacing_m)) {
    std::array<std::int64_t, 3> cell{};
    for (int a = 0; a < 3; ++a) cell.at(at(a)) = static_cast<std::int64_t>(std::floor(c.x_m[a] / apart));
    Index nearest = -1;
    float nearest_m = apart;
    for (std::int64_t z = cell[2] - 1; z <= cell[2] + 1; ++z)
      for (std::int64_t y = cell[1] - 1; y <= cell[1] + 1; ++y)
        for (std::int64_t x = cell[0] - 1; x <= cell[0] + 1; ++x) {
          const auto found = cells.find(key(x, y, z));
          if (found == cells.end()) continue;
          for (const Index i : found->second) {
            const float d = length(points[at(i)].x_m - c.x_m);
            if (d < nearest_m && dot(normals[at(i)], c.n) > 0) nearest_m = d, nearest = i;
          }
        }
    if (nearest >= 0) {
      points[at(nearest)].area_m2 += c.area_m2;
      continue;
    }
    cells[key(cell[0], cell[1], cell[2])].push_back(static_cast<Index>(points.size()));
    points.push_back({c.x_m, c.area_m2});
    normals.push_back(c.n);
  }
  return points;
}

std::vector<EmbeddedPoint> embed_points(const CubeLattice& lattice, std::span<const SpreadPoint> points,
                                        std::span<const Index> cube_of, std::span<const Vec3f> local_of) {
  constexpr float kNone = 1e-5F;  // smaller weights are left out: their nodes would be searched for nothing
  std::vector<EmbeddedPoint> embedded(points.size());
  for (std::size_t p = 0; p < points.size(); ++p) {
    const Vec3f q = local_of[p];
    const auto& nodes = lattice.cube_nodes[at(cube_of[p])];
    std::array<float, 8> weight{};
    for (std::size_t k = 0; k < 8; ++k) {
      const float w =
          ((k & 1) != 0 ? q.x : 1 - q.x) * ((k & 2) != 0 ? q.y : 1 - q.y) * ((k & 4) != 0 ? q.z : 1 - q.z);
      weight.at(k) = std::abs(w) < kNone ? 0.F : w;
    }
    std::array<std::size_t, 8> order{};
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return weight.at(a) > weight.at(b); });
    const float sum = std::accumulate(weight.begin(), weight.end(), 0.F);
    for (std::size_t k = 0; k < 8; ++k) {
      embedded[p].node[k] = nodes.at(order.at(k));
      embedded[p].weight[k] = weight.at(order.at(k)) / sum;
    }
    embedded[p].area_m2 = points[p].area_m2;
  }
  return embedded;
}

}  // namespace tactus
