#pragma once
/// One virtual body of a scene: its lattice, its solver, the surface that is seen and the nodes that touch.
#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "tactus/contact/walls/wall_mesh.h"
#include "tactus/fluid/wound_piece.h"
#include "tactus/frame/schedule.h"
#include "tactus/sim/body/body_point.h"
#include "tactus/sim/body/body_shape.h"
#include "tactus/sim/body/slab_points.h"
#include "tactus/tissue/body_monitors.h"
#include "tactus/tissue/cut/body_cutter.h"
#include "tactus/tissue/cut/cut_points.h"
#include "tactus/tissue/cut/cut_wounds.h"
#include "tactus/tissue/cut/point_blocks.h"
#include "tactus/tissue/embedded_surface.h"

namespace tactus {

class SoftBody {
 public:
  /// Its seen surface is on the first device; it is stepped by as many as pay, or by the first alone.
  SoftBody(DeviceSet& devices, const BodyDescription& body, const BodyAssets& assets,
           bool on_first_device = false);

  const std::string& name() const { return description_.name; }
  /// Record that its last stage leaves for the host.
  Resource report_resource() const { return stage("report"); }
  Resource contact_resource() const { return stage("contact report"); }
  Index node_count() const { return shape_.lattice.node_count(); }
  Index contact_point_count() const { return points_.count(); }
  /// Points of its surface that touch; of a body on one device, as the next but one. Those without weights
  /// are capacity. Synchronizes.
  std::vector<EmbeddedPoint> contact_points(ExecContext& ctx) const {
    return to_host(ctx, points_.points(0).table().points);
  }
  Resource nodes_resource() const { return stage("nodes"); }
  ContactNodes contact_nodes() const { return points_.nodes(0); }
  MeshFill fill() const { return description_.shape.fill; }
  /// Its limits of steps hold for the body; its nodes may be a part of the body's.
  const Hybrid& model() const { return tissue_.model(); }
  /// Substeps for which the body is stable as strained as it was at the end of the last part of a frame.
  int substeps_for(float dt_s) const { return model().substeps_for(dt_s, strain_.speed_ratio); }
  /// Speed of the fastest among its elements and the things that act on it, in the time of its motions given
  /// [m/s]; 0 for a body on which nothing acts. Shape matching is as stable, however it is strained.
  double fastest_near_m_s(double surface_m_s, double from_s, double to_s) const;
  /// At the end of the last frame that was waited for.
  const RigidMotion& motion() const { return motion_; }
  double spacing_m() const { return description_.spacing_m; }
  /// At the end of the last frame that was waited for.
  double kinetic_J() const { return motion_.kinetic_J; }
  /// All nodes stand still where they were so long ago. Synchronizes.
  void stop_nodes(ExecContext& ctx, double ago_s);
  /// Takes from the velocity of each node. Synchronizes.
  void slow_nodes(ExecContext& ctx, std::span<const Vec3d> by_m_s);
  /// Per moved region, in the description's order: mean force and torque on the body over the last frame.
  /// Synchronizes.
  BodySolver::MotionForces motion_forces(double dt_frame_s) { return tissue_.motion_forces(dt_frame_s); }
  /// Between frames: Young's modulus of the body, and those of its regions in proportion; and its drag. Other
  /// parts of a material can't change. A recorded frame must be recorded anew.
  void set_young_modulus_Pa(double young_Pa);
  void set_drag_per_s(double drag_per_s) { description_.material.drag_per_s = drag_per_s; }
  /// The rate of a body that bleeds; likewise.
  void set_bleeding_m_s(double rate_m_s) { description_.bleeding.value().rate_m_s = rate_m_s; }
  /// Declares its work in a frame: steps, contact, the check of nodes, and the surface that is seen. `world`
  /// and the schedule's frame must outlive its runs.
  void add_stages(Schedule& schedule, Readback& readback, ContactOnDevices& world, Vec3f gravity_m_s2);
  /// Its reactions on the things that it touched, over the frame that was waited for.
  ContactReport contact(const Readback& readback, float dt_frame_s, int substeps) const;
  /// Likewise, point by point. Synchronizes.
  std::vector<ContactPoint> contacts() { return points_.contacts(); }
  /// After the frame was waited for: takes over the strain of the elements and the records of the check of
  /// nodes. A body that blew up goes back to where it was at the beginning of the frame and stays there from
  /// then on, which synchronizes.
  /// @param substeps of the frame
  /// @returns "" or a text: substep, node, and the causes that act there.
  std::string end_frame(ExecContext& ctx, const Readback& readback, int substeps);
  const tled::CubeExtremes& strain() const { return strain_; }
  bool is_frozen() const { return is_frozen_; }
  /// Fastest over the last frame [m/s]; node -1: nothing moved.
  float fastest_m_s() const;
  Index fastest_node() const { return node_check_.fastest_node; }
  /// Speed of the fastest strain wave in its material [m/s].
  double wave_m_s() const;
  /// The causes that act on the body next to its point p_m at rest: "'moved[0]' (grip) moves it, at up to 0.3
  /// m/s", "'fixed' holds it, 0.02 m from there"; "" for nothing. Synchronizes.
  std::string acting_near(Vec3f p_m) const;
  /// Centre of a cube at rest [m].
  Vec3f cube_center_m(Index cube) const;
  /// @throws Error when the elements are not stable in so many substeps, or shape matching, at its rate,
  /// would be softer than its material; warns, once, when so few make shape matching softer than its
  /// material, or when a frame takes more than `most_of_frame`.
  void check_substeps(float dt_frame_s, int substeps, int most_of_frame);
  /// "" or, once it begins, that cubes are inverted, and which is worst.
  std::string newly_inverted();
  /// "node 17, at rest at (0.1, 0.2, 0.3) m".
  std::string node_text(Index node) const;
  Vec3f rest_m(Index node) const { return shape_.lattice.rest_m(node); }
  /// "cube 17, at rest round (0.1, 0.2, 0.3) m in region 'tumour'".
  std::string cube_text(Index cube) const;
  /// Strain and stress of its cubes. Synchronizes.
  std::vector<CubeStrain> strains(ExecContext& ctx) const;
  /// Strain and stress of some of its cubes, whose nodes are at x_m.
  std::vector<CubeStrain> strains(std::span<const Vec3f> x_m, std::span<const Index> cubes) const;
  std::vector<Vec3f> velocities_m_s(ExecContext& ctx) const {
    return to_host(ctx, tissue_.body().v_m_s.const_view());
  }
  /// All of its state that a run goes on from. Synchronizes. @throws Error when the archive is another
  /// body's.
  void archive(StateArchive& a);
  /// Energies, momentum, volume. Synchronizes.
  /// @param step_s the last substep
  BodyMonitors monitors(ExecContext& ctx, double step_s = 0) const;

