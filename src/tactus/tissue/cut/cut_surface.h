#pragma once
/// The surface of a body that is cut: divided along walls, with the walls on both sides.
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <span>
#include <utility>

#include "tactus/geom/mesh/point_in_mesh.h"
#include "tactus/tissue/cut/edge_points.h"
#include "tactus/tissue/cut/flat_lists.h"
#include "tactus/tissue/cut/lattice_cutter.h"
#include "tactus/tissue/cut/short_list.h"
#include "tactus/tissue/cut/wall.h"
#include "tactus/tissue/embedding.h"

namespace tactus::cut {

/// Works in the body's rest state, in lattice coordinates, where no two pieces of material overlap. A cube
/// that falls in two has a wall (cut/wall.h). Where a wall crosses the surface both are divided; the part of
/// the wall that lies in the body becomes surface of both sides.
///
/// Corners of triangles are points and the cube or copy that moves them. Two corners at a point are one
/// vertex if the same nodes move them. So the end of a slit closes by itself, and opens when it goes on.
///
/// The original surface is taken 2e-6 spacings inside of itself, and moved by as little along itself, so that
/// it meets walls and faces of cubes in general position.
///
/// In a frame: cut() for each stage of LatticeCutter::splits(), then find_near_splits(), which may go beside
/// the cutter's commit(), and after both update().
class CutSurface {
 public:
  struct Capacity {
    Index vertices = 0, triangles = 0;
  };
  /// @param anchors of the surface's vertices, in regular cubes
  /// @throws Error if the surface bounds no solid.
  CutSurface(const LatticeCutter& cutter, const TriangleMesh& surface, std::span<const embed::Anchor> anchors,
             Capacity capacity);

  /// @returns per split: part[1]'s share of the parent's material, so that neither has less than kLeastFill;
  /// valid until the next call
  const std::vector<double>& cut(const LatticeCutter& cutter, const std::vector<CubeSplit>& stage);
  static constexpr double kLeastFill = 1.0 / 64;
  /// A cube or copy whose material is of an island, or in part. Side 1 of the wall, which has no triangles,
  /// is the island's.
  struct IslandCube {
    Index cube = 0;
    bool is_whole = false;  ///< all of its material is the island's
    Wall wall;
  };
  /// An island is a closed surface that moves with a part of the lattice that has a larger one: material that
  /// is in pieces while its cube is not. @returns the cubes of the next one; none: there is none
  std::span<const IslandCube> find_island(const LatticeCutter& cutter);
  /// In place of cut() for the cubes that find_island() found.
  const std::vector<double>& part_island(const LatticeCutter& cutter, const std::vector<CubeSplit>& stage);
  /// Copies of parts of the lattice that have no surface, and the copies across their walls that get what
  /// they have.
  std::vector<std::array<Index, 2>> join_bare(const LatticeCutter& cutter);
  /// Copies of parts of the lattice that hold less than kLeastFill in all, and the copies across their walls
  /// that have their surface from now on. update() has to follow.
  std::vector<std::array<Index, 2>> join_slivers(const LatticeCutter& cutter);
  /// Finds the triangles that update() looks at. It reads only the cubes' places from the cutter, which
  /// commit() leaves as they are.
  void find_near_splits(const LatticeCutter& cutter, std::span<const std::vector<CubeSplit>> stages);
  /// New vertices and triangles, and vertices that other cubes move from now on.
  void update(const LatticeCutter& cutter, TopologyChange& change);

