#pragma once
/// The regular lattice of cubes that a soft body is made of, on the host.
#include <array>
#include <cstdint>
#include <functional>
#include <set>
#include <vector>

#include "tactus/base/vec.h"
#include "tactus/geom/lattice/label_volume.h"
#include "tactus/geom/maths/held_axes.h"
#include "tactus/geom/mesh/mesh.h"
#include "tactus/geom/mesh/point_in_mesh.h"

namespace tactus {

/// A copy of a cube that was cut. It has the material round some corners of that cube.
struct CubeCopy {
  Index of = -1;             ///< the cube at the same coordinates that was cut; -1: capacity for a copy
  std::uint8_t corners = 0;  ///< bit q: the material at corner q is this copy's
};

/// How many copies and virtual nodes a lattice can hold.
struct VirtualCapacity {
  Index copies = 0, nodes = 0;
};

/// Cubes of edge `spacing_m` that a solid touches. Node (i,j,k) rests at origin_m + spacing_m (i,j,k).
///
/// Regular nodes and cubes come first, in ascending (z, y, x) order of their coordinates: reproducible, rows
/// along x contiguous, layers along z contiguous (a slab of layers is a range of ids). No two of them share
/// coordinates.
///
/// Virtual elements come behind them: copies of cubes that were cut, and virtual nodes of those copies
/// (geom/lattice/lattice_cut.h). They share coordinates with regular ones. Ids never change: a cube that was
/// cut stays in the list with a fill of 0, and so do entries of the virtual elements that are not in use yet.
struct CubeLattice {
  float spacing_m = 0;
  Vec3f origin_m{};
  Vec3i node_dims{};                             ///< nodes of the bounding box along x, y, z
  std::vector<Vec3i> nodes;                      ///< coordinates, 0 <= . < node_dims
  std::vector<Vec3i> cubes;                      ///< coordinates of corner 0
  std::vector<std::array<Index, 8>> cube_nodes;  ///< corner q is at cubes[c] + (q & 1, q >> 1 & 1, q >> 2)
  /// Mass and stiffness of each cube over those of a solid one; 0: no cube; empty: 1. Cubes below the surface
  /// carry part of the fill of neighbours at the surface (cube_parts.h), so some have more than 1. The sum is
  /// the volume.
  std::vector<float> cube_fill;
  std::vector<float> cube_mass_kg;
  std::vector<float> node_mass_kg;  ///< of every adjacent cube the part that share_of() says
  /// How the mass of a cube that isn't full lies: per unit of its mass, in spacings.
  struct OffCentre {
    Index cube = 0;
    Vec3f first{};   ///< from its centre to its centre of mass
    Vec3f excess{};  ///< by how much more than 1/6 second moments of eighths are too large
  };
  std::vector<OffCentre> off_centre;  ///< ascending; others lie as full cubes do
  /// Where a regular cube's mass is put, and that of its copies, from its centre in half spacings: -1..1
  /// along each axis. Its corners share it trilinearly from there. place_masses() finds it (mass_points.h).
  /// Empty: all in the middle.
  std::vector<Vec3f> mass_at;
  /// Mean over a cube's corners of an eighth of its mass over what the corner has; of the most uneven cube.
  float uneven = 1;
  std::vector<HeldAxes> fixed;   ///< per node: the axes along which it does not move
  std::vector<CubeCopy> copies;  ///< the last cubes
  std::vector<Index>
      virtual_nodes;  ///< the last nodes: per node the regular one it was split from; -1: capacity

  /// Numbers of regular nodes and cubes; those of the virtual elements follow.
  Index regular_nodes() const { return node_count() - static_cast<Index>(virtual_nodes.size()); }
  Index regular_cubes() const { return cube_count() - static_cast<Index>(copies.size()); }
  bool has_cube(std::size_t cube) const { return cube_fill.empty() || cube_fill[cube] > 0; }
  Index node_count() const { return static_cast<Index>(nodes.size()); }
  Index cube_count() const { return static_cast<Index>(cubes.size()); }
  Vec3f rest_m(Index node) const;
  std::vector<Vec3f> rest_positions_m() const;
  double mass_kg() const;
  /// The part of a cube's mass that its corner q has; the eight make 1.
  float share_of(Index cube, int q) const {
    const Index copy = cube - regular_cubes(),
                regular = copy < 0 ? cube : copies[static_cast<std::size_t>(copy)].of;
    if (mass_at.empty() || regular < 0) return 0.125F;
    const Vec3f t = mass_at[static_cast<std::size_t>(regular)];
    const auto along = [&](float v, int bit) { return 1.F + ((q & bit) != 0 ? v : -v); };
    return 0.125F * (along(t.x, 1) * along(t.y, 2) * along(t.z, 4));
  }
  /// Makes node_mass_kg from cube_mass_kg.
  void share_masses();

  /// Whether some node is held along some axes only.
  bool has_rollers() const;
  /// Fixes the nodes whose rest position satisfies the predicate. @returns how many are fixed now, along all
  /// axes.
  Index fix_where(const std::function<bool(Vec3f)>& predicate);
  /// Nodes with dot(normal, x - point) <= 0.
  Index fix_half_space(Vec3f point_m, Vec3f normal);
};

struct LatticeOptions {
  float spacing_m = 0.005F;
  float density_kg_m3 = 1000;
  double max_bytes = 2e9;     ///< refuse lattices whose bounding box would need more memory
  double bytes_per_cube = 8;  ///< of that box: cube flag, node id, search queue; more with a solver's fields
  MeshFill fill = MeshFill::closed;  ///< of meshes
  float smallest_fill = 0;           ///< of labels: cubes of which they fill less are left out, 0..1
};
/// @throws Error for a spacing that is not positive or larger than the body, or too little memory (with the
/// need), before anything is built.
void check_lattice_size(Vec3f extent_m, const LatticeOptions& options);

/// Cubes that share volume with the inside of a mesh, filled with exactly its volume (cube_parts.h); slivers
/// join a neighbour. With MeshFill::winding: cubes that the inside or the surface touches, filled by the
/// distances of their nodes.
/// @throws Error on a mesh that does not bound a solid (how many edges, where; with MeshFill::winding: when
/// nothing is inside), no triangles, NaN, bad index; and as check_lattice_size.
CubeLattice lattice_from_mesh(const TriangleMesh& mesh, const LatticeOptions& options);

/// Cubes that hold a point with distance_m <= 0, sampled at a quarter of the spacing. `distance_m` is
/// negative inside and at most as steep as a distance (1-Lipschitz); `box_m` holds the solid.
CubeLattice lattice_from_sdf(const std::function<float(Vec3f)>& distance_m, const Box3f& box_m,
                             const LatticeOptions& options);

/// Cubes that share volume with a voxel whose label is in `solid`, at least options.smallest_fill of their
/// own.
CubeLattice lattice_from_labels(const LabelVolume& volume, const std::set<VoxelLabel>& solid,
                                const LatticeOptions& options);

/// Per cube the label in `solid` that fills most of it, by 4^3 samples. Cubes that hold none take it from
/// their surroundings, up to 8 spacings across. `to_volume` takes lattice coordinates to the volume's.
/// @throws Error when none is near a cube.
std::vector<VoxelLabel> labels_of_cubes(const CubeLattice& lattice, const LabelVolume& volume,
                                        const std::set<VoxelLabel>& solid,
                                        const std::function<Vec3d(Vec3d)>& to_volume);

/// A box of nx*ny*nz cubes with its lowest corner at origin_m.
CubeLattice lattice_from_box(Vec3f origin_m, Vec3i cubes, const LatticeOptions& options);

}  // namespace tactus
