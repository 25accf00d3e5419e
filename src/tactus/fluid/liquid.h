#pragma once
/// A liquid of particles.
#include <optional>
#include <span>
#include <vector>

#include "tactus/fluid/block_lattice.h"
#include "tactus/fluid/dfsph_kernels.h"
#include "tactus/fluid/liquid_split.h"
#include "tactus/fluid/wcsph_kernels.h"
#include "tactus/fluid/wound_kernels.h"
#include "tactus/frame/frame_on_devices.h"
#include "tactus/frame/state_archive.h"

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

/// A liquid that thins when it is sheared (Carreau 1972): its viscosity falls to `viscosity_Pa_s` at last.
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
  /// Liquid that moves faster is compressed by more than 1 %. Sound goes ten times as fast, or ten times as
  /// fast as (sigma / (rho d))^(1/2), the speed of the surface's shortest waves.
  float max_speed_m_s = 1;
  float artificial_viscosity = 0.05F;  ///< alpha; in dfsph, of 4 max_speed_m_s
  Box3f box_m;                         ///< the world of the liquid
  Index open_faces = 0;                ///< bits of -x, +x, -y, +y, -z, +z where it flows out
  Index max_particles = 40000;         ///< the oldest leave when newer ones need their capacity
  std::vector<LiquidEmitter> emitters = {};
  std::vector<Box3f> sinks_m = {};
  Index arrivals = 0;     ///< the most that others bring between two steps: Liquid::arrivals()
  Index other_walls = 0;  ///< colliders of walls beside the faces of the box: kFaces, kFaces + 1, ..
  /// Capacity for particles that a device has at least; absent: Liquid::kLeast.. on GPUs, none elsewhere.
  std::optional<Index> least_particles = {};
};

/// @throws Error naming the setting that is out of range.
LiquidSettings checked(const LiquidSettings& settings);
/// Constants of settings that were checked.
LiquidConstants constants_of(const LiquidSettings& settings);

/// Where the particles are. On the device; slots change in every step, ids never.
struct LiquidView {
  Count count;            ///< slots in use
  View<const Vec3f> x_m;  ///< a particle that just left is nowhere: NaN
  View<const Vec3f> v_m_s;
  View<const Index> id;
};

/// Owns the particles, in slabs on the first devices of a set. Results have the same bits on every set. Call
/// `place` before the first step. A step is asynchronous and may be recorded: nothing is allocated or read
/// back there. Where other walls are near, call begin_step, which needs the particles alone; then let the
/// solvers that have these walls add them, for each part, to near_walls() of the particles in search(), then
/// call end_step. After that, walls know their impulses. docs/concepts/liquid.md has the equations.
class Liquid {
 public:
  static constexpr Index kFaces = FindBoxWalls::kFaces;
  /// On GPUs, a part has capacity for as many. On two H200, the exchange costs 0.14 ms a step of WCSPH and
  /// 0.7 ms of DFSPH: half of a step of 340,000 and 560,000 particles on one H200. See part_count.
  static constexpr Index kLeastWcsph = 200000, kLeastDfsph = 300000;

  /// Synchronizes. @throws Error naming the setting that is out of range.
  Liquid(DeviceSet& devices, const LiquidSettings& settings);
  Liquid(const Liquid&) = delete;
  Liquid& operator=(const Liquid&) = delete;

  /// How many devices take part: all, but no more than have max_particles / least_particles each, and one
  /// where devices can't read each other's memory.
  static int part_count(const DeviceSet& devices, const LiquidSettings& settings);
  int part_count() const { return static_cast<int>(parts_.size()); }

  /// These particles and no others; ids are numbers. Synchronizes. @throws Error when they are too many.
  void place(std::span<const LiquidParticle> particles);

  /// One step in a box alone. @throws Error when `time.dt_s` is above largest_step_s(); with `time.frame`,
  /// the caller sees to that.
  void step(const StepTime& time);
  /// @param frame `time` as each device has it; none: as the host gives it
  void begin_step(const StepTime& time, const FrameOnDevices* frame = nullptr);
  void end_step(const StepTime& time, const FrameOnDevices* frame = nullptr);
  /// The search of a part: its particles, and copies of others' that are near. Copies do nothing to walls.
  const NeighbourSearch& search(int part = 0) const { return parts_[at(part)].search; }
  NearWalls near_walls(int part = 0) { return parts_[at(part)].near_walls(); }
  /// The buffers of a liquid in one part, for solvers that bring particles between two steps.
  LiquidArrivals arrivals() {
    LiquidPart& part = parts_[0];
    return {
        part.counters.view(),      part.count.view(),        part.x_m.view(),
        part.v_m_s.view(),         part.id.view(),           part.push.view(),
        part.density_kg_m3.view(), part.relative_m_s.view(), settings_.max_particles + settings_.arrivals};
  }
  /// The walls of the box, of others than the liquid's particles; the first that `near` gets.
  void find_box_walls(ExecContext& ctx, const NeighbourSearch& places, const NearWalls& near) const {
    ctx.parallel_for("fluid/walls", places.placed(),
                     FindBoxWalls{places.cells().particles, settings_.box_m, settings_.open_faces,
                                  constants_.kernel.reach_m(), near});
  }
  /// In place of steps, while there is no liquid and no emitter brings any.
  void pass_time(double dt_s) {
    devices_.context(0).parallel_for("fluid/pass time", emitters_.size(), PassTime{emitters_.view(), dt_s});
  }
  /// After the steps of a frame: makes wall_impulses_N_s() and report_view(), on the first device.
  void end_frame();

