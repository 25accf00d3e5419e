#pragma once
/// Cuts the lattice of a body by the strips that a blade sweeps, frame by frame (Molino et al. 2004, Sifakis
/// et al. 2007).
#include <functional>
#include <span>
#include <vector>

#include "tactus/geom/lattice/cube_lattice.h"
#include "tactus/tissue/cut/blade_trail.h"
#include "tactus/tissue/cut/exact_sign.h"
#include "tactus/tissue/cut/flat_lists.h"
#include "tactus/tissue/cut/point_blocks.h"
#include "tactus/tissue/topology_change.h"

namespace tactus::cut {

/// Walls stay so far from nodes, in spacings.
inline constexpr double kFromNode = 5e-5;

/// The strip that the edge of a blade sweeps in a frame: a polyline at the frame's begin and end [m], as many
/// points; no end: it stays.
struct BladeStrip {
  std::vector<Vec3f> begin_m, end_m;
  /// Number of the strip; the next one of a stroke has the next number. Then an edge that passes where two
  /// strips meet is cut by one of them.
  int frame = 0;

  Box3f box_m() const;
  double area_m2() const;
  /// With names that nodes don't have.
  void add_triangles_to(std::vector<NamedTriangle>& found) const;
  /// The k-th segment of the edge at the begin.
  std::array<NamedPoint, 2> begin_segment(std::size_t k) const {
    return {named(begin_m, k, frame), named(begin_m, k + 1, frame)};
  }

 private:
  static NamedPoint named(const std::vector<Vec3f>& of, std::size_t k, int when);
  template <class F>
  void for_each_triangle(F&& f) const;
};

/// Pairs of corners along which cuts are looked up: edges of the cube, and of the six tetrahedra round its
/// diagonal from corner 0 to corner 7.
inline constexpr int kPairs = 19;
extern const std::array<std::array<int, 2>, kPairs> kCornerPairs;  ///< the first twelve are the cube's edges

/// A cube or copy that falls in two along a wall.
struct CubeSplit {
  Index parent = 0;
  Index part[2] = {};  ///< copies that have its material
  std::uint8_t sides =
      0;  ///< bit q: corner q is on the side of part[1], also where the parent has no material
};

/// Owns the lattice as it is cut now. In a frame: mark(), splits(), divide() for each stage, and
/// commit(). Cuts of edges stay until they take part in a split; until then nothing moves.
class LatticeCutter {
 public:
  /// @param lattice with capacity for copies, not cut yet
  /// @param may_cut per regular cube; empty: all
  explicit LatticeCutter(CubeLattice lattice, std::vector<std::uint8_t> may_cut = {});

  const CubeLattice& lattice() const { return lattice_; }
  struct Marked {
    Index edges = 0;       ///< of cubes, cut now
    bool refused = false;  ///< the strip meets cubes that must not be cut
  };
  /// Notes which edges a strip crosses. @param x_m of all nodes, which rest
  Marked mark(const BladeStrip& strip, std::span<const Vec3f> x_m);
  /// Notes which edges a blade crosses since its last strip, while the body moves, too.
  /// @param strip the next one of the trail, or the first of another stroke
  /// @param before_m,x_m of all nodes at the strip's begin and end
  Marked mark(BladeTrail& trail, const BladeStrip& strip, std::span<const Vec3f> before_m,
              std::span<const Vec3f> x_m);
  /// Which edges a strip cut, between nodes low < high, and cubes that have one of them. A body that takes
  /// over all journals of another, one by one, is cut as that is.
  struct Journal {
    struct Edge {
      Index low = 0, high = 0;
      float place = 0;  ///< share of the way from low to high
    };
    std::vector<Edge> edges;
    std::vector<Index> cubes;
  };
  /// Journals of all mark()s that cut something.
  const std::vector<Journal>& journals() const { return journals_; }
  /// In place of mark() with a strip. @throws Error naming an id that is out of range.
  void mark(const Journal& journal);
  /// Nodes that blades find elsewhere, away from a wall or off a blade's way: by how much, in spacings.
  struct KeptOff {
    Index node = 0;
    Vec3f by{};
  };
  std::vector<KeptOff> kept_off() const;
  /// Replaces the kept-off nodes that journals left. @param nodes ascending @throws Error naming an id that
  /// is out of range.
  void keep_off(std::span<const KeptOff> nodes);
  /// Which cubes fall apart by the cuts so far, in stages: a cube that falls in three is in two of them, its
  /// last part is the parent of the second. Copies are theirs from now on, nodes are not.
  /// @param has_capacity whether others have capacity for so many copies; none: they have
  /// @returns valid until the next call; nothing where there is no capacity: is_full() says so, and the cuts
  /// stay
  std::span<const std::vector<CubeSplit>> splits(const std::function<bool(Index copies)>& has_capacity = {});
  bool is_full() const { return is_full_; }
  /// part_island() found no capacity once: the island goes on with the part that it was in.
  bool has_left_islands() const { return has_left_islands_; }
  /// In place of splits(): material of a closed surface falls off. Its copies share nodes with one another,
  /// but none with others from now on, though these may own the same corners.
  /// @param is_whole per cube: part[0] has nothing
  std::span<const std::vector<CubeSplit>> part_island(std::span<const Index> cubes,
                                                      std::span<const std::uint8_t> is_whole);
  /// Gives a stage's parts their parents' fill and mass, before the next stage parts them again. @param share
  /// per split: part[1]'s share of the parent's fill
  void divide(const std::vector<CubeSplit>& stage, const std::vector<double>& share);
  /// Gives copies their nodes, and these their masses, once all stages were divided.
  /// @param change its old contents are dropped
  void commit(std::span<const std::vector<CubeSplit>> stages, TopologyChange& change);

