#pragma once
/// Rigid motion of each piece of the real surface between two frames: point-to-plane registration (Chen &
/// Medioni 1992) of the last frame's samples on this frame's, damped so that directions the shape says
/// nothing about keep the first guess, the difference of the centres of gravity [P 19].
#include "tactus/contact/piece_kernels.h"
#include "tactus/geom/cholesky.h"

namespace tactus {

inline constexpr Index kFitPoints = 512;  ///< samples of the last frame that are registered, at most
inline constexpr Index kFitParts = 64;    ///< partial sums: point j goes to part j % 64, on every device

/// The simplest motion that explains what is seen.
enum class MotionSource : Index {
  still = 0,     ///< also: no last frame, or faster than can be true
  centroid = 1,  ///< difference of the centres of gravity [P 19]
  rigid = 2,     ///< registered translation and rotation
  carried = 3,   ///< of the last frame: pieces that joined or came apart can't be compared
};

/// How a piece of the surface moves: p(t) = c + v t + R(w t) (p - c), t in seconds after the surface's frame.
struct SurfaceMotion {
  Vec3f center_m;      ///< c: centre of gravity
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

/// State of the registration of one piece.
struct FitState {
  Index previous = -1;  ///< the piece of the last frame that it was
  Rigidf pose;          ///< last frame -> this frame
  Quatf rotation;       ///< of pose
  Vec3f center_m, previous_center_m;
  float area_m2 = 0;
  Index previous_points = 0;
  FitQuality still, guess;  ///< of no motion, of the first guess
  SurfaceMotion carried;    ///< where there is no previous piece
};

/// Partial sums of one group of points: upper triangle of J^T J (21), J^T e (6), e², matched, |arm|².
struct FitSums {
  static constexpr int kSize = 30;
  float value[kSize];
};

struct SetCaptureTime {
  View<float> dt_capture_s;
  float value_s;
  TACTUS_HD void operator()(Index) const { dt_capture_s[0] = value_s; }
};

/// Which piece was which: nearest pairs first, one each, of where it was and where it would be had it moved
/// on steadily. A piece moves by less than its own size between two frames, and its area changes by less than
/// half, else pieces joined or came apart (with less, 2/3 of the points still find their partners, which is
/// enough for a fit). A single piece is the one before, whatever it does.
struct MatchPieces {
  static constexpr float kMostGrowth = 1.5F;
  View<const SurfaceMotion> motion;  ///< of the last frame
  View<const float> dt_capture_s;    ///< (1) from the last capture to this one [s]; 0: it stands still
  View<SurfacePieces> before, now;
  TACTUS_HD void operator()(Index) const {
    SurfacePieces &was = before[0], &is = now[0];
    is.next_label = was.next_label;
    for (Index q = 0; q < was.count; ++q) was.piece[q].next = -1;
    for (Index k = 0; k < is.count; ++k) is.piece[k].label = -1;
    if (was.count == 1 && is.count == 1) pair(0, 0);
    for (Index pairs = 0; pairs < min(was.count, is.count); ++pairs) {
      Index best_q = -1, best_k = -1;
      float best = 1e30F;
      for (Index q = 0; q < was.count; ++q) {
        for (Index k = 0; k < is.count; ++k) {
          if (was.piece[q].next >= 0 || is.piece[k].label >= 0 || !alike(q, k)) continue;
          const float d = distance(q, k);
          if (d < best && d < was.piece[q].size_m()) {
            best = d;
            best_q = q;
            best_k = k;
          }
        }
      }
      if (best_q < 0) break;
      pair(best_q, best_k);
    }
    for (Index k = 0; k < is.count; ++k) {
      if (is.piece[k].label < 0) is.piece[k].label = is.next_label++;
    }
  }

