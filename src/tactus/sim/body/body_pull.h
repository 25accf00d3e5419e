#pragma once
/// A spring between a point of a body and a target, on every device that steps a slab of it.
#include <deque>
#include <optional>

#include "tactus/frame/frame_on_devices.h"
#include "tactus/frame/state_archive.h"
#include "tactus/sim/body/body_point.h"
#include "tactus/tissue/boundary/boundary_data.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus {

struct PullSettings {
  Vec3d target_m;  ///< world; where the point was when it was attached, nothing pulls
  double stiffness_N_m = 0, max_force_N = 0;
};

/// The spring is shared among the nodes near the point, by mass and distance, so it strains no single cube.
/// A node's own spring depends on that node alone, so slabs exchange nothing of it.
class BodyPull {
 public:
  /// At most so many nodes share it.
  static constexpr Index kMostNodes = 256;

  /// Nothing can be pulled.
  BodyPull() = default;
  /// @param tissue must outlive this
  explicit BodyPull(BodySolver& tissue);

  bool can_pull() const { return !parts_.empty(); }
  /// Whether pull() submits its kernel.
  void set_active(bool is_active) { is_active_ = is_active; }
  bool is_attached() const { return !nodes_.empty(); }
  /// The nodes within a radius of the point at rest share it from now on, those that cuts don't part from it.
  /// @param x_m of all nodes of the body. Synchronizes.
  void attach(const CubeLattice& lattice, const BodyPoint& point, double radius_m,
              std::span<const Vec3f> x_m);
  void release();
  const BodyPoint& point() const { return point_; }
  /// Before a frame: impulses count from here. Asynchronous.
  void begin_frame(const PullSettings& settings);
  /// After substep k of a block. Asynchronous.
  void pull(int k, const FrameOnDevices& frame);
  /// Mean force on the body since begin_frame [N]. Synchronizes.
  Vec3d mean_force_N(double dt_frame_s) const;
  /// @throws Error when the archive is another body's.
  void archive(StateArchive& a);

 private:
  /// As the body counts nodes.
  struct Shared {
    Index node = 0, layer = 0;
    float weight = 0, inverse_mass_per_kg = 0;
    Vec3f offset_m;
  };
  struct Part {
    Buffer<boundary::Pull> pull;
    Buffer<boundary::PulledNode> nodes;
    Buffer<Vec3f> impulse_N_s;
    std::vector<Index> own;  ///< of the pulled nodes here
    boundary::Pull sent;     ///< while it is sent
  };
  void send_nodes();

  BodySolver* tissue_ = nullptr;
  bool is_active_ = false;
  BodyPoint point_;
  std::vector<Shared> nodes_;
  std::deque<Part> parts_;  ///< per slab
};

}  // namespace tactus
