#pragma once
/// Parts of a lattice that are solved apart: by model, or by device.
#include <functional>

#include "tactus/geom/lattice/cube_lattice.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {

/// The regular cubes of a lattice for which keep is set, and their nodes; node[i] is the number in the whole
/// of the part's node i. Masses are those of these cubes alone.
struct LatticePart {
  CubeLattice lattice;
  std::vector<Index> node;
};
LatticePart lattice_part(const CubeLattice& lattice, const std::function<bool(std::size_t cube)>& keep);

/// The layers of nodes [begin, end) of a lattice and the cubes between them, without the virtual elements;
/// layer begin is layer 0 of the part. Nodes keep the masses they have in the whole. Node i of the part is
/// first_node + i of the whole.
struct LatticeLayers {
  CubeLattice lattice;
  Index first_node = 0, first_cube = 0;
};
LatticeLayers lattice_layers(const CubeLattice& lattice, Slab layers);

/// Where a slab keeps virtual nodes: behind its regular nodes, in up to three regions. Each has a place
/// for every virtual node of the body, in the body's order, so nothing moves when a cut adds some. The first
/// region is for nodes in the slab's own layers. The next ones, if there are such layers, are for copies of
/// nodes in the layers that the slab holds below and above its own.
struct VirtualRegions {
  Index first = 0;     ///< node of the part
  Index capacity = 0;  ///< virtual nodes of the body
  bool below = false, above = false;
  int count() const { return 1 + (below ? 1 : 0) + (above ? 1 : 0); }
  Slab own() const { return {first, first + capacity}; }
  Slab from_below() const { return {own().end, own().end + (below ? capacity : 0)}; }
  Slab from_above() const { return {from_below().end, from_below().end + (above ? capacity : 0)}; }
};
/// Regions of a part that lattice_window made, or of a whole lattice.
VirtualRegions virtual_regions(const CubeLattice& part, Slab own_layers);

/// Layers of a lattice, and the part of its virtual elements that lies in them. Places of nodes and copies
/// that lie elsewhere are capacity. @param held,own layers of nodes that a slab has, and of those the ones
/// that move there
LatticeLayers lattice_window(const CubeLattice& lattice, Slab held, Slab own);

}  // namespace tactus
