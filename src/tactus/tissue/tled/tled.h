#pragma once
/// Total Lagrangian explicit dynamics (Miller et al. 2007; [P 3-7]) on cube lattices.
#include <array>
#include <optional>
#include <span>

#include "tactus/frame/frame_params.h"
#include "tactus/frame/state_archive.h"
#include "tactus/geom/arrays/vector_fields.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/tissue/body_state.h"
#include "tactus/tissue/tled/elastic_material.h"
#include "tactus/tissue/tled/tled_data.h"
#include "tactus/tissue/tled/virtual_elements.h"
#include "tactus/tissue/topology_on_device.h"

namespace tactus {

namespace tled {
struct LoadPositions;
struct MoveNodes;
}  // namespace tled

struct TledStep {
  float dt_s = 1e-4F;
  Vec3f gravity_m_s2{0, -9.81F, 0};
  float drag_per_s = 0;  ///< damps all motion, falling, too: for settling only
  /// When given, dt_s and gravity are read from here when the kernels run.
  View<const FrameParams> frame = {};
  View<const Index> stopped = {};  ///< (1) with `frame`; != 0: the body stays where it is
  /// One: how fast the body turns as a whole, which is not damped; none: it does not.
  View<const Vec3f> spin_rad_s = {};
  Index in_block = 0;  ///< with `frame`: which substep of its block
  StepTime time() const { return {dt_s, gravity_m_s2, frame, stopped, spin_rad_s, in_block}; }
};

/// Solver of one body, or of the part of it that is made of elements, or of some layers of it, on one device.
/// Between two steps, callers may change x and v (contact does). Regular cubes are in dense tiles, copies of
/// cut ones in virtual elements.
class Tled {
 public:
  static constexpr std::uint8_t kNoElement = 255;

  /// @param materials at most 255
  /// @param material_of_cube index into materials, or kNoElement; empty: all 0
  /// @param own layers of nodes to move; those around are moved by other devices (BodySolver)
  /// @throws Error naming a field or cube that is out of range.
  Tled(ExecContext& ctx, const CubeLattice& lattice, std::span<const ElasticMaterial> materials,
       std::span<const std::uint8_t> material_of_cube = {}, const TledOptions& options = {},
       std::optional<Slab> own = std::nullopt);

  /// Internal forces of all nodes [N] for the positions damping_time_s() ahead. Stresses relax for a step of
  /// `time`; without one not at all. Asynchronous.
  void compute_forces(ExecContext& ctx, const BodyState& state, const StepTime& time = {});
  /// Likewise, for solvers that ask for them node by node: forces().
  void find_forces(ExecContext& ctx, const BodyState& state, const StepTime& time);
  /// @throws Error when dt_s exceeds stable_step_s(), naming the limit.
  void check_step(float dt_s) const;
  /// So many substeps of a body whose cubes are all elements, after check_step. Nodes are held along all axes
  /// or none (Hybrid has rollers). Asynchronous. Between calls, positions are rounded once more than between
  /// substeps.
  void step(ExecContext& ctx, BodyState& state, const TledStep& step, int count = 1);

  /// Substeps in pieces, for a solver that exchanges nodes with other devices: load once; then for k = 0, 1,
  /// .. move the virtual elements, then the edges and the interior, in any order or at once, each node's
  /// neighbours having been moved by k - 1; store after `count` moves. Between, nodes are in cells only.
  enum class Tiles : std::uint8_t {
    all,
    edges,     ///< own nodes that other devices read
    interior,  ///< those that depend on no other device's
  };
  void load(ExecContext& ctx, const BodyState& state);
  void move_virtual(ExecContext& ctx, const TledStep& step, int k);
  void move(ExecContext& ctx, const TledStep& step, int k, Tiles which);
  /// @param frame when given, it says how many moves there were
  void store(ExecContext& ctx, BodyState& state, int count, View<const FrameParams> frame = {});
  /// Where move(k) finds positions ahead [m]: three fields over cells.
  View<float> predicted_m(int k) { return predicted_m_[static_cast<std::size_t>(k % 2)].view(); }
  /// Nodes before move(k).
  NodeFields fields(int k) { return {predicted_m(k), v_m_s_.view(), grid_.cells, damping_time_s_}; }

