#pragma once
/// The points of a body's surface that touch, their contacts, and the nodes that they move.
#include <array>
#include <span>
#include <vector>

#include "tactus/compute/atomic.h"
#include "tactus/compute/exec_context.h"
#include "tactus/contact/friction.h"
#include "tactus/contact/real/motion_kernels.h"
#include "tactus/frame/state_archive.h"
#include "tactus/geom/arrays/index_lists.h"
#include "tactus/geom/arrays/used_list.h"
#include "tactus/geom/arrays/vector_fields.h"
#include "tactus/geom/lattice/boundary_points.h"
#include "tactus/geom/maths/held_axes.h"

namespace tactus {

inline constexpr Index kMaxObstacles = 16;
/// Colliders of the surfaces that bodies touch: the components of the real surface, then the obstacles.
inline constexpr Index kColliders = kComponents + kMaxObstacles;

/// Where a body's nodes are, on the device; one entry per node.
struct ContactNodes {
  View<Vec3f> x_m;                 ///< positions, world [m]
  View<Vec3f> v_m_s;               ///< velocities [m/s]
  View<const float> mass_kg;       ///< [kg], > 0
  View<const Index> held;          ///< HeldAxes, along which contact doesn't move the node; or empty
  View<const Index> stopped = {};  ///< (1) != 0: contact leaves the body alone; or empty
  NodeFields fields = {};          ///< or nodes are cells, and are here
  Index size() const { return fields.cells > 0 ? fields.cells : x_m.size(); }
  TACTUS_HD Vec3f position(Index node) const { return fields.cells > 0 ? fields.position(node) : x_m[node]; }
  TACTUS_HD Vec3f velocity(Index node) const {
    return fields.cells > 0 ? fields.velocity(node) : v_m_s[node];
  }
  TACTUS_HD void change(Index node, Vec3f dx_m, Vec3f dv_m_s) const {
    if (fields.cells > 0) return fields.change(node, dx_m, dv_m_s);
    v_m_s[node] += dv_m_s;
    x_m[node] += dx_m;
  }
  TACTUS_HD bool has_stopped() const { return !stopped.empty() && stopped[0] != 0; }
  TACTUS_HD bool is_held(Index node) const { return !held.empty() && held[node] == kAllAxes; }
  TACTUS_HD Vec3f free_part(Index node, Vec3f v) const {
    return held.empty() ? v : tactus::free_part(v, held[node]);
  }
  TACTUS_HD Vec3f position(const EmbeddedPoint& p) const {
    return p.position([&](int k) { return position(p.node[k]); });
  }
  TACTUS_HD Vec3f velocity(const EmbeddedPoint& p) const {
    return p.velocity([&](int k) { return velocity(p.node[k]); });
  }
};

/// Correction that a touching point wants: as if it were alone, with a mass of its own.
struct PointContact {
  Vec3f x_m;                      ///< where it will be then
  Vec3f position_correction_m;    ///< change of its position
  Vec3f velocity_correction_m_s;  ///< change of its velocity
  float depth_m;                  ///< how far it was inside
  Index collider = -1;            ///< of the surface that it touches
  Vec3f n;                        ///< normal there, world: the side it is on, kept for the next correction
  Vec3f anchor_m;                 ///< where friction holds it; moves along with the collider
  float left_m = 0;  ///< depth that corrections leave it, as walls of a cut are parted over several
  FrictionMemory friction = {};
  Index label = -1;  ///< of a component of the real surface: components are numbered anew in each frame
};

/// Effect of one point, or of all, on an collider since the frame began.
struct ContactRecord {
  Vec3f impulse_N_s;      ///< on the collider
  Vec3f moment_N_m_s;     ///< of that impulse about SurfacePoses::reference_m
  float max_depth_m = 0;  ///< deepest point
  Index contacts = 0;     ///< corrections in which a point was in contact
  Index pushed_out = 0;   ///< points that were deeper than 2 spacings
  Index collider = -1;
  TACTUS_HD void add(const ContactRecord& r) {
    impulse_N_s += r.impulse_N_s;
    moment_N_m_s += r.moment_N_m_s;
    max_depth_m = max(max_depth_m, r.max_depth_m);
    contacts += r.contacts;
    pushed_out += r.pushed_out;
  }
};

/// Impulse and moment in units of 2^-40, as integers: sums that don't depend on the order in which they come.
struct ReactionSums {
  static constexpr float kUnit = 1.F / (1ULL << 40);
  std::uint64_t impulse[3], moment[3];
  TACTUS_HD void add(Vec3f impulse_N_s, Vec3f moment_N_m_s) {
    for (int a = 0; a < 3; ++a) {
      impulse[a] += units(impulse_N_s[a]);
      moment[a] += units(moment_N_m_s[a]);
    }
  }
  TACTUS_HD void add(const ReactionSums& sums) {
    for (int a = 0; a < 3; ++a) {
      impulse[a] += sums.impulse[a];
      moment[a] += sums.moment[a];
    }
  }
  TACTUS_HD void add_atomically(Vec3f impulse_N_s, Vec3f moment_N_m_s) {
    for (int a = 0; a < 3; ++a) {
      atomic_add(impulse[a], units(impulse_N_s[a]));
      atomic_add(moment[a], units(moment_N_m_s[a]));
    }
  }
  TACTUS_HD static Vec3f value(const std::uint64_t* sum) {
    const auto of = [](std::uint64_t u) { return kUnit * static_cast<float>(static_cast<std::int64_t>(u)); };
    return {of(sum[0]), of(sum[1]), of(sum[2])};
  }

