#include "tactus/tissue/rigid_motion.h"

#include <algorithm>

#include "tactus/tissue/rigid_motion_kernels.h"

namespace tactus {
namespace {

/// 0 where the inertia about some axis is less than 1e-9 of the largest (one node, nodes on a line).
Vec3d spin_of(const Mat3d& inertia, Vec3d angular_momentum) {
  const double trace = inertia(0, 0) + inertia(1, 1) + inertia(2, 2);
  if (!(determinant(inertia) > 1e-9 * trace * trace * trace)) return {};
  return inverse(inertia) * angular_momentum;
}

}  // namespace

RigidMotion rigid_motion(std::span<const MotionSums> sums) {
  MotionSums all;
  for (const MotionSums& sum : sums) all.add(sum);
  RigidMotion motion;
  motion.mass_kg = all.mass_kg;
  motion.kinetic_J = all.kinetic_J;
  motion.low_m = all.low_m;
  motion.high_m = all.high_m;
  if (!(all.mass_kg > 0)) return motion;
  const Vec3d c = all.first_kg_m / all.mass_kg, v = all.momentum_kg_m_s / all.mass_kg;
  motion.center_m = c;
  motion.velocity_m_s = v;
  motion.angular_momentum_kg_m2_s = all.angular_kg_m2_s - all.mass_kg * cross(c, v);
  const double m = all.mass_kg, xx = all.xx - m * c.x * c.x, yy = all.yy - m * c.y * c.y,
               zz = all.zz - m * c.z * c.z;
  const double xy = all.xy - m * c.x * c.y, yz = all.yz - m * c.y * c.z, zx = all.zx - m * c.z * c.x;
  motion.inertia_kg_m2 = {{{yy + zz, -xy, -zx}, {-xy, xx + zz, -yz}, {-zx, -yz, xx + yy}}};
  motion.spin_rad_s = spin_of(motion.inertia_kg_m2, motion.angular_momentum_kg_m2_s);
  return motion;
}

MotionMeter::MotionMeter(ExecContext& ctx, const CubeLattice& lattice, Slab nodes) {
  std::vector<MotionBlock> blocks;
  const auto layer_of = [&](Index node) { return lattice.nodes[static_cast<std::size_t>(node)].z; };
  for (Index begin = nodes.begin; begin < nodes.end;) {
    Index end = begin;
    const bool is_virtual = begin >= lattice.regular_nodes();  // its nodes lie in any layer
    const Index most = is_virtual ? nodes.end : std::min(nodes.end, lattice.regular_nodes());
    while (end < most && end - begin < SumMotion::kNodes && (is_virtual || layer_of(end) == layer_of(begin)))
      ++end;
    blocks.push_back({begin - nodes.begin, end - nodes.begin});
    begin = end;
  }
  const auto first = lattice.node_mass_kg.begin();
  mass_kg_ = to_device(ctx, std::vector<float>(first + nodes.begin, first + nodes.end));
  blocks_ = to_device(ctx, blocks);
  sums_ = to_device(ctx, std::vector<MotionSums>(blocks.size()));
}

void MotionMeter::measure(ExecContext& ctx, View<const Vec3f> x_m, View<const Vec3f> v_m_s) {
  ctx.parallel_for("motion/sums", blocks_.size(),
                   SumMotion{x_m, v_m_s, mass_kg_.const_view(), blocks_.const_view(), sums_.view()});
}

}  // namespace tactus
