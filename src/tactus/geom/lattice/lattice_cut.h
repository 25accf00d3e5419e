#pragma once
/// Cuts a lattice of cubes by virtual nodes (Molino et al. 2004), on the host.
///
/// A cut crosses edges of the lattice. A cube whose eight corners fall into two or more components, joined by
/// uncut edges, is completely cut. Each component gets a copy of the cube. A copy has the regular nodes at
/// the corners of its component, and virtual nodes at the others. So a corner of the lattice is material on
/// one side only, and cubes that are not completely cut keep their eight regular nodes.
///
/// Two cubes or copies that share a face share all four nodes of it if one of its corners is real in both.
/// The same holds for an edge and its two nodes. So the end of a slit closes by itself (Sifakis et al. 2007).
#include <functional>

#include "tactus/geom/lattice/cube_lattice.h"

namespace tactus {

/// Whether an edge is cut: from a node's coordinates one step along an axis (0 x, 1 y, 2 z).
using EdgeIsCut = std::function<bool(Vec3i from, int axis)>;

/// The lattice with these edges cut. Regular nodes and cubes keep their ids. Cubes that are completely cut
/// get a fill of 0. Copies follow in ascending order of cube and lowest corner, and virtual nodes in the
/// order in which copies use them. A copy has the part of its cube's fill that its number of corners is of
/// eight. Virtual nodes of fixed nodes are fixed.
/// @param capacity the virtual elements has capacity for so many copies and nodes, at least for those that
/// the cut needs
/// @throws Error when the lattice has virtual elements already.
CubeLattice cut_lattice(const CubeLattice& lattice, const EdgeIsCut& is_cut, VirtualCapacity capacity = {});

/// Nodes but for those that are capacity: ids of nodes in use are below.
Index nodes_in_use(const CubeLattice& lattice);

/// Extends values per regular cube to all cubes: a copy has the value of its cube, an unused entry T{}.
template <class T>
std::vector<T> with_copies(const CubeLattice& lattice, std::vector<T> of_regular_cubes) {
  for (const CubeCopy& copy : lattice.copies)
    of_regular_cubes.push_back(copy.of < 0 ? T{} : of_regular_cubes[static_cast<std::size_t>(copy.of)]);
  return of_regular_cubes;
}

}  // namespace tactus
