#pragma once
/// Contents of a scene file: plain data, complete with defaults, checked when it was read (io/scene_file.h).
/// docs/scene.md, generated from the declaration in io/scene_schema.cpp, explains every field to users.
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tactus/base/vec.h"
#include "tactus/contact/contact_report.h"
#include "tactus/geom/mesh/mesh.h"
#include "tactus/rig/sources/source_kinds.h"
#include "tactus/tissue/tled/elastic_material.h"

namespace tactus {

struct LabelVolume;

/// Axis-aligned box in double precision [m].
struct BoxRegion {
  Vec3d min_m, max_m;
};

/// Frames that a synthetic source gives when nothing says where it ends: ten seconds at its 30 per second.
inline constexpr int kSyntheticFrames = 300;

/// Frames `first` to `last`, both included; without `last`, to the end of the recording.
struct FrameRange {
  int first = 0;
  std::optional<int> last;
};
/// Reads "A-B", "A-" or "A" (that frame alone); nothing when the text is neither or B < A.
std::optional<FrameRange> parse_frame_range(std::string_view text);
std::string frame_range_text(const FrameRange& range);

struct SourceDescription {
  SourceKind kind = SourceKind::synthetic;
  std::string figure = "hand";  ///< synthetic only
  std::string path;  ///< rig YAML, or folder of Middlebury or Azure Kinect, resolved; empty for synthetic
  FrameRange frames;
  std::optional<double> fps;  ///< none: the recording's own; synthetic 30
  bool moving = true;         ///< synthetic only
  double scale = 1;           ///< synthetic only
  Vec3d offset_m;             ///< synthetic only
  int depth_cameras = 1;      ///< synthetic only
  bool plain = false;         ///< live only: without keys, on this computer alone
};

struct ReconstructionDescription {
  int resolution = 100;                  ///< voxels along the longest side of the workspace
  std::optional<BoxRegion> workspace_m;  ///< none: the rig's
  bool depth = true;                     ///< use the depth camera when the source has one
  bool repair_masks = false;             ///< fill holes in the mask of a suspect view
  int tolerated_views = 0;               ///< keep space that up to so many views carve
  int min_views = 2;                     ///< space that fewer cameras look at is outside
  int smooth = 0;                        ///< steps of smoothing that keep edges and volume
  double depth_jump_m = 0.1;             ///< neighbouring depth pixels that differ by more are not used
  // Capacity for the surface; 0: from the resolution. HullOptions says more.
  int max_active_bricks = 0;
  int max_vertices = 0;
  int max_triangles = 0;
};

enum class ShapeKind : std::uint8_t { box, sphere, figure, mesh, labels };

struct ShapeDescription {
  ShapeKind kind = ShapeKind::box;
  Vec3d size_m = {0.3, 0.1, 0.3};    ///< box, centred on the body's origin
  double radius_m = 0.1;             ///< sphere, centred on the body's origin
  std::string figure;                ///< figure: its name
  std::string path;                  ///< mesh or labels: the file, resolved
  double unit_m = 1;                 ///< mesh: metres per unit of length in the file
  MeshFill fill = MeshFill::closed;  ///< mesh: which points are inside
  std::vector<int> labels;           ///< labels: which of them are the body (1..255); empty: all but 0
};

/// Body to world: p_world = R (scale p_body) + position.
struct PlacementDescription {
  Vec3d position_m;
  Vec3d rotation_deg;  ///< about the fixed axes x, then y, then z
  double scale = 1;