  /// Copies that are no more, and those that get their material. @param change its old contents are dropped
  void join(std::span<const std::array<Index, 2>> from_to, TopologyChange& change);

  /// Where a strip crossed the way between two corners: share of the way from `a`; -1: none did.
  double place(Index cube, int a, int b) const;
  /// Cubes and copies that have material in a regular cube, ascending.
  std::span<const Index> live(Index regular) const {
    if (const Index place = cut_place_[index(regular)]; place >= 0)
      return std::span(live_[index(place)].cubes).first(index(live_[index(place)].count));
    return {&grid_[cell(lattice_.cubes[index(regular)])], 1};
  }
  /// Regular cube at lattice coordinates; -1: none.
  Index regular_at(Vec3i p) const {
    const Vec3i n = lattice_.node_dims - Vec3i{1, 1, 1};
    if (p.x < 0 || p.y < 0 || p.z < 0 || p.x >= n.x || p.y >= n.y || p.z >= n.z) return -1;
    return grid_[cell(p)];
  }
  Index regular_of(Index cube) const {
    return cube < lattice_.regular_cubes() ? cube
                                           : lattice_.copies[index(cube - lattice_.regular_cubes())].of;
  }
  /// Corners whose material is a cube's own.
  std::uint8_t corners(Index cube) const {
    return cube < lattice_.regular_cubes() ? std::uint8_t{0xFF}
                                           : lattice_.copies[index(cube - lattice_.regular_cubes())].corners;
  }
  Index copies_in_use() const { return next_copy_ - lattice_.regular_cubes(); }
  /// Per node, which nodes hang together: the lowest of them. Looks at all cubes.
  std::vector<Index> part_of_nodes() const;
  /// Bodies that nodes hold together. Looks at all cubes.
  int part_count() const;

 private:
  static constexpr Index kCubeBlock = 16;  ///< regular cubes that are looked at together
  static std::size_t index(std::int64_t i) { return static_cast<std::size_t>(i); }
  /// Place of a cell in the box.
  std::size_t cell(Vec3i p) const {
    const Vec3i n = lattice_.node_dims - Vec3i{1, 1, 1};
    return index((std::int64_t{p.z} * n.y + p.y) * n.x + p.x);
  }
  static std::uint64_t key(Index a, Index b);
  std::uint32_t cut_edges(Index cube) const;
  /// Pairs that join the corners of a cube: its edges. A copy's corners may hang together along a diagonal
  /// alone, as their material does.
  unsigned pairs_of(Index cube) const { return cube < lattice_.regular_cubes() ? 12 : kPairs; }
  /// Pairs of a cube's corners that the strip parts.
  struct Crossed {
    std::uint32_t pairs = 0;          ///< bits
    std::array<float, kPairs> place;  ///< share of the way from the lower id
  };
  /// Nodes go from one place to another while the blade's edge stays at its begin, then it sweeps its strip.
  struct Sweep {
    BladeStrip strip;
    std::span<const Vec3f> from, to;                   ///< places of nodes; the same: nothing moves
    std::span<const std::uint8_t> from_name, to_name;  ///< empty: the same
    bool moves() const { return from.data() != to.data(); }
    NamedPoint node_before(Index i) const { return {from[index(i)], name(i, from_name)}; }
    NamedPoint node(Index i) const { return {to[index(i)], name(i, to_name)}; }