  Index vertex_count() const { return static_cast<Index>(vertex_point_.size()); }
  Index triangle_count() const { return static_cast<Index>(triangles_.size()); }
  /// More than there was capacity for was left out.
  bool is_full() const { return is_full_; }
  bool has_capacity(Index splits) const {
    return triangle_count() + 150 * splits <= capacity_.triangles &&
           vertex_count() + 100 * splits <= capacity_.vertices;
  }
  /// A triangle of a wall inside of the body, in lattice coordinates, and whose surface it is.
  struct NewWall {
    std::array<Vec3d, 3> corners;
    std::array<Index, 2> part;
  };
  /// New walls of the last update().
  const std::vector<NewWall>& new_walls() const { return new_walls_; }
  /// A cube that fell in two, with its whole wall.
  struct NewSplit {
    CubeSplit split;
    std::size_t first = 0, end = 0;  ///< of the walls' triangles
  };
  /// New splits of the last update(), in the order in which they were made.
  const std::vector<NewSplit>& new_splits() const { return new_splits_; }
  /// In lattice coordinates, with their normals to part[1].
  std::span<const std::array<Vec3d, 3>> triangles_of(const NewSplit& split) const {
    return std::span(split_walls_).subspan(split.first, split.end - split.first);
  }
  /// On which side of its wall a cube that was cut has a point: that of part[0] or part[1].
  int side(Index parent, Vec3d p) const { return parted_[index(parted_place_[index(parent)])].wall.side(p); }
  /// Number of triangles that close gaps, in all: those that rounding left, and those between walls.
  Index filled() const { return filled_; }
  /// Area of all walls, of one side, at rest [spacings^2].
  double wall_area() const { return wall_area_; }
  /// Depth of the deepest point of walls since the last call below the original surface, at rest [spacings].
  double take_depth() { return std::exchange(deepest_, 0.0); }
  /// Parts of cubes since the last call that had less than kLeastFill, and got it from the part across their
  /// wall.
  Index take_slivers() { return std::exchange(slivers_, 0); }
  /// How deep a point lies below the original surface, at rest [spacings].
  double depth(Vec3d p) const { return static_cast<double>(solid_->distance_m(vec_cast<float>(p))); }
  /// The way out of the original surface from a point in it; unit.
  Vec3d outward(Vec3d p) const;
  /// Vertices of each triangle; all the same: it is not in use.
  const std::vector<std::array<Index, 3>>& triangles() const { return vertices_of_; }
  embed::Anchor anchor(const LatticeCutter& cutter, Index vertex) const;
  /// Whether a coordinate lies between cubes.
  static bool is_whole(double v) { return v == std::floor(v); }
  /// Whether a triangle is of a wall.
  bool is_wall(Index triangle) const { return triangles_[index(triangle)].home >= 0; }
  /// Cube or copy that has a point of a cube now.
  Index leaf(Index cube, Vec3d p) const;

