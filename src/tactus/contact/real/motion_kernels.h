#pragma once
/// Rigid motion of each component of the real surface between two frames: point-to-plane registration (Chen &
/// Medioni 1992) of the last frame's samples on this frame's, damped so that directions the shape says
/// nothing about keep the first guess: the difference of the centres of gravity [P 19], or the last frame's
/// motion where that explains more.
#include "tactus/contact/real/component_kernels.h"

namespace tactus {

/// The simplest motion that explains the reconstructed surface.
enum class MotionSource : Index {
  still = 0,     ///< also: no last frame
  centroid = 1,  ///< difference of the centres of gravity [P 19]
  rigid = 2,     ///< registered translation and rotation
  carried = 3,   ///< of the last frame: components that joined or came apart can't be compared
  too_fast = 4,  ///< faster than can be true: it touches nothing in this frame
};

/// How a component of the surface moves: p(t) = c + v t + R(w t) (p - c), t in seconds after the surface's
/// frame.
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

/// Motions measured of a component in its last frames, the newest first; velocities are means over a frame.
struct MeasuredMotions {
  static constexpr Index kMost = 2;
  Index count = 0;
  SurfaceMotion motion[kMost];
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

/// State of the registration of one component.
struct FitState {
  Index previous = -1;  ///< the component of the last frame that it was
  Rigidf pose;          ///< last frame -> this frame
  Quatf rotation;       ///< of pose
  Vec3f center_m, previous_center_m;
  float area_m2 = 0;
  Index previous_points = 0;
  Rigidf steady;            ///< where it would be had it moved on as before
  Quatf steady_rotation;    ///< of `steady`
  FitQuality still, guess;  ///< of no motion, of the shift of the centre
  TACTUS_HD Vec3f guess_m() const { return center_m - previous_center_m; }  ///< [P 19]
  SurfaceMotion carried;     ///< where there is no previous component
  MeasuredMotions measured;  ///< of the previous component
};

/// Which component each vertex of the last update's mesh is of, and how components moved until then and move
/// from there.
struct VertexMotions {
  View<const std::uint32_t> parent;  ///< of the forest of vertices
  View<const Index> number;          ///< of a root's component
  View<const SurfaceComponents> before, now;
  View<const SurfaceMotion> motion;
  View<const FitState> fit;
  TACTUS_HD Index component(Index v) const {
    if (now[0].mixed == 0) return 0;
    auto root = static_cast<Index>(parent[v]);
    for (auto next = static_cast<Index>(parent[root]); next != root; next = static_cast<Index>(parent[root]))
      root = next;
    return max(number[root], Index(0));
  }
  /// From where component q of the update before was to where it is now, as registered; one that is lost, or
  /// jumped, stays. A motion that is too slow to be told from noise counts, too: over many frames its sum is
  /// right, and that of nothing isn't.
  TACTUS_HD Rigidf since_before(Index q) const {
    const Rigidf stays{Mat3f::identity(), {}};
    if (q < 0 || q >= before[0].count) return stays;
    const Index k = before[0].component[q].next;
    if (k < 0 || k >= now[0].count || motion[k].source == MotionSource::too_fast) return stays;
    return fit[k].previous == q && fit[k].previous_points > 0 ? fit[k].pose : stays;
  }
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

/// Which component was which: nearest pairs first, one each, of where it was and where it would be had it
/// moved on steadily. A component moves by less than its own size between two frames, and its area changes by
/// less than half, else components joined or came apart (with less, 2/3 of the points still find their
/// partners, which is enough for a fit). A single component is the one before, however it moves. A lost
/// component that is seen again gets its label back, and begins a new motion.
struct MatchComponents {
  static constexpr float kMostGrowth = 1.5F;
  View<const SurfaceMotion> motion;  ///< of the last frame
  View<const float> dt_capture_s;    ///< (1) from the last capture to this one [s]; 0: it stands still
  View<SurfaceComponents> before, now;
  TACTUS_HD void operator()(Index) const {
    SurfaceComponents &was = before[0], &is = now[0];
    is.next_label = was.next_label;
    for (Index q = 0; q < was.count; ++q) was.component[q].next = -1;
    for (Index k = 0; k < is.count; ++k) is.component[k].label = -1;
    if (was.count == 1 && is.count == 1) pair(0, 0);
    for (Index pairs = 0; pairs < min(was.count, is.count); ++pairs) {
      Index best_q = -1, best_k = -1;
      float best = 1e30F;
      for (Index q = 0; q < was.count; ++q) {
        for (Index k = 0; k < is.count; ++k) {
          if (was.component[q].next >= 0 || is.component[k].label >= 0 ||
              !alike(was.component[q].area_m2, is.component[k].area_m2))
            continue;
          const float d = distance(q, k);
          if (d < best && d < was.component[q].size_m()) {
            best = d;
            best_q = q;
            best_k = k;
          }
        }
      }
      if (best_q < 0) break;
      pair(best_q, best_k);
    }
    remember(was, is);
    for (Index k = 0; k < is.count; ++k) {
      if (is.component[k].label < 0) is.component[k].label = found_again(is, is.component[k]);
      if (is.component[k].label < 0) is.component[k].label = is.next_label++;
    }
  }

