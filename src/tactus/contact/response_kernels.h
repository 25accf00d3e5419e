#pragma once
/// Response of contact: corrections of the points of a body's surface, and through them of its nodes.
#include <limits>

#include "tactus/compute/fold.h"
#include "tactus/contact/body_points.h"
#include "tactus/contact/friction.h"
#include "tactus/contact/obstacles.h"
#include "tactus/frame/frame_params.h"

namespace tactus {

/// The motion of a component of the surface at one time, worked out once for all points.
struct SurfacePose {
  SurfaceMotion motion;
  SurfaceComponent component;
  Mat3f turn = Mat3f::identity();  ///< R(w t)
  Vec3f center_m;                  ///< c + v t
  /// False only where nothing of it is within reach_m of a point, taken to its capture.
  TACTUS_HD bool may_touch(Vec3f p_capture_m, float reach_m) const {
    return motion.source != MotionSource::too_fast && component.may_reach(p_capture_m, reach_m);
  }
  /// Where the material that is at p_m now was at the surface's capture.
  TACTUS_HD Vec3f to_capture(Vec3f p_m) const { return motion.center_m + transpose(turn) * (p_m - center_m); }
  TACTUS_HD Vec3f velocity_at(Vec3f p_m) const {
    return motion.velocity_m_s + cross(motion.spin_rad_s, p_m - center_m);
  }
};

/// All components and tools at one time.
struct SurfacePoses {
  Index count = 0;    ///< of components, >= 1
  Vec3f reference_m;  ///< centre of moments: the centre of gravity of all components at their capture
  SurfacePose component[kComponents];
  Index tools = 0;
  ToolPose tool[kMostTools];
  /// Which samples a search for component k takes: kAnyComponent where all are its own.
  TACTUS_HD Index own(Index k) const { return count > 1 ? k : kAnyComponent; }
};

/// When in a frame the surface is met, relative to its capture. To end on the measured surface, dt_frame_s is
/// the time between the last capture and this one (one frame of delay, no guess); to predict, 0.
struct ContactTimes {
  float dt_s = 0;        ///< of a substep [s]
  Index substeps = 0;    ///< of the frame
  float dt_frame_s = 0;  ///< how long before its capture the frame's substeps begin [s]
  /// When given, the others are read from here when the kernels run.
  View<const FrameParams> frame = {};
  TACTUS_HD void load() {
    if (frame.empty()) return;
    dt_s = frame[0].dt_s;
    substeps = frame[0].substeps;
    dt_frame_s = -frame[0].surface_age_s;
  }
  /// After so many substeps.
  TACTUS_HD float after_s(Index steps) const { return dt_s * static_cast<float>(steps) - dt_frame_s; }
};

/// From the substep at whose begin points were corrected last to when they are corrected now: one later, or
/// several for the last points of a body, which shape matching moves by several at once.
struct SubstepsTo {
  Index substep = 0;  ///< or, with `frame`, the device's
  float dt_s = 0;
  View<const FrameParams> frame = {};
  Index first_later = std::numeric_limits<Index>::max();  ///< the first of the last points
  Index later_steps = 1;
  Index first_pose = 0;  ///< of this frame; those of the frame before may be there, too
  TACTUS_HD void load() {
    if (frame.empty()) return;
    substep += frame[0].done;
    dt_s = frame[0].dt_s;
  }
  TACTUS_HD Index steps(Index point) const { return point < first_later ? 1 : later_steps; }
  TACTUS_HD float since_s(Index point) const { return dt_s * static_cast<float>(steps(point)); }
  /// The number of the poses that a point meets.
  TACTUS_HD Index pose(Index point) const { return first_pose + substep + steps(point) - 1; }
};

/// Thread i: all components and tools after i + 1 substeps.
struct PoseSurface {
  static constexpr int kGrain = 16;
  View<const SurfaceMotion> motion;
  View<const SurfaceComponents> components;
  ContactTimes times;
  View<SurfacePoses> poses;
  View<const ToolMotion> tools = {};
  TACTUS_HD void load() { times.load(); }
  TACTUS_HD void operator()(Index i) const {
    const SurfaceComponents& all = components[0];
    SurfacePoses& out = poses[i];
    const float time_s = times.after_s(i + 1);
    float area = 0;
    Vec3f x{};
    for (Index k = 0; k < all.count; ++k) {
      const SurfaceMotion& m = motion[k];
      out.component[k] = {m, all.component[k], m.turn(time_s), m.center_m + time_s * m.velocity_m_s};
      area += m.area_m2;
      x += m.area_m2 * m.center_m;
    }
    out.count = all.count;
    out.tools = tools.size();
    for (Index t = 0; t < tools.size(); ++t) out.tool[t] = ToolPose::at(tools[t], time_s);
    out.reference_m = all.count > 1 && area > 0.F ? x / area : motion[0].center_m;
  }
};

/// The boundaries that bodies touch: the real surface at one time, obstacles that stand still, and tools.
struct Boundaries {
  SurfaceTrianglesView surface;
  SamplesView coarse;              ///< of the real surface
  View<const SurfacePoses> poses;  ///< after 1, 2, .. substeps
  View<const Obstacle> obstacles;
};

/// The points of one body that take part in a correction.
struct TouchingPoints {
  ContactNodes nodes;
  PointTable table;
  PointState state;
  float reach_m;   ///< points deeper than that are found by DeepRescue only
  float margin_m;  ///< no point is farther from its first node
  TACTUS_HD Vec3f position(const EmbeddedPoint& p) const { return nodes.position(p); }
  TACTUS_HD Vec3f velocity(const EmbeddedPoint& p) const { return nodes.velocity(p); }
  /// By how much a point may move, at most, when each of its nodes moves by 1.
  TACTUS_HD static float spread(const EmbeddedPoint& p) {
    float sum = 0;
    for (int k = 0; k < 8; ++k) sum += abs(p.weight[k]);
    return sum;
  }
  TACTUS_HD bool moves(const EmbeddedPoint& p) const {
    for (int k = 0; k < 8; ++k) {
      if (p.weight[k] != 0.F && !nodes.is_held(p.node[k])) return true;
    }
    return false;
  }
  /// Notes whether point i touches (1), and with it the weights of its nodes.
  TACTUS_HD void set_touching(Index i, const EmbeddedPoint& p, Index touching) const {
    const bool touched = state.touching[i] == 1, touches = touching == 1;
    state.touching[i] = touching;
    if (touched == touches) return;
    TACTUS_ROLLED
    for (int k = 0; k < 8; ++k) {
      if (p.weight[k] == 0.F) continue;
      const std::uint32_t weight = PointWeights::quantized(p.weight[k]);
      atomic_add(state.node_weight[table.rows[8 * i + k]], touches ? weight : 0U - weight);
    }
  }
};

/// Block: points that sleep together, of which mostly none touches. Finds the effective mass of a touching
/// point's impulse, and with it notes the reaction on its collider.
///
/// A point that is a mean of nodes, u = sum w_k v_k, changes by sum w_k²/m_k J under an impulse J on it.
/// Points share nodes, so all of them together change a point's velocity by more than its own impulse does:
/// the matrix A = W M^-1 W^T of all impulses isn't diagonal. Its row sums D = sum_k |w_k| s_k / m_k, with s_k
/// the sum of the weights of all touching points at node k, bound it (D - A is diagonally dominant). So the
/// impulses J = D^-1 (change wanted) change the kinetic energy by u^T J + J^T A J / 2 <= u^T J + J^T D J / 2,
/// which for a reflection with e <= 1 and friction is never above 0, and a change that all points want alike
/// they get in one go.
struct WeighPoints {
  static constexpr int kThreads = kBlockPoints, kGrain = 64;
  using Shared = NoShared;
  TouchingPoints body;
  UsedEntries used;  ///< blocks
  View<const IndexRange> blocks;
  View<const SurfacePoses> poses;
  Index is_push_out;   ///< != 0: counts as that, not as contact
  ContactTimes times;  ///< nothing moves in a frame without substeps
  TACTUS_HD void load() { times.load(); }
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    if (b.index() == 0) body.state.awake.count[0] = 0;
    if (times.substeps == 0 || body.nodes.has_stopped()) return;
    const IndexRange points = blocks[used[b.index()]];
    const Index first = points.begin, count = points.end - first;
    if (Block::kIsLoop && !any_touches(first, count)) return;
    b.for_each_thread([&](int t) {
      if (t < count && body.state.touching[first + t] == 1) weigh(first + t);
    });
  }

