#pragma once
/// Soft bodies, liquid and obstacles, stepped frame by frame. Needs no camera.
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tactus/base/timing.h"
#include "tactus/base/vec.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/perception/perception.h"
#include "tactus/sim/stroke_result.h"
#include "tactus/world/scene_parameters.h"
#include "tactus/world/step_report.h"

namespace tactus {

struct BodyAssets;
struct Scene;

/// A spring from a point of a body's surface to a target. It is shared among the nodes near the point, as
/// fingers that pinch tissue hold more than a point of it. Absent values follow from the material and the
/// lattice.
struct Grab {
  std::string body;
  Vec3d point_m;                   ///< of the surface when the body is grabbed, world; the nearest counts
  Vec3d target_m;                  ///< world, pulls by stiffness times the way of target beyond point
  std::optional<double> radius_m;  ///< of the tissue that is held, at rest; absent: 2 spacings
  std::optional<double> stiffness_N_m;  ///< absent: 8 E radius; a stamp of that radius feels 2.5 E radius
  std::optional<double> max_force_N;    ///< absent: E pi radius^2 / 2, which strains the tissue by half
};

/// Owns bodies, liquid, obstacles, probes, cuts and time; one thread calls it. Bodies are stepped by as many
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
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// The next step has the surface and tools of these images. An observation without new images changes
  /// nothing: the surface goes on with its motion. @throws usage Error without a Perception, and for an
  /// observation of another one.
  void set_surface(Observation observation);
  /// One frame. @param dt_s time since the last frame, to the capture of new images or to now; 0 for the
  /// first. At most 'frame.max_dt_s' of it is simulated. One that is negative, not finite or above 2 s is a
  /// break of the clock: nothing is simulated, and a notice says so.
  /// @throws Error when 'frame.substeps' is not stable.
  StepReport step(double dt_s);
  /// step() in parts, for many worlds on one GPU: all submit a frame before any is waited for, each with the
  /// bits of step(). begin_step() submits work and waits for no GPU. continue_step() waits for that work; it
  /// submits the frame's next part, or ends the frame with its report. No other call comes between.
  void begin_step(double dt_s);
  std::optional<StepReport> continue_step();
  /// Where an obstacle or a blade with `held: true` is at the end of the next frame and from then on; it goes
  /// there evenly, and a blade cuts on the way. A rotation that is off by up to 1e-3 becomes the nearest. It
  /// cuts nothing in its first frame, in one of no time, or where its edge goes farther than 0.2 m. From a
  /// robot, a haptic arm, a mouse, a tracker.
  /// @param at_once it is there from the frame's beginning on: put down elsewhere, not led there
  /// @throws usage Error for a name that nothing held has, with the nearest that something has; and for a
  /// pose that is not finite or not rigid.
  void set_pose(const std::string& tool, const Rigidd& T_world_tool, bool at_once = false);
  /// Where it is now. @throws usage Error for other things than held blades and obstacles that move.
  Rigidd pose(const std::string& tool) const;
  /// From the next frame on, this grab's spring pulls, or none does. The same body, point and radius as
  /// before are the same grab: only its target and strength change. Stable at any stiffness: the spring is
  /// implicit.
  /// @throws usage Error for a body that isn't in the scene or has `contact: false`, a point that is not near
  /// its surface, and settings that are not positive.
  void set_grab(const std::optional<Grab>& grab);
  /// Numbers of the scene that may change while it runs: gravity, friction, stiffness, and so on.
  SceneParameters& parameters();
  /// From the next frame on, contacts() has those of this body. @throws usage Error for a body that isn't in
  /// the scene, with those that are.
  void report_contacts(const std::string& body);
  /// Contacts of a body over the last frame; none unless they were asked for by report_contacts() before it.
  const std::vector<BodyPointContact>& contacts(const std::string& body) const;
  /// Reductions that reduce_quality() can make in this scene's frames, the one that is missed least first.
  std::vector<QualityReduction> quality_reductions() const;
  /// From the next new images on, frames make these reductions and no others. On a GPU, each choice
  /// is recorded in its first frame.
  void reduce_quality(std::span<const QualityReduction> quality_reductions);
  /// Copies everything that is to be seen to the host. Synchronizes. The first call after a frame with live
  /// images counts as showing them, for their latency.
  FrameSnapshot snapshot();
  /// Readings of the scene's probes, in its order. Synchronizes.
  std::vector<ProbeReading> probes();
  /// Nodes of a body. Synchronizes. @throws usage Error for a body that isn't in the scene, with those that
  /// are.
  BodyNodes nodes(const std::string& body);
  /// Monitors of every body, in the scene's order. Synchronizes.
  std::vector<BodyMonitors> monitors();
  /// Per body and moved region: of the prescribed motion on the body, in the mean over the last frame.
  /// Synchronizes.
  std::vector<std::vector<MotionForce>> motion_forces();
  /// Results of the blades' strokes so far.
  const std::vector<CutScore>& cuts() const;
  /// The same, with lines on the skin and how they keep to the scene's plans. Looks at all walls of all cuts.
  std::vector<StrokeResult> stroke_results() const;
  const Timings& timings() const;
  /// nullptr: nothing is reconstructed.
  Perception* perception() const;

  /// All that the coming frames depend on. Synchronizes. @param last the frame that was stepped last, or
  /// nullptr for none: the state has only those data of the real surface that can't be made from it
  std::string save_state(const FrameSet* last = nullptr);
  /// Takes a state over, in a world that has no cuts yet. It must be of the same scene, on the same devices,
  /// and `last` the same frame. @throws Error when it is of another scene; the world is of no use then.
  void load_state(const std::string& state, const FrameSet* last = nullptr);

  struct Impl;
  /// For the library itself: its header is not installed.
  Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// Hash of the positions and velocities of all bodies' nodes and of the positions of the real surface and the
/// liquid, in hexadecimal: the same on every set of devices. Synchronizes.
std::string state_hash(const World& world);

}  // namespace tactus
