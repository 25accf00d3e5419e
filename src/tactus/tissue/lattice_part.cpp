#include "tactus/tissue/lattice_part.h"

#include <algorithm>

#include "tactus/base/at.h"

namespace tactus {
namespace {

/// Ids of the first `count`, of ascending z, that lie in [begin, end).
Slab ids_between(const std::vector<Vec3i>& ascending, Index count, Index begin, Index end) {
  const auto first_at = [&](Index z) {
    return static_cast<Index>(
        std::partition_point(ascending.begin(), ascending.begin() + count, [z](Vec3i p) { return p.z < z; }) -
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
  const std::size_t cubes = at(lattice.regular_cubes());
  for (std::size_t c = 0; c < cubes; ++c) {
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
  for (std::size_t c = 0; c < cubes; ++c) {
    if (!keep(c)) continue;
    part.lattice.cubes.push_back(lattice.cubes[c]);
    part.lattice.cube_mass_kg.push_back(lattice.cube_mass_kg[c]);
    if (!lattice.mass_at.empty()) part.lattice.mass_at.push_back(lattice.mass_at[c]);
    std::array<Index, 8> nodes = lattice.cube_nodes[c];
    for (Index& i : nodes) i = id[static_cast<std::size_t>(i)];
    part.lattice.cube_nodes.push_back(nodes);
  }
  part.lattice.share_masses();
  return part;
}

LatticeLayers lattice_layers(const CubeLattice& lattice, Slab layers) {
  const Slab nodes = ids_between(lattice.nodes, lattice.regular_nodes(), layers.begin, layers.end);
  const Slab cubes = ids_between(lattice.cubes, lattice.regular_cubes(), layers.begin, layers.end - 1);
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
  own.mass_at = part_of(lattice.mass_at, cubes);
  own.uneven = lattice.uneven;
  own.node_mass_kg = part_of(lattice.node_mass_kg, nodes);
  own.fixed = part_of(lattice.fixed, nodes);
  return part;
}

VirtualRegions virtual_regions(const CubeLattice& part, Slab own_layers) {
  VirtualRegions regions{.first = part.regular_nodes(),
                         .below = own_layers.begin > 0,
                         .above = own_layers.end < part.node_dims.z};
  regions.capacity = static_cast<Index>(part.virtual_nodes.size()) / regions.count();
  return regions;
}

LatticeLayers lattice_window(const CubeLattice& lattice, Slab held, Slab own) {
  LatticeLayers part = lattice_layers(lattice, held);
  CubeLattice& window = part.lattice;
  const Index first_virtual = lattice.regular_nodes(),
              capacity = static_cast<Index>(lattice.virtual_nodes.size());
  const VirtualRegions regions{.first = window.node_count(),
                               .capacity = capacity,
                               .below = own.begin > held.begin,
                               .above = own.end < held.end};
  const auto region_of = [&](Index z) {
    return z < own.begin ? regions.from_below() : z < own.end ? regions.own() : regions.from_above();
  };
  const auto is_held = [](Index z, Slab layers) { return z >= layers.begin && z < layers.end; };
  const Index places = regions.count() * capacity;
  window.virtual_nodes.assign(at(places), -1);
  window.nodes.resize(window.nodes.size() + at(places), window.nodes.front());
  window.node_mass_kg.resize(window.nodes.size(), 0);
  window.fixed.resize(window.nodes.size(), kAllAxes);
  const auto place_of = [&](Index node) {
    const Index z = lattice.nodes[at(node)].z;
    return node < first_virtual ? node - part.first_node : region_of(z).begin + node - first_virtual;
  };
  for (Index node = first_virtual; node < lattice.node_count(); ++node) {
    const Index regular = lattice.virtual_nodes[at(node - first_virtual)], place = place_of(node);
    if (regular < 0 || !is_held(lattice.nodes[at(node)].z, held)) continue;
    window.virtual_nodes[at(place - regions.first)] = regular - part.first_node;
    window.nodes[at(place)] = window.nodes[at(regular - part.first_node)];
    window.node_mass_kg[at(place)] = lattice.node_mass_kg[at(node)];
    window.fixed[at(place)] = lattice.fixed[at(node)];
  }
  for (std::size_t k = 0; k < lattice.copies.size(); ++k) {
    const std::size_t cube = at(lattice.regular_cubes()) + k;
    const bool here = lattice.copies[k].of >= 0 && is_held(lattice.cubes[cube].z, {held.begin, held.end - 1});
    std::array<Index, 8> nodes = window.cube_nodes.front();
    if (here)
      for (std::size_t q = 0; q < 8; ++q) nodes[q] = place_of(lattice.cube_nodes[cube][q]);
    window.copies.push_back(here ? CubeCopy{lattice.copies[k].of - part.first_cube, lattice.copies[k].corners}
                                 : CubeCopy{});
    window.cubes.push_back(here ? window.cubes[at(window.copies.back().of)] : window.cubes.front());
    window.cube_nodes.push_back(nodes);
    window.cube_fill.push_back(here ? lattice.cube_fill[cube] : 0);
    window.cube_mass_kg.push_back(here ? lattice.cube_mass_kg[cube] : 0);
  }
  return part;
}

}  // namespace tactus
