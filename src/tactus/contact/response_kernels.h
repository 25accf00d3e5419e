#pragma once
/// What contact does to the nodes of a virtual body.
#include "tactus/contact/motion_kernels.h"
#include "tactus/frame/frame_params.h"

namespace tactus {

/// Where a contact node touched last, kept from one correction to the next. All zero: it did not.
struct ContactMemory {
  Vec3f x_m;  ///< the node's corrected position, world
  Vec3f n;    ///< the surface's normal there, world
  Index touched = 0;
  Index label = 0;  ///< of the piece of the surface
};

/// Nodes of one body, on the device.
struct ContactNodes {
  View<Vec3f> x_m;            ///< positions, world [m] (all nodes of the body)
  View<Vec3f> v_m_s;          ///< velocities [m/s], as x_m
  View<const float> mass_kg;  ///< [kg], as x_m: for the reaction only
  View<const float>
      rest_gap_m;           ///< d_i [m], as x_m: distance at which the node touches; d_i < 2 sample spacings
  View<const Index> nodes;  ///< the surface-near nodes that take part
  View<const Index> fixed;  ///< != 0: node isn't moved; as x_m, or empty
  /// One per contact node, or empty. With it, a node that the body springs back into a thin real object
  /// (deeper than its nearest side, in one substep) is first held on the side where it was.
  View<ContactMemory> memory = {};
  Index first_record = 0;  ///< each body's records are its own: the sum of the nodes of those before
};

/// What one node, or all, did since the frame began.
struct ContactRecord {
  Vec3f impulse_N_s;   ///< on the real object
  Vec3f moment_N_m_s;  ///< of that impulse about the real object's centre of gravity at the time
  float max_depth_m;   ///< largest correction
  Index contacts;      ///< corrections in which the node was in contact
  Index rescued;       ///< nodes that were deeper than 2 spacings
  TACTUS_HD void add(const ContactRecord& r) {
    impulse_N_s += r.impulse_N_s;
    moment_N_m_s += r.moment_N_m_s;
    max_depth_m = max(max_depth_m, r.max_depth_m);
    contacts += r.contacts;
    rescued += r.rescued;
  }
};

/// The motion of a piece of the surface at one time, worked out once for all nodes.
struct SurfacePose {
  SurfaceMotion motion;
  SurfacePiece piece;
  Mat3f turn;      ///< R(w t)
  Vec3f center_m;  ///< c + v t
  /// Where the material that is at p_m now was at the surface's capture.
  TACTUS_HD Vec3f to_capture(Vec3f p_m) const { return motion.center_m + transpose(turn) * (p_m - center_m); }
  TACTUS_HD Vec3f velocity_at(Vec3f p_m) const {
    return motion.velocity_m_s + cross(motion.spin_rad_s, p_m - center_m);
  }
};

/// All pieces at one time.
struct SurfacePoses {
  Index count = 0;  ///< of pieces, >= 1
  Vec3f center_m;   ///< centre of gravity of all
  SurfacePose piece[kPieces];
  /// Which samples a search for piece k takes: kAnyPiece where all are its own.
  TACTUS_HD Index own(Index k) const { return count > 1 ? k : kAnyPiece; }
};

/// When in a frame the surface is met, relative to its capture. To end on what was measured, dt_frame_s is
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

/// From the substep at whose begin nodes were corrected last to when they are corrected now.
struct SubstepsTo {
  Index substep = 0;  ///< or, with `frame`, the device's
  Index steps = 1;
  float dt_s = 0;
  View<const FrameParams> frame = {};
  TACTUS_HD void load() {
    if (frame.empty()) return;
    substep = frame[0].substep;
    dt_s = frame[0].dt_s;
  }
};

/// Thread i: all pieces after i + 1 substeps.
struct PoseSurface {
  View<const SurfaceMotion> motion;
  View<const SurfacePieces> pieces;
  ContactTimes times;
  View<SurfacePoses> poses;
  TACTUS_HD void load() { times.load(); }
  TACTUS_HD void operator()(Index i) const {
    const SurfacePieces& all = pieces[0];
    SurfacePoses& out = poses[i];
    const float time_s = times.after_s(i + 1);
    for (Index k = 0; k < all.count; ++k) {
      const SurfaceMotion& m = motion[k];
      out.piece[k] = {m, all.piece[k], m.turn(time_s), center(k, time_s)};
    }
    out.count = all.count;
    out.center_m = center(0, time_s);
    if (all.count == 1) return;
    float area = 0;
    Vec3f x{};
    for (Index j = 0; j < all.count; ++j) {
      area += motion[j].area_m2;
      x += motion[j].area_m2 * center(j, time_s);
    }
    if (area > 0.F) out.center_m = x / area;
  }

