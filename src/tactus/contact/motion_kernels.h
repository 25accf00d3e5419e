#pragma once
/// Rigid motion of the real surface between two frames: point-to-plane registration (Chen & Medioni 1992) of
/// the last frame's samples on this frame's, damped so that directions the shape says nothing about keep the
/// first guess, the difference of the centres of gravity [P 19].
#include "tactus/contact/sample_kernels.h"
#include "tactus/geom/cholesky.h"

namespace tactus {

inline constexpr Index kFitPoints = 512;  ///< samples of the last frame that are registered, at most
inline constexpr Index kFitParts = 64;    ///< partial sums: point j goes to part j % 64, on every device

/// The simplest motion that explains what is seen.
enum class MotionSource : Index {
  still = 0,     ///< also: no last frame, or faster than can be true
  centroid = 1,  ///< difference of the centres of gravity [P 19]
  rigid = 2,     ///< registered translation and rotation
};

/// How the surface moves: p(t) = c + v t + R(w t) (p - c), t in seconds after the surface's frame.
struct SurfaceMotion {
  Vec3f center_m;      ///< c: centre of gravity of the surface
  Vec3f velocity_m_s;  ///< v of the centre
  Vec3f spin_rad_s;    ///< w
  float area_m2 = 0;
  float residual_m = 0;  ///< root mean square distance of the fit
  MotionSource source = MotionSource::still;

  TACTUS_HD Mat3f turn(float t_s) const {
    const float rate = length(spin_rad_s);
    return rotation_matrix(axis_angle(normalized(spin_rad_s), rate * t_s));
  }
  /// Velocity of the surface's material at p_m, p_m given at time t_s.
  TACTUS_HD Vec3f velocity_at(Vec3f p_m, float t_s) const {
    return velocity_m_s + cross(spin_rad_s, p_m - (center_m + t_s * velocity_m_s));
  }
};

/// How well a pose brings the last frame's samples onto this frame's.
struct FitQuality {
  float rms_m = 0;
  float share = 0;  ///< of the points that found a partner
  /// Explains more than `simpler` does: noise alone can't halve the mean square.
  TACTUS_HD bool clearly_better_than(const FitQuality& simpler) const {
    return share > simpler.share + 0.05F ||
           (share >= simpler.share - 0.05F && sqr(rms_m) < 0.5F * sqr(simpler.rms_m));
  }
};

/// State of the registration.
struct FitState {
  Rigidf pose;     ///< last frame -> this frame
  Quatf rotation;  ///< of pose
  Vec3f center_m, previous_center_m;
  float area_m2 = 0;
  Index previous_points = 0;
  FitQuality still, guess;  ///< of no motion, of the first guess
};

/// Partial sums of one group of points: upper triangle of J^T J (21), J^T e (6), e², matched, |arm|².
struct FitSums {
  static constexpr int kSize = 30;
  float value[kSize];
};

struct KeepPrevious {
  SamplesView from;
  View<Vec3f> x_m;  ///< (kFitPoints)
  View<FitState> state;
  TACTUS_HD void operator()(Index j) const {
    const Index n = from.count[0], kept = min(n, kFitPoints);
    if (j == 0) {
      state[0].previous_points = kept;
      state[0].previous_center_m = state[0].center_m;
    }
    if (j < kept) x_m[j] = from.x_m[static_cast<Index>(static_cast<std::int64_t>(j) * n / kept)];
  }
};

struct CentroidParts {
  static constexpr int kGrain = 4;
  SamplesView samples;
  View<FitSums> parts;
  TACTUS_HD void operator()(Index p) const {
    Vec3f x{};
    float area = 0;
    for (Index i = p, n = samples.count[0]; i < n; i += kFitParts) {
      area += samples.area_m2[i];
      x += samples.area_m2[i] * samples.x_m[i];
    }
    parts[p].value[0] = area;
    parts[p].value[1] = x.x;
    parts[p].value[2] = x.y;
    parts[p].value[3] = x.z;
  }
};

/// The centre of gravity; the pose starts at no motion.
struct GuessMotion {
  View<const FitSums> parts;
  View<FitState> state;
  TACTUS_HD void operator()(Index) const {
    float sum[4] = {};
    for (Index p = 0; p < kFitParts; ++p) {
      for (int k = 0; k < 4; ++k) sum[k] += parts[p].value[k];
    }
    FitState& s = state[0];
    s.area_m2 = sum[0];
    s.center_m = sum[0] > 0.F ? Vec3f{sum[1], sum[2], sum[3]} / sum[0] : s.previous_center_m;
    s.rotation = {};
    s.pose = {};
  }
};

/// One registered point's share of the normal equations: its distance from the tangent plane of the nearest
/// sample of this frame; all 0 where none is within reach.
struct FitPoints {
  static constexpr int kGrain = 32;
  View<const Vec3f> previous_m;
  SamplesView samples;
  float reach_m;  ///< partners are sought that far, <= the cells' edge
  float scale_m;  ///< distances above count less and less
  View<const FitState> state;
  View<FitSums> points;  ///< (kFitPoints)
  TACTUS_HD void operator()(Index j) const {
    FitSums sums{};
    const FitState& s = state[0];
    if (j < s.previous_points) add(sums, s.pose * previous_m[j], s.center_m);
    points[j] = sums;
  }