  /// The limit of stability: min(0.4 d / (c (1 + 0.6 alpha)), d^2 / (8 nu), (rho d^3 / (8 pi sigma))^(1/2));
  /// dfsph has max_speed_m_s in place of c (1 + 0.6 alpha). The last is half the time that the shortest wave
  /// of the surface takes to the next particle (Brackbill, Kothe & Zemach 1992).
  float largest_step_s() const { return largest_step_s(settings_.max_speed_m_s); }
  /// The same for a liquid that is no faster than that; dfsph alone takes longer steps then, up to
  /// kMostLonger times.
  float largest_step_s(float fastest_m_s) const;
  static constexpr float kMostLonger = 6;
  /// Before so many steps, where so many particles are here: unless there is room for all that may come, each
  /// step looks whether the oldest have to make way. Without it, each does.
  void expect(Index here, int steps);
  bool may_be_full() const { return may_be_full_; }
  /// Sets the iterations of dfsph from the next step on, at least 1.
  void set_iterations(int iterations) { settings_.iterations = iterations; }
  const LiquidSettings& settings() const { return settings_; }
  const LiquidConstants& constants() const { return constants_; }
  /// The particles of a part. Copies are nowhere (NaN).
  LiquidView view(int part = 0) const;
  /// (kFaces + other_walls) The impulse of the liquid on each collider in the last frame.
  View<const Vec3f> wall_impulses_N_s() const { return wall_impulse_.const_view(); }
  View<const LiquidReport> report_view() const { return report_.const_view(); }

  /// (LiquidLayers::kCounts) Particles of a part by layers at the end of the last frame, for balance(); empty
  /// where there is one part.
  View<const Index> layers(int part) const { return parts_[at(part)].layers.const_view(); }
  /// Between frames, once devices were waited for: moves the cuts between parts, so that devices are done at
  /// the same time. @param layers of all parts
  void balance(std::span<const std::vector<Index>> layers);
  const LiquidSlabs& slabs() const { return balance_.slabs(); }

  /// All that the next steps depend on. Synchronizes. @throws Error.
  void archive(StateArchive& a);
  /// The particles that are here, by id, and their densities. Both synchronize.
  std::vector<LiquidParticle> particles() const;
  std::vector<float> densities_kg_m3() const;
  /// The pressures p of the last step, which took dt_s; never negative.
  std::vector<float> pressures_Pa(float dt_s) const;

 private:
  /// On the host.
  struct Kept {
    LiquidParticle particle;
    float push = 0, density_kg_m3 = 0;
    Vec3f sorted_m{};  ///< where it was when the last step sorted
  };
  static std::size_t at(int part) { return static_cast<std::size_t>(part); }
  template <class F>
  void each(F&& body) {
    for (int p = 0; p < part_count(); ++p) body(devices_.context(p), parts_[at(p)]);
  }
  void make_emitters();
  void emit(const StepTime& time);
  void keep_youngest();
  void sum_neighbours(const StepTime& time, const FrameOnDevices* frame);
  void prepare_forces();
  void measure_surface();
  LiquidShear shear_of(LiquidPart& part) const;
  template <class Force>
  void exert(ExecContext& ctx, LiquidPart& part, const Force& force);
  void end_weakly(const StepTime& time, const FrameOnDevices* frame);
  void end_dfsph(const StepTime& time, const FrameOnDevices* frame);
  LiquidStepped stepped(LiquidPart& part) const;
  bool is_timed(const StepTime& time) const;
  std::vector<Kept> kept() const;
  /// All on the first part. @param count with those that left in the last step
  void put(const std::vector<Kept>& particles, Index count, const LiquidCounters& counters);
  /// For a liquid in one part, after put(): slots are those of the last step again, in which wounds look for
  /// capacity before the next.
  void sort_again(const std::vector<Kept>& particles);

  DeviceSet& devices_;
  LiquidSettings settings_;
  LiquidConstants constants_;
  std::vector<LiquidPart> parts_;
  LiquidSplit split_;
  LiquidBalance balance_;
  bool may_be_full_ = true;
  // On the first device:
  Buffer<Vec3f> wall_impulse_;
  Buffer<LiquidReport> report_;
  Buffer<EmitterState> emitters_;
  Buffer<Vec3f> pattern_points_;
  Buffer<float> pattern_phases_;
  Buffer<Index> emitter_of_;
};

}  // namespace tactus
