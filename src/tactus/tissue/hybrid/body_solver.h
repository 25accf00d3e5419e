#pragma once
/// The solver of one body, on one device or many.
#include <array>
#include <memory>
#include <optional>

#include "tactus/frame/frame_on_devices.h"
#include "tactus/frame/readback.h"
#include "tactus/multi_device/halo.h"
#include "tactus/tissue/boundary/boundary.h"
#include "tactus/tissue/hybrid/hybrid.h"
#include "tactus/tissue/node_check.h"
#include "tactus/tissue/rigid_motion.h"

namespace tactus {

/// A body cut into slabs of layers along z, one for each device, each with a few layers of its neighbours'
/// nodes; its motions and loads act on each slab's own nodes. A substep begins with pulling the others, or
/// ends with it where contact follows. The same bits on any number of devices.
///
/// Elements that nothing moves or loads stay in their cells, contact or not. Without it, nodes at the cuts
/// move first, and are pulled for the next substep while the others move.
class BodySolver {
 public:
  struct Settings {
    /// As many as these, or matched nodes that cost as much, are in each slab, or there are fewer; absent:
    /// kLeast... on GPUs, none elsewhere.
    std::optional<double> least_elements = std::nullopt;
    int changes =
        0;  ///< so many times after each substep others change the nodes, as contact does (SlabNodes)
  };
  /// A body too small for all devices is on the first few, small ones on the first. @throws Error as Hybrid.
  BodySolver(DeviceSet& devices, const BodyModel& model, const Settings& settings);
  /// With fewer, a second H200 costs more in waiting than it saves. Between rows of bench/results: n million
  /// elements take 3 + 44 n us on one and 12 + 20 n us on two, equal at 0.4; matched nodes 16 + 443 n and 30
  /// + 262 n, equal at 0.07; fig20's bodies of both are equal at 93,000 nodes (7:3) and 36,000 (3:7), which
  /// cost as much as 0.26 and 0.19 million elements.
  static constexpr double kLeastElements = 200000, kLeastMatched = 36000, kLeastOfBoth = 110000;

  // A frame is begin_frame, begin_substeps, blocks of substeps, end_substeps, end_frame. All of them are
  // asynchronous and need no host; each, and each block, may be recorded on its own (DeviceReplay).

  /// From now on, kernels read the step, gravity, and number of a substep from here.
  void follow(const FrameOnDevices& frame) { frame_ = &frame; }
  /// Clears the forces of the motions and the results of the check of nodes.
  void begin_frame();
  /// Nodes that only elements and contact change go to the cells in which elements step them.
  void begin_substeps();
  /// Substep k of a block of `count`. Blocks begin after an even number of substeps, and after a multiple of
  /// matching_every.
  void substep(const BodyStep& step, int k, int count);
  /// After substep k of the frame's `count`, or with follow(), of a block: notes which nodes diverged. The
  /// last check is end_frame's.
  void check_nodes(int k, int count);
  /// Diverged nodes are looked for after so many substeps: of elements alone four, as a check costs a
  /// twentieth of such a substep; else before shapes are matched, which carries them to whole regions.
  int check_every() const { return model().flsm() ? matching_every_ : 4; }
  /// And come back. `count` substeps were made; with follow(), the device knows.
  void end_substeps(int count);
  /// Checks nodes after the last substep, measures how strained the elements are, and brings all nodes to the
  /// first device.
  void end_frame(int count);
  /// begin_substeps, one block, end_substeps; nodes are checked if the body is moved or loaded.
  void step(const BodyStep& step, int count = 1);

  /// The records that end_frame leaves for the host are read back with the frame's others.
  void add_reports(Readback& readback);
  /// Results of the checks since begin_frame: the earliest bad node, of several the lowest. Without a
  /// readback, the devices are asked, which synchronizes.
  NodeCheckRecord node_check(const Readback* readback = nullptr);
  /// How strained the elements were at the last end_frame; likewise.
  tled::CubeExtremes extremes(const Readback* readback = nullptr);
  /// From now on the body stays where it is, under any forces. With follow() only. Synchronizes.
  void stop();
  /// Motion of the whole body at the last end_frame; the same on any number of devices; likewise.
  RigidMotion rigid_motion(const Readback* readback = nullptr);
  /// How fast the body turns as a whole in the coming frame: this turning is not damped
  /// (tissue/rigid_motion.h finds it). It has no effect on a body with fixed nodes. Asynchronous.
  void set_spin(Vec3d spin_rad_s);
  /// Mean force of each motion on the body since begin_frame, and mean torque about the motion's pivot where
  /// it is then.
  struct MotionForces {
    std::vector<Vec3d> forces_N, torques_N_m;  ///< per motion, in the model's order
  };
  /// Synchronizes.
  MotionForces motion_forces(double dt_frame_s) const;
  /// All nodes of the body on the first device, as end_frame left them; where that is the only device, the
  /// state that it steps.
  const BodyState& body() const { return parts_.size() == 1 ? parts_.front()->state : body_; }
  /// Solver on the first device: its limits of steps hold for the body.
  const Hybrid& model() const { return parts_.front()->tissue; }
  const Boundary& boundary() const { return parts_.front()->boundary; }

