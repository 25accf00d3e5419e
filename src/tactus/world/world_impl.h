#pragma once
/// The inside of a World, for the rest of the library.
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>

#include "tactus/base/timing.h"
#include "tactus/frame/schedule.h"
#include "tactus/io/scene_fingerprint.h"
#include "tactus/perception/frame_quality.h"
#include "tactus/perception/perception_impl.h"
#include "tactus/sim/blade.h"
#include "tactus/sim/body/body_point.h"
#include "tactus/sim/body/soft_body.h"
#include "tactus/sim/body/touching_bodies.h"
#include "tactus/sim/cut_score.h"
#include "tactus/sim/frame_clock.h"
#include "tactus/sim/held_blades.h"
#include "tactus/sim/scene.h"
#include "tactus/sim/scene_liquid.h"
#include "tactus/sim/scene_obstacles.h"
#include "tactus/tissue/substep_choice.h"
#include "tactus/world/contact_log.h"
#include "tactus/world/energy_watch.h"
#include "tactus/world/fall_watch.h"
#include "tactus/world/obstacle_watch.h"
#include "tactus/world/scene_parameters.h"
#include "tactus/world/world.h"

namespace tactus {

/// World's functions say more.
struct World::Impl {
 public:
  Impl(DeviceSet& devices, const Scene& scene, const BodyAssets& assets, Perception* perception);
  /// Synchronizes: work that waits may read from members.
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void set_surface(Observation observation);
  StepReport step(double dt_s);
  void begin_step(double dt_s);
  std::optional<StepReport> continue_step();
  void set_pose(const std::string& tool, const Rigidd& T_world_tool, bool at_once);
  Rigidd pose(const std::string& tool) const;
  void set_grab(const std::optional<Grab>& grab);
  SceneParameters& parameters() { return parameters_; }
  void report_contacts(const std::string& body) { contact_log_.ask(body); }
  const std::vector<BodyPointContact>& contacts(const std::string& body) const {
    return contact_log_.of(body);
  }
  std::vector<QualityReduction> quality_reductions() const;
  void reduce_quality(std::span<const QualityReduction> quality_reductions);
  FrameSnapshot snapshot();
  std::vector<ProbeReading> probes();
  BodyNodes nodes(const std::string& name);
  std::vector<BodyMonitors> monitors();
  std::vector<std::vector<MotionForce>> motion_forces();

  void archive(StateArchive& a, const FrameSet* last);
  /// Between frames: doubles a body's capacity for cuts, which changes nothing else. Synchronizes.
  /// @param in_frame the body will be cut once more in the frame that ends
  /// @returns whether it may grow
  bool grow(std::size_t body, bool in_frame);

  const std::vector<CutScore>& cuts() const { return cuts_; }
  std::vector<StrokeResult> stroke_results() const;
  const std::vector<PlannedLine>& plans() const { return plans_; }

