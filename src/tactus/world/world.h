#pragma once
/// Soft bodies, liquid and obstacles, stepped frame by frame. Needs no camera.
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>

#include "tactus/base/timing.h"
#include "tactus/frame/schedule.h"
#include "tactus/perception/frame_quality.h"
#include "tactus/perception/perception.h"
#include "tactus/sim/blade.h"
#include "tactus/sim/body/body_point.h"
#include "tactus/sim/body/soft_body.h"
#include "tactus/sim/body/touching_bodies.h"
#include "tactus/sim/cut_score.h"
#include "tactus/sim/frame_clock.h"
#include "tactus/sim/scene_liquid.h"
#include "tactus/sim/scene_obstacles.h"
#include "tactus/tissue/substep_choice.h"
#include "tactus/world/contact_log.h"
#include "tactus/world/energy_watch.h"
#include "tactus/world/obstacle_watch.h"
#include "tactus/world/scene_parameters.h"

namespace tactus {

/// Reaction of one body on one thing over a frame.
struct BodyContact {
  std::string body;
  std::string component;  ///< "3": label of a component of the real surface, the same from frame to frame; or
                          ///< an obstacle's name, or a body's
  ColliderReaction reaction;
};

/// How a frame went.
struct StepReport {
  HullReport hull;
  ContactReport contact;                      ///< of all bodies with all that is real
  std::vector<BodyContact> contacts;          ///< of each body with each thing that it touched
  LiquidReport liquid;                        ///< where the scene has one
  std::vector<LiquidReaction> liquid_forces;  ///< on everything that it touched
  int substeps = 0;
  int liquid_steps = 0;
  double liquid_waiting_m3 = 0;  ///< that emitters and wounds should have brought by now
  SceneFilmReport film;          ///< of the liquid on bodies
  int settling_substeps = 0;     ///< before the first frame, where 'frame.start' is settled
  double dt_s = 0;               ///< simulated
  std::vector<Notice> notices;   ///< all of this frame
};

/// Force and torque of a prescribed motion on a body.
struct MotionForce {
  Vec3d force_N, torque_N_m;  ///< the torque about the moved region's pivot
};

/// Where the tissue under a probe is, and how it is strained.
struct ProbeReading {
  Vec3f position_m;   ///< world
  CubeStrain strain;  ///< and stress
};

/// Meshes for viewers and exporters: owns its data, never the world's.
struct FrameSnapshot {
  TriangleMesh real;                        ///< the reconstructed surface, with normals
  std::vector<TriangleMesh> bodies;         ///< in the scene's order
  std::vector<Index> smooth;                ///< per body: so many of its first vertices are at no crease
  std::vector<TriangleMesh> obstacles;      ///< those that move, in the scene's order
  std::vector<TriangleMesh> blades;         ///< tracked ones that are seen; others until their path ends
  std::vector<ToolAxis> tools;              ///< tracked ones that were found
  std::vector<Vec3f> liquid_m;              ///< its particles, by id
  std::vector<SceneFilm::Thickness> films;  ///< on the bodies, in their order; none where there is no film
  std::int64_t tick = 0;                    ///< of the images
  double captured_s = 0;                    ///< when those came, on the clock of now_s()
};

/// Owns bodies, liquid, obstacles, probes, cuts and time; one thread calls it. Its solvers declare their work
/// as stages; a Schedule orders them (schedule().text() prints the result). Bodies are stepped by as many
/// devices as pay, with the same bits; their seen surfaces are on the first.
///
///   World world(devices, scene, assets);
///   per frame: world.set_pose("tool", T_world_tool); const StepReport report = world.step(dt_s);
///
/// With a Perception, the real surface of new images is made in the same submission.
class World {
 public:
  /// @param perception makes the real surface; nullptr: there is none. Kept; it belongs to one World
  /// @throws Error naming the fault of the body or material.
  World(DeviceSet& devices, const Scene& scene, const BodyAssets& assets, Perception* perception = nullptr);