 private:
  TACTUS_HD void add(FitSums& sums, Vec3f q, Vec3f center) const {
    Index best = -1;
    float best_d2 = reach_m * reach_m;
    samples.cells.for_each_slot(q, [&](Index i) {
      const Vec3f d = q - samples.x_m[i];
      const float d2 = dot(d, d);
      if (d2 < best_d2) {
        best_d2 = d2;
        best = i;
      }
    });
    if (best < 0) return;
    const Vec3f n = samples.n[best], arm = q - center;
    const float e = dot(q - samples.x_m[best], n);
    const float weight = 1.F / (1.F + sqr(e / scale_m));
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

/// Sums the points of each part, in their order.
struct FitParts {
  static constexpr int kGrain = 16;
  View<const FitSums> points;
  View<FitSums> parts;
  TACTUS_HD void operator()(Index p) const {
    FitSums sums{};
    for (Index j = p; j < kFitPoints; j += kFitParts) {
      for (int k = 0; k < FitSums::kSize; ++k) sums.value[k] += points[j].value[k];
    }
    parts[p] = sums;
  }
};

/// Sums the parts in their order.
TACTUS_HD inline FitSums total_of(View<const FitSums> parts) {
  FitSums total{};
  for (Index p = 0; p < kFitParts; ++p) {
    for (int k = 0; k < FitSums::kSize; ++k) total.value[k] += parts[p].value[k];
  }
  return total;
}

TACTUS_HD inline FitQuality quality_of(const FitSums& total, Index points) {
  const float matched = total.value[28];
  return {matched > 0.F ? tactus::sqrt(total.value[27] / matched) : 0.F,
          points > 0 ? matched / static_cast<float>(points) : 0.F};
}

/// Notes how good no motion is and goes on to the first guess, [P 19].
struct NoteStill {
  View<const FitSums> parts;
  View<FitState> state;
  TACTUS_HD void operator()(Index) const {
    FitState& s = state[0];
    s.still = quality_of(total_of(parts), s.previous_points);
    s.pose.t = s.center_m - s.previous_center_m;
  }
};

/// Notes how good the first guess is.
struct NoteGuess {
  View<const FitSums> parts;
  View<FitState> state;
  TACTUS_HD void operator()(Index) const {
    state[0].guess = quality_of(total_of(parts), state[0].previous_points);
  }
};

/// One damped Gauss-Newton step.
struct FitStep {
  static constexpr float kDamping = 1e-3F;
  View<const FitSums> parts;
  View<FitState> state;
  TACTUS_HD void operator()(Index) const {
    const FitSums total = total_of(parts);
    FitState& s = state[0];
    const float matched = total.value[28];
    if (matched < 12.F) return;
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

/// The simplest of no motion, [P 19] and the fit that the next one doesn't clearly beat: the noise of
/// sampling must not become a velocity, or friction makes what rests creep.
struct ChooseMotion {
  View<const FitSums> parts;  ///< of the final pose
  View<const FitState> state;
  float dt_s, good_rms_m, max_speed_m_s;
  View<SurfaceMotion> motion;
  TACTUS_HD void operator()(Index) const {
    const FitState& s = state[0];
    const FitQuality fit = quality_of(total_of(parts), s.previous_points);
    SurfaceMotion m;
    m.center_m = s.center_m;
    m.area_m2 = s.area_m2;
    m.residual_m = s.still.rms_m;
    if (s.previous_points > 0 && dt_s > 0.F && s.area_m2 > 0.F) {
      const bool good = fit.share >= 0.6F && fit.rms_m <= good_rms_m && tactus::abs(s.rotation.w) > 0.9F;
      const bool moves =
          s.guess.clearly_better_than(s.still) || s.still.share < 0.6F || s.still.rms_m > good_rms_m;
      const FitQuality& simpler = moves ? s.guess : s.still;
      if (good && fit.clearly_better_than(simpler))
        set_rigid(m, fit.rms_m);
      else if (moves)
        set_centroid(m);
      if (!(length(m.velocity_m_s) <= max_speed_m_s)) {
        m.velocity_m_s = m.spin_rad_s = {};
        m.source = MotionSource::still;
      }
    }
    motion[0] = m;
  }

 private:
  TACTUS_HD void set_centroid(SurfaceMotion& m) const {
    const FitState& s = state[0];
    m.source = MotionSource::centroid;
    m.residual_m = s.guess.rms_m;
    m.velocity_m_s = (s.center_m - s.previous_center_m) / dt_s;
  }
  TACTUS_HD void set_rigid(SurfaceMotion& m, float rms) const {
    const FitState& s = state[0];
    const Vec3f back = inverse(s.pose) * s.center_m;
    const float sign = s.rotation.w < 0.F ? -1.F : 1.F;
    const Vec3f half = sign * Vec3f{s.rotation.x, s.rotation.y, s.rotation.z};
    const float x2 = dot(half, half);  // sin²(angle/2) <= 0.19: asin's series to x^9 is good to 2e-6
    const float asin_over_x =
        1.F + x2 * (1.F / 6.F + x2 * (3.F / 40.F + x2 * (15.F / 336.F + x2 * (105.F / 3456.F))));
    m.source = MotionSource::rigid;
    m.residual_m = rms;
    m.velocity_m_s = (m.center_m - back) / dt_s;
    m.spin_rad_s = (2.F * asin_over_x / dt_s) * half;
  }
};

}  // namespace tactus
