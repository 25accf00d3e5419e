#include "tactus/tissue/topology_change.h"

#include <string>

#include "tactus/base/at.h"
#include "tactus/base/error.h"

namespace tactus {
namespace {

void check(Index id, Index count, const char* what) {
  if (id < 0 || id >= count)
    throw Error(std::string("change of a body: ") + what + " " + std::to_string(id) + " of " +
                std::to_string(count));
}

}  // namespace

HeldAxes held_axes(const CubeLattice& lattice, Index node) {
  return lattice.node_mass_kg[at(node)] > 0 ? lattice.fixed[at(node)] : HeldAxes{kAllAxes};
}

TopologyChange topology_change(const CubeLattice& before, const CubeLattice& after) {
  if (before.node_count() != after.node_count() || before.cube_count() != after.cube_count() ||
      before.regular_nodes() != after.regular_nodes() || before.regular_cubes() != after.regular_cubes())
    throw Error("a body of " + std::to_string(before.node_count()) + " nodes and " +
                std::to_string(before.cube_count()) + " cubes can't become one of " +
                std::to_string(after.node_count()) + " and " + std::to_string(after.cube_count()) +
                ": expected the same regular ones and the same capacity");
  TopologyChange change;
  for (Index c = 0; c < after.cube_count(); ++c) {
    const bool was = before.has_cube(at(c)), is = after.has_cube(at(c));
    if (was && !is) change.cut.push_back({c, after.cubes[at(c)].z});
    if (was || !is) continue;
    const CubeCopy copy = after.copies.at(at(c - after.regular_cubes()));
    change.copies.push_back({c, copy, copy.of, after.cubes[at(c)].z, after.cube_nodes[at(c)],
                             after.cube_fill[at(c)], after.cube_mass_kg[at(c)]});
  }
  for (Index i = 0; i < after.node_count(); ++i) {
    const Index k = i - after.regular_nodes();
    const bool is_new = k >= 0 && before.virtual_nodes[at(k)] < 0 && after.virtual_nodes[at(k)] >= 0;
    if (is_new || before.node_mass_kg[at(i)] != after.node_mass_kg[at(i)])
      change.nodes.push_back({.node = i,
                              .from = is_new ? after.virtual_nodes[at(k)] : -1,
                              .layer = after.nodes[at(i)].z,
                              .mass_kg = after.node_mass_kg[at(i)],
                              .fixed = held_axes(after, i)});
  }
  return change;
}

void apply(const TopologyChange& change, CubeLattice& lattice) {
  for (const auto& [cube, layer] : change.cut) {
    check(cube, lattice.cube_count(), "cube");
    lattice.cube_fill.at(at(cube)) = lattice.cube_mass_kg[at(cube)] = 0;
  }
  for (const TopologyChange::Copy& made : change.copies) {
    check(made.cube - lattice.regular_cubes(), static_cast<Index>(lattice.copies.size()), "copy");
    check(made.copy.of, lattice.regular_cubes(), "cube");
    for (const Index node : made.nodes) check(node, lattice.node_count(), "node");
    lattice.copies[at(made.cube - lattice.regular_cubes())] = made.copy;
    lattice.cubes[at(made.cube)] = lattice.cubes[at(made.copy.of)];
    lattice.cube_nodes[at(made.cube)] = made.nodes;
    lattice.cube_fill[at(made.cube)] = made.fill;
    lattice.cube_mass_kg[at(made.cube)] = made.mass_kg;
  }
  for (const TopologyChange::Node& changed : change.nodes) {
    check(changed.node, lattice.node_count(), "node");
    lattice.node_mass_kg[at(changed.node)] = changed.mass_kg;
    if (changed.from < 0) continue;
    const Index k = changed.node - lattice.regular_nodes();
    check(k, static_cast<Index>(lattice.virtual_nodes.size()), "virtual node");
    check(changed.from, lattice.node_count(), "node");
    const Index from = changed.from - lattice.regular_nodes();
    lattice.virtual_nodes[at(k)] = from < 0 ? changed.from : lattice.virtual_nodes[at(from)];
    lattice.nodes[at(changed.node)] = lattice.nodes[at(changed.from)];
    lattice.fixed[at(changed.node)] = changed.fixed;
  }
}

}  // namespace tactus
