#pragma once
/// Moments of a body's nodes, which give its motion as a whole.
#include "tactus/base/vec.h"

namespace tactus {

/// Moments of some nodes about the world's origin.
struct MotionSums {
  double mass_kg = 0, kinetic_J = 0;
  Vec3d first_kg_m, momentum_kg_m_s, angular_kg_m2_s;
  double xx = 0, yy = 0, zz = 0, xy = 0, yz = 0, zx = 0;       ///< second moments [kg m^2]
  Vec3d low_m{kFar, kFar, kFar}, high_m{-kFar, -kFar, -kFar};  ///< box
  static constexpr double kFar = 1e30;

  TACTUS_HD void add_node(double m, Vec3d x, Vec3d v) {
    mass_kg += m;
    kinetic_J += 0.5 * m * dot(v, v);
    first_kg_m = first_kg_m + m * x;
    momentum_kg_m_s = momentum_kg_m_s + m * v;
    angular_kg_m2_s = angular_kg_m2_s + m * cross(x, v);
    xx += m * x.x * x.x, yy += m * x.y * x.y, zz += m * x.z * x.z;
    xy += m * x.x * x.y, yz += m * x.y * x.z, zx += m * x.z * x.x;
    low_m = min(low_m, x);
    high_m = max(high_m, x);
  }
  TACTUS_HD void add(const MotionSums& o) {
    mass_kg += o.mass_kg;
    kinetic_J += o.kinetic_J;
    first_kg_m = first_kg_m + o.first_kg_m;
    momentum_kg_m_s = momentum_kg_m_s + o.momentum_kg_m_s;
    angular_kg_m2_s = angular_kg_m2_s + o.angular_kg_m2_s;
    xx += o.xx, yy += o.yy, zz += o.zz;
    xy += o.xy, yz += o.yz, zx += o.zx;
    low_m = min(low_m, o.low_m);
    high_m = max(high_m, o.high_m);
  }
};

/// Nodes [begin, end) of one layer of a lattice, at most SumMotion::kNodes.
struct MotionBlock {
  Index begin = 0, end = 0;
};

}  // namespace tactus
