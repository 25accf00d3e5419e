#pragma once
/// Fast lattice shape matching (Rivers & James 2007; [P 9-14]) with a material's stiffness.
#include "tactus/frame/frame_params.h"
#include "tactus/frame/state_archive.h"
#include "tactus/tissue/body_state.h"
#include "tactus/tissue/flsm/flsm_regions.h"
#include "tactus/tissue/flsm/step_parameters.h"

namespace tactus {

/// Material of the body.
struct FlsmMaterial {
  float young_Pa = 3000;
  float density_kg_m3 = 1000;
  int half_width = 1;  ///< of the regions, in spacings: 1..4
  /// Part of critical damping of the fastest mode, 0..0.7 (0.75 is where steps of 1/omega become unstable);
  /// rigid motion is not damped.
  float damping_ratio = 0.3F;
  /// > 0: motion that is this much ahead sets damping instead, of which a mode omega has time omega / 2 of
  /// critical: within 0.1 and 0.7 of the fastest mode's.
  float damping_time_s = 0;
  float stiffness_scale = 1;  ///< of omega^2, 0.1..10: from a deflection test (match_deflection)
};

/// Parameters that may change from substep to substep.
struct FlsmStep {
  float dt_s = 0.001F;  ///< of a substep
  Index substeps = 1;   ///< that this step covers
  Vec3f gravity_m_s2{0, -9.81F, 0};
  float drag_per_s = 0;         ///< damps all motion, falling, too: for settling only
  bool full_stiffness = false;  ///< kappa = 1, the paper's choice: stiffness then depends on dt
  int rotation_iterations = 2;
  /// When given, dt_s and gravity are read from here when the kernels run.
  View<const FrameParams> frame = {};
  View<const Index> stopped = {};  ///< (1) with `frame`; != 0: the body stays where it is
  /// One: how fast the body turns as a whole, which is not damped; none: it does not.
  View<const Vec3f> spin_rad_s = {};
  Index in_block = 0;  ///< with `frame`: which substep of its block
  StepTime time() const { return {dt_s, gravity_m_s2, frame, stopped, spin_rad_s, in_block}; }
};

/// Results of compute_goals, for solvers that go on with them.
struct FlsmGoals {
  View<const Index> cell;             ///< per node
  View<const double> sum_m;           ///< 3 fields over cells: weighted sum of T_r x0_i over i's regions
  View<const double> inverse_weight;  ///< per node: 1 / sum of those weights
  Index cells = 0;
};

/// Solver of one body on one device. Between two steps, callers may change x and v (contact does).
///
///   Flsm flsm(ctx, lattice, material);
///   BodyState body = rest_state(ctx, lattice);
///   const int n = flsm.substeps_for(dt_frame_s);
///   for (int k = 0; k < n; ++k) flsm.step(ctx, body, {.dt_s = dt_frame_s / n});
///
/// The goal force linearises to rho omega^2 (sigma^2/2) (laplace u + grad div u): shear modulus
/// rho omega^2 sigma^2 / 2 and lambda = 0. So E is matched by omega^2 = E / (rho sigma^2); Poisson's ratio
/// cannot be chosen. Goals are means over regions with weights 1 / sigma_r^2 [ours], sigma_r^2 the region's
/// largest variance along any direction: along that direction each resists as the material does, across it
/// less. kappa = min(1, (omega dt)^2) [ours].
class Flsm {
 public:
  /// @throws Error naming the field for a material out of range, or a body too large.
  Flsm(ExecContext& ctx, const CubeLattice& lattice, const FlsmMaterial& material);
  /// For some layers of a body. @param regions those that flsm_layers left, of the nodes of `lattice`
  Flsm(ExecContext& ctx, const CubeLattice& lattice, const FlsmRegions& regions,
       const FlsmMaterial& material);

  /// One substep: goals, forces, integration. @throws Error when dt_s or another parameter is out of range.
  void step(ExecContext& ctx, BodyState& state, const FlsmStep& step);
  /// The first half of a step: goals [P 12], the weighted mean of T_r x0_i [m] over i's regions r. Where all
  /// nodes are held, nobody asks for goals, and there are none.
  /// @param nodes where the state has each node; empty: in the lattice's order
  void compute_goals(ExecContext& ctx, const BodyState& state, const FlsmStep& step,
                     View<const Index> nodes = {});
  /// Goals of all nodes from the last compute_goals, on the host. Synchronizes.
  std::vector<Vec3d> goals_m(ExecContext& ctx) const;

  /// State that it keeps from step to step: the rotations of regions, where the next search begins.
  void archive(ExecContext& ctx, StateArchive& a) { a.buffer(ctx, "rotations", quaternion_); }

  FlsmGoals goals() const {
    return {cell_.const_view(), goal_sum_.const_view(), inverse_weight_.const_view(), grid_.cells};
  }

  /// Parameters that depend on the length of a step.
  flsm::StepParameters pace(const FlsmStep& step) const {
    return {omega_, material_.damping_ratio, step.full_stiffness ? 1 : 0, step.substeps};
  }
  /// Between frames: so many times as stiff as it was built, as Tled::scale_stiffness.
  void scale_stiffness(float scale);
  float omega_per_s() const { return omega_; }
  double sigma2_m2() const { return sigma2_; }
  /// Young's modulus that a substep of dt really gives: E, or E / (omega dt)^2 where kappa is cut off at 1.
  float effective_young_Pa(float dt_s) const;
  /// How many substeps keep dt <= 1/omega, so that the stiffness is the material's.
  int substeps_for(float dt_frame_s) const;
  Index node_count() const { return cell_.size(); }

 private:
  void sum_over_regions(ExecContext& ctx);
  void slide_sums(ExecContext& ctx);
  void sum_goals(ExecContext& ctx);
  void slide_goals(ExecContext& ctx);

  FlsmMaterial material_;
  float spacing_m_ = 0, omega_ = 0, scale_ = 1;
  bool moves_ = false;  ///< whether a node may
  double sigma2_ = 0;
  FlsmGrid grid_;
  // per node
  Buffer<Index> cell_, fixed_;
  Buffer<float> mass_kg_;
  Buffer<float> held_;
  Buffer<double> shared_mass_kg_, inverse_weight_;
  // per cell
  Buffer<double> inverse_mass_, center_;
  Buffer<float> quaternion_, turn_m_;
  Buffer<FlsmException> exceptions_;
  Buffer<FlsmOffset> offsets_;
  Buffer<Index> node_rows_, x_rows_, y_blocks_, z_blocks_, goal_z_blocks_, goal_y_blocks_;
  // work: fields over cells, 0 where nothing writes; sums_z_ and rotation_ hold those that are complete
  Buffer<double> loaded_, sums_x_, sums_y_, sums_z_;
  Buffer<double> translation_, goals_z_, goals_y_, goal_sum_;
  Buffer<float> rotation_, turns_z_, turns_y_;
};

}  // namespace tactus