 private:
  TACTUS_HD bool any_touches(Index first, Index count) const {
    Index touching = 0;
    for (Index i = first; i < first + count; ++i) touching |= body.state.touching[i] == 1 ? 1 : 0;
    return touching != 0;
  }
  TACTUS_HD void weigh(Index i) const {
    const float mass = body.state.mass_kg[i] = 1.F / inverse_mass(i);
    const PointContact& contact = body.state.contact[i];
    if (body.table.points[i].weight[0] != 0.F && body.table.rows[8 * i] < body.table.own)
      note(i, contact, -mass * contact.velocity_correction_m_s);
  }
  /// D of a point. A held node counts, too, though it stays: A is smaller then, so the bound holds. Else the
  /// little weight of a free node beside it would have to make up for all, and the node be thrown far off.
  /// Without branches: all is read at once.
  TACTUS_HD float inverse_mass(Index i) const {
    const EmbeddedPoint& p = body.table.points[i];
    float sum = 0;
    for (int k = 0; k < 8; ++k) {
      sum += abs(p.weight[k]) * PointWeights::value(body.state.node_weight[body.table.rows[8 * i + k]]) /
             body.nodes.mass_kg[p.node[k]];
    }
    return sum;
  }
  TACTUS_HD void note(Index i, const PointContact& contact, Vec3f impulse_N_s) const {
    const bool moved = dot(contact.position_correction_m, contact.position_correction_m) > 0.F;
    if (is_push_out != 0 && !moved) return;  // a contact of the last correction
    ContactRecord& record = body.state.records[i];
    if (body.state.recorded[i]++ == 0)
      record = {};
    else if (record.collider != contact.collider)
      move_on(record);
    record.collider = contact.collider;
    atomic_store(body.state.collider_used[contact.collider], 1U);
    record.add({impulse_N_s, cross(contact.x_m - poses[0].reference_m, impulse_N_s), contact.depth_m,
                1 - is_push_out, is_push_out, contact.collider});
  }
  /// Adds the reaction on the point's last collider to that collider's sums.
  TACTUS_HD void move_on(ContactRecord& record) const {
    body.state.moved_on[record.collider].add_atomically(record.impulse_N_s, record.moment_N_m_s);
    record.impulse_N_s = record.moment_N_m_s = {};
  }
};