   private:
    static std::int64_t name(Index i, std::span<const std::uint8_t> of) {
      return 2 * std::int64_t{i} + (of.empty() ? 0 : of[index(i)]);
    }
  };
  void mark(const Sweep& sweep, Marked& marked);
  void keep_journal();
  void find_crossed(Index cube, const Sweep& sweep, Crossed& found) const;
  void find_swept(Index cube, const Sweep& sweep, Crossed& found) const;
  void mark_cube(Index cube, const Crossed& crossed, Marked& marked);
  bool add_cut(Index low, Index high, float place);
  int steps_of(const BladeTrail& trail, const std::vector<Vec3f>& edge) const;
  void take_nodes_off(BladeTrail& trail, Marked& marked);
  bool move_nodes(BladeTrail& trail, float share);
  void mark_step(BladeTrail& trail, const std::vector<Vec3f>& edge, int k, int steps, Marked& marked);
  void place_nodes(const RestFrame& frame, std::span<const Vec3f> x_m, std::vector<Vec3f>& nodes) const;
  /// Corners of the parts of a cube.
  struct Parts {
    std::array<std::uint8_t, 8> corners{};
    Index count = 0;
  };
  Parts components(Index cube, std::uint32_t cut_edges) const;
  void find_blocks();
  void take_capacity_for_frame(std::size_t splits);
  void find_cubes_in(const Box3f& box, const Sweep& sweep);
  static std::uint8_t extended(std::uint32_t cut_edges, std::uint8_t low, std::uint8_t high);
  void add_copy(const CubeSplit& split, int part, std::uint8_t corners);
  void add_splits(Index cube, std::uint32_t cut_edges, const Parts& parts, Index first);
  bool fits();
  void find_affected();
  void replace_live(Index cube, Index first_copy, Index count);
  /// A cube or copy at a lattice corner.
  struct AtCorner {
    Index cube;
    std::uint8_t corner;
    bool owns_corner;
    Index node, before;  ///< node ids from next_node_ on are new
  };
  /// The nodes at a lattice corner.
  struct SharedNodes {
    Vec3i corner{};
    std::size_t first = 0, count = 0;  ///< in at_corners_
    Index new_nodes = 0;               ///< as if no other corner had any
  };
  std::span<AtCorner> entries(const SharedNodes& shared) {
    return std::span(at_corners_).subspan(shared.first, shared.count);
  }
  void share_nodes(SharedNodes& shared);
  void add_copies(Index first_copy, TopologyChange& change);
  void remove_live(Index copy);
  void take_nodes(TopologyChange& change);
  void copy_cuts(Index cube, const std::array<Index, 8>& before);
  void share_masses(Index first_new, TopologyChange& change);
  void add_node(Index node, Index old, TopologyChange& change);

  CubeLattice lattice_;
  std::vector<std::uint8_t> may_cut_;
  std::vector<Index> island_;  ///< per cube and copy: its island; 0: none
  Index islands_ = 0;
  std::vector<Index> grid_;       ///< regular cube per cell of the box
  std::vector<Index> cut_place_;  ///< per regular cube: in live_; -1: it is whole
  /// Cubes and copies with a regular cube's material; each has a corner of it at least. Those of different
  /// islands may have the same ones, kMostLive in all.
  static constexpr std::size_t kMostLive = 16;
  struct Live {
    std::array<Index, kMostLive> cubes{};
    Index count = 0;
  };
  std::vector<Live> live_;              ///< of regular cubes that were cut
  FlatMap<std::uint64_t, float> cuts_;  ///< per pair of nodes: share of the way from the lower id
  std::vector<Vec3f> kept_off_;   ///< per node: where blades find it, away from a wall that is near, spacings
  std::vector<Index> near_wall_;  ///< nodes that have some, and maybe others
  PointBlocks blocks_, blocks_before_;                   ///< of nodes
  std::vector<Index> first_of_cubes_, blocks_of_cubes_;  ///< per kCubeBlock regular cubes: blocks of nodes
  std::vector<Index> dirty_;                             ///< cubes with new cuts
  struct DirtyCube {
    std::uint32_t cut_edges = 0;
    Parts parts;
  };
  std::vector<DirtyCube> dirty_cubes_;  ///< state of dirty_ now; no parts for cubes that are no more
  std::vector<Journal> journals_;
  IndexSet touched_;
  std::vector<SharedNodes> affected_;  ///< corners round the cubes of the last splits()
  std::vector<AtCorner> at_corners_;
  // In mark().
  std::vector<Vec3f> next_nodes_, step_nodes_;
  std::vector<std::uint8_t> step_names_;
  std::vector<std::pair<Index, Vec3f>> off_ways_;  ///< of nodes that the strip takes off its way
  Journal journal_;
  std::vector<NamedTriangle> strip_;
  std::vector<std::uint32_t> hits_;  ///< per kCubeBlock regular cubes: bits of those that meet the strip
  std::vector<Crossed> crossed_;     ///< per cube in found_
  // In splits().
  struct Falling {
    Index cube, parts;
  };
  std::vector<Falling> falling_;
  std::vector<std::pair<Index, Live>> before_;  ///< places in live_, and their old entries
  std::vector<std::vector<CubeSplit>> stages_;  ///< those from stage_count_ on are empty
  std::size_t stage_count_ = 0;
  std::vector<Index> found_, root_;
  Index next_copy_, next_node_;
  bool is_full_ = false, has_left_islands_ = false;
};

}  // namespace tactus::cut
