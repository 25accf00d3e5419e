#pragma once
/// The inside of a Perception, for the World.
#include <memory>
#include <optional>
#include <span>

#include "tactus/frame/schedule.h"
#include "tactus/perception/perception.h"
#include "tactus/perception/tracked_blades.h"
#include "tactus/reconstruct/doctor/mask_repair.h"
#include "tactus/reconstruct/hull_check.h"
#include "tactus/reconstruct/surface_pipeline.h"
#include "tactus/sim/frame_clock.h"
#include "tactus/sim/reach.h"
#include "tactus/sim/scene.h"
#include "tactus/tissue/cut/lattice_cutter.h"

namespace tactus {

/// Tracked tools as of the last images.
struct SeenTools {
  std::vector<ToolMotion> motions;      ///< in the scene's order
  std::vector<Reach> reaches;           ///< of those that are there and touch
  std::vector<cut::BladeStrip> strips;  ///< by blades of the scene: the strip that a tracked edge passed
};

/// Perception's functions say more.
struct Perception::Impl {
 public:
  Impl(DeviceSet& devices, const Scene& scene, const Rig& rig, const BodyAssets& assets, bool can_reduce);

  Observation observe(const FrameSet* frame, double dt_s);
  std::vector<Notice> last_notices();

  const DeviceSet& devices() const { return devices_; }
  const TrackedBlades& tracked_blades() const { return tracked_blades_; }
  const VisualHull& hull() const { return pipeline().hull(); }
  float voxel_size_m() const { return fine_.voxel_size_m(); }
  const Box3f& workspace_m() const { return workspace_m_; }
  TriangleMesh download() { return pipeline().download(); }
  MeshView finished() { return pipeline().finished(); }

  /// Stages that make the surface, VisualHull::kMesh, and check it.
  void add_stages(Schedule& schedule, Readback& readback);
  /// In the memory of the first device.
  MeshView surface() const { return pipeline().surface(); }
  bool can_reduce() const { return coarse_ != nullptr; }
  /// From the next submission on, the hull has voxels twice as large, and isn't checked.
  void reduce(bool is_reduced) { is_reduced_ = is_reduced; }
  /// The host's part of the check of the hull. Call while the devices work on new images.
  void prepare_check();
  /// After a frame: how the hull went. @throws Error when the rig is wrong.
  HullReport report(const Readback& readback, std::vector<Notice>& notices);

 private:
  const SurfacePipeline& pipeline() const { return is_reduced_ ? *coarse_ : fine_; }
  SurfacePipeline& pipeline() { return is_reduced_ ? *coarse_ : fine_; }
  std::vector<Stage> surface_stages();
  /// The frame's silhouettes, repaired when the scene asks for it; notes suspect masks.
  std::span<const BitMask> silhouettes(const FrameSet& frame, Observation& seen);
  /// The same without tools that are tracked.
  std::span<const BitMask> follow_blades(std::span<const BitMask> masks, const FrameSet& frame, double dt_s,
                                         Observation& seen);
  /// The frame's depth images, or none when depth is not used.
  std::span<const DepthImage> depths(const FrameSet& frame) const;

  DeviceSet& devices_;
  Box3f workspace_m_;
  std::size_t blade_count_;  ///< of the scene
  bool uses_depth_;
  SurfacePipeline fine_;
  std::unique_ptr<SurfacePipeline> coarse_;  ///< where reductions may be made
  bool is_reduced_ = false;
  HullCheck hull_check_;
  std::optional<ViewScores> view_scores_;  ///< when masks are repaired
  std::vector<BitMask> repaired_;
  TrackedBlades tracked_blades_;
  FrameClock clock_;                 ///< the same times as the World's
  const FrameSet* frame_ = nullptr;  ///< while it is simulated
  std::span<const BitMask> masks_;   ///< likewise
};

}  // namespace tactus
