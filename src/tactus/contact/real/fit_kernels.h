#pragma once
/// The registration's steps: the equations of every point, and the poses and motions from their sums.
#include "tactus/contact/real/motion_kernels.h"
#include "tactus/geom/maths/cholesky.h"

namespace tactus {

/// One registered point's share of the normal equations: its distance from the tangent plane of the nearest
/// sample of this frame; all 0 where none is within reach. Block j: point j; its threads share the cells.
/// With `first`, four poses at once: block kFitPoints e + j, e = 0: no motion; 1 and 2: the shift of the
/// centre [P 19], on the fine and on the coarse samples; 3: had it moved on as before.
struct FitPoints {
  static constexpr int kThreads = 32, kCells = 27, kOwnCell = 13, kGrain = 8;
  View<const Vec3f> previous_m;
  SamplesView fine, coarse;
  Index first, far;  ///< far != 0: on the coarse samples
  float spacing_m;   ///< of the fine samples; distances above half of it count less and less
  View<const SurfaceComponents> before, now;
  View<const FitState> state;
  View<FitSums> points;
  struct Shared {
    Vec3f at;
    float reach_m;
    Index component, active;
    float d2[kThreads];
    Index sample[kThreads];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index evaluation = b.index() / kFitPoints, j = b.index() % kFitPoints;
    const bool on_coarse = first != 0 ? evaluation == 2 : far != 0;
    b.on_one_thread([&] { begin(evaluation, j, on_coarse, s); });
    if (s.active == 0) return;
    const SamplesView& samples = on_coarse ? coarse : fine;
    if constexpr (Block::kIsLoop) {
      // One after the other, so cells that are farther than the sample found in the own cell can be left out.
      search_cell(kOwnCell, samples, sqr(s.reach_m), s);
      const float least2 = s.sample[kOwnCell] < 0 ? sqr(s.reach_m) : s.d2[kOwnCell];
      for (int t = 0; t < kCells; ++t)
        if (t != kOwnCell) search_cell(t, samples, least2, s);
    } else {
      b.for_threads(kCells, [&](int t) { search_cell(t, samples, sqr(s.reach_m), s); });
    }
    b.on_one_thread([&] {
      Index best = -1;
      float best_d2 = 1e30F;
      for (int t = 0; t < kCells; ++t) {
        if (s.sample[t] < 0 || !(s.d2[t] < best_d2)) continue;
        best_d2 = s.d2[t];
        best = s.sample[t];
      }
      FitSums sums{};
      if (best >= 0) add(sums, s.at, center(j), samples.x_m[best], samples.n[best]);
      points[b.index()] = sums;
    });
  }