/// Moves the nodes of a body by the changes that its touching points want.
/// Block: kNodes nodes, each with kLanes threads that share its points.
struct ApplyContacts {
  static constexpr int kThreads = 128, kLanes = 8, kNodes = kRowGroup, kGrain = 32;
  static_assert(kNodes * kLanes == kThreads);
  TouchingPoints body;
  Index end_point;  ///< points from there on take no part
  ContactTimes times;
  struct Shared {
    Vec3f impulse[kNodes][kLanes], push[kNodes][kLanes];
  };
  TACTUS_HD void load() { times.load(); }
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    if (times.substeps == 0 || body.nodes.has_stopped()) return;
    const Index first = body.table.row_groups[b.index()] * kNodes,
                count = min(Index(kNodes), body.table.moved - first);
    if (count <= 0) return;
    const auto is_touched = [&](int g) { return body.state.node_weight[first + g] != 0U; };
    if (Block::kIsLoop && !any_touched(first, count)) return;
    b.template for_groups<kLanes>(count, is_touched, [&](int g, int lane) {
      Vec3f impulse{}, push{};
      const IndexRange points = body.table.lists[first + g];
      for (Index e = points.begin + lane; e < points.end; e += kLanes)
        add_point(body.table.incident[e], impulse, push);
      s.impulse[g][lane] = impulse;
      s.push[g][lane] = push;
    });
    b.for_threads(count, [&](int g) {
      if (is_touched(g)) move(first + g, s.impulse[g], s.push[g]);
    });
  }

 private:
  TACTUS_HD bool any_touched(Index first, Index count) const {
    std::uint32_t weights = 0;
    for (Index row = first; row < first + count; ++row) weights |= body.state.node_weight[row];
    return weights != 0U;
  }
  TACTUS_HD void add_point(Index entry, Vec3f& impulse, Vec3f& push) const {
    const Index i = entry / 8, corner = entry % 8;
    if (i >= end_point || body.state.touching[i] != 1) return;
    const float share = body.state.mass_kg[i] * body.table.points[i].weight[corner];
    const PointContact& contact = body.state.contact[i];
    impulse += share * contact.velocity_correction_m_s;
    push += share * contact.position_correction_m;
  }
  TACTUS_HD void move(Index row, const Vec3f* impulses, const Vec3f* pushes) const {
    const Index node = body.table.nodes[row];
    if (body.nodes.is_held(node)) return;
    Vec3f impulse{}, push{};
    for (int lane = 0; lane < kLanes; ++lane) {
      impulse += impulses[lane];
      push += pushes[lane];
    }
    const float inverse = 1.F / body.nodes.mass_kg[node];
    body.nodes.change(node, body.nodes.free_part(node, inverse * push),
                      body.nodes.free_part(node, inverse * impulse));
  }
};