 private:
  static std::size_t index(std::int64_t i) { return static_cast<std::size_t>(i); }
  static std::uint64_t edge_key(Index a, Index b) {
    return static_cast<std::uint64_t>(std::min(a, b)) << 32U | static_cast<std::uint64_t>(std::max(a, b));
  }
  struct Point {
    Vec3d p;
    bool is_wall = false;
    std::array<Index, 2> on{-1, -1};  ///< points of a wall's edge that it lies on
    bool is_beyond = false;           ///< of a wall that was led round the end of an older one
  };
  struct Corner {
    Index point = 0, cube = 0;
  };
  struct Triangle {
    std::array<Corner, 3> corner;
    Index home = -1;  ///< of a wall: whose surface it is; kNone: of the original surface
    int tet = -1;     ///< of a wall
    bool is_fill = false;
  };
  struct Split {
    CubeSplit split;
    Index regular = 0;
    const Wall* wall = nullptr;         ///< in parted_
    std::array<Index, kPairs> point{};  ///< of pairs across the wall
    /// Bits of pairs: whose point the parent's material reaches, and ends there.
    std::uint32_t in_reach = 0, at_end = 0;
    /// Per side: pairs on which the parent has material there without a corner.
    std::array<std::uint32_t, 2> wedges{};
    std::uint32_t beyond = 0;  ///< pairs where it goes round the end of an older wall
    Vec3d reference{};         ///< a point of the parent's material space
    bool is_reference_inside = true, has_surface = false;
    std::size_t first_face = 0, face_count = 0;                          ///< in the stage's faces
    Vec3d faces_low{1e30, 1e30, 1e30}, faces_high{-1e30, -1e30, -1e30};  ///< box around all
    std::size_t first_wall = 0, end_wall = 0;                            ///< in the stage's walls
  };
  /// A triangle of a parent's surface, or of the original one.
  struct Face {
    Index triangle;
    Vec3d a, b, c, low, high;  ///< corners, and a box around them
    double of_reference;       ///< six times the volume with the reference
    bool is_wall;
  };
  static constexpr Vec3d kFaceMargin{1e-9, 1e-9, 1e-9};
  struct Segment {
    std::array<Index, 2> points;
    std::size_t other;  ///< number of the triangle of the wall, or of the surface, that made it
  };
  struct WallTriangle {
    std::array<Index, 3> point;
    std::size_t split;
    int tet;
    bool may_be_whole;  ///< not so if it has a corner beyond the parent's material, or lies on its end
  };
  struct Side {
    int region;
    Index split;
    double vote = 0;       ///< positive: side 1
    bool is_both = false;  ///< the region goes round the wall's end
  };
  using Piece = std::array<Index, 3>;
  using Places = ShortList<std::size_t, 12>;
  /// A triangle of the surface, or of a wall, in pieces.
  struct Divided {
    /// Edge of a piece, from a corner to the next one.
    struct Edge {
      int beside;   ///< piece that has it, too; -1: none
      int segment;  ///< that lies there; -1: none
    };
    ShortList<Piece, 8> pieces;
    ShortList<Segment, 4> segments;
    ShortList<std::array<Edge, 3>, 8> edges;  ///< per piece
    ShortList<int, 8> region_of;              ///< per piece
    ShortList<Side, 4> sides;                 ///< of regions, of splits' walls
    ShortList<Triangle, 8> triangles;         ///< of the surface: those that take its place
    Vec3d normal{};
    bool is_round = true;
    const Side* find_side(int region, Index split) const {
      return std::find_if(sides.begin(), sides.end(),
                          [&](const Side& s) { return s.region == region && s.split == split; });
    }
    Side& side(int region, Index split) {
      const auto k = static_cast<std::size_t>(find_side(region, split) - sides.begin());
      if (k == sides.size()) sides.push_back({region, split});
      return sides[k];
    }
  };
  /// While a stage is cut.
  struct Stage {
    std::vector<Split> splits;
    std::vector<WallTriangle> walls;
    std::vector<Face> faces;
    std::vector<Index> near;  ///< triangles in the cubes of the stage
    EdgePoints on_edge;
    /// Point of two edges, or of an edge and {-1, triangle}.
    FlatMap<std::array<Index, 4>, Index> crossings;
    Index first_point = 0;                    ///< of crossings
    Chains<Index> parents;                    ///< per crossing: cubes whose walls made it
    Chains<Segment> segments, wall_segments;  ///< per triangle in `near`; per wall
    FlatMap<std::uint64_t, bool>
        rim;  ///< points of the surface on edges of walls; whether they are their ends
    std::vector<double> shares, found;    ///< of side 1: as lattices need them, and as samples say
    std::vector<std::uint8_t> is_sliver;  ///< per split
    /// Per split: the side of its wall where samples found nothing, or kNoSide, or kBothSides.
    std::vector<std::int8_t> empty_side;
    std::vector<Index> near_pieces;  ///< per triangle in `near`: place in divided_; kWhole
    std::vector<Index> wall_pieces;  ///< per wall: the same, or kOutside
    bool is_crossing(Index point) const {
      return point >= first_point && point - first_point < parents.count() &&
             !parents.empty(point - first_point);
    }
    Index lowest_parent(Index point) const {
      Index lowest = *parents.of(point - first_point).begin();
      for (const Index parent : parents.of(point - first_point)) lowest = std::min(lowest, parent);
      return lowest;
    }
    void clear() {
      splits.clear();
      walls.clear();
      faces.clear();
      on_edge.clear();
      crossings.clear();
      parents.reset(0);
      rim.clear();
    }
  };
  static constexpr std::size_t kMostParents = 32;  ///< of a copy
  static constexpr std::int8_t kNoSide = -1, kBothSides = 2;
  /// Instead of a place in divided_: it is in one piece, or outside of the body.
  static constexpr Index kWhole = -1, kOutside = -2, kInPieces = -3;
  /// Where an edge of one triangle meets another.
  struct Crossing {
    std::array<Index, 2> surface{-1, -1}, wall{-1, -1};  ///< edges; -1: inside of the triangle
    Vec3d p;
  };
  using Crossings = ShortList<Crossing, 6>;
  using Touching = ShortList<Index, 3>;
  /// A triangle of the surface and one of a wall.
  struct Meeting {
    Index triangle;
    std::size_t wall;   ///< its number
    Touching touching;  ///< points of the surface on the wall's edges
    std::array<Crossing, 2> found;
    bool is_segment = false;
  };
  struct Vertex {
    std::array<Index, 8> nodes;
    Index vertex;
  };

