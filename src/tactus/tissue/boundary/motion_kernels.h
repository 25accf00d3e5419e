#pragma once
/// Nodes that follow a given motion: p(t) = pivot + R(axis, angle(t)) (rest - pivot) + displacement(t).
#include "tactus/frame/frame_params.h"
#include "tactus/geom/maths/held_axes.h"
#include "tactus/tissue/boundary/boundary_data.h"
#include "tactus/tissue/boundary/time_curve.h"

namespace tactus::boundary {

/// All motions, and time goes on: one thread.
struct StepMotions {
  View<const Motion> motions;
  View<const MotionKey> keys;
  View<double> clock_s;
  View<MotionStep> steps;
  StepTime time;
  TACTUS_HD void load() { time.load(); }

  TACTUS_HD MotionKey at(const Motion& m, double time_s) const {
    const CurvePlace p = place_on_curve(keys, m.begin, m.end, time_s);
    const MotionKey &a = keys[p.before], &b = keys[p.after];
    return {time_s, a.displacement_m + p.share * (b.displacement_m - a.displacement_m),
            a.angle_rad + p.share * (b.angle_rad - a.angle_rad)};
  }
  /// Whole turns are taken off in double: in float many of them would blur the angle.
  TACTUS_HD static Mat3f turned(Vec3f axis, double angle_rad) {
    constexpr double kTurn = 6.283185307179586;
    const double turns = static_cast<double>(floor_to_int(static_cast<float>(angle_rad / kTurn)));
    return rotation_matrix(axis_angle(axis, static_cast<float>(angle_rad - kTurn * turns)));
  }
  TACTUS_HD void operator()(Index) const {
    if (time.stands_still()) return;
    const double dt_s = static_cast<double>(time.dt_s), begin_s = clock_s[0],
                 end_s = time.settles() ? begin_s : begin_s + dt_s;
    for (Index i = 0; i < motions.size(); ++i) {
      const Motion& m = motions[i];
      const MotionKey from = at(m, begin_s), to = at(m, end_s);
      const double angle = to.angle_rad - from.angle_rad;
      const float half = sin_cos(static_cast<float>(0.5 * angle)).sin;
      steps[i] = {.shift_m = vec_cast<float>(to.displacement_m),
                  .turn = turned(m.axis, to.angle_rad),
                  .velocity_m_s = vec_cast<float>((1 / dt_s) * (to.displacement_m - from.displacement_m)),
                  .spin_rad_s = (2.F * half / time.dt_s) * m.axis,
                  .half_turn = turned(m.axis, from.angle_rad + 0.5 * angle),
                  .released = begin_s + 0.5 * dt_s >= m.release_s ? 1 : 0};
    }
    clock_s[0] = end_s;
  }
};

/// A frame begins, unless this is a later part of it.
struct ClearImpulses {
  View<Vec3f> impulse_N_s, moment_N_m_s;
  View<const FrameParams> frame;
  TACTUS_HD void operator()(Index j) const {
    if (frame[0].part == 0) impulse_N_s[j] = moment_N_m_s[j] = {};
  }
};

/// Replaces the solver's position and velocity of a node by those of its motion. The motion's impulse on the
/// body is m (v_motion - v_solver). x+ = x + dt v+ holds for the node as for all others.
struct MoveDriven {
  View<const Index> node, motion;  ///< per driven node
  View<const Vec3f> rest_m;
  View<const float> mass_kg;
  View<const Motion> motions;
  View<const MotionStep> steps;
  View<Vec3f> x_m, v_m_s;       ///< per node of the state
  View<const Index> supported;  ///< per driven node: HeldAxes once it is released
  View<Index> held;             ///< per node of the state: HeldAxes, all while it is driven
  View<Vec3f> impulse_N_s;      ///< on the body, summed
  View<Vec3f> moment_N_m_s;     ///< of that about the motion's pivot, where it is then
  TACTUS_HD void operator()(Index j) const {
    const Index i = node[j];
    const MotionStep& step = steps[motion[j]];
    held[i] = step.released != 0 ? supported[j] : Index{kAllAxes};
    if (step.released != 0) return;
    const Vec3f arm = rest_m[j] - motions[motion[j]].pivot_m;
    const Vec3f v = step.velocity_m_s + cross(step.spin_rad_s, step.half_turn * arm);
    const Vec3f impulse = mass_kg[j] * (v - v_m_s[i]);
    impulse_N_s[j] += impulse;
    moment_N_m_s[j] += cross(step.turn * arm, impulse);
    x_m[i] = rest_m[j] + (step.shift_m + (step.turn * arm - arm));
    v_m_s[i] = v;
  }
};

}  // namespace tactus::boundary