 private:
  TACTUS_HD Index component_of(Index j) const {
    const Index q = j / before[0].share_of(kFitPoints);
    return q < before[0].count ? before[0].component[q].next : -1;
  }
  /// The nearest sample in the t-th of the 27 cells, if it can be nearer than least2 (squared).
  TACTUS_HD void search_cell(int t, const SamplesView& samples, float least2, Shared& s) const {
    s.sample[t] = -1;
    const CellGrid& grid = samples.cells.grid;
    const Vec3i c = grid.cell(s.at), d{t % 3 - 1, t / 3 % 3 - 1, t / 9 - 1};
    const Vec3f in = grid.inverse_cell_1_m * s.at - vec_cast<float>(c);  // 0..1
    const auto away = [](Index to, float from) { return to == 0 ? 0.F : to < 0 ? from : 1.F - from; };
    const float away2 = sqr(away(d.x, in.x)) + sqr(away(d.y, in.y)) + sqr(away(d.z, in.z));
    // 1 % for samples that rounding puts into the next cell.
    if (0.99F * away2 > sqr(grid.inverse_cell_1_m) * least2) return;
    const Index w = grid.wrapped({c.x + d.x, c.y + d.y, c.z + d.z});
    float best_d2 = sqr(s.reach_m);
    for (Index i = samples.cells.begin[w], end = samples.cells.end[w]; i < end; ++i) {
      const Vec3f off = s.at - samples.x_m[i];
      const float d2 = dot(off, off);
      if (!(d2 < best_d2) || (s.component != kAnyComponent && samples.component[i] != s.component)) continue;
      best_d2 = d2;
      s.sample[t] = i;
    }
    s.d2[t] = best_d2;
  }
  TACTUS_HD Vec3f center(Index j) const { return state[component_of(j)].center_m; }
  TACTUS_HD void begin(Index evaluation, Index j, bool on_coarse, Shared& s) const {
    const SurfaceComponents& was = before[0];
    const Index share = was.share_of(kFitPoints), k = component_of(j);
    s.active = 0;
    if (k < 0 || j % share >= was.points_of(j / share)) return;
    s.active = 1;
    Rigidf pose = state[k].pose;
    if (first != 0 && evaluation > 0) pose.t = state[k].guess_m();
    if (first != 0 && evaluation == 3) pose = state[k].steady;
    s.at = pose * previous_m[j];
    s.component = now[0].mixed != 0 ? k : kAnyComponent;
    s.reach_m = on_coarse ? 8 * spacing_m : 2 * spacing_m;
    const SamplesView& samples = on_coarse ? coarse : fine;
    if (samples.may_be_near(s.at)) return;
    points[evaluation * kFitPoints + j] = {};
    s.active = 0;
  }
  TACTUS_HD void add(FitSums& sums, Vec3f q, Vec3f about, Vec3f on_m, Vec3f n) const {
    const Vec3f arm = q - about;
    const float e = dot(q - on_m, n);
    const float weight = 1.F / (1.F + 4.F * sqr(e / spacing_m));
    const Vec3f r = cross(arm, n);
    const float row[6] = {r.x, r.y, r.z, n.x, n.y, n.z};
    int k = 0;
    for (int a = 0; a < 6; ++a) {
      for (int b = a; b < 6; ++b) sums.value[k++] += weight * row[a] * row[b];
    }
    for (int a = 0; a < 6; ++a) sums.value[k++] += weight * row[a] * e;
    sums.value[27] += e * e;
    sums.value[28] += 1.F;
    sums.value[29] += dot(arm, arm);
  }
};

TACTUS_HD inline FitQuality quality_of(const FitSums& total, Index points) {
  const float matched = total.value[28];
  return {matched > 0.F ? tactus::sqrt(total.value[27] / matched) : 0.F,
          points > 0 ? matched / static_cast<float>(points) : 0.F};
}

/// One damped Gauss-Newton step.
struct FitStep {
  static constexpr int kEvaluations = 1;
  static constexpr float kDamping = 1e-3F;
  View<FitState> state;
  TACTUS_HD void operator()(Index, Index component, const FitSums& total) const {
    FitState& s = state[component];
    const float matched = total.value[28];
    if (s.previous < 0 || matched < 12.F) return;
    float a[6][6], x[6];
    int k = 0;
    for (int i = 0; i < 6; ++i) {
      for (int j = i; j < 6; ++j) a[i][j] = a[j][i] = total.value[k++];
    }
    for (int i = 0; i < 6; ++i) x[i] = -total.value[k++];
    const float move = kDamping * (a[3][3] + a[4][4] + a[5][5]);
    const float turn = move * total.value[29] / matched;
    for (int i = 0; i < 6; ++i) a[i][i] += i < 3 ? turn : move;
    solve_cholesky(a, x);  // positive definite through its damping
    const Vec3f w = {x[0], x[1], x[2]};
    const float angle = length(w);
    if (!(angle < 1.F)) return;
    s.rotation = normalized(axis_angle(normalized(w), angle) * s.rotation);
    const Vec3f moved_center = s.pose * s.previous_center_m;
    const Mat3f step = rotation_matrix(axis_angle(normalized(w), angle));
    const Vec3f new_center = s.center_m + step * (moved_center - s.center_m) + Vec3f{x[3], x[4], x[5]};
    s.pose.R = rotation_matrix(s.rotation);
    s.pose.t = new_center - s.pose.R * s.previous_center_m;
  }
};

/// Notes how good no motion is, and how good the shift of the centre [P 19]; then the first step from there,
/// unless the motion before explains more.
struct FirstFitStep {
  static constexpr int kEvaluations = 4;
  View<FitState> state;
  TACTUS_HD void operator()(Index evaluation, Index k, const FitSums& total) const {
    FitState& s = state[k];
    if (s.previous < 0) return;
    const FitQuality quality = quality_of(total, s.previous_points);
    if (evaluation == 0) s.still = quality;
    if (evaluation == 1) s.guess = quality;
    if (evaluation == 2) {
      s.pose.t = s.guess_m();
      FitStep{state}(0, k, total);
    }
    if (evaluation < 3 || !(quality.share * s.guess.rms_m > s.guess.share * quality.rms_m)) return;
    s.pose = s.steady;
    s.rotation = s.steady_rotation;
  }
};

/// Sums over the points of each component and then does `Step` for it. One block. Strip r of the n strips of
/// a component sums every n-th of its points, beginning with r: the same sums on every device.
template <class Step>
struct FitStage {
  static constexpr int kStrips = 2 * kComponents, kThreads = 1024;
  static_assert(kStrips * FitSums::kSize <= kThreads);
  View<const FitSums> points;
  View<const SurfaceComponents> before, now;
  Step step;
  struct Shared {
    float strip[kStrips][FitSums::kSize];
    FitSums total[kComponents];
  };
  /// The sum over every `strips`-th of `count` points, from the r-th on. A GPU fetches many while it waits
  /// for one.
  TACTUS_HD float strip_sum(Index first, Index r, Index strips, Index count, int value) const {
    constexpr Index kAhead = 16;
    float sum = 0;
    Index i = r;
    for (; i + (kAhead - 1) * strips < count; i += kAhead * strips) {
      float fetched[kAhead];
      for (Index u = 0; u < kAhead; ++u) fetched[u] = points[first + i + u * strips].value[value];
      for (Index u = 0; u < kAhead; ++u) sum += fetched[u];
    }
    for (; i < count; i += strips) sum += points[first + i].value[value];
    return sum;
  }
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const SurfaceComponents& was = before[0];
    const Index strips = was.share_of(kStrips), share = was.share_of(kFitPoints);
    for (Index e = 0; e < Step::kEvaluations; ++e) {
      b.for_threads(kStrips * FitSums::kSize, [&](int t) {
        const Index strip = t / FitSums::kSize, q = strip / strips;
        const int value = t % FitSums::kSize;
        const Index count = q < was.count && was.component[q].next >= 0 ? was.points_of(q) : 0;
        s.strip[strip][value] = strip_sum(e * kFitPoints + q * share, strip % strips, strips, count, value);
      });
      b.for_threads(kComponents * FitSums::kSize, [&](int t) {
        const Index q = t / FitSums::kSize;
        const int value = t % FitSums::kSize;
        float sum = 0;
        for (Index strip = q * strips; q < was.count && strip < (q + 1) * strips; ++strip)
          sum += s.strip[strip][value];
        s.total[q].value[value] = sum;
      });
      b.for_threads(kComponents, [&](int k) {
        if (k >= now[0].count) return;
        const Index q = step.state[k].previous;
        step(e, k, s.total[q < 0 ? 0 : q]);
      });
    }
  }
};

