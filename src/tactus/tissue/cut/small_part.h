#pragma once
/// Parts of a lattice that are a few copies of cubes.
#include <functional>
#include <vector>

#include "tactus/tissue/cut/lattice_cutter.h"

namespace tactus::cut {

/// The copies that hang together with this one by nodes, in the order in which they are found. Empty where
/// one of them is a whole cube, they are more than `most`, or takes(copy) is false for one.
std::vector<Index> small_part(const LatticeCutter& cutter, Index copy, std::size_t most,
                              const std::function<bool(Index copy)>& takes);

}  // namespace tactus::cut
