#pragma once
/// Changes of a body by a cut between two frames.
#include <vector>

#include "tactus/geom/lattice/cube_lattice.h"
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// The changes that a cut asks of all objects that hold ids of nodes or cubes. Ids are the body's and never
/// change their meaning: new nodes and copies take places for which the body has capacity.
struct TopologyChange {
  struct Copy {
    Index cube = 0;  ///< its id
    CubeCopy copy;
    Index parent = 0;  ///< cube that it replaces a part of: it takes over its history
    Index layer = 0;   ///< its z
    std::array<Index, 8> nodes{};
    float fill = 0;
    float mass_kg = 0;
  };
  struct Node {
    Index node = 0;
    Index from =
        -1;  ///< of a new virtual node: where it is, and how fast; -1: not new, only its mass changes
    Index layer = 0;  ///< its z
    float mass_kg = 0;
    HeldAxes fixed = 0;
  };
  struct Cut {
    Index cube = 0;
    Index layer = 0;
  };
  std::vector<Cut> cut;  ///< cubes that are no more
  std::vector<Copy> copies;
  std::vector<Node> nodes;

  /// A vertex of the body's surface that is new, or that another cube or copy moves from now on.
  struct Vertex {
    Index vertex = 0;
    Index cube = 0;
    Vec3f local{};  ///< where in the cube, in spacings
  };
  /// A triangle that is new, or has other vertices.
  struct Triangle {
    Index triangle = 0;
    std::array<Index, 3> vertices{};
  };
  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;

  /// Lists keep their capacity.
  void clear() {
    cut.clear();
    copies.clear();
    nodes.clear();
    vertices.clear();
    triangles.clear();
  }
};

/// The axes along which a node does not move: all, if no cube with material hangs on it, since it has no
/// mass.
HeldAxes held_axes(const CubeLattice& lattice, Index node);

/// From a lattice that has capacity, and no cuts yet, to one with the same capacity that cut_lattice made.
/// @throws Error when they are not of one body, or their capacity differs.
TopologyChange topology_change(const CubeLattice& before, const CubeLattice& after);

/// The lattice after a change. @throws Error naming an id that is out of range.
void apply(const TopologyChange& change, CubeLattice& lattice);

}  // namespace tactus
