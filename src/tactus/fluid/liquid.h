#pragma once
/// A liquid of particles.
#include <optional>
#include <span>
#include <vector>

#include "tactus/fluid/dfsph_kernels.h"
#include "tactus/fluid/flow_kernels.h"
#include "tactus/fluid/tension_kernels.h"
#include "tactus/fluid/wcsph_kernels.h"
#include "tactus/frame/state_archive.h"
#include "tactus/geom/neighbour_search.h"

namespace tactus {

/// A disc from which liquid flows at `speed_m_s`.
struct LiquidEmitter {
  Vec3f position_m, direction{0, -1, 0};
  float radius_m = 0.01F, speed_m_s = 0.5F;
  double from_s = 0, until_s = 1e30;
};

enum class LiquidSolver : std::uint8_t {
  wcsph,  ///< weakly compressible: many cheap steps
  dfsph,  ///< incompressible: steps ten times as long, three times as dear
};

/// What thins when it is sheared (Carreau 1972): of the viscosity at rest, `viscosity_Pa_s` is left at last.
struct Carreau {
  float zero_shear_Pa_s = 0.056F;
  float relaxation_s = 3.313F;  ///< lambda: thinning begins at the shear rate 1 / lambda
  float index = 0.3568F;        ///< n: viscosity falls as rate^(n - 1)
};

struct LiquidSettings {
  LiquidSolver solver = LiquidSolver::wcsph;
  int iterations = 4;        ///< dfsph
  float spacing_m = 0.004F;  ///< d: of particles at rest
  float density_kg_m3 = 1060;
  float viscosity_Pa_s = 0.0035F;
  std::optional<Carreau> carreau = {};
  float surface_tension_N_m = 0;
  float contact_angle_deg = 90;  ///< of its surface on walls, in the liquid; < 90 wets
  /// What moves faster is compressed by more than 1 %. Sound goes ten times as fast, or ten times as fast as
  /// (sigma / (rho d))^(1/2), the speed of the surface's shortest waves.
  float max_speed_m_s = 1;
  float artificial_viscosity = 0.05F;  ///< alpha; in dfsph, of 4 max_speed_m_s
  Box3f box_m;                         ///< the world of the liquid
  Index open_faces = 0;                ///< bits of -x, +x, -y, +y, -z, +z where it flows out
  Index max_particles = 40000;
  std::vector<LiquidEmitter> emitters = {};
  std::vector<Box3f> sinks_m = {};
  Index other_walls = 0;  ///< owners of walls beside the faces of the box: kFaces, kFaces + 1, ..
};

/// @throws Error naming the setting that is out of range.
LiquidSettings checked(const LiquidSettings& settings);

/// Where the particles are. On the device; slots change in every step, ids never.
struct LiquidView {
  Count count;            ///< slots in use
  View<const Vec3f> x_m;  ///< a particle that just left is nowhere: NaN
  View<const Vec3f> v_m_s;
  View<const Index> id;
};

/// A particle on the host.
struct LiquidParticle {
  Vec3f x_m, v_m_s;
  Index id = 0;
};

/// Owns the particles. Call `place` before the first step. A step is asynchronous and may be recorded:
/// nothing is allocated or read back there. Where other walls are near, it is begin_step, then whoever knows
/// them adds them to near_walls() of the particles in search(), then end_step, after which walls know their
/// impulses. docs/concepts/liquid.md has the equations.
class Liquid {
 public:
  static constexpr Index kFaces = FindBoxWalls::kFaces;

  /// Synchronizes. @throws Error naming the setting that is out of range.
  Liquid(ExecContext& ctx, const LiquidSettings& settings);

  /// These particles and no others; ids are numbers. Synchronizes. @throws Error when they are too many.
  void place(ExecContext& ctx, std::span<const LiquidParticle> particles);

  /// One step in a box alone. @throws Error when `time.dt_s` is above largest_step_s(); with `time.frame`,
  /// the caller sees to that.
  void step(ExecContext& ctx, const StepTime& time);
  void begin_step(ExecContext& ctx, const StepTime& time);
  void end_step(ExecContext& ctx, const StepTime& time);
  const NeighbourSearch& search() const { return search_; }
  NearWalls near_walls() { return {wall_count_.view(), walls_.view()}; }
  /// After the steps of a frame: makes wall_impulses_N_s() and report_view().
  void end_frame(ExecContext& ctx);

  /// The limit of stability: min(0.4 d / (c (1 + 0.6 alpha)), d^2 / (8 nu), (rho d^3 / (8 pi sigma))^(1/2));
  /// of dfsph, with the largest speed in place of c (1 + 0.6 alpha). The last is half the time that the
  /// shortest wave of the surface takes to the next particle (Brackbill, Kothe & Zemach 1992).
  float largest_step_s() const;
  /// Of dfsph, from the next step on, at least 1.
  void set_iterations(int iterations) { settings_.iterations = iterations; }
  const LiquidSettings& settings() const { return settings_; }
  const LiquidConstants& constants() const { return constants_; }
  LiquidView view() const;
  View<const float> density_kg_m3() const { return density_kg_m3_.const_view(); }
  /// (kFaces + other_walls) What the liquid did to each owner in the last frame.
  View<const Vec3f> wall_impulses_N_s() const { return wall_impulse_.const_view(); }
  View<const LiquidReport> report_view() const { return report_.const_view(); }

  /// All that the next steps depend on. Synchronizes. @throws Error.
  void archive(ExecContext& ctx, StateArchive& a);
  /// Synchronize.
  std::vector<LiquidParticle> particles(ExecContext& ctx) const;  ///< by id
  std::vector<float> densities_kg_m3(ExecContext& ctx) const;     ///< by slot

 private:
  void make_emitters(ExecContext& ctx);
  void measure_shear(ExecContext& ctx);
  void pull_surface(ExecContext& ctx, const StepTime& time);
  void end_weakly(ExecContext& ctx, const StepTime& time, const LiquidStepped& stepped);
  void end_dfsph(ExecContext& ctx, const StepTime& time, const LiquidStepped& stepped);

  LiquidSettings settings_;
  LiquidConstants constants_;
  NeighbourSearch search_;
  Buffer<Index> count_, id_, wall_count_, list_count_, near_;
  Buffer<Vec3f> x_m_, v_m_s_;
  Buffer<float> density_kg_m3_;
  Buffer<float> push_, inverse_D_, found_, kd_;  ///< dfsph
  Buffer<float> shear_m2_s_;                     ///< of what thins
  Buffer<LiquidMotion> motion_, star_, moved_;
  Buffer<LiquidNormal> surface_, smooth_;  ///< with surface tension
  Buffer<float> curvature_;
  Buffer<NearWall> walls_;
  Buffer<WallSums> wall_sums_;
  Buffer<Vec3f> wall_impulse_;
  Buffer<LiquidCounters> counters_;
  Buffer<LiquidReport> report_;
  Buffer<Box3f> sinks_;
  Buffer<EmitterState> emitters_;
  Buffer<Vec3f> layer_points_;
  Buffer<Index> emitter_of_;
};

/// Particles on a lattice that fill a box, along each edge as many as fit `spacing_m` apart or farther:
/// nearer, a block would burst.
std::vector<LiquidParticle> fill_box(const Box3f& box_m, float spacing_m);

}  // namespace tactus