  /// The next step has the surface and tools of these images. An observation without new images changes
  /// nothing: the surface goes on with its motion. @throws usage Error without a Perception.
  void set_surface(Observation observation);
  /// One frame. @param dt_s time since the last frame, to the capture of new images or to now; 0 for the
  /// first
  /// @throws Error when 'frame.substeps' is not stable.
  StepReport step(double dt_s);
  /// Where an obstacle with `held: true` is at the end of the next frame and from then on; it goes there
  /// evenly. From a robot, a haptic arm, a mouse, a tracker. @throws usage Error as
  /// MovingObstacles::set_pose.
  void set_pose(const std::string& obstacle, const Rigidd& T_world_obstacle) {
    moving_obstacles_.set_pose(obstacle, T_world_obstacle);
  }
  /// Where it is now. @throws usage Error for an obstacle that does not move.
  Rigidd pose(const std::string& obstacle) const { return moving_obstacles_.pose(obstacle); }
  /// What may change while it runs: gravity, friction, stiffness, drag, bleeding.
  SceneParameters& parameters() { return parameters_; }
  /// From the next frame on, contacts() has those of this body. @throws usage Error for a body that isn't in
  /// the scene, with those that are.
  void report_contacts(const std::string& body) { contact_log_.ask(body); }
  /// Contacts of a body over the last frame; none unless they were asked for by report_contacts() before it.
  const std::vector<BodyPointContact>& contacts(const std::string& body) const {
    return contact_log_.of(body);
  }
  /// Reductions that reduce_quality() can make in this scene's frames, the one that is missed least first.
  std::vector<QualityReduction> quality_reductions() const;
  /// From the next new images on, frames make these reductions and no others. On a GPU, each choice
  /// is recorded in its first frame.
  void reduce_quality(std::span<const QualityReduction> quality_reductions);
  /// Copies everything that is to be seen to the host. Synchronizes.
  FrameSnapshot snapshot();
  /// The viewer has the snapshot of the last frame: counts the latency of live images.
  void note_shown();
  /// What the scene's probes read, in its order. Synchronizes.
  std::vector<ProbeReading> probes();
  /// Monitors of every body, in the scene's order. Synchronizes.
  std::vector<BodyMonitors> monitors();
  /// Per body and moved region: of the prescribed motion on the body, in the mean over the last frame.
  /// Synchronizes.
  std::vector<std::vector<MotionForce>> motion_forces();

  /// All that the coming frames depend on, and nothing else. An archive that is read must be of the same
  /// scene, on the same devices. Synchronizes. @param last the frame that was stepped last, or nullptr for
  /// none: the archive has only those data of the real surface that can't be made from it
  /// @throws Error when it is of another scene; the world is of no use then.
  void archive(StateArchive& a, const FrameSet* last);

  /// Results of the blades' strokes so far.
  const std::vector<CutScore>& cuts() const { return cuts_; }
  /// The same, with lines on the skin and how they keep to the scene's plans. Looks at all walls of all cuts.
  std::vector<StrokeResult> stroke_results() const;
  const std::vector<PlannedLine>& plans() const { return plans_; }

  const Timings& timings() const { return timings_; }
  /// The stages of a frame in order, and how often they were recorded.
  const Schedule& schedule() const { return schedule_; }
  const std::vector<std::unique_ptr<SoftBody>>& bodies() const { return bodies_; }
  /// nullptr: nothing is reconstructed.
  Perception* perception() const { return perception_; }
  /// nullptr where the scene has none.
  const SceneLiquid* liquid() const { return liquid_.get(); }
  /// Where bodies live.
  ExecContext& context() { return devices_.context(0); }

