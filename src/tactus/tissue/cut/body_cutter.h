#pragma once
/// Cuts a body, its lattice and its surface, by the strips that a blade sweeps.
#include "tactus/tissue/cut/cut_surface.h"

namespace tactus::cut {

/// Result of a strip in a frame.
struct CutReport {
  Index cut_cubes = 0;      ///< cubes and copies that fell apart
  Index slivers = 0;        ///< parts that had too little fill, and got it from the part across their wall
  double area_m2 = 0;       ///< of new walls at rest, one side
  double depth_m = 0;       ///< of the deepest new wall below the original surface, at rest
  bool is_refused = false;  ///< the strip meets cubes that must not be cut
  bool is_full = false;     ///< there was no capacity for its cuts
};

/// Owns a body's lattice and surface as they are cut, on the host. Changes go to `apply` of the solver and of
/// the embedded surface, between two frames. The time of a cut follows the strip, but for one look at all
/// cubes.
class BodyCutter {
 public:
  /// @param lattice with capacity for copies @param may_cut per regular cube; empty: all
  /// @param surface closed @throws Error if it is not
  BodyCutter(const CubeLattice& lattice, std::vector<std::uint8_t> may_cut, const TriangleMesh& surface,
             std::span<const embed::Anchor> anchors, CutSurface::Capacity capacity)
      : lattice_(lattice, std::move(may_cut)), surface_(lattice_, surface, anchors, capacity) {}

  /// Takes capacity for the changes of a frame.
  void take_capacity_for(TopologyChange& change) const;

  /// @param x_m of all nodes, which rest @param change its old contents are dropped
  CutReport cut(const BladeStrip& strip, std::span<const Vec3f> x_m, TopologyChange& change);
  /// The same for a body that moves. Trails of all blades have to follow the change.
  /// @param before_m,x_m of all nodes at the strip's begin and end
  CutReport cut(BladeTrail& trail, const BladeStrip& strip, std::span<const Vec3f> before_m,
                std::span<const Vec3f> x_m, TopologyChange& change);

  /// In place of a strip. @throws Error.
  CutReport cut(const LatticeCutter::Journal& journal, TopologyChange& change) {
    lattice_.mark(journal);
    return cut_marked(change);
  }
  /// A strip that found no capacity. @throws Error.
  void mark(const LatticeCutter::Journal& journal) { lattice_.mark(journal); }
  /// Cuts of strips that found no capacity are made, once there is some.
  CutReport go_on(TopologyChange& change) { return cut_marked(change); }
  /// From now on, a strip finds no capacity where less than as much again would be left for the islands that
  /// it makes.
  void keep_spare() { keeps_spare_ = true; }

  /// After cut(), as long as it changes something, so that each part of the lattice has one closed surface:
  /// parts a piece of the surface from the part that it moves with, if that has a larger one, or joins parts
  /// without a surface, or with a sliver, to their neighbours.
  /// @param change its old contents are dropped @returns whether it did
  bool match_parts(TopologyChange& change);

  /// After all journals of another body.
  void keep_off(std::span<const LatticeCutter::KeptOff> nodes) { lattice_.keep_off(nodes); }

  const LatticeCutter& lattice() const { return lattice_; }
  const CutSurface& surface() const { return surface_; }
  /// Pieces of the surface that hang together, with their volumes where the nodes are [m^3].
  std::vector<double> closed_volumes_m3(std::span<const Vec3f> x_m) const;
  /// The surface where the nodes are. @param only_used leaves triangles out that are not in use
  TriangleMesh mesh(std::span<const Vec3f> x_m) const;

 private:
  CutReport cut_marked(TopologyChange& change);
  bool has_capacity(Index copies) const;
  LatticeCutter lattice_;
  CutSurface surface_;
  bool keeps_spare_ = false;
};

}  // namespace tactus::cut
