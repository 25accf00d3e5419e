#pragma once
/// One virtual body of a scene: its lattice, its solver, the surface that is seen and the nodes that touch.
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tactus/frame/stage.h"
#include "tactus/sim/body/body_shape.h"
#include "tactus/sim/body/body_status.h"

namespace tactus {

class BodyCuts;
class BodyMeasures;
class BodyPlaces;
class BodyPull;
class BodySolver;
class BodySteps;
class ContactOnDevices;
class EmbeddedSurface;
class Readback;
class Schedule;
class SlabPoints;
class StateArchive;

/// Names by which stages of a frame say that they read or change something of a body.
struct BodyResources {
  Resource nodes, surface;          ///< the surface that is seen
  Resource report, contact_report;  ///< records that the body's last stages leave for the host
};

/// Its parts have headers of their own, and answer for themselves: `body.places().node_text(node)`.
class SoftBody {
 public:
  /// Its seen surface is on the first device; it is stepped by as many as pay, or by the first alone.
  SoftBody(DeviceSet& devices, const BodyDescription& body, const BodyAssets& assets,
           bool on_first_device = false);
  SoftBody(const SoftBody&) = delete;
  SoftBody& operator=(const SoftBody&) = delete;
  ~SoftBody();

  const std::string& name() const { return description_.name; }
  /// With the parameters that were set since. Where it says no contact, the real surface never touches the
  /// body, which goes a frame at a time.
  const BodyDescription& description() const { return description_; }
  /// At rest, as it is cut by now.
  const BodyShape& shape() const { return shape_; }
  const BodyStatus& status() const { return status_; }
  BodyResources resources() const;
  /// Devices that step it, and why no more of those there are.
  std::string devices_text() const;

  /// Its solver. Limits of the steps of tissue().model() hold for the body; its nodes may be a part of the
  /// body's.
  const BodySolver& tissue() const { return *tissue_; }
  /// Points of its surface that touch; none without contact.
  SlabPoints& points() { return *points_; }
  const SlabPoints& points() const { return *points_; }
  /// The spring that may pull a body that touches.
  BodyPull& spring() { return *pull_; }
  /// The seen surface, where recorded launches find it after each cut.
  const EmbeddedSurface& surface() const { return *surface_; }
  const BodyMeasures& measures() const { return *measures_; }
  const BodyPlaces& places() const { return *places_; }
  BodySteps& steps() { return *steps_; }
  const BodySteps& steps() const { return *steps_; }
  /// Null: it isn't cuttable.
  BodyCuts* cuts() { return cuts_.get(); }
  const BodyCuts* cuts() const { return cuts_.get(); }

  /// Positions of all nodes on the host [m]. Synchronizes.
  std::vector<Vec3f> positions_m(ExecContext& ctx) const;
  std::vector<Vec3f> velocities_m_s(ExecContext& ctx) const;
  /// Between frames. Synchronizes.
  void set_nodes(std::span<const Vec3f> x_m, std::span<const Vec3f> v_m_s);
  /// Moves the seen surface to where the nodes are now. Asynchronous.
  void update_surface(ExecContext& ctx);
  /// Between frames: Young's modulus of the body, and those of its regions in proportion; and its drag. Other
  /// parts of a material can't change. A recorded frame must be recorded anew.
  void set_young_modulus_Pa(double young_Pa);
  void set_drag_per_s(double drag_per_s) { description_.material.drag_per_s = drag_per_s; }
  /// The rate of a body that bleeds; likewise.
  void set_bleeding_m_s(double rate_m_s) { description_.bleeding.value().rate_m_s = rate_m_s; }

  /// Declares its work in a frame: steps, contact, the check of nodes, and the surface that is seen. `world`
  /// and the schedule's frame must outlive its runs.
  void add_stages(Schedule& schedule, Readback& readback, ContactOnDevices& world, Vec3f gravity_m_s2);
  /// After the frame was waited for: takes over the strain of the elements and the records of the check of
  /// nodes. A body that blew up goes back to where it was at the beginning of the frame and stays there from
  /// then on, which synchronizes.
  /// @param substeps of the frame
  /// @returns "" or a text: substep, node, and the causes that act there.
  std::string end_frame(ExecContext& ctx, const Readback& readback, int substeps);
  /// "" or, once it begins, that cubes are inverted, and which is worst.
  std::string newly_inverted();
  /// All of its state that a run goes on from. Synchronizes. @throws Error when the archive is another
  /// body's.
  void archive(StateArchive& a);
  /// Whether it may get capacity for more: the scene sets no limit, and its cuts can be made once more.
  bool may_grow() const;
  /// A cuttable body gets this capacity, and is as it was made: without cuts, at rest. All its parts are new
  /// ones; their stages are added, and archive() is called, after that. Synchronizes.
  void rebuild(Index copies);

 private:
  SoftBody(DeviceSet& devices, const BodyDescription& body, BodyShape shape, bool on_first_device);

  std::string stage(const char* what) const { return "body '" + name() + "': " + what; }
  StageDevices stage_devices() const;
  void add_contact_stages(Schedule& schedule, Readback& readback, ContactOnDevices& world);
  void begin_stage(ExecContext& ctx);
  void find_largest_energy();
  /// "" or why the body's state is none that its material could reach.
  std::string impossible_state() const;
  /// @throws Error that names the body, and what is odd about its shape.
  void make_parts();
  void build_parts();
  void make_points_and_cuts();
  void warn_of_fast_motion(const NodeMotion& motion) const;

  BodyDescription description_;
  double built_young_Pa_;
  BodyShape uncut_;  ///< without capacity, of a cuttable one
  BodyShape shape_;
  std::vector<ElasticMaterial> built_materials_;  ///< shape_'s, before Young's modulus was set
  DeviceSet& devices_;
  bool on_first_device_;
  BodyStatus status_;
  bool was_inverted_ = false;
  double largest_energy_J_ = 0;  ///< that its material could hold: Young's modulus times volume
  Buffer<Vec3f> frame_begin_x_m_;
  std::unique_ptr<BodySolver> tissue_;
  std::unique_ptr<EmbeddedSurface> surface_;
  std::unique_ptr<SlabPoints> points_;
  std::unique_ptr<BodyPull> pull_;
  std::unique_ptr<BodyMeasures> measures_;
  std::unique_ptr<BodyPlaces> places_;
  std::unique_ptr<BodySteps> steps_;
  std::unique_ptr<BodyCuts> cuts_;
};

}  // namespace tactus