 private:
  TACTUS_HD Vec3f center(Index k, float time_s) const {
    return motion[k].center_m + time_s * motion[k].velocity_m_s;
  }
};

/// Surface near a point: averages [P 20] over the samples of the near side within the reach.
struct NearSurface {
  Vec3f x_m, n;
  bool found = false;
};

/// The samples that face as the nearest one does, weighted by their area and (1 - r²/reach²)²: a weight that
/// vanishes at the reach, so samples come and go without a jump. Reach: 2 spacings, the cells' edge.
/// Nothing is found where the nearest sample already shows that p is more than clear_m in front of the
/// surface.
/// @param piece whose samples count, or kAnyPiece
TACTUS_HD inline NearSurface near_surface(const SamplesView& samples, Index piece, Vec3f p_m, float reach_m,
                                          float clear_m) {
  constexpr Index kKept = 64;  // samples in reach that needn't be sought twice: a plane has about 14
  Index kept[kKept];
  NearSurface near;
  Index nearest = -1, in_reach = 0;
  const float reach2 = reach_m * reach_m;
  float nearest_d2 = reach2;
  samples.for_each_near(p_m, [&](Index k) {
    const Vec3f d = p_m - samples.x_m[k];
    const float d2 = dot(d, d);
    if (!(d2 < reach2) || !samples.is_of(piece, k)) return;
    if (in_reach < kKept) kept[in_reach] = k;
    ++in_reach;
    if (d2 < nearest_d2) {
      nearest_d2 = d2;
      nearest = k;
    }
  });
  if (nearest < 0) return near;
  const Vec3f facing = samples.n[nearest];
  if (dot(p_m - samples.x_m[nearest], facing) > clear_m) return near;
  const float inverse_reach2 = 1.F / reach2;
  float weight = 0;
  Vec3f offset{}, n{};
  const auto add = [&](Index k) {
    const Vec3f d = samples.x_m[k] - p_m;
    const float u = 1.F - dot(d, d) * inverse_reach2;
    const bool counts = u > 0.F && dot(samples.n[k], facing) > 0.F && samples.is_of(piece, k);
    const float w = counts ? samples.area_m2[k] * u * u : 0.F;
    weight += w;
    offset += w * d;
    n += w * samples.n[k];
  };
  if (in_reach <= kKept) {
    for (Index j = 0; j < in_reach; ++j) add(kept[j]);
  } else {
    samples.for_each_near(p_m, add);
  }
  if (!(weight > 0.F)) return near;
  near.x_m = p_m + offset / weight;
  near.n = normalized(n, facing);
  near.found = true;
  return near;
}

/// Velocity after touching a surface of velocity u and normal n: nothing when separating, else the normal
/// part is reflected with restitution e and friction takes at most μ times the normal impulse from the
/// tangential part.
TACTUS_HD inline Vec3f touched_velocity(Vec3f v, Vec3f u, Vec3f n, float restitution, float friction) {
  const Vec3f rel = v - u;
  const float approach = dot(rel, n);
  if (!(approach < 0.F)) return v;
  const Vec3f slide = rel - approach * n;
  const float speed = length(slide), most = -friction * (1.F + restitution) * approach;
  const float kept = speed > most ? 1.F - most / speed : 0.F;
  return u + kept * slide - restitution * approach * n;
}

/// Velocity-position correction of one node. Works in the frame of each piece of the surface at its capture:
/// the node is taken back by the piece's motion, so samples and cells stay as they were made however fast the
/// surface moves.
struct ContactResponse {
  static constexpr int kGrain = 128;
  SamplesView samples;
  View<const SurfacePoses> poses;  ///< after 1, 2, .. substeps
  ContactNodes body;
  float reach_m, restitution, friction;
  SubstepsTo since;
  View<ContactRecord> records;
  float dt_s = 0;  ///< since the last correction: how far the surface carried what touched it
  TACTUS_HD void load() {
    since.load();
    dt_s = since.dt_s * static_cast<float>(since.steps);
    poses = poses.part(since.substep + since.steps - 1, 1);
  }
  TACTUS_HD void operator()(Index c) const {
    const Index i = body.nodes[c];
    if (!body.fixed.empty() && body.fixed[i] != 0) return;
    ContactRecord record{};
    ContactMemory memory = body.memory.empty() ? ContactMemory{} : body.memory[c];
    const Index touched_before = memory.touched;
    const SurfacePoses& all = poses[0];
    if (touched_before != 0) hold(i, memory, record);
    for (Index k = 0; k < all.count; ++k) respond(i, all.piece[k], all.own(k), memory, record);
    if (touched_before == 0 && record.contacts == 0) return;  // most nodes write nothing
    if (!body.memory.empty()) body.memory[c] = memory;
    records[c].add(record);
  }