 private:
  TACTUS_HD static std::uint64_t units(float value) {
    constexpr float kMost = 4e6F;  // N s: 2^62 units
    if (value != value) return 0;  // of a body that blew up
    const float half = value < 0 ? -0.5F : 0.5F;
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(clamp(value, -kMost, kMost) / kUnit + half));
  }
};

/// Effect of all points of a device on an collider over a frame. Totals of several devices add up in any
/// order.
struct ColliderTotals {
  ReactionSums sums;
  float max_depth_m;
  Index contacts, pushed_out, collider;
  Vec3f impulse_N_s() const { return ReactionSums::value(sums.impulse); }
  Vec3f moment_N_m_s() const { return ReactionSums::value(sums.moment); }
  TACTUS_HD void add(const ColliderTotals& t) {
    sums.add(t.sums);
    max_depth_m = max(max_depth_m, t.max_depth_m);
    contacts += t.contacts;
    pushed_out += t.pushed_out;
  }
  TACTUS_HD void add(const ContactRecord& r) {
    sums.add(r.impulse_N_s, r.moment_N_m_s);
    max_depth_m = max(max_depth_m, r.max_depth_m);
    contacts += r.contacts;
    pushed_out += r.pushed_out;
  }
};

/// Which points a node moves with: those of entries lists[c] of `incident`.
struct PointTable {
  View<const EmbeddedPoint> points;
  View<const Index> nodes;       ///< that move with any point: a row each, in the order of NodeShare
  View<const IndexRange> lists;  ///< per row
  View<const Index> incident;    ///< 8 point + corner
  View<const Index> rows;        ///< at 8 point + corner: of that node; any, where its weight is 0
  View<const WallSide> sides;    ///< per point; empty: no point can be on a wall of a cut
  Index own = 0, moved = 0;      ///< so many of the first rows are NodeShare::own; or that or copy
  UsedEntries row_groups = {};   ///< kRowGroup rows each
};
inline constexpr Index kRowGroup = 16;

/// Treatment of a node by contact, on a device that has a part of a body.
enum class NodeShare : std::uint8_t {
  own,      ///< moves it; the reactions of its points are recorded here
  copy,     ///< moves it, as its collider does: all points at this node, and all at theirs, are here
  outside,  ///< lets it be: it is there for its points
};

/// Points are taken in blocks, so that those that are far from everything sleep together.
inline constexpr Index kBlockPoints = 32;

/// Which points are in a block, and which nodes move them.
struct PointBlocks {
  UsedEntries used;
  View<const IndexRange> points;  ///< of each
  View<const IndexRange> lists;   ///< entries of the next
  View<const Index> nodes;
  View<Index> pose;     ///< at which pose of the surface nodes were at x_m; < 0: none
  View<Vec3f> x_m;      ///< per entry of `nodes`
  View<float> sleep_m;  ///< per point: nothing touches it until a node of its block has moved that far
};

/// Points in blocks that are in use, as numbers 0, 1, .. of which some are none.
struct UsedPoints {
  Index all = 0;          ///< that there are
  UsedEntries used = {};  ///< blocks
  View<const IndexRange> blocks = {};
  TACTUS_HD Index end() const { return used.entries.empty() ? all : kBlockPoints * used.count[0]; }
  /// -1: none
  TACTUS_HD Index operator[](Index k) const {
    if (used.entries.empty()) return k;
    const IndexRange block = blocks[used.entries[k / kBlockPoints]];
    const Index point = block.begin + k % kBlockPoints;
    return point < block.end ? point : -1;
  }
};

