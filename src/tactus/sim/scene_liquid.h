#pragma once
/// The liquid of a scene in the frame.
#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tactus/contact/contact_on_devices.h"
#include "tactus/contact/walls/body_walls.h"
#include "tactus/fluid/liquid.h"
#include "tactus/fluid/liquid_report.h"
#include "tactus/fluid/wounds.h"
#include "tactus/frame/readback.h"
#include "tactus/frame/schedule.h"
#include "tactus/sim/blade.h"
#include "tactus/sim/body/soft_body.h"
#include "tactus/sim/notice.h"
#include "tactus/sim/reach.h"
#include "tactus/sim/scene_film.h"
#include "tactus/sim/still_solids.h"

namespace tactus {

/// The speed that a liquid is made for where the scene says none: that of a fall through its box, which
/// begins with the highest speed of blocks and emitters.
double liquid_speed_m_s(const LiquidDescription& liquid, Vec3d gravity_m_s2);

/// Owns the liquid, on the first part_count() devices; bodies that touch it are on the first. It moves in
/// steps of its own. The real surface and obstacles push it; it and bodies push one another.
class SceneLiquid {
 public:
  /// Fills the blocks with particles, except inside bodies and obstacles. Synchronizes.
  /// @throws Error naming a value that is not allowed.
  SceneLiquid(DeviceSet& devices, const Scene& scene, const std::vector<std::unique_ptr<SoftBody>>& bodies,
              std::span<const ObstacleDescription> obstacles);

  /// Before add_stages(): the liquid wets the real surface, as SceneFilm::add_real.
  void wet_real(const RealSurface& real, std::function<MeshView()> mesh, float cell_m) {
    if (film_) film_->add_real(real, std::move(mesh), cell_m);
  }
  /// How many devices the liquid of a scene is on; 0 when it has none.
  static int part_count(const DeviceSet& devices, const Scene& scene);
  /// After the stages of the bodies. `world`, which is on as many devices, and this must outlive the
  /// schedule's runs.
  void add_stages(Schedule& schedule, Readback& readback, ContactOnDevices& world, Vec3f gravity_m_s2);
  static Resource report_resource() { return "liquid/report"; }

  /// Before a frame, chooses the pace: the liquid's speed in it, as far as the last frame's record can tell.
  /// @param movers all that moves and may push it @param from_s,to_s of simulated time
  void look_ahead(double from_s, double to_s, Vec3d gravity_m_s2, std::span<const Reach> movers);
  /// As many as it needs in that time; none while there is no liquid.
  int steps_for(double dt_s) const;
  void pass_time(double dt_s) { liquid_.pass_time(dt_s); }
  /// The least substeps of bodies in that time: where walls move, liquid meets each of them in a new place.
  int substeps_for(double dt_s) const { return pace_.walls_move != 0 ? steps_for(dt_s) : 1; }
  /// After the substeps of a frame, or of a part of it, of that length.
  void follow(const Readback& readback, double dt_s);
  /// Whether steps can cost less with less accuracy; then they take half their iterations from now on, and at
  /// least three, or all.
  bool can_be_reduced() const { return reduced_iterations() < description_.iterations; }
  void reduce_quality(bool is_reduced) { is_reduced_ = is_reduced; }
  /// Before that many steps, in a frame or a part of it.
  void expect(int steps) { liquid_.expect(last_.here, steps); }
  /// Which of several sets of submissions they make, from 0 on.
  std::size_t variant() const {
    return static_cast<std::size_t>(pace_.growth) * 4 + (is_reduced_ ? 2 : 0) +
           (liquid_.may_be_full() ? 1 : 0);
  }
  /// Over the frame that was waited for. @param notices for the user, added to
  LiquidReport report(const Readback& readback, std::vector<Notice>& notices);

  /// Adds the liquid's forces on walls in the part of a frame that was waited for, as a mean over the frame.
  /// @param name_of colliders of contact (contact/body_points.h), and from kColliders on, bodies
  void add_forces(const Readback& readback, const std::function<std::string(Index collider)>& name_of,
                  double dt_frame_s, std::vector<LiquidReaction>& forces) const;

