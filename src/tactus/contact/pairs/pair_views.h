#pragma once
/// Data of contact between bodies, and of a body with itself, on the device.
#include "tactus/contact/body_points.h"
#include "tactus/contact/cube_map.h"
#include "tactus/frame/frame_params.h"
#include "tactus/geom/arrays/index_lists.h"

namespace tactus {

/// Points that are nearer than that at rest, in spacings, don't touch one another.
inline constexpr float kSelfSpacings = 3;

/// Points of a body's own that a point may touch, beside those of other parts of a body that was cut.
enum class SelfTouch : std::uint8_t {
  none,
  walls,  ///< a point on a wall: material beyond that wall at rest
  all     ///< likewise, and any point: material over kSelfSpacings from it at rest
};

/// One body of many.
struct PairBody {
  ContactNodes nodes;
  Index first_patch = 0, end_patch = 0;
  Index first_point = 0, end_point = 0;
  Index first_group = 0, end_group = 0;
  float spacing_m = 0;
  SelfTouch self = SelfTouch::none;
  Index is_cut = 0;  ///< cubes overlap, and points are in several
  Index parts = 1;   ///< each hangs together
};

/// A cube next to a body's surface.
struct SolidCube {
  Index node[8], row[8];  ///< of its body; of all bodies
  Index body = 0;
  Vec3i cell;
};

/// Cubes that lie together at rest, with the points of the surface there.
struct CubePatch {
  Index body = 0;
};

/// Points that are worked on together: some of a patch.
struct PointGroup {
  Index body = 0, patch = 0, first = 0, count = 0;
};
inline constexpr Index kGroupPoints = 128;

/// Box in the world.
struct PatchBox {
  Vec3f min_m, max_m;
  TACTUS_HD static PatchBox empty() { return {{1e30F, 1e30F, 1e30F}, {-1e30F, -1e30F, -1e30F}}; }
  TACTUS_HD void take(const PatchBox& b) {
    min_m = min(min_m, b.min_m);
    max_m = max(max_m, b.max_m);
  }
  TACTUS_HD bool meets(const PatchBox& b, float slack_m) const {
    return min_m.x - slack_m <= b.max_m.x && b.min_m.x - slack_m <= max_m.x &&
           min_m.y - slack_m <= b.max_m.y && b.min_m.y - slack_m <= max_m.y &&
           min_m.z - slack_m <= b.max_m.z && b.min_m.z - slack_m <= max_m.z;
  }
  TACTUS_HD float distance2_m2(Vec3f p) const {
    const Vec3f out = max(max(min_m - p, p - max_m), Vec3f{});
    return dot(out, out);
  }
  TACTUS_HD bool holds(Vec3f p) const {
    return p.x >= min_m.x && p.x <= max_m.x && p.y >= min_m.y && p.y <= max_m.y && p.z >= min_m.z &&
           p.z <= max_m.z;
  }
};

/// A node that moves with points or cubes, of all bodies: a row each.
struct PairNode {
  Index body = 0, node = 0;
};

/// Boxes of cubes as they are deformed now; each coordinate in a row of its own, for many at once.
struct CubeBoxes {
  static constexpr int kMostAtOnce = 16;
  View<float> bounds_m;  ///< 6 rows: least x, y, z, largest x, y, z; and capacity to read behind the last
  static Index size(Index boxes) { return 6 * boxes + kMostAtOnce; }
  TACTUS_HD Index capacity() const { return (bounds_m.size() - kMostAtOnce) / 6; }
  TACTUS_HD void set(Index i, const PatchBox& box) const {
    const Index n = capacity();
    const float bound[6] = {box.min_m.x, box.min_m.y, box.min_m.z, box.max_m.x, box.max_m.y, box.max_m.z};
    for (Index k = 0; k < 6; ++k) bounds_m[k * n + i] = bound[k];
  }
  /// Squared distances from p of the `count` boxes from `first` on, at most kRow; returns the least. All kRow
  /// are loaded, so that a thread waits for memory once.
  template <int kRow>
  TACTUS_HD float distances2_m2(Index first, int count, Vec3f p, float* out_m2) const {
    static_assert(kRow <= kMostAtOnce);
    const float* least = bounds_m.data() + first;
    const Index n = capacity();
    const auto beyond = [](float low, float high) {  // 0 inside
      const float most = low > high ? low : high;
      return most > 0.F ? most : 0.F;
    };
    float nearest2_m2 = 1e30F;
#pragma omp simd reduction(min : nearest2_m2)
    for (int k = 0; k < kRow; ++k) {
      const float x = beyond(least[k] - p.x, p.x - least[3 * n + k]),
                  y = beyond(least[n + k] - p.y, p.y - least[4 * n + k]),
                  z = beyond(least[2 * n + k] - p.z, p.z - least[5 * n + k]);
      const float d2 = x * x + y * y + z * z;
      out_m2[k] = d2;
      nearest2_m2 = k < count && d2 < nearest2_m2 ? d2 : nearest2_m2;
    }
    return nearest2_m2;
  }
};

/// Place of a cube, by which points of its own body may touch it or not.
struct CubePlace {
  Vec3i cell;
  Index part = 0;
  Index row[8];  ///< as SolidCube
};

/// Where a point of a surface rests.
struct PointRest {
  Vec3f p;          ///< in spacings of its lattice
  Vec3f wall;       ///< of the wall of a cut, the normal away from its material; 0: it is on none
  Index cube = -1;  ///< that it moves with, of all bodies', since a cut told; -1: none did
};

/// A point that is new, or moves with other nodes.
struct PairPointChange {
  Index place = 0;
  EmbeddedPoint point;
  PointRest rest;
  Index rows[8] = {};
};

/// Lists of indices, on the device.
struct IndexListsView {
  View<const IndexRange> ranges;
  View<const Index> values;
};

/// Tables that change only where bodies are cut. Bodies, patches, cubes, points and rows are counted through
/// all bodies.
struct PairTable {
  View<const PairBody> bodies;
  View<const CubePatch> patches;
  IndexListsView patch_nodes;  ///< per patch, as its body counts them
  IndexListsView patch_cubes;  ///< per patch
  View<const SolidCube> cubes;
  CubeSamples samples;
  View<const PointGroup> groups;
  View<const EmbeddedPoint> points;
  View<const Index> rows;      ///< at 8 point + corner
  View<const PointRest> rest;  ///< of points
  View<const PairNode> nodes;
  View<const Index> part;          ///< per row: of the body, which the node hangs together with
  IndexListsView incident_points;  ///< per row: 8 point + corner
  IndexListsView incident_cubes;   ///< per row: 8 cube + corner
  UsedEntries used_groups, used_row_groups;