  // body_cut.cpp
  bool is_cuttable() const { return cutter_.has_value(); }
  /// Cuts it by the strip that an edge swept since the last frame, as the body saw it. Called between two
  /// frames. Synchronizes.
  /// @param blade number of the blade @param observer of each change, after the body took it over
  using CutObserver = std::function<void(const TopologyChange&, std::span<const PointChange>)>;
  cut::CutReport cut(ExecContext& ctx, std::size_t blade, const cut::BladeStrip& strip,
                     const CutObserver& observer = {});
  /// Cuts from now on count to this stroke, 0, 1, .. of the body.
  /// @param frame of the simulation
  void begin_stroke(Index stroke, int frame) {
    stroke_ = stroke;
    cut_frame_ = frame;
  }
  /// Walls that a stroke made, at rest, in lattice coordinates.
  std::span<const std::array<Vec3d, 3>> walls_of(Index stroke) const;
  const cut::BodyCutter& cutter() const { return *cutter_; }
  /// Its cuts so far; cuts that are read are done once more. For a cuttable body, before archive().
  /// Synchronizes. @throws Error when the archive is another body's.
  /// @param end_frame when all cuts of a frame were done
  void archive_cuts(ExecContext& ctx, StateArchive& a, const CutObserver& observer,
                    const std::function<void()>& end_frame);
  /// A point moves with the copy that has its material now.
  void follow_cut(BodyPoint& point) const;
  /// After all blades cut in a frame.
  void remember_nodes() {
    last_x_m_.swap(x_m_);
    x_m_.clear();
  }
  /// Its surface as a liquid feels it, all of it. Synchronizes.
  WallChange walls(ExecContext& ctx);
  /// Changes of its surface by cuts since the last call, or since walls().
  WallChange take_wall_change();
  /// From now on, walls of cuts are wounds of a liquid, if the body bleeds. @param spacing_m of its particles
  /// @returns the components that there will be at most; 0: it doesn't bleed
  Index keep_wounds(float spacing_m);
  const std::optional<BleedingDescription>& bleeding() const { return description_.bleeding; }
  std::vector<WoundPiece> wound_pieces() const;
  /// Some found no capacity.
  bool wounds_are_full() const { return wounds_.is_full(); }
  void forget_wall_change() { wall_changes_ = {}; }
  /// State of a cuttable body: its parts, copies in use, and the volumes that its surface encloses.
  /// Synchronizes.
  struct CutState {
    int parts = 1;
    Index copies = 0;
    std::vector<double> closed_volumes_m3;
  };
  CutState cut_state(ExecContext& ctx) const;

