#pragma once
/// Bodies that touch one another, as the host knows them.
#include <array>
#include <map>
#include <span>
#include <vector>

#include "tactus/contact/pairs/pair_views.h"
#include "tactus/contact/pairs/rest_solid.h"
#include "tactus/contact/pairs/solid_change.h"

namespace tactus {

/// A body that touches others.
struct PairedBody {
  const CubeLattice& lattice;
  const TriangleMesh& surface;  ///< closed, where the lattice rests
  MeshFill fill = MeshFill::closed;
  std::span<const EmbeddedPoint> points;  ///< of its surface, that touch; without weights: capacity
  ContactNodes nodes;                     ///< the views stay valid
  bool touches_itself = false;
  bool cuttable = false;             ///< BodyPairs::apply takes its cuts over
  bool walls_touch = true;           ///< of a cut: each other, and its parts each other
  const RestSolid* solid = nullptr;  ///< rest_solid() of it, if known
};

/// All bodies' patches, cubes, points and rows, one body after the other. Points of a patch are in groups. A
/// cuttable body has patches everywhere, and capacity: places for all its cubes, and for points in groups of
/// their own. A cut changes entries of a body, and lists the changed ones.
class PairModel {
 public:
  void add(const PairedBody& body);
  /// @throws Error for a body that is not cuttable, an id that is out of range, or where there is no
  /// capacity.
  void apply(Index body, const SolidChange& change);

  std::vector<PairBody> bodies;
  std::vector<CubePatch> patches;
  std::vector<SolidCube> cubes;
  std::vector<float> samples;  ///< while bodies are added
  std::vector<PointGroup> groups;
  std::vector<EmbeddedPoint> points;
  std::vector<PointRest> rest;
  std::vector<Index> rows;  ///< at 8 point + corner
  std::vector<PairNode> nodes;
  std::vector<Index> part;
  std::vector<std::vector<Index>> patch_nodes, patch_cubes, row_points, row_cubes;
  float smallest_mass_kg = 1e30F;

  /// Entries that the last apply() changed; patches and rows whose lists did are ascending.
  struct Changed {
    std::vector<Index> cubes, points, gone;
    std::vector<Index> patches, rows;
  };
  const Changed& changed() const { return changed_; }

 private:
  using Key = std::array<Index, 3>;
  struct Patch {
    std::vector<std::size_t> cubes;  ///< of the solid
    std::vector<std::size_t> points;
  };
  /// State of a body that cuts need.
  struct Body {
    bool cuttable = false, walls_touch = false;
    std::map<Key, Index> patch_of;
    std::vector<Index> place_of_cube, place_of_point, row_of;
    Index next_cube = 0, end_cube = 0, next_group = 0, end_group = 0;
    std::map<Index, Index> open_group;  ///< per patch
  };
  static Key key_of(Vec3f p);
  void add_patch(const PairedBody& b, Index body, const RestSolid& solid, const Patch& patch, const Key& key);
  void add_capacity(const PairedBody& b, Index body);
  void add_rows(const PairedBody& b, Index body, Index first_cube);
  void add_points(const PairedBody& b, Index body, const Patch& patch);
  Index patch_at(Index body, Vec3f p) const;
  void remove_cube(Index body, Index cube);
  void set_cube(Index body, const SolidChange::Cube& cube);
  void count_parts(Index body);
  void set_point(Index body, const PointChange& change);
  Index new_point(Index body, const PointChange& change);
  Index row_of(Index body, Index node) const;
  void hold(Index patch, Index node);

  std::vector<Body> host_;
  Changed changed_;
};

}  // namespace tactus
