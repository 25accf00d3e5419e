#pragma once
/// Contact as Shao et al. 2019 write it [P 16-25], with the repairs of docs/concepts/contact.md: points of a
/// body are particles of a liquid, samples of the real surface are its boundary.
#include "tactus/contact/real/sample_kernels.h"
#include "tactus/contact/response_kernels.h"

namespace tactus {

/// Wendland's C2 kernel, which ends at h.
struct PaperKernel {
  float h_m;
  TACTUS_HD float operator()(float r_m) const {
    const float q = min(r_m / h_m, 1.F), t = 1 - q;
    return scale() * t * t * t * t * (1 + 4 * q);
  }
  /// -dW/dr / r
  TACTUS_HD float slope_over_r(float r_m) const {
    const float t = 1 - min(r_m / h_m, 1.F);
    return scale() * 20 / (h_m * h_m) * t * t * t;
  }

 private:
  TACTUS_HD float scale() const { return 21 / (2 * kPi * h_m * h_m * h_m); }
};

/// V_k = 1 / sum_l W(x_kl) (Akinci et al. 2012).
struct PaperVolumes {
  static constexpr int kGrain = 64;
  SamplesView samples;
  PaperKernel kernel;
  View<float> volume_m3;
  TACTUS_HD void operator()(Index k) const {
    float sum = 0;
    samples.for_each_near(samples.x_m[k],
                          [&](Index l) { sum += kernel(length(samples.x_m[l] - samples.x_m[k])); });
    volume_m3[k] = sum > 0.F ? 1 / sum : 0.F;
  }
};

/// Contact of one point with all samples near it. Its mass is rho0 d^3, with d the spacing of the lattice, so
/// neither it nor rho0 matters.
struct PaperContact {
  static constexpr int kGrain = 32;
  SamplesView samples;
  View<const float> volume_m3;
  View<const SurfacePoses> poses;
  TouchingPoints body;
  PaperKernel kernel, near;  ///< ending at h, and at the d of the correction
  float friction, particle_m3;
  SubstepsTo now;
  float dt_s = 0;
  Index pose = 0;
  TACTUS_HD void load() { now.load(); }

  /// Sums over the samples of a component, in its coordinates at its capture: terms of the forces,
  struct Forces {
    float density = 0;  ///< over rho0
    Vec3f slope;        ///< sum of V_k grad W
    Vec3f drag;         ///< sum of 2 V_k (r . grad W) / (r^2 + .01 h^2) v_ik
    float rate = 0;     ///< sum of its coefficients
  };
  /// and the samples that the point has gone through: sums weighted by V_k W(r, d).
  struct Penetrated {
    Vec3f x_m, n;
    float weight = 0, volume_m3 = 0;
  };

  TACTUS_HD void operator()(Index i) const {
    if (body.nodes.has_stopped()) return;
    PaperContact one = *this;
    one.dt_s = now.since_s(i);
    one.pose = now.pose(i);
    one.touch_all(i);
  }

 private:
  TACTUS_HD void touch_all(Index i) const {
    const EmbeddedPoint& point = body.table.points[i];
    if (!body.moves(point)) return;
    const Vec3f x = body.position(point), v = body.velocity(point);
    PointContact best{x, {}, {}, 0, -1, {}, x};
    for (Index k = 0; k < poses[pose].count; ++k) touch(k, x, v, best);
    const bool touches = best.collider >= 0;
    if (touches) body.state.contact[i] = best;
    body.set_touching(i, point, touches ? 1 : 0);
  }
  TACTUS_HD void touch(Index k, Vec3f x, Vec3f v, PointContact& best) const {
    const SurfacePose& surface = poses[pose].component[k];
    const Vec3f p = surface.to_capture(x), rel = transpose(surface.turn) * (v - surface.velocity_at(x));
    if (!surface.may_touch(p, kernel.h_m)) return;
    const Forces forces = forces_of(k, p, rel);
    if (!(forces.density > 0.F)) return;
    const Vec3f velocity_correction = correction_of(forces);
    const Penetrated hit = penetrated(k, p, rel + velocity_correction);
    Vec3f push{}, moved = velocity_correction, n{};
    float depth = 0;
    if (hit.weight > 0.F) {
      n = normalized(hit.n, {0, 1, 0});
      const Vec3f middle = (1 / hit.weight) * hit.x_m;
      push = middle + near.h_m * n - p;  // [P 21]
      depth = max(0.F, -dot(p - middle, n));
      // [P 24-25]: the velocity that the real object's mass carries is added; where it rests, the approach
      // stays.
      const float share = hit.volume_m3 / hit.weight / particle_m3;
      moved += share * (transpose(surface.turn) * surface.velocity_at(x));
    }
    if (dot(push, push) + dot(moved, moved) == 0.F) return;
    const Vec3f world_push = surface.turn * push;
    best.position_correction_m += world_push;
    best.velocity_correction_m_s += surface.turn * moved;
    best.x_m += world_push;
    best.depth_m = max(best.depth_m, depth);
    best.n = surface.turn * n;
    best.collider = k;
    best.anchor_m = best.x_m;
  }

  TACTUS_HD Forces forces_of(Index k, Vec3f p, Vec3f rel) const {
    Forces s;
    samples.for_each_near(p, [&](Index l) {
      if (!samples.is_of(poses[pose].own(k), l)) return;
      const Vec3f r = p - samples.x_m[l];
      const float d = length(r);
      if (!(d < kernel.h_m)) return;
      const float slope = kernel.slope_over_r(d), volume = volume_m3[l],
                  drag = 2 * volume * slope * d * d / (d * d + 0.01F * kernel.h_m * kernel.h_m);
      s.density += volume * kernel(d);
      s.slope -= (volume * slope) * r;
      s.drag += drag * rel;
      s.rate += drag;
    });
    return s;
  }
  /// Pressure [P 17] with its kernel's gradient, so that it repels, and friction [P 18] with Brookshaw's
  /// Laplacian, no more than stops the point. A plane surface of the body itself has density 1/2.
  TACTUS_HD Vec3f correction_of(const Forces& s) const {
    const float density = 0.5F + s.density, sound_m_s = 0.2F * kernel.h_m / dt_s;
    const float r2 = density * density, pressure = max(0.F, r2 * r2 * r2 * density - 1.F) / 7;  // of rho0 c^2
    const float push = dt_s * sound_m_s * sound_m_s * pressure / r2,
                rubs = dt_s * friction * sound_m_s * kernel.h_m / r2,
                most = rubs * s.rate > 1.F ? 1 / (rubs * s.rate) : 1.F;
    return -push * s.slope - (rubs * most) * s.drag;
  }
  /// The mean [P 20] of samples nearer than d that the point approaches.
  TACTUS_HD Penetrated penetrated(Index k, Vec3f p, Vec3f rel) const {
    Penetrated s;
    samples.for_each_near(p, [&](Index l) {
      const float d = length(p - samples.x_m[l]);
      if (!(d < near.h_m) || !samples.is_of(poses[pose].own(k), l) || !(dot(rel, samples.n[l]) < 0.F)) return;
      const float w = volume_m3[l] * near(d);
      s.weight += w;
      s.volume_m3 += w * volume_m3[l];
      s.x_m += w * samples.x_m[l];
      s.n += w * samples.n[l];
    });
    return s;
  }
};

}  // namespace tactus