  /// Whether the real surface never touches it: it goes a frame at a time.
  bool is_untouched() const { return !description_.contact; }
  /// Devices that step it, and why no more of those there are.
  int device_count() const { return tissue_.slab_count(); }
  std::string devices_text() const;
  /// Substeps of a frame are a multiple of this.
  int matching_every() const { return model().flsm() ? description_.matching_every : 1; }
  Resource surface_resource() const { return stage("surface"); }
  /// The seen surface, where recorded launches find it after each cut.
  const EmbeddedSurface& seen_surface() const { return surface_; }
  /// Moves the seen surface to where the nodes are now.
  void update_surface(ExecContext& ctx) { surface_.update(ctx, tissue_.body()); }
  /// Vertices of the seen surface that a cut left without triangles, and the nearest ones at rest that have
  /// some. @param wanted per vertex: 1 for those to look at
  struct VertexHeir {
    Index from = 0, to = 0;
  };
  std::vector<VertexHeir> heirs(std::span<const std::uint8_t> wanted) const;
  /// The seen surface on the host. Synchronizes.
  TriangleMesh surface(ExecContext& ctx) const { return surface_.to_mesh(ctx); }
  /// Per triangle of the seen surface: 1 where elements deform it. Synchronizes.
  std::vector<std::uint8_t> element_triangles(ExecContext& ctx) const;
  /// Positions of all nodes on the host [m]. Synchronizes.
  std::vector<Vec3f> positions_m(ExecContext& ctx) const {
    return to_host(ctx, tissue_.body().x_m.const_view());
  }
  /// At rest.
  const BodyShape& shape() const { return shape_; }

 private:
  SoftBody(DeviceSet& devices, const BodyDescription& body, BodyShape shape, bool on_first_device);

  std::string stage(const char* what) const { return "body '" + name() + "': " + what; }
  StageDevices stage_devices() const { return device_count() > 1 ? StageDevices::all : StageDevices::first; }
  void add_contact_stages(Schedule& schedule, Readback& readback, ContactOnDevices& world);
  void begin_stage(ExecContext& ctx);
  int check_every(int substeps) const;
  bool nothing_acts() const { return is_untouched() && shape_.motions.empty() && shape_.loads.empty(); }
  void find_largest_energy();
  void warn_of_many_substeps(float dt_s, int substeps, int most);
  /// "" or why the body's state is none that its material could reach.
  std::string impossible_state() const;
  void make_cuttable(ExecContext& ctx);
  void make_points();
  bool is_far(const cut::BladeStrip& strip) const;
  void archive_trails(StateArchive& a);
  void follow(ExecContext& ctx, const TopologyChange& change, const CutObserver& observer);
  void warn_of_fast_motion(const NodeMotion& motion) const;

  BodyDescription description_;
  double built_young_Pa_;
  BodyShape shape_;
  std::vector<ElasticMaterial> built_materials_;  ///< shape_'s, before Young's modulus was set
  TledOptions element_options_;
  DeviceSet& devices_;
  bool on_first_device_;
  BodySolver tissue_;
  bool is_frozen_ = false, warned_of_softness_ = false, warned_of_substeps_ = false, was_inverted_ = false;
  tled::CubeExtremes strain_{1, 0, 1, 0, 0};
  NodeCheckRecord node_check_;
  RigidMotion motion_;
  double largest_energy_J_ = 0;  ///< that its material could hold: Young's modulus times volume
  Buffer<Vec3f> frame_begin_x_m_;
  EmbeddedSurface surface_;
  bool full_stiffness_;
  SlabPoints points_;
  std::optional<cut::BodyCutter> cutter_;
  TopologyChange change_;  ///< by the last strip; its lists keep their capacity
  cut::CutPoints cut_points_;
  cut::CutWounds wounds_;
  Index stroke_ = 0;
  int cut_frame_ = 0;
  std::vector<std::vector<std::array<Vec3d, 3>>> stroke_walls_;  ///< per stroke
  /// Which stroke, in which frame, made each journal of the cutter.
  struct JournalOrigin {
    Index stroke = 0;
    std::int32_t frame = 0;
  };
  std::vector<JournalOrigin> journal_origins_;
  float wound_spacing_m_ = 0;  ///< 0: no wounds are kept
  /// Ids that cuts changed since take_wall_change().
  struct WallChangeIds {
    std::set<Index> vertices, cubes, triangles;
  };
  WallChangeIds wall_changes_;
  std::vector<Vec3f> x_m_;       ///< of nodes, while blades cut; empty: none is near
  std::vector<Vec3f> last_x_m_;  ///< in the frame before; empty: none was
  std::map<std::size_t, cut::BladeTrail> trails_;
};

}  // namespace tactus