 private:
  TACTUS_HD void pair(Index q, Index k) const {
    before[0].piece[q].next = k;
    now[0].piece[k].label = before[0].piece[q].label;
  }
  TACTUS_HD bool alike(Index q, Index k) const {
    const float a = before[0].piece[q].area_m2, b = now[0].piece[k].area_m2;
    return a < kMostGrowth * b && b < kMostGrowth * a;
  }
  TACTUS_HD float distance(Index q, Index k) const {
    const Vec3f step = now[0].piece[k].center_m - before[0].piece[q].center_m;
    return min(length(step), length(step - dt_capture_s[0] * motion[q].velocity_m_s));
  }
};

/// The pose of piece k starts at no motion. What is new moves as the nearest piece did, if there was one.
struct StartFit {
  View<const SurfaceMotion> motion;  ///< of the last frame
  View<const float> dt_capture_s;    ///< (1) from the last capture to this one [s]; 0: it stands still
  View<const SurfacePieces> before, now;
  View<FitState> state;
  TACTUS_HD void operator()(Index k) const {
    const SurfacePieces &was = before[0], &is = now[0];
    FitState s{};
    for (Index q = 0; q < was.count && k < is.count; ++q) {
      if (was.piece[q].next != k) continue;
      s.previous = q;
      s.previous_points = min(was.piece[q].samples, was.share_of(kFitPoints));
      s.previous_center_m = was.piece[q].center_m;
    }
    if (k < is.count) {
      s.center_m = s.carried.center_m = is.piece[k].center_m;
      s.area_m2 = s.carried.area_m2 = is.piece[k].area_m2;
      if (dt_capture_s[0] > 0.F) carry(s.carried);
    }
    state[k] = s;
  }