  Mat3d rotation() const;
  Vec3d to_world(Vec3d p_body_m) const { return rotation() * (scale * p_body_m) + position_m; }
  Vec3d to_body(Vec3d p_world_m) const {
    return (1 / scale) * (transpose(rotation()) * (p_world_m - position_m));
  }
};

/// How a body deforms: shape matching, finite elements, or both (regions or a ratio say where).
enum class TissueModel : std::uint8_t { flsm, tled, hybrid };
enum class Stiffness : std::uint8_t { material, paper };
enum class Axis : std::uint8_t { x, y, z };

/// Ratio in a hybrid body of nodes of elements to nodes of shape matching. The elements are at the low end of
/// the axis.
struct RatioDescription {
  double tled = 6, flsm = 4;
  Axis axis = Axis::x;  ///< of the world
};

/// A part of the shear modulus that fades as exp(-t / time).
struct RelaxationDescription {
  double share = 0;  ///< of the shear modulus; all together below 1
  double time_s = 1;
};

struct MaterialDescription {
  TissueModel model = TissueModel::flsm;
  int half_width = 1;               ///< of the FLSM regions, in lattice cubes, 1..4
  double young_modulus_pa = 10000;  ///< E
  double poisson_ratio = 0.45;      ///< nu, elements only
  double density_kg_m3 = 1000;
  /// Part of critical damping of the fastest mode, 0..0.7. None: of the slowest (default_damping.h).
  std::optional<double> damping;
  double drag_per_s = 0;  ///< slows all motion, rigid motion too
  Stiffness kappa = Stiffness::material;
  bool deflection_test = false;  ///< scale shape matching until the held body sags as elements do
  MaterialLaw law = MaterialLaw::neo_hookean;  ///< elements only
  Vec3d fibre = {1, 0, 0};                     ///< transversely isotropic: direction, world
  double fibre_ratio = 0;                      ///< transversely isotropic: fibre stiffness over shear modulus
  std::vector<RelaxationDescription> relaxation;  ///< elements only; at most 2
};

enum class CoordinateFrame : std::uint8_t { body, world };
enum class RegionKind : std::uint8_t { box, sphere, half_space, label };

/// A part of space, in a body's rest state, or the cubes of some labels.
struct SpaceRegion {
  RegionKind kind = RegionKind::box;
  CoordinateFrame frame = CoordinateFrame::body;
  BoxRegion box;  ///< kind box
  Vec3d center_m;
  double radius_m = 0.05;    ///< kind sphere
  Vec3d point_m;             ///< kind half_space: a point on the plane
  Vec3d normal = {0, 1, 0};  ///< kind half_space: points out of the region; any length > 0
  std::vector<int> labels;   ///< kind label: of the body's label volume

  /// Whether a point, given in this region's own frame, is inside. Kind label: never.
  bool contains(Vec3d p_m) const;
};

enum class RegionModel : std::uint8_t { unchanged, flsm, tled };

/// Cubes whose centres lie in a region are of something else. Later regions paint over earlier ones.
struct PaintedRegion {
  std::string name;
  SpaceRegion where;
  RegionModel model = RegionModel::unchanged;                            ///< hybrid bodies
  std::optional<double> young_modulus_pa, poisson_ratio, density_kg_m3;  ///< none: the body's
  std::optional<double> bleeding;                                        ///< of its rate; none: all of it
};

struct MotionKeyDescription {
  double time_s = 0;
  Vec3d displacement_m;  ///< from rest, world
  double angle_deg = 0;  ///< from rest
};

/// Nodes that follow a given motion, linear between keyframes.
struct MovedRegion {
  std::string name;
  SpaceRegion where;
  std::vector<MotionKeyDescription> path;
  Vec3d axis = {0, 1, 0};           ///< of the angles, world
  std::optional<Vec3d> pivot_m;     ///< on the axis, in the region's frame; none: the middle of the nodes
  std::optional<double> release_s;  ///< the nodes are free from then on; none: never
};

struct LoadKeyDescription {
  double time_s = 0, factor = 1;
};

/// Load on a part of the body's surface: one of the three.
struct LoadedRegion {
  std::string name;
  SpaceRegion where;
  std::optional<Vec3d> force_n;               ///< in all
  std::optional<Vec3d> traction_pa;           ///< per area at rest
  std::optional<double> pressure_pa;          ///< into the body
  std::vector<LoadKeyDescription> over_time;  ///< empty: all of it, always
};

/// Nodes that are held along some axes of the world: all of them, or a roller or a plane of symmetry.
struct FixedRegion {
  SpaceRegion where;
  std::uint8_t axes = 7;
};

enum class BladeShape : std::uint8_t { scalpel, mesh };

/// A square marker on a tool, in the coordinates of its model's file.
struct BladeMarkerDescription {
  int id = 0;
  Vec3d at;           ///< its middle
  Vec3d right, down;  ///< of its pattern as one reads it; any length, at right angles
  double size = 0;    ///< of the black square
};

/// A tool of known shape that is tracked in the camera images.
struct TrackedBladeDescription {
  BladeShape model = BladeShape::scalpel;
  std::string path;                   ///< mesh: the file, resolved
  double unit_m = 1;                  ///< mesh: metres per unit of length in the file, and of the edge
  std::vector<Vec3d> edge;            ///< mesh: its cutting edge from the tip, in the file's units
  std::optional<double> two_sigma_m;  ///< it cuts only where its edge is known so well
  bool touches = false;               ///< whether its handle, back and flanks push and rub
  std::vector<BladeMarkerDescription> markers;
  std::string dictionary = "4X4_50";  ///< of all markers of a scene
};

/// The straight edge of a blade that follows keyframes, and cuts from the first to the last of them; that a
/// program holds; or a real one.
struct BladeDescription {
  std::string name;
  std::optional<TrackedBladeDescription> tracked;
  bool held = false;                       ///< a program sets its pose (World::set_pose)
  Vec3d from_m, to_m;                      ///< its ends where nothing moves it, world
  std::vector<MotionKeyDescription> path;  ///< linear between keyframes
  Vec3d axis = {0, 1, 0};                  ///< of the angles, world
  std::optional<Vec3d> pivot_m;            ///< on the axis, it moves along; none: from_m
};

/// Bleeding of the walls of cuts.
struct BleedingDescription {
  double rate_m_s = 0;             ///< volume per time and area
  std::optional<double> fading_s;  ///< the rate falls as exp(-t / fading_s); none: it stays
  /// Beats of the heart; none: it flows evenly.
  std::optional<double> pulse_per_min;
  double pulse_share = 0.6;  ///< the rate swings by so much of itself, up and down
};

struct BodyDescription {
  std::string name;
  ShapeDescription shape;
  PlacementDescription placement;
  double spacing_m = 0.02;  ///< edge of a lattice cube, in the world
  MaterialDescription material;
  std::optional<RatioDescription> ratio;  ///< hybrid
  bool contact = true;                    ///< the real surface pushes it
  int matching_every = 1;                 ///< hybrid: substeps of the elements to one of shape matching
  bool cuttable = false;                  ///< blades cut its elements
  std::optional<double> cut_energy_j_m2;  ///< that a new wall takes, per area; none: unknown
  std::optional<int> cut_capacity;        ///< most copies of cubes; none: no limit, capacity grows
  std::optional<BleedingDescription> bleeding;
  std::vector<PaintedRegion> regions;
  std::vector<FixedRegion> fixed;     ///< where lattice nodes don't move
  std::vector<MovedRegion> moved;     ///< where they follow a given motion
  std::vector<LoadedRegion> loads;    ///< on the surface
  Vec3d colour = {0.84, 0.42, 0.36};  ///< sRGB, 0..1