/// The simplest of no motion, [P 19] and the fit that the next one doesn't clearly beat: the noise of
/// sampling must not become a velocity, or friction makes resting bodies creep.
struct ChooseMotion {
  static constexpr int kEvaluations = 1;
  View<FitState> state;
  View<const float> dt_capture_s;  ///< (1) as MatchComponents'
  /// The residual of a fit may be twice the one that says that nothing moves: with a sample for each voxel,
  /// hulls of an object that turns differ by more than half a spacing.
  static constexpr float kMostFitRms = 2;
  float good_rms_m, max_speed_m_s;
  View<const SurfaceComponents> components;
  View<SurfaceMotion> motion;
  View<MeasuredMotions> measured;
  TACTUS_HD void operator()(Index, Index k, const FitSums& total) const {
    const FitState& s = state[k];
    const float dt_s = dt_capture_s[0];
    SurfaceMotion m;
    if (s.previous < 0) {
      motion[k] = s.carried;
      measured[k].count = 0;
      return;
    }
    m.center_m = s.center_m;
    m.area_m2 = s.area_m2;
    const FitQuality fit = quality_of(total, s.previous_points);
    m.residual_m = s.still.rms_m;
    if (s.previous_points > 0 && dt_s > 0.F && s.area_m2 > 0.F) {
      const bool good =
          fit.share >= 0.6F && fit.rms_m <= kMostFitRms * good_rms_m && tactus::abs(s.rotation.w) > 0.9F;
      const bool moves =
          s.guess.clearly_better_than(s.still) || s.still.share < 0.6F || s.still.rms_m > good_rms_m;
      const FitQuality& simpler = moves ? s.guess : s.still;
      if (good && fit.clearly_better_than(simpler))
        set_rigid(s, m, fit.rms_m, dt_s);
      else if (moves)
        set_centroid(s, m, dt_s);
      if (!(length(m.velocity_m_s) <= max_speed_m_s)) {
        m.velocity_m_s = m.spin_rad_s = {};
        m.source = MotionSource::too_fast;
      }
    }
    motion[k] = mean(k, m, dt_s);
  }