 private:
  TACTUS_HD void carry(SurfaceMotion& m) const {
    const SurfacePieces& was = before[0];
    Index nearest = -1;
    float best = 1e30F;
    for (Index q = 0; q < was.count; ++q) {
      const SurfacePiece& p = was.piece[q];
      const float d = length(m.center_m - p.center_m);
      if (!(d < best && d < p.size_m())) continue;
      best = d;
      nearest = q;
    }
    if (nearest < 0) return;
    m.source = MotionSource::carried;
    m.velocity_m_s = motion[nearest].velocity_at(m.center_m, dt_capture_s[0]);
    m.spin_rad_s = motion[nearest].spin_rad_s;
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
  View<const SurfacePieces> before, now;
  View<const FitState> state;
  View<FitSums> points;  ///< (kFitPoints)
  TACTUS_HD void operator()(Index j) const {
    FitSums sums{};
    const SurfacePieces& was = before[0];
    const Index share = was.share_of(kFitPoints), q = j / share, k = q < was.count ? was.piece[q].next : -1;
    if (k >= 0) {
      const FitState& s = state[k];
      if (j % share < s.previous_points)
        add(sums, s.pose * previous_m[j], s.center_m, now[0].mixed != 0 ? k : kAnyPiece);
    }
    points[j] = sums;
  }

 private:
  /// @param piece on which the partner must be, or kAnyPiece
  TACTUS_HD void add(FitSums& sums, Vec3f q, Vec3f center, Index piece) const {
    Index best = -1;
    float best_d2 = reach_m * reach_m;
    samples.for_each_near(q, [&](Index i) {
      const Vec3f d = q - samples.x_m[i];
      const float d2 = dot(d, d);
      if (d2 < best_d2 && (piece == kAnyPiece || samples.piece[i] == piece)) {
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

/// Part p: each piece has its share of the parts, as of the points; of its points, number j goes to its part
/// j % share: the same sums on every device.
struct FitParts {
  View<const FitSums> points;
  View<const SurfacePieces> before;
  View<FitSums> parts;
  TACTUS_HD void operator()(Index p) const {
    FitSums sums{};
    const Index stride = before[0].share_of(kFitParts), share = before[0].share_of(kFitPoints);
    const Index first = p / stride * share;
    for (Index j = first + p % stride; j < first + share; j += stride) {
      for (int k = 0; k < FitSums::kSize; ++k) sums.value[k] += points[j].value[k];
    }
    parts[p] = sums;
  }
};

/// The parts of the pieces of the last frame.
struct FitPartsView {
  View<const FitSums> parts;
  View<const SurfacePieces> before;
  /// Sums those of piece q in their order.
  TACTUS_HD FitSums total(Index q) const {
    FitSums total{};
    const Index share = before[0].share_of(kFitParts);
    for (Index p = q * share; p < (q + 1) * share; ++p) {
      for (int k = 0; k < FitSums::kSize; ++k) total.value[k] += parts[p].value[k];
    }
    return total;
  }
};

TACTUS_HD inline FitQuality quality_of(const FitSums& total, Index points) {
  const float matched = total.value[28];
  return {matched > 0.F ? tactus::sqrt(total.value[27] / matched) : 0.F,
          points > 0 ? matched / static_cast<float>(points) : 0.F};
}

/// Notes how good no motion is and goes on to the first guess, [P 19].
struct NoteStill {
  FitPartsView parts;
  View<FitState> state;
  TACTUS_HD void operator()(Index k) const {
    FitState& s = state[k];
    if (s.previous < 0) return;
    s.still = quality_of(parts.total(s.previous), s.previous_points);
    s.pose.t = s.center_m - s.previous_center_m;
  }
};

/// Notes how good the first guess is.
struct NoteGuess {
  FitPartsView parts;
  View<FitState> state;
  TACTUS_HD void operator()(Index k) const {
    FitState& s = state[k];
    if (s.previous >= 0) s.guess = quality_of(parts.total(s.previous), s.previous_points);
  }
};

/// One damped Gauss-Newton step.
struct FitStep {
  static constexpr float kDamping = 1e-3F;
  FitPartsView parts;
  View<FitState> state;
  TACTUS_HD void operator()(Index piece) const {
    FitState& s = state[piece];
    if (s.previous < 0) return;
    const FitSums total = parts.total(s.previous);
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

/// Sums the parts and then does `Step` for each piece: one launch for both. One block.
template <class Step>
struct FitStage {
  static constexpr int kThreads = kFitParts;
  FitParts parts;
  Step step;
  struct Shared {};
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    b.for_each_thread([&](int p) { parts(p); });
    b.for_threads(kPieces, [&](int k) { step(k); });
  }
};

/// From where this frame's pieces are to where their registration begins. One block.
struct FitBegin {
  static constexpr int kThreads = 32;
  static_assert(kThreads >= kPieces);
  PieceCenters centers;
  MatchPieces match;
  StartFit start;
  struct Shared {};
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    b.for_threads(kPieces, [&](int k) { centers(k); });
    b.on_one_thread([&] { match(0); });
    b.for_threads(kPieces, [&](int k) { start(k); });
  }
};

/// The simplest of no motion, [P 19] and the fit that the next one doesn't clearly beat: the noise of
/// sampling must not become a velocity, or friction makes what rests creep.
struct ChooseMotion {
  FitPartsView parts;  ///< of the final pose
  View<const SurfacePieces> now;
  View<const FitState> state;
  View<const float> dt_capture_s;  ///< (1) as MatchPieces'
  float good_rms_m, max_speed_m_s;
  View<SurfaceMotion> motion;
  TACTUS_HD void operator()(Index k) const {
    const FitState& s = state[k];
    if (k >= now[0].count) return;
    const float dt_s = dt_capture_s[0];
    SurfaceMotion m;
    if (s.previous < 0) {
      motion[k] = s.carried;
      return;
    }
    m.center_m = s.center_m;
    m.area_m2 = s.area_m2;
    const FitQuality fit = quality_of(parts.total(s.previous), s.previous_points);
    m.residual_m = s.still.rms_m;
    if (s.previous_points > 0 && dt_s > 0.F && s.area_m2 > 0.F) {
      const bool good = fit.share >= 0.6F && fit.rms_m <= good_rms_m && tactus::abs(s.rotation.w) > 0.9F;
      const bool moves =
          s.guess.clearly_better_than(s.still) || s.still.share < 0.6F || s.still.rms_m > good_rms_m;
      const FitQuality& simpler = moves ? s.guess : s.still;
      if (good && fit.clearly_better_than(simpler))
        set_rigid(s, m, fit.rms_m, dt_s);
      else if (moves)
        set_centroid(s, m, dt_s);
      if (!(length(m.velocity_m_s) <= max_speed_m_s)) {
        m.velocity_m_s = m.spin_rad_s = {};
        m.source = MotionSource::still;
      }
    }
    motion[k] = m;
  }

 private:
  TACTUS_HD void set_centroid(const FitState& s, SurfaceMotion& m, float dt_s) const {
    m.source = MotionSource::centroid;
    m.residual_m = s.guess.rms_m;
    m.velocity_m_s = (s.center_m - s.previous_center_m) / dt_s;
  }
  TACTUS_HD void set_rigid(const FitState& s, SurfaceMotion& m, float rms, float dt_s) const {
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