  /// Whether a point at rest at `p_world_m` is in a region.
  bool in(const SpaceRegion& region, Vec3d p_world_m) const;
};

enum class ObstacleShape : std::uint8_t { plane, box, sphere, mesh };

/// A rigid thing that bodies touch: it stands still, follows keyframes, or is held by a program.
struct ObstacleSetting {
  std::string name;
  ObstacleShape kind = ObstacleShape::plane;
  PlacementDescription placement;            ///< a plane is y = 0 of its own coordinates and solid below
  Vec3d size_m = {1, 0.1, 1};                ///< box, centred on the obstacle's origin
  double radius_m = 0.05;                    ///< sphere, likewise
  std::string path;                          ///< mesh: the file, resolved
  double unit_m = 1;                         ///< mesh: metres per unit of length in the file
  std::vector<MotionKeyDescription> motion;  ///< keyframes, from its placement; empty: it stands still
  Vec3d axis = {0, 1, 0};                    ///< of their angles, world
  std::optional<Vec3d> pivot_m;              ///< on the axis; none: where its origin is placed
  bool held = false;                         ///< a program sets its pose (World::set_pose)

  bool moves() const { return held || !motion.empty(); }
};

struct BlockDescription {
  BoxRegion box;
  Vec3d velocity_m_s;
};

struct EmitterDescription {
  std::string name;
  Vec3d position_m, direction = {0, -1, 0};
  double radius_m = 0.01, speed_m_s = 0.5, from_s = 0;
  std::optional<double> until_s;  ///< none: never
};

struct SinkDescription {
  BoxRegion box;
};

/// Which faces of the liquid's box are no walls.
enum class LiquidOpen : std::uint8_t { none, top, sides, all };

enum class LiquidLooks : std::uint8_t { blood, water };

enum class LiquidModel : std::uint8_t { wcsph, dfsph };

enum class LiquidViscosity : std::uint8_t { newton, carreau };

struct LiquidDescription {
  LiquidModel solver = LiquidModel::dfsph;
  int iterations = 4;  ///< dfsph
  double spacing_m = 0.01;
  BoxRegion box;
  LiquidOpen open = LiquidOpen::none;
  std::vector<BlockDescription> blocks;
  std::vector<EmitterDescription> emitters;
  std::vector<SinkDescription> sinks;
  int max_particles = 40000;
  double density_kg_m3 = 1060, viscosity_pa_s = 0.0035;
  LiquidViscosity viscosity = LiquidViscosity::newton;
  double zero_shear_viscosity_pa_s = 0.056, relaxation_s = 3.313, power_index = 0.3568;  ///< carreau: blood
  double surface_tension_n_m = 0, contact_angle_deg = 90;
  double artificial_viscosity = 0.05;
  std::optional<double> max_speed_m_s;  ///< none: that of a fall through the box
  std::optional<bool> film;    ///< bodies and obstacles that it wets have a film; none: has_film() decides
  double film_drying_m_s = 0;  ///< by which a film gets thinner, and leaves a stain
  LiquidLooks looks = LiquidLooks::blood;
  std::optional<int> least_particles;  ///< LiquidSettings'; in no file: results don't depend on it
};

struct ContactDescription {
  std::optional<double> sample_spacing_m;  ///< of the real surface; none: the smallest lattice spacing
  double friction = 0.4;                   ///< Coulomb's coefficient
  double restitution = 0;                  ///< 0 (no bounce) .. 1
  ContactResponse response = ContactResponse::exact;
  bool bodies = true;     ///< bodies touch one another
  bool self = false;      ///< each body touches itself
  bool cut_walls = true;  ///< of a body that is cut: the walls of an incision, and parts
  int every = 1;          ///< substeps from a correction of touching bodies to the next
};
/// Whether anything of a body may touch the same body.
inline bool touches_itself(const ContactDescription& contact, bool cuttable) {
  return contact.self || (contact.cut_walls && cuttable);
}

/// How bodies are before the first frame: as built, or at rest under gravity and loads.
enum class FrameStart : std::uint8_t { undeformed, settled };

struct FrameDescription {
  FrameStart start = FrameStart::undeformed;
  std::optional<double> dt_s;   ///< simulated time per frame; none: the time between frame sets
  double max_dt_s = 0.25;       ///< no frame simulates more
  std::optional<int> substeps;  ///< none: as many as the bodies' stable step asks for
  int max_substeps = 2000;      ///< of a frame, however strained the bodies are
};

struct ViewCameraDescription {
  std::optional<Vec3d> target_m;     ///< none: the middle of workspace and bodies
  std::optional<Vec3d> eye_m;        ///< none: on the orbit below
  std::optional<double> distance_m;  ///< none: as near as all of workspace and bodies is in the picture
  double azimuth_deg = 30;           ///< 0: from +Z, 90: from +X
  double elevation_deg = 25;         ///< above the horizon
  double field_of_view_deg = 40;     ///< vertical
};

struct ViewDescription {
  Vec2i size_px = {1280, 720};
  ViewCameraDescription camera;
  bool show_frusta = true;
  bool show_models = false;  ///< colour hybrid bodies by the model that deforms them
  int photographs = 0;       ///< from how many each component of the real surface takes its colour; 0: none
  bool overlay = true;
};

/// A point of a body whose position is recorded in every frame.
struct ProbeDescription {
  std::string name;
  std::string body;
  CoordinateFrame frame = CoordinateFrame::body;
  Vec3d position_m;  ///< at rest, in `frame`
};

/// A line that blades are to follow on a body's surface.
struct PlanDescription {
  std::string name;
  std::string body;
  CoordinateFrame frame = CoordinateFrame::body;
  std::vector<Vec3d> line;            ///< polyline on the surface at rest, in `frame` [m]
  std::optional<double> tolerance_m;  ///< none: the body's spacing
};

struct OutputDescription {
  bool video = true;
  bool contact_sheet = true;
  bool score = true;  ///< a picture of each body that was cut
  bool trace = false;
  int mesh_every = 0;  ///< frames from one set of PLY files to the next; 0: none
  int vtk_every = 0;   ///< frames from one set of VTK files to the next; 0: none
  int usd_every = 0;   ///< frames from one time code of the USD file to the next; 0: none
};

struct Scene {
  std::string name;
  SourceDescription source;
  ReconstructionDescription reconstruction;
  std::vector<BodyDescription> bodies;
  std::vector<ObstacleSetting> obstacles;
  std::vector<BladeDescription> blades;
  std::vector<PlanDescription> plans;
  std::optional<LiquidDescription> fluid;
  Vec3d gravity_m_s2 = {0, -9.81, 0};
  ContactDescription contact;
  FrameDescription frame;
  ViewDescription view;
  std::vector<ProbeDescription> probes;
  OutputDescription output;
};

/// File contents that shapes need, by the body's name; in the file's own coordinates, metres.
struct BodyAssets {
  std::map<std::string, TriangleMesh> meshes = {};
  std::map<std::string, std::shared_ptr<const LabelVolume>> labels = {};
  std::map<std::string, TriangleMesh> obstacle_meshes = {};  ///< by the obstacle's name
  std::map<std::string, TriangleMesh> blade_meshes = {};     ///< by the blade's name
};

}  // namespace tactus