  /// Points of a body may stick out of all cubes by that much.
  TACTUS_HD static float slack_m(const PairBody& body) { return 0.1F * body.spacing_m; }
  /// From a point of a body, at q in a cube, to the surface of the cube's material, negative inside. At rest
  /// no point is inside of other material of its body, so nothing is deeper there than it is far from the
  /// point's place: what samples tell beyond that is their error, where walls are bent. It is taken off near
  /// that place, and less and less over a spacing: where it faded faster than the distance grows, a push
  /// along the gradient would deepen the point.
  TACTUS_HD RestDistance distance(Index body, Index point, Index cube, Vec3f q) const {
    constexpr float kNear = 0.25F;
    RestDistance found = samples.at(cube, q);
    if (cubes[cube].body != body || !(found.distance_m < 0.F)) return found;
    const Vec3f own = rest[point].p - vec_cast<float>(cubes[cube].cell),
                inside = min(max(own, Vec3f{}), Vec3f{1, 1, 1});
    const float share = min(1 + kNear - length(q - own), 1.F);
    if (!(share > 0.F)) return found;
    const float away_m = bodies[body].spacing_m * length(own - inside);
    found.distance_m += share * max(-samples.at(cube, inside).distance_m - away_m, 0.F);
    return found;
  }
};

/// From one correction to the next.
struct CorrectionTime {
  float dt_s = 0;      ///< of a substep or, with `frame`, the device's
  Index substeps = 1;  ///< between two corrections
  View<const FrameParams> frame = {};
  /// Read where a point touches: a kernel that loads is copied, and FindPairs is large.
  TACTUS_HD float since_s() const {
    return (frame.empty() ? dt_s : frame[0].dt_s) * static_cast<float>(substeps);
  }
};

/// Correction that a point of one body wants that is inside of another, or of its own.
struct PairContact {
  Index touching = 0;  ///< 1 while it touches; 2 .. kLingering: so many corrections after
  Index cube = -1;     ///< that it is inside of
  Vec3f q;             ///< in that cube
  Index anchor_cube = -1;
  Vec3f anchor_q;  ///< where friction holds it
  Vec3f x_m, position_correction_m, velocity_correction_m_s;
  float depth_m = 0;
  FrictionMemory friction = {};
  Vec3f impulse_N_s, shift_kg_m;  ///< after all that touch were seen
};

/// How far a point that touches nothing of its own body may move before that has to be looked at again.
struct SelfSleep {
  static constexpr float kFarthest = 1.5F;  ///< that it looks, in spacings
  std::uint32_t since = 0;                  ///< SelfMotion::moved then
  float free_m = 0;
};

/// How a body that touches itself moves, beside its motion as a whole.
struct SelfMotion {
  std::uint32_t moved = 0;  ///< the longest way of a node so far, in units of kUnit spacings; wraps around
  Vec3f middle_m, shift_m;  ///< of the body's box; by how much that moved last
  static constexpr float kUnit = 1.F / (1 << 16);
  /// Two points that both moved came nearer by twice that at most.
  TACTUS_HD bool may_wake(const SelfSleep& sleep, float spacing_m) const {
    return !(2 * kUnit * spacing_m * static_cast<float>(moved - sleep.since) < sleep.free_m);
  }
  TACTUS_HD static std::uint32_t units(float displacement_m, float spacing_m) {
    return static_cast<std::uint32_t>(min(displacement_m / (kUnit * spacing_m), 1e9F)) + 1U;
  }
};

struct PairState {
  View<PatchBox> patch_box, body_box;
  CubeBoxes cube_boxes;         ///< of patch_cubes' values
  View<CubePlace> cube_places;  ///< likewise
  View<PatchBox> wake_box;      ///< per body: of the points that look for their own body
  View<float>
      patch_displacement_m;      ///< how far its nodes moved since the last correction, less the body's shift
  View<Vec3f> last_x_m;          ///< of patch_nodes' values
  View<SelfMotion> self_motion;  ///< of bodies
  View<SelfSleep> group_sleep, point_sleep;
  View<std::uint32_t> group_active;  ///< != 0: has points that touch, or did a moment ago
  View<PairContact> contact;
  View<std::uint32_t> row_weight;  ///< sums of the weights of touching points and of where they touch
  View<std::uint32_t> cube_list;   ///< first point that touches in a cube, plus one; 0: none
  View<std::uint32_t> next;        ///< of that list, likewise
  View<Index> recorded;            ///< per point: corrections of this frame in its record
  View<ContactRecord> records;     ///< its collider is the other body
  View<ReactionSums> moved_on;     ///< at bodies a + b: impulses of points of a on b before they went on
  View<std::uint32_t> used;        ///< likewise, != 0: there are records
  float smallest_mass_kg = 1;
};

/// Reads the corners of a cube.
struct CubeCorners {
  TACTUS_HD static CubeMap map(const ContactNodes& nodes, const SolidCube& cube) {
    Vec3f x[8];
    for (int k = 0; k < 8; ++k) x[k] = nodes.x_m[cube.node[k]];
    return CubeMap::of(x);
  }
  TACTUS_HD static Vec3f velocity(const ContactNodes& nodes, const SolidCube& cube, Vec3f q) {
    Vec3f sum{};
    for (int k = 0; k < 8; ++k) sum += CubeMap::weight(q, k) * nodes.v_m_s[cube.node[k]];
    return sum;
  }
};

}  // namespace tactus
