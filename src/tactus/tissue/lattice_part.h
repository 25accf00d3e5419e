#pragma once
/// Parts of a lattice that are solved apart: by model, or by device.
#include <functional>

#include "tactus/geom/cube_lattice.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {

/// The cubes of a lattice for which keep is set, and their nodes; node[i] is what the part's node i is in the
/// whole. Masses are those of these cubes alone.
struct LatticePart {
  CubeLattice lattice;
  std::vector<Index> node;
};
LatticePart lattice_part(const CubeLattice& lattice, const std::function<bool(std::size_t cube)>& keep);

/// The layers of nodes [begin, end) of a lattice and the cubes between them; layer begin is layer 0 of the
/// part. Nodes keep the masses they have in the whole. Node i of the part is first_node + i of the whole.
struct LatticeLayers {
  CubeLattice lattice;
  Index first_node = 0, first_cube = 0;
};
LatticeLayers lattice_layers(const CubeLattice& lattice, Slab layers);

}  // namespace tactus