  int slab_count() const { return static_cast<int>(parts_.size()); }
  /// Nodes of a slab, for solvers that change them after begin_substeps and after each substep. Then all
  /// nodes that it holds are up to date, and they are pulled only after the next substep. So a solver changes
  /// them in all of changed_layers, as their owners do. The nodes that a change depends on are at most
  /// kShared layers away; so many more are held for each change.
  struct SlabNodes {
    ExecContext& ctx;
    Index count = 0;            ///< of places where a node may be
    View<Vec3f> x_m, v_m_s;     ///< per place
    NodeFields fields;          ///< or places are cells, and nodes are here: where they never leave them
    View<const Index> held;     ///< per place: HeldAxes, also of nodes driven now
    View<const Index> stopped;  ///< (1) != 0: the body stays where it is
    Slab own_layers, changed_layers;  ///< of the body
  };
  static constexpr Index kShared = 2;
  /// @param k after substep k of a block, or -1: before its first
  SlabNodes slab(int p, int k = -1);
  /// Place of a node of the body that lies in `layer`; -1: it is not there.
  Index find(int p, Index node, Index layer) const;
  float stable_step_s() const { return parts_.front()->tissue.stable_step_s(); }
  /// @param x_m,v_m_s per node of the body. Synchronizes.
  void set_state(std::span<const Vec3f> x_m, std::span<const Vec3f> v_m_s);
  /// A cut, between frames: its new nodes and copies take places that the body's lattice has capacity for.
  /// New nodes begin where those are that they were split from, copies take over their cubes' history. No
  /// address changes, so recordings stay valid. Synchronizes. @throws Error before anything is changed: no
  /// capacity, a shape-matched cube is cut.
  void apply(const TopologyChange& change);
  /// As Tled's, on all devices.
  void scale_stiffness(float scale) {
    for (const auto& part : parts_) part->tissue.scale_stiffness(scale);
  }
  /// State of a body that is not cut; slabs and devices must be the same. Synchronizes.
  void archive(StateArchive& a);
  /// State of all nodes of the body, on the host. Synchronizes.
  std::vector<Vec3f> positions_m();
  std::vector<Vec3f> velocities_m_s();

