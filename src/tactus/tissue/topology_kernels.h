#pragma once
/// A change of a body's topology, on a device that has all of it or a slab.
#include "tactus/geom/maths/held_axes.h"
#include "tactus/tissue/changed_element.h"

namespace tactus::cut {

/// Cubes that are no more have no stiffness, and no stress that has to fade.
struct ClearCubes {
  View<const Index> cubes;
  View<const Index> cube_cell;                 ///< of regular cubes; the others are copies
  View<std::uint16_t> kind;                    ///< over cells
  View<float> stiffness_fields;                ///< on a CPU: 3 fields over cells
  View<float> history_Pa, virtual_history_Pa;  ///< fields over cells and over copies, if anything relaxes
  View<tled::Stiffness> of_copies;
  Index cells;
  TACTUS_HD void operator()(Index i) const {
    const Index cube = cubes[i], copy = cube - cube_cell.size();
    if (copy >= 0) {
      of_copies[copy] = {};
      for (Index at = copy; at < virtual_history_Pa.size(); at += of_copies.size())
        virtual_history_Pa[at] = 0;
      return;
    }
    const Index cell = cube_cell[cube];
    for (Index at = cell; at < history_Pa.size(); at += cells) history_Pa[at] = 0;
    kind[cell] = 0;
    for (Index field = 0; field < 3 && !stiffness_fields.empty(); ++field)
      stiffness_fields[field * cells + cell] = 0;
  }
};

/// Copies take over their parents' history, as much as they have of their stiffness.
struct AddCopies {
  View<const LocalCopy> copies;
  View<const Index> cube_cell;
  tled::StiffnessKinds of_cells;
  View<const float> history_Pa;  ///< fields over cells; empty: nothing relaxes
  View<embed::CubeNodes> nodes;
  View<tled::Stiffness> stiffness;
  View<float> virtual_history_Pa;  ///< the same fields over copies
  Index cells;
  TACTUS_HD void operator()(Index i) const {
    const LocalCopy made = copies[i];
    const Index capacity = nodes.size(), of_virtual = made.parent - cube_cell.size();
    const float parent_mu_Pa =
        of_virtual < 0 ? of_cells[cube_cell[made.parent]].mu_Pa : stiffness[of_virtual].mu_Pa;
    const float share = made.stiffness.mu_Pa / parent_mu_Pa;
    nodes[made.copy] = made.nodes;
    stiffness[made.copy] = made.stiffness;
    for (Index field = 0; field * capacity < virtual_history_Pa.size(); ++field)
      virtual_history_Pa[field * capacity + made.copy] =
          share * (of_virtual < 0 ? history_Pa[field * cells + cube_cell[made.parent]]
                                  : virtual_history_Pa[field * capacity + of_virtual]);
  }
};

/// A node that no cube with material hangs on has no mass.
TACTUS_HD inline float inverse_or_0(float mass_kg) { return mass_kg > 0 ? 1.F / mass_kg : 0.F; }

/// New masses where elements move nodes.
struct SetCellMasses {
  View<const LocalNode> nodes;
  View<const Index> cell;
  View<float> inverse_mass_per_kg;  ///< over cells
  TACTUS_HD void operator()(Index i) const {
    const LocalNode n = nodes[i];
    inverse_mass_per_kg[cell[n.node]] = n.fixed == kAllAxes ? 0.F : inverse_or_0(n.mass_kg);
  }
};

/// New masses, fixed nodes, and the part of its mass by which shape matching pulls a node.
struct SetNodeMasses {
  View<const LocalNode> nodes;
  View<const float> matched_mass_kg, held;  ///< per node
  View<float> inverse_mass_per_kg, matched_share;
  View<Index> fixed;
  TACTUS_HD void operator()(Index i) const {
    const LocalNode n = nodes[i];
    const float inverse_mass = inverse_or_0(n.mass_kg);
    inverse_mass_per_kg[n.node] = inverse_mass;
    matched_share[n.node] = inverse_mass > 0 ? matched_mass_kg[n.node] / n.mass_kg * held[n.node] : 0.F;
    fixed[n.node] = n.fixed;
  }
};

/// New nodes begin where those are that they were split from.
struct PlaceNodes {
  View<const LocalNode> nodes;
  View<Vec3f> x_m, v_m_s, f_ext_N;  ///< forces: empty where no step reads them
  TACTUS_HD void operator()(Index i) const {
    const LocalNode n = nodes[i];
    if (n.from < 0) return;
    x_m[n.node] = x_m[n.from];
    v_m_s[n.node] = v_m_s[n.from];
    if (n.node < f_ext_N.size()) f_ext_N[n.node] = Vec3f{};
  }
};

/// Contact moves new nodes as others.
struct SetHeldNodes {
  View<const LocalNode> nodes;
  View<const Index> cell;  ///< per node, where nodes are in cells; or empty
  View<Index> held;        ///< HeldAxes per node, or cell
  TACTUS_HD void operator()(Index i) const {
    const LocalNode n = nodes[i];
    if (n.from >= 0) held[cell.empty() ? n.node : cell[n.node]] = n.fixed;
  }
};

/// New masses of nodes [first, first + mass_kg.size()).
struct SetMasses {
  View<const LocalNode> nodes;
  Index first;
  View<float> mass_kg;
  TACTUS_HD void operator()(Index i) const {
    const Index at = nodes[i].node - first;
    if (at >= 0 && at < mass_kg.size()) mass_kg[at] = nodes[i].mass_kg;
  }
};

}  // namespace tactus::cut
