#pragma once
/// The frame: silhouettes in, a reconstructed surface that pushes soft bodies, snapshots out.
#include <memory>
#include <optional>
#include <span>

#include "tactus/base/timing.h"
#include "tactus/reconstruct/hull_check.h"
#include "tactus/reconstruct/mask_repair.h"
#include "tactus/reconstruct/surface_texture.h"
#include "tactus/reconstruct/visual_hull.h"
#include "tactus/rig/frame_source.h"
#include "tactus/sim/body_point.h"
#include "tactus/sim/soft_body.h"

namespace tactus {

/// How a frame went.
struct StepReport {
  HullReport hull;
  ContactReport contact;
  int substeps = 0;
  double dt_s = 0;
  std::string status;  ///< empty, or what went wrong and its remedy
};

/// What viewers and exporters get: owns its data, never the simulation's.
struct FrameSnapshot {
  TriangleMesh real;                 ///< the reconstructed surface, with normals
  std::vector<TriangleMesh> bodies;  ///< in the scene's order
};

/// Owns all state; one thread calls it. Stages of a frame, in order (their names are those of the timings):
///   views      holes in masks are repaired, when the scene asks for it
///   upload     silhouettes to the devices                              writes masks
///   hull       classification, signs of nodes          reads masks     writes signs
///   mesh       marching cubes on the silhouettes       reads signs     writes real mesh
///   check      what the masks say about the mesh       reads real mesh
///   surface    samples and velocity of the real mesh   reads real mesh writes samples
///   bodies     substeps of forces, integration and contact             writes nodes
///   embed      seen surfaces follow the nodes          reads nodes     writes surfaces
/// Reconstruction is spread over all devices; bodies live on the first, and those that the real surface never
/// touches are stepped by as many as pay (HybridSlabs), with the same bits.
class Simulation {
 public:
  /// @throws Error naming what is wrong with rig, body or material.
  Simulation(DeviceSet& devices, const Scene& scene, const Rig& rig, const BodyAssets& assets);

  /// One frame. @throws Error when nothing can be right with rig or masks and no frame before was well.
  /// dt_s: time since the last frame's capture; 0 for the first.
  StepReport step(const FrameSet& frame, double dt_s);
  /// Copies what is to be seen to the host. Synchronizes.
  FrameSnapshot snapshot();
  /// World positions of the scene's probes [m], in its order. Synchronizes.
  std::vector<Vec3f> probe_positions_m();
  /// Of every body, in the scene's order. Synchronizes.
  std::vector<BodyMonitors> monitors();
  /// Per body and moved region: mean force of whoever moves it on the body over the last frame [N].
  /// Synchronizes.
  std::vector<std::vector<Vec3d>> motion_forces_N();

  const Timings& timings() const { return timings_; }
  const std::vector<std::unique_ptr<SoftBody>>& bodies() const { return bodies_; }
  const VisualHull& hull() const { return hull_; }
  /// Where bodies live.
  ExecContext& context() { return devices_.context(0); }

 private:
  struct Probe {
    std::size_t body;
    BodyPoint point;
  };
  /// @throws usage Error for a point that is not in its body, with the nearest one that is.
  void add_probe(const ProbeDescription& probe);
  /// The frame's depth images, or none when depth is not used.
  std::span<const DepthImage> depths(const FrameSet& frame) const;
  /// What a recording of a frame's substeps depends on.
  struct SubstepPlan {
    float dt_s = 0;
    int count = 0, resting_bodies = 0;
    friend bool operator==(const SubstepPlan&, const SubstepPlan&) = default;
  };
  SubstepPlan plan_substeps(float dt_s) const;
  /// The frame's silhouettes, repaired when the scene asks for it; tells what was suspect.
  std::span<const BitMask> silhouettes(const FrameSet& frame, std::string& status);
  void reconstruct(const FrameSet& frame, StepReport& report);
  void touch(double dt_s, StepReport& report);
  void run_substeps(ExecContext& ctx, const SubstepPlan& plan);

  DeviceSet& devices_;
  Scene scene_;
  VisualHull hull_;
  HullCheck hull_check_;
  SurfaceNormals normals_;  ///< for pictures
  bool uses_depth_;
  std::optional<ViewScores> view_scores_;  ///< when masks are repaired
  std::vector<BitMask> repaired_;
  float sample_spacing_m_;
  RealSurface surface_;
  std::vector<std::unique_ptr<SoftBody>> bodies_;
  Contact contact_;
  KeyedReplay<float> surface_replay_;
  KeyedReplay<SubstepPlan> substep_replay_;
  std::vector<Probe> probes_;
  double last_dt_s_ = 0;
  Timings timings_;
};

}  // namespace tactus