/// At most so many triangles are kept per point. On a hull whose edges are half a spacing, those within an
/// eighth of a spacing of a point that touches are 1 to 8; of a point deep in a finger, 50 to 130.
inline constexpr Index kNearTriangles = 128;

/// Results of the last search round a point.
struct PointNeighbours {
  Vec3f x_m;                ///< where it was then
  float free_m;             ///< nothing but listed triangles is nearer than that
  float listed_m;           ///< of `colliders`, all triangles within that are listed; < 0: the point sleeps
  std::uint32_t colliders;  ///< bit k: collider k is near
  Index count;              ///< of triangles
  float moved_m;            ///< since then, when it was awake last
};

/// Points in any order: the result of one doesn't depend on the others. Empty between corrections.
struct PointList {
  View<Index> points;
  View<Index> count;  ///< (1)
  TACTUS_HD void add(Index i) const {
    points[static_cast<Index>(atomic_fetch_add(reinterpret_cast<std::uint32_t&>(count[0]), 1U))] = i;
  }
  Count used() const { return {count, points.size()}; }
};

/// Contact state of one body.
struct PointState {
  View<Index> touching;        ///< per point: 1 while it touches; 2 .. kLingering: so many corrections after
  View<PointContact> contact;  ///< per point, where it touches
  View<std::uint32_t> node_weight;  ///< per row: sum of the weights of touching points
  View<Index> searched;             ///< per point: the pose of the surface at its last search; < 0: none
  View<PointNeighbours> neighbours;
  View<std::uint32_t> near;           ///< kNearTriangles per point: NearTriangle
  View<Index> recorded;               ///< per point: corrections of this frame that are in its record
  View<ContactRecord> records;        ///< per point
  View<ReactionSums> moved_on;        ///< (kColliders) of points that went on to another collider
  View<std::uint32_t> collider_used;  ///< (kColliders) != 0: it has records
  View<float> mass_kg;  ///< per point that touches: effective mass of its impulse, with those of all others
  PointList awake;      ///< points i that may touch something; ~i: its list of triangles is of no use
};

/// Weights as integers, so that their sums don't depend on the order in which they come. Rounded up: the sum
/// must not be below the true one (ApplyContacts).
struct PointWeights {
  static constexpr float kOne = 1 << 20;
  TACTUS_HD static std::uint32_t quantized(float weight) {
    return static_cast<std::uint32_t>(floor_to_int(abs(weight) * kOne)) + 1U;
  }
  TACTUS_HD static float value(std::uint32_t sum) { return static_cast<float>(sum) / kOne; }
};

/// Points that move with other nodes from now on.
struct SetPoints {
  struct Change {
    Index point = 0;
    EmbeddedPoint to;
    Index rows[8] = {};
    WallSide side;
  };
  View<const Change> changes;
  View<EmbeddedPoint> points;
  View<Index> rows;
  View<WallSide> sides;
  TACTUS_HD void operator()(Index i) const {
    const Change& change = changes[i];
    points[change.point] = change.to;
    sides[change.point] = change.side;
    for (int k = 0; k < 8; ++k) rows[8 * change.point + k] = change.rows[k];
  }
};

/// Masses of a body's nodes that changed.
struct NodeMasses {
  struct Change {
    Index node = 0;
    float mass_kg = 0;
  };
  View<const Change> changes;
  View<float> mass_kg;
  TACTUS_HD void operator()(Index i) const { mass_kg[changes[i].node] = changes[i].mass_kg; }
};

/// Thread: row of those in use. The sum of the weights of its touching points, anew.
struct WeighRows {
  UsedEntries row_groups;
  View<const IndexRange> lists;
  View<const Index> incident;
  View<const EmbeddedPoint> points;
  View<const Index> touching;
  View<std::uint32_t> node_weight;
  TACTUS_HD void operator()(Index k) const {
    const Index row = kRowGroup * row_groups[k / kRowGroup] + k % kRowGroup;
    if (row >= lists.size()) return;
    std::uint32_t sum = 0;
    for (Index e = lists[row].begin; e < lists[row].end; ++e) {
      const Index i = incident[e] / 8;
      if (touching[i] == 1) sum += PointWeights::quantized(points[i].weight[incident[e] % 8]);
    }
    node_weight[row] = sum;
  }
};

