#include "tactus/tissue/cut/small_part.h"

#include <algorithm>

#include "tactus/base/at.h"

namespace tactus::cut {

std::vector<Index> small_part(const LatticeCutter& cutter, Index copy, std::size_t most,
                              const std::function<bool(Index copy)>& takes) {
  const CubeLattice& lattice = cutter.lattice();
  const auto share_node = [&](Index a, Index b) {
    const auto &of_a = lattice.cube_nodes[at(a)], &of_b = lattice.cube_nodes[at(b)];
    return std::any_of(of_b.begin(), of_b.end(),
                       [&](Index node) { return std::find(of_a.begin(), of_a.end(), node) != of_a.end(); });
  };
  if (copy < lattice.regular_cubes() || !(lattice.cube_fill[at(copy)] > 0)) return {};
  std::vector<Index> copies{copy};
  for (std::size_t k = 0; k < copies.size(); ++k) {
    if (copies.size() > most || !takes(copies[k])) return {};
    const Vec3i p = lattice.cubes[at(copies[k])];
    for (Index n = 0; n < 27; ++n) {
      const Index regular = cutter.regular_at(p + Vec3i{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1});
      if (regular < 0) continue;
      for (const Index other : cutter.live(regular))
        if (lattice.cube_fill[at(other)] > 0 && share_node(copies[k], other) &&
            std::find(copies.begin(), copies.end(), other) == copies.end()) {
          if (other < lattice.regular_cubes()) return {};
          copies.push_back(other);
        }
    }
  }
  return copies;
}

}  // namespace tactus::cut