  const Vec3d& at(Index point) const { return points_[index(point)].p; }
  void place_points(const LatticeCutter& cutter, const TriangleMesh& surface,
                    std::span<const embed::Anchor> anchors);
  void find_empty_cubes(const LatticeCutter& cutter);
  void add_to_bins(const LatticeCutter& cutter, std::span<const Index> triangles);
  Index place_triangle(const Triangle& triangle);
  void add_triangle(const LatticeCutter& cutter, const Triangle& triangle);
  void make_walls(const LatticeCutter& cutter, const std::vector<CubeSplit>& stage, Stage& s);
  void find_points(const LatticeCutter& cutter, Split& split);
  std::array<double, kPairs> places_of(const LatticeCutter& cutter, const CubeSplit& split) const;
  bool has_wedge(const LatticeCutter& cutter, Index cube, std::size_t pair, double place) const;
  void keep_in_reach(const LatticeCutter& cutter, Split& split, std::array<double, kPairs>& places) const;
  double share_of(const LatticeCutter& cutter, Index cube, std::size_t pair, Index point) const;
  void note_ends(const LatticeCutter& cutter, Split& split);
  void find_reference(const LatticeCutter& cutter, Split& split) const;
  bool is_on(Index point, const std::array<Index, 3>& wall) const;
  void intersect_all(Stage& s);
  void add_meetings(const Stage& s, const Split& split, std::vector<Meeting>& meetings) const;
  bool find_meeting(const Stage& s, Index triangle, std::size_t number, Meeting& m) const;
  void add_meeting(Stage& s, const Meeting& m);
  void find_crossings(const Triangle& t, const WallTriangle& wall, const Touching& touching,
                      Crossings& found) const;
  Index add_crossing(Stage& s, const Crossing& c, Index triangle, std::size_t number);
  bool inside(const Stage& s, const Split& split, Vec3d p) const;
  template <class F>
  void for_each_tet(const LatticeCutter& cutter, Index cube, F&& f) const;
  double inside_share(const Stage& s, const Split& split, const Tet& tet) const;
  /// @returns side 1's; -1: no sample found anything
  double share(const LatticeCutter& cutter, const Stage& s, const Split& split) const;
  void find_share(const LatticeCutter& cutter, Stage& s, std::size_t k) const;
  void find_faces(Stage& s, Split& split) const;
  bool is_whole_still(const std::array<Index, 3>& corners, const EdgePoints& on_edge) const {
    return !on_edge.has(edge_key(corners[0], corners[1])) && !on_edge.has(edge_key(corners[1], corners[2])) &&
           !on_edge.has(edge_key(corners[2], corners[0]));
  }
  template <class Counts>
  void divide(const std::array<Index, 3>& corners, const EdgePoints& on_edge, const Counts& counts,
              Divided& d) const;
  bool is_cut_at(const LatticeCutter& cutter, const Stage& s, const Triangle& t, Index point) const;
  double roundness(std::size_t triangle) const;
  static void link_pieces(Divided& d);
  static void find_region(const Divided& d, std::size_t piece, Places& found);
  double side_of(const Stage& s, const Divided& d, std::size_t number, Index a, Index b) const;
  Vec3d middle_of(const std::array<Index, 3>& t) const;
  double above_wall(const Stage& s, std::size_t number, Vec3d p) const;
  void find_sides(const Stage& s, Divided& d) const;
  void add_vote(const Stage& s, const Divided& d, const Places& region, Side& side, std::size_t number,
                std::array<Index, 2> edge) const;
  Index part_round(const Stage& s, const Divided& d, std::size_t piece, std::size_t corner) const;
  Index copy_beside(const LatticeCutter& cutter, const Stage& s, Corner corner, Vec3d inner) const;
  void set_cubes(const LatticeCutter& cutter, const Stage& s, const Divided* d, std::size_t piece,
                 Triangle& t) const;
  void find_pieces(const LatticeCutter& cutter, Stage& s);
  void keep_inner_pieces(const Stage& s, std::size_t number, Divided& d) const;
  bool is_inner(const Stage& s, std::size_t number, const Divided& d, const Places& region) const;
  void divide_triangle(const LatticeCutter& cutter, const Stage& s, std::size_t number, Divided& d) const;
  void make_triangles(const LatticeCutter& cutter, const Stage& s, const Triangle& old, Divided& d) const;
  void part_cubes(const Stage& s);
  void note_depths();
  void divide_near(const LatticeCutter& cutter, const Stage& s);
  void drop_empty_parts(const LatticeCutter& cutter, Stage& s);
  bool is_empty(const Stage& s, const Split& split, int side) const;
  int side_of_faces(const LatticeCutter& cutter, const Stage& s, const Split& split) const;
  void add_walls(const LatticeCutter& cutter, const Stage& s);
  void add_wall(const LatticeCutter& cutter, const Stage& s, std::size_t number, const Piece& piece);
  // cut_vertices.cpp
  void take_capacity_for_frame(std::size_t splits);
  void take_capacity_for_stage(std::size_t splits);
  void add_near(const LatticeCutter& cutter, Index cube);
  void take_near();
  std::array<Index, 8> nodes_of(const LatticeCutter& cutter, Corner corner) const;
  /// A corner of a triangle.
  struct Use {
    Index triangle;  ///< number in a list
    Index corner;
    Index cube;
    std::size_t nodes;  ///< that move it: place in use_nodes_
  };
  void find_uses(const LatticeCutter& cutter, const std::vector<Index>& triangles);
  void sort_by_nodes(const LatticeCutter& cutter, Index point, std::span<Use> here, std::size_t first);
  const std::array<Index, 8>& nodes_of(const Use& use) const { return use_nodes_[use.nodes]; }
  bool knows_all_at(const LatticeCutter& cutter, Vec3d p) const;
  void name_point(const LatticeCutter& cutter, Index point, std::span<const Use> here);
  Index vertex_of(Index point, const std::array<Index, 8>& nodes);
  void anchor_vertex(const LatticeCutter& cutter, Index vertex, Index point, std::span<const Use> uses);
  void name_vertices(const LatticeCutter& cutter, const std::vector<Index>& triangles);
  static std::uint64_t edge_weight(const std::array<Index, 3>& vertices);
  std::uint64_t weight_change(Index triangle, const std::array<Index, 3>& to) const {
    const std::array<Index, 3>& now = vertices_of_[index(triangle)];
    return now == to ? 0 : edge_weight(to) - edge_weight(now);
  }
  void set_vertices(Index triangle, const std::array<Index, 3>& vertices) {
    set_vertices(triangle, vertices, weight_change(triangle, vertices));
  }
  void set_vertices(Index triangle, const std::array<Index, 3>& vertices, std::uint64_t change);
  void count_edges(const std::array<Index, 3>& vertices, int sign);
  void sum_edges();
  // cut_islands.cpp
  struct ClosedPiece {
    Index count = 0, part = 0;
    double volume = 0;  ///< spacings^3
  };
  /// Closed surfaces, by the root of their vertices, and the largest volume per part of the lattice.
  struct ClosedPieces {
    std::vector<Index> of_vertex;
    std::map<Index, ClosedPiece> pieces;
    std::map<Index, double> largest;
  };
  ClosedPieces closed_pieces(const LatticeCutter& cutter) const;
  static bool is_used(const Piece& t) { return t[0] != t[1] || t[1] != t[2]; }
  template <class F>
  void add_island_cube(const LatticeCutter& cutter, Index cube, const F& is_of_island);
  void take_to_island(const Stage& s);
  /// A copy on the other side of a wall, and that wall: place in parted_, and its side.
  struct Across {
    Index copy = -1;
    std::size_t wall = 0;
    int side = 0;
  };
  template <class F>
  Across across(const LatticeCutter& cutter, Index cube, const F& counts) const;
  // cut_slivers.cpp
  void note_slivers(const LatticeCutter& cutter, const Stage& s);
  std::vector<Index> severed_sliver(const LatticeCutter& cutter, Index copy) const;
  void move_triangles(Index from, Index to);
  void drop_shut_walls(const std::vector<std::array<Index, 2>>& from_to);
  // cut_parts.cpp
  void drop_dust(const LatticeCutter& cutter);
  void drop_triangle(Index triangle);
  void drop_fills(const LatticeCutter& cutter, const std::vector<Index>& triangles);
  void mend_sides(const LatticeCutter& cutter, const std::vector<Index>& triangles);
  void note_suspects(const std::vector<Index>& triangles);
  void separate(const LatticeCutter& cutter);
  void part_triangles(const LatticeCutter& cutter, const std::vector<Index>& triangles,
                      const std::vector<Index>& part_of_node);
  std::vector<std::vector<Index>> open_loops() const;
  std::vector<Index> tips_of(const std::vector<std::vector<Index>>& loops) const;
  Index vertex_in(const LatticeCutter& cutter, const std::vector<Index>& loop, Index point);
  bool add_fan(const LatticeCutter& cutter, std::span<const Index> way);
  void close(const LatticeCutter& cutter);

