#pragma once
/// Forces on the surface of a body.
#include "tactus/frame/frame_params.h"
#include "tactus/tissue/boundary/boundary_data.h"
#include "tactus/tissue/boundary/time_curve.h"

namespace tactus::boundary {

/// Factors of all loads at the middle of the substep, and time goes on: one thread.
struct StepLoads {
  View<const LoadCurve> curves;
  View<const LoadKey> keys;
  View<double> clock_s;
  View<float> factor;
  StepTime time;
  TACTUS_HD void load() { time.load(); }
  TACTUS_HD void operator()(Index) const {
    const double dt_s = time.settles() ? 0.0 : static_cast<double>(time.dt_s),
                 now_s = clock_s[0] + 0.5 * dt_s;
    for (Index i = 0; i < curves.size(); ++i) {
      const CurvePlace p = place_on_curve(keys, curves[i].begin, curves[i].end, now_s);
      const double from = keys[p.before].factor;
      factor[i] = static_cast<float>(from + p.share * (keys[p.after].factor - from));
    }
    clock_s[0] += dt_s;
  }
};

/// Force on a cube's part of the surface. An area vector A of the surface at rest is cof(F) A where it is now
/// (Nanson 1878), F at the cube's centre.
struct LoadCubes {
  View<const LoadedCube> loaded;
  View<const float> factor;
  View<const Vec3f> x_m;
  View<Vec3f> force_N;
  float gradient_per_m;  ///< 1 / (4 h)
  TACTUS_HD void operator()(Index i) const {
    const LoadedCube c = loaded[i];
    Vec3f a{}, b{}, d{};
    for (Index q = 0; q < 8; ++q) {
      const Vec3f x = gradient_per_m * x_m[c.nodes.node[q]];
      a += (q & 1) != 0 ? x : -x;
      b += (q & 2) != 0 ? x : -x;
      d += (q & 4) != 0 ? x : -x;
    }
    const Vec3f A = c.pressed_N;
    const Vec3f now = A.x * cross(b, d) + A.y * cross(d, a) + A.z * cross(a, b);
    force_N[i] = factor[c.load] * (c.force_N - now);
  }
};

/// Nodes gather the forces of their cubes' parts, in a fixed order.
struct GatherLoads {
  View<const Index> node, begin;  ///< (loaded nodes + 1) into shares
  View<const LoadShare> shares;
  View<const Vec3f> part_force_N;
  View<Vec3f> f_ext_N;
  TACTUS_HD void operator()(Index j) const {
    Vec3f f{};
    for (Index s = begin[j]; s < begin[j + 1]; ++s) f += shares[s].weight * part_force_N[shares[s].part];
    f_ext_N[node[j]] = f;
  }
};

}  // namespace tactus::boundary