 private:
  struct Part {
    Part(ExecContext& ctx, Hybrid of_layers, const BodyModel& model);
    template <class T>
    View<const T> own(const Buffer<T>& of_state) const {
      return of_state.const_view().part(tissue.window().own.begin, tissue.window().own.count());
    }
    void check_in_cells(int k, View<const FrameParams> frame, int every) {
      const auto cells = [&](Slab of) { return tissue.tled().cell().part(of.begin, of.count()); };
      const NodeFields fields = tissue.tled().fields(k + 1);
      node_check.check(ctx, cells(tissue.window().own), fields, k, frame, every);
      if (virtual_check)
        virtual_check->check(ctx, cells(tissue.window().virtual_nodes), fields, k, frame, every);
    }
    void check_now(int k, View<const FrameParams> frame, int every) {
      node_check.check(ctx, tissue.own_in_use(), own(state.x_m), own(state.v_m_s), own(tissue.only_matched()),
                       k, frame, every);
      if (!virtual_check) return;
      const Slab virtual_nodes = tissue.window().virtual_nodes;
      virtual_check->check(
          ctx, virtual_nodes.count(), state.x_m.const_view().part(virtual_nodes.begin, virtual_nodes.count()),
          state.v_m_s.const_view().part(virtual_nodes.begin, virtual_nodes.count()), {}, k, frame, every);
    }
    /// Values of the nodes that it holds, picked from those of all nodes of the body.
    std::vector<Vec3f> held(std::span<const Vec3f> of_body) const;
    Index first_own() const { return tissue.window().held.begin + tissue.window().own.begin; }
    ExecContext& ctx;
    ExecContext beside;  ///< for the interior
    Hybrid tissue;
    Boundary boundary;
    NodeCheck node_check;
    std::optional<NodeCheck> virtual_check;  ///< of several parts, where there is capacity for a cut
    MotionMeter motion;
    Buffer<Vec3f> spin_rad_s;  ///< one
    BodyState state;           ///< of the window
    Event moved, virtual_moved, interior_moved;
    Buffer<Index> stopped;        ///< (1)
    std::vector<Index> cell_of;   ///< per node, where they are changed in cells
    Buffer<Index> held_in_cells;  ///< likewise, per cell
    Readback::Place check_report, virtual_check_report, motion_report, extremes_report;
    std::optional<ChangeLists> change;  ///< where there is capacity for a cut
  };
  /// Virtual nodes of a body on several devices, on the first.
  struct VirtualElementsOfAll {
    VirtualElementsOfAll(ExecContext& ctx, const CubeLattice& lattice, const std::vector<Slab>& slabs);
    void take(ExecContext& ctx, Index part, View<const Vec3f> x_m, View<const Vec3f> v_m_s, BodyState& to);
    void apply(ExecContext& ctx, const TopologyChange& change, std::span<const std::unique_ptr<Part>> parts,
               BodyState& gathered);
    Index first;  ///< node of the body
    MotionMeter motion;
    std::vector<Index> owner;  ///< per node: part
    Buffer<Index> device_owner;
    std::array<Buffer<Vec3f>, 2> copy;  ///< of a part's region: x, v
    Readback::Place motion_report;
  };
  void link_neighbours();
  /// Adds a link of nodes and, where they are in cells, one of the cells.
  void add_link(const HaloLink& nodes, std::vector<HaloLink>& node_links, std::vector<HaloLink>& cell_links);
  template <class F>
  void for_each_slab(F&& body) {
    for (int p = 0; p < slab_count(); ++p) body(p);
  }
  /// Fields of a part that neighbours read: nodes, or in cells positions ahead.
  auto nodes() {
    return [this](int part) {
      BodyState& state = parts_[static_cast<std::size_t>(part)]->state;
      return std::array{state.x_m.view(), state.v_m_s.view()};
    };
  }
  auto cells(int k) {
    return [this, k](int part) {
      Tled& tled = parts_[static_cast<std::size_t>(part)]->tissue.tled();
      const View<float> predicted_m = tled.predicted_m(k);
      const Index n = tled.cells();
      return std::array{predicted_m.part(0, n), predicted_m.part(n, n), predicted_m.part(2 * n, n)};
    };
  }
  /// The same with velocities.
  auto cell_nodes(int k) {
    return [this, k](int part) {
      const NodeFields f = parts_[static_cast<std::size_t>(part)]->tissue.tled().fields(k);
      const auto field = [&](const View<float>& of, Index a) { return of.part(a * f.cells, f.cells); };
      return std::array{field(f.predicted_m, 0), field(f.predicted_m, 1), field(f.predicted_m, 2),
                        field(f.v_m_s, 0),       field(f.v_m_s, 1),       field(f.v_m_s, 2)};
    };
  }
  /// Whether nodes are in cells from the first substep to the last: there they are held along all axes or
  /// none.
  bool stays_in_cells() const { return !has_boundary_ && changes_ <= 1 && !model().flsm(); }
  /// And others change them there.
  bool is_changed_in_cells() const { return stays_in_cells() && changes_ > 0; }
  void substep_in_cells(const BodyStep& step, int k, int count);
  void changed_substep_in_cells(const BodyStep& step, int k);
  void keep_places(const CubeLattice& lattice);
  View<const FrameParams> frame_of(std::size_t part) const {
    return frame_ != nullptr ? frame_->view(static_cast<int>(part)) : View<const FrameParams>{};
  }
  void check_now(int k, int every);
  void pull_nodes();
  /// As one device reads it.
  BodyStep on_part(const BodyStep& step, std::size_t part, int k) const;
  std::vector<Vec3f> all_of(Buffer<Vec3f> BodyState::*field);

  DeviceSet& devices_;
  std::vector<std::unique_ptr<Part>> parts_;
  std::optional<Halo<Vec3f, 2>> node_halo_;
  std::optional<Halo<float, 3>> cell_halo_;
  std::optional<Halo<float, 6>> changed_cell_halo_;
  std::size_t motion_count_;
  bool has_boundary_, is_free_;
  int changes_;
  int matching_every_ = 1;             ///< of the latest substep
  std::array<Vec3f, 1> spin_rad_s_{};  ///< sent to the devices
  const FrameOnDevices* frame_ = nullptr;
  BodyState body_;                                        ///< x and v, of several parts
  std::optional<VirtualElementsOfAll> virtual_elements_;  ///< likewise, where there is capacity for one
  Event stored_;
};

}  // namespace tactus
