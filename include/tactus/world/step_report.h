#pragma once
/// Results of a frame: forces, contacts, surfaces.
#include <cstdint>
#include <string>
#include <vector>

#include "tactus/base/vec.h"
#include "tactus/contact/contact_report.h"
#include "tactus/fluid/liquid_report.h"
#include "tactus/geom/mesh/mesh.h"
#include "tactus/perception/perception.h"
#include "tactus/sim/notice.h"
#include "tactus/tissue/body_measures.h"

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
  Vec3d grab_N;                  ///< force of a grab on its body, mean over the frame
  double dt_s = 0;               ///< simulated
  std::vector<Notice> notices;   ///< all of this frame
};

/// Force and torque of a prescribed motion on a body.
struct MotionForce {
  Vec3d force_N, torque_N_m;  ///< the torque about the moved region's pivot
};

/// A body's nodes, in the order of its lattice; those of cuts come last.
struct BodyNodes {
  std::vector<Vec3f> positions_m, velocities_m_s;  ///< world
};

/// Where the tissue under a probe is, and how it is strained.
struct ProbeReading {
  Vec3f position_m;   ///< world
  CubeStrain strain;  ///< and stress
};

enum class ColliderKind : std::uint8_t { component, obstacle, tool, body };
/// "component", "obstacle", "tool" or "body": for programs.
const char* kind_text(ColliderKind kind);
/// "sticking", "sliding" or "left"; likewise.
const char* state_text(TouchState state);

/// A point of a body's surface that touched something in a frame, and the impulse that it got there.
///
/// The impulses of all entries add up to the change of the body's momentum by contact; a share of it that
/// goes to nodes that are held doesn't move them. Friction keeps to Coulomb's law in the sum over the points
/// that a body touches one thing with. A single point's tangential impulses may be more than mu times its
/// normal ones: up to 1.7 times over its life were seen with elements on a plane, as friction may still use
/// normal impulses of some corrections before (FrictionMemory), and neighbours share what one point is
/// pushed.
///
/// Velocities are those between two substeps (leapfrog). So the momentum of a frame whose length of substep
/// differs from the last one's has half a substep of gravity more or less than m g dt.
///
/// Entries with point -1 have only an impulse: that of points that went on to another collider within the
/// frame, and that of another body, as one sum.
struct BodyPointContact {
  Index point = -1;     ///< number among the contact points of the body; the same as long as it isn't cut
  std::string other{};  ///< as BodyContact::component
  ColliderKind kind = ColliderKind::component;
  Vec3f point_m{};  ///< world
  Vec3f normal{};   ///< unit, towards the body; 0 with `response: paper`
  float gap_m = 0;  ///< before the last correction of the frame; < 0: inside
  /// On the body over the frame. Split by the normal of the last correction: normal_N_s * normal +
  /// tangential_N_s.
  Vec3f impulse_N_s{};
  float normal_N_s = 0;
  Vec3f tangential_N_s{};
  TouchState state = TouchState::left;
};

/// From which side pictures are made: `view.camera` of the scene as it is now.
struct ViewAngles {
  double azimuth_deg = 0, elevation_deg = 0;  ///< unused where the scene gives the eye
  double field_of_view_deg = 40;
  friend bool operator==(const ViewAngles&, const ViewAngles&) = default;
};

/// The walls of a body's cuts, on its surface. Empty where nothing was cut.
struct CutWalls {
  std::vector<std::uint8_t> is_wall;  ///< per triangle
  std::vector<Vec3f> rest_m;          ///< per vertex: where it is at rest
  float spacing_m = 0;                ///< of the body
};

/// Meshes for viewers and exporters: owns its data, never the world's.
struct FrameSnapshot {
  TriangleMesh real;                       ///< the reconstructed surface, with normals
  std::vector<TriangleMesh> bodies;        ///< in the scene's order
  std::vector<Index> smooth;               ///< per body: so many of its first vertices are at no crease
  std::vector<TriangleMesh> obstacles;     ///< those that move, in the scene's order
  std::vector<TriangleMesh> blades;        ///< held ones, as in the scene; then tracked ones; then others
  std::vector<ToolAxis> tools;             ///< tracked ones that were found
  std::vector<Vec3f> liquid_m;             ///< its particles, by id
  std::vector<FilmThickness> films;        ///< on the bodies, in their order; none where there is no film
  std::vector<WetObstacle> wet_obstacles;  ///< those on which a film or stain lies
  std::vector<CutWalls> cut_walls;         ///< of the bodies, in their order
  ViewAngles view;
  std::int64_t tick = 0;  ///< of the images
  double captured_s = 0;  ///< when those came, on the clock of now_s()
};

}  // namespace tactus