  Capacity capacity_;
  std::vector<Point> points_;
  std::vector<Triangle> triangles_;
  std::vector<std::array<Index, 3>> vertices_of_;  ///< per triangle
  std::vector<Index> free_;                        ///< triangles that are not in use
  Chains<Index> bins_;                             ///< triangles in each regular cube
  std::vector<std::uint8_t> is_empty_;             ///< per regular cube: nothing of the body lies in it
  FlatMap<std::uint64_t, Index> wall_points_;      ///< by pair of nodes
  struct Parted {
    Wall wall;
    std::array<Index, 2> part;
    int only = -1;  ///< side that has all of the material; -1: both have some
    Index part_at(Vec3d p) const { return part[index(only >= 0 ? only : wall.side(p))]; }
  };
  std::vector<Parted> parted_;
  std::vector<Index> parted_place_;  ///< per cube and copy: in parted_; -1: it is whole
  std::vector<Index> parent_;        ///< per cube and copy: the one that it is a part of; -1: none
  std::vector<Index> joined_;        ///< per cube and copy: the one that it joined; -1: none
  /// Per copy and pair: of one with a corner of its own, the point of the wall where its material ends; of a
  /// wedge, where that begins and ends, from the pair's first corner on; else -1.
  using Ends = std::array<Index, 2>;
  std::vector<std::array<Ends, kPairs>> ends_;
  Chains<Vertex> vertices_at_;  ///< per point of a wall
  std::vector<Index> vertex_point_, vertex_cube_;
  std::vector<Vec3f> local_;  ///< of the original vertices
  struct EdgeSum {
    std::uint64_t edge = 0;
    int sum = 0;
  };
  std::vector<EdgeSum> open_edges_;  ///< directed sums over triangles; after sum_edges() one per edge, not 0
  struct VertexChange {
    std::array<Index, 3> before, after;
  };
  std::vector<VertexChange> changes_;  ///< of triangles, that open_edges_ doesn't count yet
  std::uint64_t edge_weight_ = 0;      ///< sum over their edges
  std::unique_ptr<PointInMesh> solid_;
  IndexSet set_;
  Stage stage_;
  std::vector<std::size_t> at_surface_;         ///< splits of the stage that have faces
  std::vector<std::vector<Meeting>> meetings_;  ///< of each of these, at least as many
  /// Triangles of `near`, or of walls, that are divided.
  struct Dividing {
    bool is_wall;
    std::size_t number;
  };
  std::vector<Dividing> dividing_;
  std::vector<Divided> divided_;  ///< of each of these, at least as many
  // In find_near_splits() and update().
  std::vector<Index> near_cubes_;
  std::vector<Index> near_;                    ///< triangles round the cubes that fell apart, ascending
  std::vector<std::uint8_t> is_mended_;        ///< of these
  std::vector<Index> suspects_;                ///< triangles that may reach from part to part one day
  std::vector<Piece> named_;                   ///< their vertices
  std::vector<std::uint64_t> weight_changes_;  ///< their changes of edge_weight_
  std::vector<Index> use_points_;              ///< ascending
  std::vector<Index> first_use_;               ///< per point in use_points_, and the end
  std::vector<Index> uses_at_;                 ///< of points: counts, then places
  std::vector<Use> uses_;
  std::vector<std::array<Index, 8>> use_nodes_;
  std::vector<EdgeSum> edge_table_;
  std::vector<Index> new_anchors_, new_triangles_;  ///< of the last update()
  std::vector<NewWall> new_walls_, next_walls_;
  std::vector<NewSplit> new_splits_, next_splits_;
  std::vector<std::array<Vec3d, 3>> split_walls_, next_split_walls_;
  std::vector<Vec3d> wall_middles_;  ///< of the stage's new walls
  std::vector<double> run_depths_;   ///< of some of these
  bool is_cut_again_ = false;        ///< a copy fell apart since the last update()
  Index islands_ = 0;                ///< that the last update() found, less those that were parted
  bool may_be_bare_ = false;         ///< a part of the lattice, since the last join_bare()
  std::vector<IslandCube> island_;   ///< of the last find_island()
  Index island_root_ = 0;
  std::vector<Index> island_of_vertex_;
  std::vector<double> held_;        ///< per copy: its material [cubes]
  std::vector<Index> new_slivers_;  ///< copies, since the last join_slivers()
  Index filled_ = 0, slivers_ = 0;
  double wall_area_ = 0, deepest_ = 0;
  bool is_full_ = false;
};

}  // namespace tactus::cut