 private:
  /// Moves node i to x, takes the approach out of its velocity and notes what that did to the real object.
  TACTUS_HD void touch(Index i, const SurfacePose& now, Vec3f x, Vec3f n, float depth_m,
                       ContactRecord& record) const {
    const Vec3f v = body.v_m_s[i];
    const Vec3f v_new = touched_velocity(v, now.velocity_at(x), n, restitution, friction);
    body.x_m[i] = x;
    body.v_m_s[i] = v_new;
    const Vec3f impulse = body.mass_kg[i] * (v - v_new);
    record.impulse_N_s += impulse;
    record.moment_N_m_s += cross(x - poses[0].center_m, impulse);
    record.max_depth_m = max(record.max_depth_m, depth_m);
    record.contacts = 1;
  }

  /// Keeps a node that touched from going back through the plane on which it touched, which moves with its
  /// piece of the surface. What it slid meanwhile is Coulomb's at the level of positions: at most mu times
  /// how deep it went.
  TACTUS_HD void hold(Index i, ContactMemory& memory, ContactRecord& record) const {
    const SurfacePoses& all = poses[0];
    memory.touched = 0;
    Index k = 0;
    while (k < all.count && all.piece[k].piece.label != memory.label) ++k;
    if (k == all.count) return;  // it is gone
    const SurfacePose& now = all.piece[k];
    const Vec3f held = memory.x_m + dt_s * now.velocity_at(memory.x_m), moved = body.x_m[i] - held;
    const float depth = -dot(moved, memory.n);
    if (!(depth > 0.F)) return;
    const Vec3f slide = moved + depth * memory.n;
    const float distance = length(slide), most = friction * depth;
    memory.x_m = held + (distance > most ? 1.F - most / distance : 0.F) * slide;
    memory.touched = 1;
    touch(i, now, memory.x_m, memory.n, depth, record);
  }

