#pragma once
/// Prescribed nodes: boundary conditions of displacement over time.
#include <limits>
#include <string>

#include "tactus/frame/frame_params.h"
#include "tactus/frame/state_archive.h"
#include "tactus/tissue/body_state.h"
#include "tactus/tissue/boundary/boundary_data.h"

namespace tactus {

/// Motion that some nodes of a body follow from rest on, linear between keyframes; the last one holds.
struct NodeMotion {
  std::string name;                       ///< for messages
  std::vector<boundary::MotionKey> keys;  ///< times >= 0, increasing; before the first, from rest at 0
  Vec3d axis{0, 1, 0};                    ///< of the angles, world, any length > 0
  Vec3d pivot_m;                          ///< stays on the axis, world
  double release_s = std::numeric_limits<double>::infinity();  ///< nodes are free from then on
  std::vector<Index> nodes;
};

/// Moves nodes of one body, with any solver, on the device and without the host. After each substep:
///
///   tissue.step(ctx, state, ..);            // as if they were free
///   driven.move(ctx, state, held, time);
///
/// Elements and regions see position and velocity of these nodes in the next substep, so the nodes act on the
/// body (viscous forces included) as free nodes in that motion would.
class DrivenNodes {
 public:
  DrivenNodes() = default;
  /// @param window of the state; of the nodes that the motions name, its own are driven. Its copies of others
  /// are let go when their owners let go of them.
  /// @throws Error naming motion and key for keyframes out of order, a jump at 0 s, numbers that aren't, a
  /// node that two motions claim, that is fixed, or that would leave its support.
  DrivenNodes(ExecContext& ctx, const CubeLattice& lattice, std::span<const NodeMotion> motions,
              const NodeWindow& window);

  bool empty() const { return nodes_.empty(); }
  /// State that it keeps from frame to frame.
  void archive(ExecContext& ctx, StateArchive& a) {
    if (!motions_.empty()) a.buffer(ctx, "time of what moves", clock_s_);
  }
  /// Forces count from here; with `frame`, only in its first part. Asynchronous.
  void begin_frame(ExecContext& ctx, View<const FrameParams> frame = {});
  /// The end of a substep. @param held per node of the state: HeldAxes, all as long as it is driven.
  /// Asynchronous.
  void move(ExecContext& ctx, BodyState& state, View<Index> held, const StepTime& time);
  /// Adds the force of each motion on its nodes here, mean since begin_frame [N]: reaction, weight and
  /// inertia. Node after node: parts of a body, in order, come to the same bits as the whole. Synchronizes.
  void add_mean_forces_N(ExecContext& ctx, double dt_frame_s, std::span<Vec3d> of_motion) const {
    add_means(ctx, impulse_N_s_, dt_frame_s, of_motion);
  }
  /// Likewise, the torque about the motion's pivot where it is then [N m].
  void add_mean_torques_N_m(ExecContext& ctx, double dt_frame_s, std::span<Vec3d> of_motion) const {
    add_means(ctx, moment_N_m_s_, dt_frame_s, of_motion);
  }

 private:
  void add_means(ExecContext& ctx, const Buffer<Vec3f>& sums, double dt_frame_s,
                 std::span<Vec3d> of_motion) const;
  std::vector<Index> motion_of_node_;  ///< of own nodes, which come first
  Buffer<boundary::Motion> motions_;
  Buffer<boundary::MotionKey> keys_;
  Buffer<boundary::MotionStep> steps_;
  Buffer<double> clock_s_;
  Buffer<Index> nodes_, motion_, supported_;
  Buffer<Vec3f> rest_m_, impulse_N_s_, moment_N_m_s_;
  Buffer<float> mass_kg_;
};

/// Fastest node of a motion [m/s], and the keyframe (from 0) at whose end it is that fast.
struct FastestMove {
  double speed_m_s = 0;
  std::size_t key = 0;
};
/// @param from_s,to_s of the motion
FastestMove fastest_move(const CubeLattice& lattice, const NodeMotion& motion, double from_s = 0,
                         double to_s = std::numeric_limits<double>::infinity());

}  // namespace tactus