  /// The step that step() accepts. Until measure_stable_step it is guaranteed: no smaller lattice of these
  /// materials and no deformation up to the monitor's margin has a smaller critical step than min h sqrt(rho
  /// / (3 lambda + 2 mu)), less the share that damping costs.
  float stable_step_s() const { return stable_step_s_; }
  /// 0.95 of 2/omega_max of this body at rest, by power iteration; becomes stable_step_s(). Not for bodies
  /// that will be cut. Synchronizes.
  float measure_stable_step(ExecContext& ctx, const CubeLattice& lattice, int iterations = 300);
  /// Looks how strained its cubes are, of a cut body those between an own layer of nodes and the next. Its
  /// result is read later, and kept until it looks again. Asynchronous.
  void find_extremes(ExecContext& ctx, const BodyState& state);
  /// (1) Result of find_extremes; cubes are counted from first_own_cube().
  View<const tled::CubeExtremes> extremes() const { return worst_.const_view(); }
  Index first_own_cube() const { return own_cubes_.begin; }
  /// Cubes as the lattice counts them. Synchronizes.
  tled::CubeExtremes extremes(ExecContext& ctx) const {
    return to_host(ctx, extremes())[0].counted_from(own_cubes_.begin);
  }
  /// Substeps that keep within stable_step_s() when waves are faster than at rest by this ratio.
  int substeps_for(float dt_frame_s, float speed_ratio = 1) const;
  float damping_time_s() const { return damping_time_s_; }
  /// Between frames: all cubes are so many times as stiff as they were built, 1: as built. Times of damping
  /// and of added relaxation follow the waves, which are faster by the square root. A recorded frame must be
  /// recorded anew. @throws Error unless it is positive.
  void scale_stiffness(float scale);

  Index node_count() const { return cell_.size(); }
  /// Nodes up to the last one that is in use, of those that there is capacity for.
  Count nodes_in_use() const {
    return virtual_elements_.has_capacity() ? virtual_elements_.nodes_in_use() : node_count();
  }
  /// Forces of the last compute_forces, on the host. Synchronizes.
  std::vector<Vec3f> forces_N(ExecContext& ctx) const;

  /// After find_forces. Of node i in cell()[i].
  tled::SummedForces forces() const { return virtual_elements_.forces(f_N_.view(), grid_.cells); }
  View<const Index> cell() const { return cell_.view(); }
  Index cells() const { return grid_.cells; }

  /// State that it keeps from frame to frame: stresses that relax. In this device's layout.
  void archive(ExecContext& ctx, StateArchive& a) {
    if (!relaxes()) return;
    tled::archive_fields(ctx, a, "stresses that relax", history_Pa_[0].view(), history_fields());
    if (virtual_elements_.has_capacity()) virtual_elements_.archive(ctx, a, history_fields());
  }

  /// Replaces cubes by copies, between frames. Recordings stay valid. Asynchronous.
  void apply(ExecContext& ctx, const ChangeLists& change);
  /// Stiffness of a copy that has `fill` of a cube.
  tled::Stiffness copy_stiffness(Index of_cube, float fill) const;

 private:
  /// Calls use(cube) with the force law of a cube in substep k. @param before,after history, `stride` of each
  /// field
  template <class F>
  void with_cube(const StepTime& time, View<const float> before, View<float> after, Index stride, F&& use);
  /// Forces of the copies in the virtual elements.
  void find_virtual_forces(ExecContext& ctx, int k, const StepTime& time);
  tled::MoveNodes move_nodes(const TledStep& step, int k);
  static Index used_nodes(const CubeLattice& lattice, Slab own_layers);
  void make_virtual(ExecContext& ctx, const CubeLattice& lattice, std::span<const tled::Stiffness> stiffness,
                    Slab own_layers, Index first_virtual_cell);
  /// Reads the positions that move k - 1 left.
  template <class Sink>
  void sum_forces(ExecContext& ctx, Tiles which, int k, const StepTime& time, const Sink& sink);
  template <class Cube, class Sink>
  void launch_forces(ExecContext& ctx, Tiles which, int k, const Cube& cube, const Sink& sink);
  tled::StiffnessKinds kinds() const { return {kind_.const_view(), kinds_.const_view()}; }
  tled::LoadPositions load_positions(const BodyState& state);
  /// Puts the history that the last of `count` moves left where the first one looks for it.
  void keep_history(ExecContext& ctx, int count, View<const FrameParams> frame = {});
  Index history_fields() const { return 6 * options_.relaxing_terms(); }  ///< per cube
  bool relaxes() const { return options_.relaxing_terms() > 0; }

  TledOptions options_;
  bool has_rollers_;
  float spacing_m_, stable_step_s_ = 0, damping_time_s_ = 0, stiffness_scale_ = 1;
  tled::Grid grid_;
  Index edge_tiles_ = 0;  ///< of tiles_, the first so many
  Buffer<tled::Tile> tiles_;
  Buffer<std::uint32_t> active_;
  Buffer<Index> cell_, cube_cell_;
  Slab own_cubes_;  ///< those of its layers, as the lattice counts them
  Buffer<tled::CubeExtremes> extremes_, worst_;
  Buffer<std::uint16_t> kind_;  ///< over cells, into
  Buffer<tled::Stiffness> kinds_;
  Buffer<float> stiffness_;                                          ///< fields of the same, on a CPU
  Buffer<float> inverse_mass_per_kg_, f_N_, v_m_s_, external_m_s2_;  ///< over cells
  std::array<Buffer<float>, 2> predicted_m_;  ///< a step reads one and writes the other
  std::array<Buffer<float>, 2>
      history_Pa_;  ///< the same, where stresses relax; between steps the first holds
  tled::VirtualElements virtual_elements_;
  std::vector<ElasticMaterial> materials_;  ///< where there is capacity for copies
  std::vector<std::uint8_t> material_;      ///< likewise, per cube
};

}  // namespace tactus