  const Timings& timings() const { return timings_; }
  const Schedule& schedule() const { return schedule_; }
  const std::vector<std::unique_ptr<SoftBody>>& bodies() const { return bodies_; }
  /// @throws usage Error for a body that isn't in the scene, with those that are.
  const SoftBody& body(const std::string& name) const;
  Perception* perception() const { return perception_; }
  const SceneLiquid* liquid() const { return liquid_.get(); }
  ExecContext& context() { return devices_.context(0); }
  DeviceSet& devices() { return devices_; }

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
  void add_view_parameters();
  void add_parameters_of(SoftBody& body, const BodyDescription& description);
  // world_images.cpp
  void add_surface_stages(StageDevices touching);
  bool begin_images(StepReport& report);
  bool is_reduced(QualityReduction quality_reduction) const {
    return (reductions_made_ >> static_cast<unsigned>(quality_reduction) & 1U) != 0;
  }
  void begin_quality();
  void note_latency();
  void note_shown();
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
  void report_falling_bodies(std::span<const ObstacleDescription> obstacles);
  FallWatch make_fall_watch(std::span<const ObstacleDescription> obstacles) const;
  std::string falls_for_ever(std::size_t body, const StepReport& report);
  void note_contact(const ContactReport& contact);
  std::string gained_energy();
  ObstacleWatch::Surface surface_of(const SoftBody& body) const;
  std::string inside_a_body(std::size_t body);
  std::string through_a_body(std::size_t body);
  std::string inside_the_surface(std::size_t body);
  void watch_bodies(StepReport& report);
  void report_fast_components(const RealSurfaceReport& surface, StepReport& report) const;
  // settle.cpp
  void check_settles() const;
  void settle(StepReport& report);
  void settle_interval(int substeps, StepReport& report);
  double settling_dt_s() const;
  /// A frame between begin_step() and its end.
  struct OpenFrame {
    double begin_s = 0;  ///< on the clock of now_s(); with the time that its images took before
    FrameTimes times{};
    StepReport report{};
    bool is_new = false;       ///< its images
    bool uploads = false;      ///< those are sent with the part that was submitted, or comes
    bool looks_first = false;  ///< that part only makes the new surface
    FramePart part{};          ///< that was submitted
    double part_begin_s = 0;   ///< likewise, on that clock
    double done_s = 0;         ///< of the frame's simulated time
  };
  void submit_part(OpenFrame& frame);
  void finish_part(OpenFrame& frame);
  void find_component_speeds();
  void collect(StepReport& report);
  /// After each part of a frame.
  void collect_bodies(double dt_frame_s, int substeps, StepReport& report);
  /// By blades, after the frame's substeps. @param from_s,to_s of its simulated time
  void cut_bodies(double from_s, double to_s, StepReport& report);
  cut::BladeStrip seen_strip(std::size_t blade) const;
  cut::BladeStrip strip_of(std::size_t blade, double from_s, double to_s) const;
  CutScore& stroke_of(const std::string& blade, const std::string& body, double from_s);
  static void add_cut(const cut::BladeStrip& strip, const cut::CutReport& cut, double from_s, double to_s,
                      CutScore& score);
  void follow_cuts(std::size_t body, std::vector<Notice>& notices);
  /// @returns whether the body has changed
  bool cut_body(std::size_t body, std::size_t blade, const cut::BladeStrip& strip, double from_s, double to_s,
                StepReport& report);
  void report_full(const std::string& who, const SoftBody& body, double from_s, std::vector<Notice>& notices);
  // world_growth.cpp
  void rebuild(const std::vector<Index>& capacities);
  std::vector<Index> cut_capacities() const;
  void archive_capacities(StateArchive& a);
  void archive_cut_bodies(StateArchive& a, std::size_t goes_on);
  void archive_cuts_of(std::size_t body, StateArchive& a, bool ends_frame);
  // world_grab.cpp
  void attach(const Grab& grab);
  void release_grab();
  void begin_grab();
  void follow_cut_of_grab();
  void archive_grab(StateArchive& a);
  void select_recording();
  void archive_cuts(StateArchive& a);
  void archive_scores(StateArchive& a);
  static void add_contact(const BodyContact& contact, StepReport& report);
  /// The contacts of a body that are asked for, after each part of a frame.
  void log_points(std::size_t body, const std::function<std::string(Index)>& name_of);

  DeviceSet& devices_;
  Scene scene_;
  const std::vector<KeyFingerprint> fingerprint_ =
      scene_fingerprint(scene_);                         ///< before parameters changed it
  Perception* perception_;                               ///< nullptr: no cameras, nothing is reconstructed
  unsigned reductions_made_ = 0, reductions_asked_ = 0;  ///< bits
  float sample_spacing_m_;
  std::vector<std::unique_ptr<SoftBody>> bodies_;
  MovingObstacles moving_obstacles_;
  HeldBlades held_blades_;
  std::optional<Grab> grab_;
  std::size_t grabbed_ = 0;  ///< number of the body
  Vec3d grabbed_at_m_;       ///< the nearest vertex, when it was grabbed
  ObstacleWatch obstacle_watch_;
  EnergyWatch energy_watch_;
  FallWatch fall_watch_;
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
  Observation seen_;  ///< of the last images
  SeenTools tools_;   ///< likewise; without the strips that have cut
  double last_dt_s_ = 0;
  double meshed_s_ = 0;  ///< when the mesh of the last images was there
  float last_substep_s_ = 0;
  bool has_surface_ = false;  ///< images came
  bool is_shown_ = true;      ///< the last images
  bool is_settled_ = false;   ///< or need not be
  std::vector<Reach>
      component_speeds_;  ///< of the real surface at its capture, and of all that is in tool_speeds_
  std::vector<Reach> tool_speeds_;  ///< of moving obstacles and tracked tools
  int part_ = 0;                    ///< of the frame that runs
  std::optional<OpenFrame> open_;
  std::vector<CutScore> cuts_;
  std::vector<PlannedLine> plans_;
  int cut_frame_ = 0;
  std::vector<Notice> start_notices_;     ///< for the first frame to tell
  std::set<std::string> reported_cuts_;   ///< notices given of blades and bodies
  std::map<std::string, double> full_s_;  ///< when a blade, or one in a body, found no capacity last
  SubstepChoice substep_choice_;
  SceneParameters parameters_;
  Timings timings_;
};

}  // namespace tactus
