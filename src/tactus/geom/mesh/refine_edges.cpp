#include "tactus/geom/mesh/refine_edges.h"

#include "tactus/base/at.h"

namespace tactus::refine {

Halves::Halves(std::size_t edges) {
  std::size_t size = 16;
  while (size < 2 * edges) size *= 2;
  places_.resize(size);
}

Index& Halves::of(Index a, Index b) {
  const std::uint64_t edge = static_cast<std::uint64_t>(a) << 32U | static_cast<std::uint64_t>(b);
  const std::uint64_t mixed = edge * 0x9E3779B97F4A7C15U;
  std::size_t k = (mixed ^ mixed >> 29U) & (places_.size() - 1);
  while (places_[k].vertex != kUnknown && places_[k].edge != edge) k = (k + 1) & (places_.size() - 1);
  places_[k].edge = edge;
  return places_[k].vertex;
}

Vec3f middle_m(const TriangleMesh& mesh, Index a, Index b, bool is_curved) {
  const Vec3f from = mesh.positions_m[at(a)], to = mesh.positions_m[at(b)];
  if (!is_curved) return 0.5F * (from + to);
  const Vec3f n_from = mesh.normals[at(a)], n_to = mesh.normals[at(b)];
  return 0.5F * (from + to) - (0.125F * dot(to - from, n_from)) * n_from -
         (0.125F * dot(from - to, n_to)) * n_to;
}

void divide(const TriangleMesh& mesh, const std::array<Index, 3>& corners, const std::array<Index, 3>& half,
            std::vector<std::array<Index, 3>>& parts) {
  int count = 0;
  for (const Index h : half) count += h >= 0 ? 1 : 0;
  if (count == 0) {
    parts.push_back(corners);
    return;
  }
  if (count == 3) {
    for (std::size_t k = 0; k < 3; ++k) parts.push_back({corners[k], half[k], half[(k + 2) % 3]});
    parts.push_back(half);
    return;
  }
  // Turned so that the first edge has a vertex, and of two the last one has none.
  std::size_t k = 0;
  while (half[k] < 0 || (count == 2 && half[(k + 1) % 3] < 0)) ++k;
  const Index a = corners[k], b = corners[(k + 1) % 3], c = corners[(k + 2) % 3], ab = half[k],
              bc = half[(k + 1) % 3];
  if (count == 1) {
    parts.push_back({a, ab, c});
    parts.push_back({ab, b, c});
    return;
  }
  parts.push_back({ab, b, bc});
  const auto apart_m = [&](Index i, Index j) {
    return length(mesh.positions_m[at(i)] - mesh.positions_m[at(j)]);
  };
  if (apart_m(a, bc) < apart_m(ab, c)) {  // the shorter diagonal
    parts.push_back({a, ab, bc});
    parts.push_back({a, bc, c});
  } else {
    parts.push_back({a, ab, c});
    parts.push_back({ab, bc, c});
  }
}

}  // namespace tactus::refine