 private:
  /// Adds the components that are not seen any more to those that were lost before; where there is no
  /// capacity, the longest lost goes.
  TACTUS_HD static void remember(const SurfaceComponents& was, SurfaceComponents& is) {
    is.lost_count = 0;
    for (Index i = 0; i < was.lost_count; ++i) {
      LostComponent lost = was.lost[i];
      if (++lost.frames <= LostComponent::kFrames) keep(is, lost);
    }
    for (Index q = 0; q < was.count; ++q) {
      const SurfaceComponent& p = was.component[q];
      if (p.next < 0 && p.samples > 0) keep(is, {p.label, 1, p.area_m2, p.size_m(), p.center_m});
    }
  }
  TACTUS_HD static void keep(SurfaceComponents& is, const LostComponent& lost) {
    if (is.lost_count == kComponents) forget(is, 0);
    is.lost[is.lost_count++] = lost;
  }
  TACTUS_HD static void forget(SurfaceComponents& is, Index i) {
    for (--is.lost_count; i < is.lost_count; ++i) is.lost[i] = is.lost[i + 1];
  }
  /// The label of the nearest lost component that it can be, or -1.
  TACTUS_HD static Index found_again(SurfaceComponents& is, const SurfaceComponent& component) {
    Index best = -1;
    float best_m = 1e30F;
    for (Index i = 0; i < is.lost_count; ++i) {
      const LostComponent& lost = is.lost[i];
      const float d = length(component.center_m - lost.center_m);
      if (!(d < best_m && d < lost.size_m && alike(lost.area_m2, component.area_m2))) continue;
      best_m = d;
      best = i;
    }
    if (best < 0) return -1;
    const Index label = is.lost[best].label;
    forget(is, best);
    return label;
  }
  TACTUS_HD void pair(Index q, Index k) const {
    before[0].component[q].next = k;
    now[0].component[k].label = before[0].component[q].label;
  }
  TACTUS_HD static bool alike(float a_m2, float b_m2) {
    return a_m2 < kMostGrowth * b_m2 && b_m2 < kMostGrowth * a_m2;
  }
  TACTUS_HD float distance(Index q, Index k) const {
    const Vec3f step = now[0].component[k].center_m - before[0].component[q].center_m;
    return min(length(step), length(step - dt_capture_s[0] * motion[q].velocity_m_s));
  }
};

/// The pose of component k starts at no motion. A new component moves as the nearest component did, if there
/// was one.
struct StartFit {
  View<const SurfaceMotion> motion;      ///< of the last frame
  View<const MeasuredMotions> measured;  ///< likewise
  View<const float> dt_capture_s;        ///< (1) from the last capture to this one [s]; 0: it stands still
  View<const SurfaceComponents> before, now;
  View<FitState> state;
  TACTUS_HD void operator()(Index k) const {
    const SurfaceComponents &was = before[0], &is = now[0];
    FitState s{};
    for (Index q = 0; q < was.count && k < is.count; ++q) {
      if (was.component[q].next != k) continue;
      s.previous = q;
      s.measured = measured[q];
      move_on(motion[q], s);
      s.previous_points = was.points_of(q);
      s.previous_center_m = was.component[q].center_m;
    }
    if (k < is.count) {
      s.center_m = s.carried.center_m = is.component[k].center_m;
      s.area_m2 = s.carried.area_m2 = is.component[k].area_m2;
      if (dt_capture_s[0] > 0.F) carry(s.carried);
    }
    state[k] = s;
  }

 private:
  TACTUS_HD void move_on(const SurfaceMotion& m, FitState& s) const {
    const float dt_s = dt_capture_s[0], rate = length(m.spin_rad_s);
    s.steady_rotation = axis_angle(normalized(m.spin_rad_s), rate * dt_s);
    s.steady.R = rotation_matrix(s.steady_rotation);
    s.steady.t = m.center_m + dt_s * m.velocity_m_s - s.steady.R * m.center_m;
  }
  TACTUS_HD void carry(SurfaceMotion& m) const {
    const SurfaceComponents& was = before[0];
    Index nearest = -1;
    float best = 1e30F;
    for (Index q = 0; q < was.count; ++q) {
      const SurfaceComponent& p = was.component[q];
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

/// From where this frame's components are to where their registration begins. One block.
struct FitBegin {
  static constexpr int kThreads = 32;
  static_assert(kThreads >= kComponents);
  ComponentCenters centers;
  MatchComponents match;
  StartFit start;
  struct Shared {};
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    b.for_threads(kComponents, [&](int k) { centers(k); });
    b.on_one_thread([&] { match(0); });
    b.for_threads(kComponents, [&](int k) { start(k); });
  }
};

}  // namespace tactus
