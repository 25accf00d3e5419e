#pragma once
/// A liquid of particles.
#include <span>
#include <vector>

#include "tactus/fluid/wcsph_kernels.h"
#include "tactus/geom/neighbour_search.h"

namespace tactus {

struct LiquidSettings {
  float spacing_m = 0.004F;  ///< d: of particles at rest
  float density_kg_m3 = 1060;
  float viscosity_Pa_s = 0.0035F;
  /// What moves faster is compressed by more than 1 %. Sound goes ten times as fast.
  float max_speed_m_s = 1;
  float artificial_viscosity = 0.05F;  ///< alpha
  Box3f box_m;                         ///< the world of the liquid
  Index open_faces = 0;                ///< bits of -x, +x, -y, +y, -z, +z where it flows out
  Index max_particles = 40000;
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

/// Owns the particles. Call `place` before the first step, then `step`, asynchronous and recordable: nothing
/// is allocated or read back there. docs/concepts/liquid.md has the equations.
class Liquid {
 public:
  /// @throws Error naming the setting that is out of range.
  Liquid(ExecContext& ctx, const LiquidSettings& settings);

  /// These particles and no others; ids are numbers. Synchronizes. @throws Error when they are too many.
  void place(ExecContext& ctx, std::span<const LiquidParticle> particles);
  /// One step. @throws Error when `time.dt_s` is above largest_step_s(); with `time.frame`, the caller sees
  /// to that.
  void step(ExecContext& ctx, const StepTime& time);

  /// The limit of stability: min(0.4 d / (c (1 + 0.6 alpha)), d^2 / (8 nu)).
  float largest_step_s() const;
  const LiquidSettings& settings() const { return settings_; }
  const LiquidConstants& constants() const { return constants_; }
  LiquidView view() const;
  View<const float> density_kg_m3() const { return density_kg_m3_.const_view(); }

  /// Synchronize.
  std::vector<LiquidParticle> particles(ExecContext& ctx) const;  ///< by id
  std::vector<float> densities_kg_m3(ExecContext& ctx) const;     ///< by slot
  /// How many particles have left since they were placed.
  std::uint32_t left(ExecContext& ctx) const;
  /// What the liquid did to the faces of its box since this was asked last [N s].
  std::vector<Vec3f> take_wall_impulses_N_s(ExecContext& ctx);

 private:
  LiquidSettings settings_;
  LiquidConstants constants_;
  NeighbourSearch search_;
  Buffer<Index> count_, id_, wall_count_, list_count_, near_;
  Buffer<Vec3f> x_m_, v_m_s_;
  Buffer<float> density_kg_m3_;
  Buffer<LiquidMotion> motion_;
  Buffer<NearWall> walls_;
  Buffer<WallSums> wall_sums_;
  Buffer<std::uint32_t> left_;
};

/// Particles on a cubic lattice that fill a box, its spacing as near to `spacing_m` as fits.
std::vector<LiquidParticle> fill_box(const Box3f& box_m, float spacing_m);

}  // namespace tactus