  TACTUS_HD void respond(Index i, const SurfacePose& now, Index own, ContactMemory& memory,
                         ContactRecord& record) const {
    const Vec3f p = now.to_capture(body.x_m[i]);
    NearSurface near;
    // The average plane is less than half the reach off the nearest sample's.
    if (now.piece.may_reach(p, reach_m))
      near = near_surface(samples, own, p, reach_m, body.rest_gap_m[i] + 0.5F * reach_m);
    const float gap = near.found ? dot(p - near.x_m, near.n) - body.rest_gap_m[i] : 0.5F * reach_m;
    if (gap < 0.F) {
      const Vec3f n = now.turn * near.n;
      touch(i, now, body.x_m[i] - gap * n, n, -gap, record);
      memory = {body.x_m[i], n, 1, now.piece.label};
    } else if (gap > 0.1F * reach_m && memory.label == now.piece.label) {
      memory.touched = 0;  // the surface is no longer where it was
    }
  }
};

/// Brings back nodes that are inside a piece of the real object, but too deep for a sample within 2 spacings:
/// behind the nearest coarse sample, and inside by the winding number of all coarse samples of the piece
/// (Barill et al. 2018).
struct DeepRescue {
  static constexpr int kGrain = 64;
  SamplesView fine, coarse;
  View<const SurfacePoses> poses;
  ContactNodes body;
  float reach_m, far_reach_m;
  View<ContactRecord> records;
  TACTUS_HD void operator()(Index c) const {
    const Index i = body.nodes[c];
    if (!body.fixed.empty() && body.fixed[i] != 0) return;
    ContactRecord record{};
    const SurfacePoses& all = poses[0];
    for (Index k = 0; k < all.count; ++k) rescue(i, all.piece[k], all.own(k), record);
    if (record.rescued != 0) records[c].add(record);
  }

 private:
  TACTUS_HD void rescue(Index i, const SurfacePose& now, Index own, ContactRecord& record) const {
    const Vec3f p = now.to_capture(body.x_m[i]);
    // What is inside a closed surface is inside its box. Fine samples first: most nodes are near none.
    if (!now.piece.may_reach(p, reach_m) || has_fine_sample(p, own)) return;
    Index nearest = -1;
    float nearest_d2 = far_reach_m * far_reach_m;
    coarse.for_each_near(p, [&](Index k) {
      const Vec3f d = p - coarse.x_m[k];
      const float d2 = dot(d, d);
      if (d2 < nearest_d2 && coarse.is_of(own, k)) {
        nearest_d2 = d2;
        nearest = k;
      }
    });
    if (nearest < 0) return;
    const Vec3f n = coarse.n[nearest];
    const float gap = dot(p - coarse.x_m[nearest], n) - body.rest_gap_m[i];
    if (!(gap < 0.F) || !inside(p, own)) return;
    body.x_m[i] = body.x_m[i] - gap * (now.turn * n);
    record.max_depth_m = max(record.max_depth_m, -gap);
    record.rescued = 1;
  }
  TACTUS_HD bool has_fine_sample(Vec3f p, Index own) const {
    bool found = false;
    fine.for_each_near(p, [&](Index k) {
      const Vec3f d = p - fine.x_m[k];
      found = found || (dot(d, d) < reach_m * reach_m && fine.is_of(own, k));
    });
    return found;
  }
  TACTUS_HD bool inside(Vec3f p, Index own) const {
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

/// Sums all records by one fixed tree, on every device the same.
struct SumRecords {
  static constexpr int kThreads = 256, kStrips = 16, kStrip = kThreads / kStrips;
  View<const ContactRecord> records;
  View<ContactRecord> total;
  struct Shared {
    ContactRecord of_thread[kThreads], of_strip[kStrips];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    b.for_each_thread([&](int t) {
      ContactRecord sum{};
      for (Index c = t; c < records.size(); c += kThreads) {
        if (records[c].contacts + records[c].rescued != 0) sum.add(records[c]);
      }
      s.of_thread[t] = sum;
    });
    b.for_threads(kStrips, [&](int strip) {
      ContactRecord sum{};
      for (int t = strip * kStrip; t < (strip + 1) * kStrip; ++t) sum.add(s.of_thread[t]);
      s.of_strip[strip] = sum;
    });
    b.on_one_thread([&] {
      ContactRecord sum{};
      for (const ContactRecord& strip : s.of_strip) sum.add(strip);
      total[0] = sum;
    });
  }
};

}  // namespace tactus