/// Brings back points that are inside a component of the real object, but too deep for a triangle within
/// reach: behind the nearest coarse sample, and inside by the winding number of all coarse samples of the
/// component (Barill et al. 2018).
struct DeepRescue {
  static constexpr int kGrain = 64;
  ContactTimes times;  ///< a frame without substeps has no pose of the surface
  Boundaries boundaries;
  SamplesView fine;
  TouchingPoints body;
  UsedPoints points;
  float far_reach_m;
  TACTUS_HD void load() { times.load(); }
  TACTUS_HD void operator()(Index k) const {
    const Index i = points[k];
    if (i < 0 || times.substeps == 0 || body.nodes.has_stopped()) return;
    if (body.state.touching[i] == 1) {  // of the last correction: not to be done again
      PointContact& contact = body.state.contact[i];
      contact.position_correction_m = contact.velocity_correction_m_s = {};
    }
    const SurfacePoses& all = boundaries.poses[0];
    if (all.count == 0) return;
    const Vec3f reference_node = body.nodes.position(body.table.points[i].node[0]);
    for (Index c = 0; c < all.count; ++c) {
      const Vec3f near = all.component[c].to_capture(reference_node);
      // A point inside a closed surface is inside its box.
      if (all.component[c].may_touch(near, body.margin_m) && boundaries.coarse.may_be_near(near))
        push_out(i, all, c);
    }
  }

