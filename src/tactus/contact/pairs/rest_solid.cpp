#include "tactus/contact/pairs/rest_solid.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "tactus/base/at.h"

namespace tactus {
namespace {

/// Distances at points of a grid, each worked out once.
class GridDistances {
 public:
  GridDistances(const CubeLattice& lattice, const PointInMesh& mesh) : lattice_(lattice), mesh_(mesh) {}
  float at_m(Vec3i cell, int i, int j, int k) {
    constexpr Index kCuts = CubeSamples::kCuts;
    const Vec3i p{kCuts * cell.x + i, kCuts * cell.y + j, kCuts * cell.z + k};
    const std::int64_t key = (std::int64_t{p.z} << 42) | (std::int64_t{p.y} << 21) | std::int64_t{p.x};
    const auto [found, is_new] = known_.try_emplace(key, 0.F);
    if (is_new)
      found->second =
          mesh_.signed_distance_m(lattice_.origin_m + (lattice_.spacing_m / kCuts) * vec_cast<float>(p));
    return found->second;
  }

 private:
  const CubeLattice& lattice_;
  const PointInMesh& mesh_;
  std::unordered_map<std::int64_t, float> known_;
};

}  // namespace

RestSolid rest_solid(const CubeLattice& lattice, const TriangleMesh& surface, MeshFill fill) {
  const PointInMesh mesh(surface, fill);
  GridDistances distances(lattice, mesh);
  constexpr int kCuts = CubeSamples::kCuts;
  RestSolid solid;
  for (Index c = 0; c < lattice.regular_cubes(); ++c) {
    if (!lattice.has_cube(at(c))) continue;
    const Vec3i cell = lattice.cubes[at(c)];
    std::array<float, 8> corner{};
    float nearest = 1e30F;
    for (int q = 0; q < 8; ++q) {
      corner.at(at(q)) = distances.at_m(cell, kCuts * (q & 1), kCuts * (q >> 1 & 1), kCuts * (q >> 2));
      nearest = std::min(nearest, std::abs(corner.at(at(q))));
    }
    if (nearest > kBandSpacings * lattice.spacing_m) continue;
    // No point of a cube is farther than half its diagonal from a corner.
    const bool holds_surface = nearest <= 0.8661F * lattice.spacing_m;
    solid.cubes.push_back(c);
    for (int k = 0; k <= kCuts; ++k)
      for (int j = 0; j <= kCuts; ++j)
        for (int i = 0; i <= kCuts; ++i) {
          float value = 0;
          const Vec3f q = (1.F / kCuts) * vec_cast<float>(Vec3i{i, j, k});
          for (int n = 0; n < 8; ++n) value += CubeMap::weight(q, n) * corner.at(at(n));
          solid.sample_m.push_back(holds_surface ? distances.at_m(cell, i, j, k) : value);
        }
  }
  return solid;
}

}  // namespace tactus