 private:
  struct Probe {
    std::size_t body;
    BodyPoint point;
    StrainAtPoint strain;
  };
  /// @throws usage Error for a point that is not in its body, with the nearest one that is.
  void add_probe(const ProbeDescription& probe);
  /// @throws usage Error for a plan that misses its body.
  void add_plans();
  void add_stages();
  // world_parameters.cpp
  void add_parameters();
  void add_parameters_of(SoftBody& body, const BodyDescription& description);
  // world_images.cpp
  void add_surface_stages(StageDevices touching);
  bool begin_images(StepReport& report);
  bool is_reduced(QualityReduction quality_reduction) const {
    return (reductions_made_ >> static_cast<unsigned>(quality_reduction) & 1U) != 0;
  }
  void begin_quality();
  void note_latency();
  /// Moving obstacles and tracked tools.
  void move_tools(const FrameTimes& times, bool has_new_images);
  /// Part of a frame. Things that move fast would strain bodies far more than at its beginning, so steps
  /// follow the strain from part to part.
  struct FramePart {
    double dt_s = 0;
    int substeps = 0;
    bool last = true;
    int liquid_steps = 0;
  };
  /// @param left_s of the frame @param age_s farthest from the surface's capture @param from_s when the part
  /// begins, of the bodies' motions @param done substeps of the frame before it
  FramePart next_part(double left_s, double age_s, double from_s, int done);
  /// As many as the bodies' stable steps ask for.
  int substeps_for(double dt_s, double substeps_per_s) const;
  void look_ahead_of_liquid(double dt_s);
  bool must_look_first(double dt_s) const;
  /// Speed of the fastest point of the real surface [m/s]; with a body, among the components that can reach
  /// it in so much time.
  double surface_m_s() const;
  double surface_m_s(const SoftBody& body, double seconds) const;
  // world_watch.cpp
  EnergyWatch make_energy_watch() const;
  void note_contact(const ContactReport& contact);
  std::string gained_energy();
  ObstacleWatch::Surface surface_of(const SoftBody& body) const;
  std::string inside_a_body(std::size_t body);
  std::string inside_the_surface(std::size_t body);
  void watch_bodies(StepReport& report);
  void report_fast_components(const RealSurfaceReport& surface, StepReport& report) const;
  // settle.cpp
  void check_settles() const;
  void settle(StepReport& report);
  void settle_interval(int substeps, StepReport& report);
  double settling_dt_s() const;
  void run_parts(const FrameTimes& times, bool has_new_images, StepReport& report);
  void run_part(const FrameTimes& times, const FramePart& part, double begin_s, bool has_new_images);
  void collect(StepReport& report);
  /// After each part of a frame.
  void collect_bodies(double dt_frame_s, int substeps, StepReport& report);
  /// By blades, after the frame's substeps. @param from_s,to_s of its simulated time
  void cut_bodies(double from_s, double to_s, StepReport& report);
  cut::BladeStrip seen_strip(std::size_t blade) const;
  CutScore& stroke_of(const std::string& blade, const std::string& body, double from_s);
  static void add_cut(const cut::BladeStrip& strip, const cut::CutReport& cut, double from_s, double to_s,
                      CutScore& score);
  void follow_cuts(std::size_t body, std::vector<Notice>& notices);
  void archive_cuts(StateArchive& a);
  void archive_scores(StateArchive& a);
  static void add_contact(const BodyContact& contact, StepReport& report);
  /// The contacts of a body that are asked for, after each part of a frame.
  void log_points(std::size_t body, const std::function<std::string(Index)>& name_of);

  DeviceSet& devices_;
  Scene scene_;
  Perception* perception_;                               ///< nullptr: no cameras, nothing is reconstructed
  unsigned reductions_made_ = 0, reductions_asked_ = 0;  ///< bits
  float sample_spacing_m_;
  std::vector<std::unique_ptr<SoftBody>> bodies_;
  MovingObstacles moving_obstacles_;
  ObstacleWatch obstacle_watch_;
  EnergyWatch energy_watch_;
  ContactLog contact_log_;
  /// Bodies are looked for in other things that move once in so many frames: they stay there for some.
  static constexpr int kFramesToWatch = 10;
  int frames_watched_ = 0;
  ContactOnDevices colliders_;
  TouchingBodies touching_;
  std::unique_ptr<SceneLiquid> liquid_;
  std::vector<Probe> probes_;
  Readback readback_;
  Readback::Place surface_report_;
  Schedule schedule_;
  FrameClock clock_;
  Observation seen_;  ///< of the last images; without the strips that have cut
  double last_dt_s_ = 0;
  double meshed_s_ = 0;  ///< when the mesh of the last images was there
  float last_substep_s_ = 0;
  bool has_surface_ = false;  ///< images came
  bool is_settled_ = false;   ///< or need not be
  std::vector<Reach>
      component_speeds_;  ///< of the real surface at its capture, and of all that is in tool_speeds_
  std::vector<Reach> tool_speeds_;  ///< of moving obstacles and tracked tools
  int part_ = 0;                    ///< of the frame that runs
  std::vector<CutScore> cuts_;
  std::vector<PlannedLine> plans_;
  int cut_frame_ = 0;
  std::vector<Notice> start_notices_;    ///< for the first frame to tell
  std::set<std::string> reported_cuts_;  ///< notices given of blades and bodies
  SubstepChoice substep_choice_;
  SceneParameters parameters_;
  Timings timings_;
};

}  // namespace tactus