 private:
  TACTUS_HD void push_out(Index i, const SurfacePoses& all, Index k) const {
    const EmbeddedPoint& point = body.table.points[i];
    const SurfacePose& now = all.component[k];
    const Vec3f x = body.position(point), p = now.to_capture(x);
    const Index own = all.own(k);
    if (!now.may_touch(p, 0.F) || !body.moves(point) || has_fine_sample(p, own)) return;
    const SamplesView& coarse = boundaries.coarse;
    Index nearest = -1;
    float nearest_d2 = far_reach_m * far_reach_m;
    coarse.for_each_near(p, [&](Index s) {
      const Vec3f d = p - coarse.x_m[s];
      const float d2 = dot(d, d);
      if (d2 < nearest_d2 && coarse.is_of(own, s)) {
        nearest_d2 = d2;
        nearest = s;
      }
    });
    if (nearest < 0) return;
    const float gap = dot(p - coarse.x_m[nearest], coarse.n[nearest]);
    if (!(gap < 0.F) || !inside(p, own)) return;
    const Vec3f n = now.turn * coarse.n[nearest], push = -gap * n;
    body.state.contact[i] = {x + push, push, {}, -gap, k, n, x + push, 0, {}, now.component.label};
    body.set_touching(i, point, 1);
  }
  TACTUS_HD bool has_fine_sample(Vec3f p, Index own) const {
    bool found = false;
    fine.for_each_near(p, [&](Index k) {
      const Vec3f d = p - fine.x_m[k];
      found = found || (dot(d, d) < body.reach_m * body.reach_m && fine.is_of(own, k));
    });
    return found;
  }
  TACTUS_HD bool inside(Vec3f p, Index own) const {
    const SamplesView& coarse = boundaries.coarse;
    float solid_angle = 0;
    for (Index k = 0, n = coarse.count[0]; k < n; ++k) {
      if (!coarse.is_of(own, k)) continue;
      const Vec3f d = coarse.x_m[k] - p;
      const float d2 = max(dot(d, d), 1e-12F);
      solid_angle += coarse.area_m2[k] * dot(d, coarse.n[k]) / (d2 * tactus::sqrt(d2));
    }
    return solid_angle > 2 * kPi;  // half of 4π
  }
};

/// Sums the records of each collider, as integers. Block: collider.
struct SumRecords {
  static constexpr int kThreads = 256;
  UsedPoints points;
  View<const Index> recorded;
  View<const ContactRecord> records;
  View<ReactionSums> moved_on;
  View<std::uint32_t> collider_used;
  View<ColliderTotals> totals;  ///< (kColliders)
  struct Shared {
    ColliderTotals of_thread[kThreads];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index collider = b.index(), count = collider_used[collider] != 0U ? points.end() : 0;
    if constexpr (Block::kIsLoop) {  // integers: sums and maxima in any order
      s.of_thread[0] = sum_from(0, 1, count, collider);
    } else {
      b.for_each_thread([&](int t) { s.of_thread[t] = sum_from(t, kThreads, count, collider); });
      fold<kThreads>(b, kThreads, [&](int t, int other) { s.of_thread[t].add(s.of_thread[other]); });
    }
    b.on_one_thread([&] {
      ColliderTotals sum = s.of_thread[0];
      sum.sums.add(moved_on[collider]);
      sum.collider = collider;
      totals[collider] = sum;
      moved_on[collider] = {};
      collider_used[collider] = 0;
    });
  }

 private:
  TACTUS_HD ColliderTotals sum_from(Index first, Index step, Index count, Index collider) const {
    constexpr int kAtOnce = 4;  // a GPU's thread waits for them together
    ColliderTotals sum{};
    for (Index k = first; k < count; k += kAtOnce * step) {
      Index point[kAtOnce];
      bool is_recorded[kAtOnce];
      for (int u = 0; u < kAtOnce; ++u) point[u] = k + u * step < count ? points[k + u * step] : -1;
      for (int u = 0; u < kAtOnce; ++u) is_recorded[u] = point[u] >= 0 && recorded[point[u]] != 0;
      for (int u = 0; u < kAtOnce; ++u)
        if (is_recorded[u] && records[point[u]].collider == collider) sum.add(records[point[u]]);
    }
    return sum;
  }
};

}  // namespace tactus
