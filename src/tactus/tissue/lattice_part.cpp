#include "tactus/tissue/lattice_part.h"

#include <algorithm>

namespace tactus {
namespace {

/// Ids of those of ascending z that lie in [begin, end).
Slab ids_between(const std::vector<Vec3i>& ascending, Index begin, Index end) {
  const auto first_at = [&](Index z) {
    return static_cast<Index>(
        std::partition_point(ascending.begin(), ascending.end(), [z](Vec3i p) { return p.z < z; }) -
        ascending.begin());
  };
  return {first_at(begin), first_at(end)};
}

template <class T>
std::vector<T> part_of(const std::vector<T>& all, Slab ids) {
  if (all.empty()) return {};
  return {all.begin() + ids.begin, all.begin() + ids.end};
}

}  // namespace

LatticePart lattice_part(const CubeLattice& lattice, const std::function<bool(std::size_t cube)>& keep) {
  LatticePart part;
  part.lattice.spacing_m = lattice.spacing_m;
  part.lattice.origin_m = lattice.origin_m;
  part.lattice.node_dims = lattice.node_dims;
  std::vector<Index> id(lattice.nodes.size(), -1);
  std::vector<std::uint8_t> used(lattice.nodes.size());
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    if (!keep(c)) continue;
    for (const Index i : lattice.cube_nodes[c]) used[static_cast<std::size_t>(i)] = 1;
  }
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i] == 0) continue;
    id[i] = static_cast<Index>(part.node.size());
    part.node.push_back(static_cast<Index>(i));
    part.lattice.nodes.push_back(lattice.nodes[i]);
    part.lattice.fixed.push_back(lattice.fixed[i]);
  }
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    if (!keep(c)) continue;
    part.lattice.cubes.push_back(lattice.cubes[c]);
    part.lattice.cube_mass_kg.push_back(lattice.cube_mass_kg[c]);
    std::array<Index, 8> nodes = lattice.cube_nodes[c];
    for (Index& i : nodes) i = id[static_cast<std::size_t>(i)];
    part.lattice.cube_nodes.push_back(nodes);
  }
  part.lattice.share_masses();
  return part;
}

LatticeLayers lattice_layers(const CubeLattice& lattice, Slab layers) {
  const Slab nodes = ids_between(lattice.nodes, layers.begin, layers.end);
  const Slab cubes = ids_between(lattice.cubes, layers.begin, layers.end - 1);
  LatticeLayers part{{}, nodes.begin, cubes.begin};
  CubeLattice& own = part.lattice;
  own.spacing_m = lattice.spacing_m;
  own.origin_m = lattice.origin_m + Vec3f{0, 0, lattice.spacing_m * static_cast<float>(layers.begin)};
  own.node_dims = {lattice.node_dims.x, lattice.node_dims.y, layers.count()};
  own.nodes = part_of(lattice.nodes, nodes);
  own.cubes = part_of(lattice.cubes, cubes);
  own.cube_nodes = part_of(lattice.cube_nodes, cubes);
  for (Vec3i& p : own.nodes) p.z -= layers.begin;
  for (Vec3i& p : own.cubes) p.z -= layers.begin;
  for (std::array<Index, 8>& corners : own.cube_nodes)
    for (Index& i : corners) i -= nodes.begin;
  own.cube_fill = part_of(lattice.cube_fill, cubes);
  own.cube_mass_kg = part_of(lattice.cube_mass_kg, cubes);
  own.node_mass_kg = part_of(lattice.node_mass_kg, nodes);
  own.fixed = part_of(lattice.fixed, nodes);
  return part;
}

}  // namespace tactus