 private:
  /// How fast points of a component move that moves so, about.
  TACTUS_HD static float speed(Vec3f v, Vec3f w, float size_m) {
    return length(v) + 0.25F * size_m * length(w);
  }
  /// The mean with the motions measured before, as far as they agree. The volume that a hull adds to its
  /// object changes with the view, and those errors cancel between consecutive frames.
  TACTUS_HD SurfaceMotion mean(Index k, const SurfaceMotion& m, float dt_s) const {
    const MeasuredMotions& before = state[k].measured;
    MeasuredMotions& now = measured[k];
    now.motion[0] = m;
    now.count = m.source == MotionSource::rigid || m.source == MotionSource::centroid ? 1 : 0;
    SurfaceMotion sum = m;
    if (now.count == 0 || before.count == 0 || m.source != before.motion[0].source) return sum;
    const bool turns = goes_round(before.motion[0], m, dt_s);
    sum.velocity_m_s = at_end(m, m.center_m, turns, dt_s);
    const float size_m = components[0].component[k].size_m();
    const float change = speed(sum.velocity_m_s - at_end(before.motion[0], m.center_m, turns, dt_s),
                               m.spin_rad_s - before.motion[0].spin_rad_s, size_m);
    if (change > 0.5F * speed(m.velocity_m_s, m.spin_rad_s, size_m) + 0.5F * good_rms_m / dt_s) return sum;
    for (Index i = 0; i < before.count; ++i) {
      sum.velocity_m_s += at_end(before.motion[i], m.center_m, turns, dt_s);
      sum.spin_rad_s += before.motion[i].spin_rad_s;
      if (now.count < MeasuredMotions::kMost) now.motion[now.count++] = before.motion[i];
    }
    const float share = 1.F / static_cast<float>(before.count + 1);
    sum.velocity_m_s = share * sum.velocity_m_s;
    sum.spin_rad_s = share * sum.spin_rad_s;
    return sum;
  }
  /// Whether the centre goes round an axis, as a hand's does round the wrist, and not straight on, as that of
  /// a thrown object: its way turned with the component.
  TACTUS_HD static bool goes_round(const SurfaceMotion& last, const SurfaceMotion& now, float dt_s) {
    const Vec3f straight = now.velocity_m_s - last.velocity_m_s,
                round = now.velocity_m_s - now.turn(dt_s) * last.velocity_m_s;
    return dot(round, round) < dot(straight, straight);
  }
  /// Velocity of a point at p_m, by a motion whose velocity is the centre's mean one over its frame. Round an
  /// axis, it is the one at the end: the way, which was a chord, turned on by half an angle, as long as the
  /// arc.
  TACTUS_HD static Vec3f at_end(const SurfaceMotion& m, Vec3f p_m, bool turns, float dt_s) {
    if (!turns) return m.velocity_m_s;
    const Vec3f axis = normalized(m.spin_rad_s), along = dot(axis, m.velocity_m_s) * axis;
    const float half2 = sqr(0.5F * dt_s * length(m.spin_rad_s));
    const float arc_over_chord = 1.F + half2 * (1.F / 6.F + half2 * (7.F / 360.F));  // x / sin x, x < 0.46
    const Vec3f end = along + arc_over_chord * (m.turn(0.5F * dt_s) * (m.velocity_m_s - along));
    return end + cross(m.spin_rad_s, p_m - m.center_m);
  }
  TACTUS_HD void set_centroid(const FitState& s, SurfaceMotion& m, float dt_s) const {
    m.source = MotionSource::centroid;
    m.residual_m = s.guess.rms_m;
    m.velocity_m_s = (s.center_m - s.previous_center_m) / dt_s;
  }
  TACTUS_HD void set_rigid(const FitState& s, SurfaceMotion& m, float rms, float dt_s) const {
    const float sign = s.rotation.w < 0.F ? -1.F : 1.F;
    const Vec3f half = sign * Vec3f{s.rotation.x, s.rotation.y, s.rotation.z};
    const float x2 = dot(half, half);  // sin²(angle/2) <= 0.19: asin's series to x^9 is good to 2e-6
    const float asin_over_x =
        1.F + x2 * (1.F / 6.F + x2 * (3.F / 40.F + x2 * (15.F / 336.F + x2 * (105.F / 3456.F))));
    m.source = MotionSource::rigid;
    m.residual_m = rms;
    m.velocity_m_s = (m.center_m - inverse(s.pose) * s.center_m) / dt_s;
    m.spin_rad_s = (2.F * asin_over_x / dt_s) * half;
  }
};

}  // namespace tactus