  /// Volume that emitters and wounds should have brought by now [m^3]. Reports wounds that can't keep up.
  double waiting_m3(const Readback& readback, double dt_frame_s, std::vector<Notice>& notices);
  /// Adds the volumes that strokes bled until the frame that was waited for.
  void add_bleeding(const Readback& readback, std::vector<CutScore>& cuts) const;
  /// What lies on bodies and obstacles as a film, over the frame that was waited for.
  SceneFilmReport film_report(const Readback& readback) const {
    return film_ ? film_->report(readback) : SceneFilmReport{};
  }
  /// Between frames, as SceneFilm::set_gravity; steps read gravity where frames have it.
  void set_gravity(Vec3d gravity_m_s2) {
    if (film_) film_->set_gravity(gravity_m_s2);
  }
  /// Before a frame, as SceneFilm::place_obstacles.
  void place_obstacles(std::span<const Rigidd> T_world) {
    if (film_) film_->place_obstacles(T_world);
  }
  /// nullptr where there is none.
  const SceneFilm* film() const { return film_.get(); }
  /// When a body was cut, between frames. Synchronizes.
  void follow_cut(SoftBody& body, std::vector<Notice>& notices);

  /// Once the body was rebuilt, between frames: the liquid feels it as it was made. Stages are added anew.
  /// Synchronizes.
  void renew(SoftBody& body);

  /// Evens out the work of devices, after a frame that was waited for.
  void balance(const Readback& readback);

  const Liquid& liquid() const { return liquid_; }
  /// Positions of the particles that are here, by id [m]. Synchronizes.
  std::vector<Vec3f> positions_m() const;
  /// Where bodies were cut, call this once they have these cuts and the liquid follows them.
  void archive(StateArchive& a);
  /// What is kept of bodies alone: wounds and films. Likewise.
  void archive_of_bodies(StateArchive& a);

 private:
  /// With two, a pool of 26 layers boils: Liquid.IsCalmerWithThreeIterationsThanWithTwo.
  static constexpr int kLeastInHaste = 3;
  int reduced_iterations() const {
    const int all = description_.iterations;
    if (description_.solver != LiquidModel::dfsph) return all;
    return std::min(all, std::max((all + 1) / 2, kLeastInHaste));
  }
  /// Iterations grow in these steps.
  static constexpr std::array kGrowth{1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0};
  void remember_layers(double dt_s, double gravity_m_s2);
  void choose_iterations();

  /// A body that the liquid and it push.
  struct Felt {
    SoftBody* body = nullptr;
    Index collider = 0;
    std::unique_ptr<BodyWalls> walls = nullptr;
    std::unique_ptr<Wounds> wounds = nullptr;  ///< where it bleeds
    Buffer<WallHit> hits = {};                 ///< of the places where those may bleed, on any body
    Readback::Place ledgers = {};
    bool was_full = false, bleeds = false, was_late = false;
  };
  struct LeftOut {
    int in_solids = 0, in_blocks = 0;
  };
  std::vector<LiquidParticle> fill_blocks(const StillSolids& solids, LeftOut& left_out) const;
  void tell_of_short_steps();
  void tell_of_thin_puddles(double placed_m3, Vec3d gravity_m_s2);
  [[noreturn]] void refuse_blocks(double count) const;
  void add_body(SoftBody& body, Index collider);
  void bleed(Felt& felt, const ContactOnDevices::Part& solid, View<const FrameParams> frame);
  void begin_step(const FrameOnDevices& frame, Vec3f gravity_m_s2);
  void end_step(ContactOnDevices& world, const FrameOnDevices& frame, Vec3f gravity_m_s2);
  bool may_bring(double from_s, double to_s) const;

  struct StepSize {
    float fastest_m_s = 0, longest_step_s = 0;
    Index is_empty = 0, walls_move = 1;
    float layers = 0;                  ///< that bear on one another, or did until lately
    float yields_m_s2 = 0;             ///< of the bodies' walls, as liquid presses them or did until lately
    Index growth = 0, for_excess = 0;  ///< numbers in kGrowth: of the iterations, and of those for densities
  };
  DeviceSet& devices_;
  LiquidDescription description_;
  Liquid liquid_;
  std::vector<Felt> bodies_;
  std::unique_ptr<SceneFilm> film_;
  Readback::Place report_, impulses_;
  std::vector<Readback::Place> layers_;  ///< per part
  std::vector<Notice> first_notices_;    ///< of the start
  std::uint32_t replaced_ = 0;           ///< until the last frame
  LiquidReport last_;                    ///< of the last frame
  StepSize pace_;
  bool is_reduced_ = false;
};

}  // namespace tactus
