#include "tactus/tissue/boundary/driven_nodes.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"
#include "tactus/tissue/boundary/motion_kernels.h"

namespace tactus {
namespace {

[[noreturn]] void refuse(const NodeMotion& motion, const std::string& what) {
  throw usage_error(motion.name + ": " + what);
}

void check_keys(const NodeMotion& motion) {
  if (motion.keys.empty()) refuse(motion, "it has no keyframe, expected at least one");
  if (motion.nodes.empty()) refuse(motion, "it moves no node: its region holds none");
  if (!(dot(motion.axis, motion.axis) > 0)) refuse(motion, "its axis is zero, expected a direction");
  double last_s = -1;
  for (std::size_t k = 0; k < motion.keys.size(); ++k) {
    const boundary::MotionKey& key = motion.keys[k];
    const std::string head = "keyframe " + std::to_string(k) + " ";
    if (!std::isfinite(key.time_s + length(key.displacement_m) + key.angle_rad))
      refuse(motion, head + "holds a value that is not a number");
    if (key.time_s < 0) refuse(motion, head + "is at " + number_text(key.time_s) + " s, expected 0 or more");
    if (key.time_s <= last_s)
      refuse(motion, head + "is at " + number_text(key.time_s, last_s) +
                         " s, expected later than the one before, at " + number_text(last_s) + " s");
    last_s = key.time_s;
  }
  const boundary::MotionKey& first = motion.keys.front();
  if (first.time_s == 0 && (length(first.displacement_m) > 0 || first.angle_rad != 0))
    refuse(motion,
           "keyframe 0 moves its nodes at 0 s, all at once; expected a later time, or no displacement");
  if (std::isnan(motion.release_s) || motion.release_s <= 0)
    refuse(motion, "it is released at " + number_text(motion.release_s) + " s, expected a time after 0");
}

/// A node may be on a roller or a plane of symmetry, along which it is moved.
void check_support(const NodeMotion& motion, Index node, HeldAxes held) {
  if (held == 0) return;
  const std::string head = "node " + std::to_string(node) + " of its region is also 'fixed'";
  if (held == kAllAxes) refuse(motion, head + "; expected one of both");
  for (int axis = 0; axis < 3; ++axis) {
    if ((held >> axis & 1) == 0) continue;
    const auto leaves = [&](const boundary::MotionKey& key) {
      return key.displacement_m[axis] != 0 || key.angle_rad != 0;
    };
    if (std::any_of(motion.keys.begin(), motion.keys.end(), leaves))
      refuse(motion, head + " along " + "xyz"[axis] + ", and its motion leaves that; expected no turn, and " +
                         "no displacement along " + "xyz"[axis]);
  }
}

/// Keyframes that begin at rest.
std::vector<boundary::MotionKey> whole_keys(const NodeMotion& motion) {
  std::vector<boundary::MotionKey> keys = motion.keys;
  if (keys.front().time_s > 0) keys.insert(keys.begin(), boundary::MotionKey{});
  return keys;
}

}  // namespace

DrivenNodes::DrivenNodes(ExecContext& ctx, const CubeLattice& lattice, std::span<const NodeMotion> motions,
                         const NodeWindow& window) {
  if (motions.empty()) return;
  std::vector<Index> owner(lattice.nodes.size(), -1), nodes, copies;
  std::vector<boundary::Motion> all;
  std::vector<boundary::MotionKey> keys;
  std::vector<Index> supported;
  std::vector<Vec3f> rest;
  std::vector<float> mass;
  for (const NodeMotion& motion : motions) {
    check_keys(motion);
    const std::vector<boundary::MotionKey> own = whole_keys(motion);
    const auto begin = static_cast<Index>(keys.size());
    keys.insert(keys.end(), own.begin(), own.end());
    all.push_back({begin, static_cast<Index>(keys.size()), vec_cast<float>(normalized(motion.axis)),
                   vec_cast<float>(motion.pivot_m), motion.release_s});
    std::vector<Index> claimed = motion.nodes;
    std::sort(claimed.begin(), claimed.end());
    for (const Index node : claimed) {
      const auto i = static_cast<std::size_t>(node);
      check_support(motion, node, lattice.fixed[i]);
      if (owner[i] >= 0)
        refuse(motion, "node " + std::to_string(node) + " of its region is also in " +
                           motions[static_cast<std::size_t>(owner[i])].name + "; expected regions apart");
      owner[i] = static_cast<Index>(all.size()) - 1;
      if (window.owns(node)) {
        nodes.push_back(node);
        motion_of_node_.push_back(owner[i]);
      } else if (window.holds(node)) {
        copies.push_back(node);
      }
    }
  }
  nodes.insert(nodes.end(), copies.begin(), copies.end());
  std::vector<Index> motion;
  for (Index& node : nodes) {
    const auto i = static_cast<std::size_t>(node);
    motion.push_back(owner[i]);
    supported.push_back(lattice.fixed[i]);
    rest.push_back(lattice.rest_m(node));
    mass.push_back(lattice.node_mass_kg[i]);
    node -= window.held.begin;
  }
  motions_ = to_device(ctx, all);
  keys_ = to_device(ctx, keys);
  steps_ = to_device(ctx, std::vector<boundary::MotionStep>(all.size()));
  clock_s_ = to_device(ctx, std::vector<double>{0});
  nodes_ = to_device(ctx, nodes);
  motion_ = to_device(ctx, motion);
  supported_ = to_device(ctx, supported);
  rest_m_ = to_device(ctx, rest);
  mass_kg_ = to_device(ctx, mass);
  for (Buffer<Vec3f>* sums : {&impulse_N_s_, &moment_N_m_s_})
    *sums = to_device(ctx, std::vector<Vec3f>(nodes.size()));
}

void DrivenNodes::begin_frame(ExecContext& ctx, View<const FrameParams> frame) {
  if (empty()) return;
  if (!frame.empty()) {
    ctx.parallel_for("driven/clear", nodes_.size(),
                     boundary::ClearImpulses{impulse_N_s_.view(), moment_N_m_s_.view(), frame});
    return;
  }
  ctx.fill_bytes(impulse_N_s_.view(), 0);
  ctx.fill_bytes(moment_N_m_s_.view(), 0);
}

void DrivenNodes::move(ExecContext& ctx, BodyState& state, View<Index> held, const StepTime& time) {
  if (empty()) return;
  ctx.parallel_for(
      "driven/step", 1,
      boundary::StepMotions{motions_.const_view(), keys_.const_view(), clock_s_.view(), steps_.view(), time});
  ctx.parallel_for("driven/move", nodes_.size(),
                   boundary::MoveDriven{nodes_.const_view(), motion_.const_view(), rest_m_.const_view(),
                                        mass_kg_.const_view(), motions_.const_view(), steps_.const_view(),
                                        state.x_m.view(), state.v_m_s.view(), supported_.const_view(), held,
                                        impulse_N_s_.view(), moment_N_m_s_.view()});
}

void DrivenNodes::add_means(ExecContext& ctx, const Buffer<Vec3f>& sums, double dt_frame_s,
                            std::span<Vec3d> of_motion) const {
  if (empty() || !(dt_frame_s > 0)) return;
  const std::vector<Vec3f> of_node = to_host(ctx, sums.const_view());
  for (std::size_t j = 0; j < motion_of_node_.size(); ++j)
    of_motion[static_cast<std::size_t>(motion_of_node_[j])] +=
        (1 / dt_frame_s) * vec_cast<double>(of_node[j]);
}

FastestMove fastest_move(const CubeLattice& lattice, const NodeMotion& motion, double from_s, double to_s) {
  const Vec3d axis = normalized(motion.axis);
  double arm_m = 0;
  for (const Index node : motion.nodes)
    arm_m = std::max(arm_m, length(cross(axis, vec_cast<double>(lattice.rest_m(node)) - motion.pivot_m)));
  FastestMove fastest;
  boundary::MotionKey before;
  for (std::size_t k = 0; k < motion.keys.size(); ++k) {
    const boundary::MotionKey& key = motion.keys[k];
    const double moved_m = length(key.displacement_m - before.displacement_m) +
                           arm_m * std::abs(key.angle_rad - before.angle_rad);
    const bool overlaps = before.time_s < to_s && key.time_s > from_s;
    if (overlaps && key.time_s > before.time_s && moved_m > fastest.speed_m_s * (key.time_s - before.time_s))
      fastest = {moved_m / (key.time_s - before.time_s), k};
    before = key;
  }
  return fastest;
}

}  // namespace tactus