/// A frame of contact.
struct ContactFrame {
  std::int64_t number = 0;  ///< 1, 2, ..; 0: not counted
  bool is_new = true;       ///< what bodies touch isn't the same as in the frame before
};

/// Host and device side of one body's points.
class BodyPoints {
 public:
  BodyPoints() = default;
  /// Synchronizes. @throws Error when a point names a node that is not there.
  /// @param first_part so many of the first points may be corrected without the others
  /// @param share per node; empty: all are own. A point is recorded where its node[0] is own
  /// @param capacity so many of the first part's last points are places for points that apply() adds; nothing
  /// moves them
  BodyPoints(ExecContext& ctx, std::span<const EmbeddedPoint> points, Index node_count,
             float lattice_spacing_m, Index first_part = 0, std::span<const NodeShare> share = {},
             Index capacity = 0);
  /// Between frames, where there is capacity. New points take the places that are next. Points that touch go
  /// on touching. Synchronizes. @throws Error for a point or node that is not there.
  void apply(ExecContext& ctx, std::span<const PointChange> changes);

  Index count() const { return points_.size(); }
  Index node_count() const { return node_count_; }
  float lattice_spacing_m() const { return lattice_spacing_m_; }
  PointTable table() const;
  PointState state();
  PointBlocks blocks();
  /// Points and blocks of the first part, and all blocks.
  Index first_count() const { return first_count_; }
  Index first_blocks() const { return first_blocks_; }
  Index block_count() const { return block_pose_.size(); }
  /// For launches: blocks in use, those of the first part, UsedPoints, and groups of rows.
  Count used_blocks() const { return used_blocks_.count(block_count()); }
  Count used_first_blocks() const { return used_blocks_.first_count(first_blocks()); }
  Count used_point_count() const { return used_blocks_.member_count(count()); }
  Count used_row_groups() const { return used_rows_.count(ceil_div(moved_rows_, kRowGroup)); }
  UsedPoints used_points() const { return {count(), used_blocks_.view(), blocks_.const_view()}; }
  /// (kColliders) Sums of the frame that ended.
  View<const ColliderTotals> totals() const { return totals_.const_view(); }
  /// Searches of the frame before stay valid where nothing new is to be touched. @param frame
  /// Contact::frame()
  void begin_frame(ExecContext& ctx, ContactFrame frame = {});
  void end_frame(ExecContext& ctx);
  View<const Index> touching() const { return touching_.const_view(); }
  /// Archives the state that lasts from frame to frame. Synchronizes. @throws Error.
  void archive(ExecContext& ctx, StateArchive& a);
  /// Nothing touches: after a body's state was set anew.
  void reset(ExecContext& ctx);

 private:
  void make_rows(ExecContext& ctx, std::span<const EmbeddedPoint> points, std::span<const NodeShare> share);
  void make_blocks(ExecContext& ctx, std::span<const EmbeddedPoint> points);
  void make_used(ExecContext& ctx);
  void check(std::span<const PointChange> changes) const;
  void change_rows(std::span<const PointChange> changes);
  void change_blocks(std::span<const PointChange> changes);
  void weigh_rows(ExecContext& ctx);

  float lattice_spacing_m_ = 0;
  Index node_count_ = 0, first_count_ = 0, first_blocks_ = 0, own_rows_ = 0, moved_rows_ = 0;
  Index capacity_ = 0;                      ///< points that may still come
  std::int64_t searched_in_ = -1;           ///< the frame; < 0: none
  std::vector<EmbeddedPoint> host_points_;  ///< where there is capacity
  std::vector<Index> row_of_;               ///< per node
  std::vector<IndexRange> host_blocks_;
  UsedList used_blocks_, used_rows_;  ///< where there is capacity
  Buffer<EmbeddedPoint> points_;
  IndexLists incident_, block_nodes_;
  Buffer<IndexRange> blocks_;
  Buffer<Index> nodes_, rows_, touching_, recorded_, searched_, block_pose_, awake_, awake_count_;
  Buffer<SetPoints::Change> changes_;
  Buffer<WallSide> sides_;
  Buffer<float> sleep_m_, mass_kg_;
  Buffer<Vec3f> block_x_m_;
  Buffer<PointNeighbours> neighbours_;
  Buffer<std::uint32_t> near_;
  Buffer<PointContact> contact_;
  Buffer<std::uint32_t> node_weight_, collider_used_;
  Buffer<ContactRecord> records_;
  Buffer<ColliderTotals> totals_;
  Buffer<ReactionSums> moved_on_;
};

}  // namespace tactus
