#pragma once
/// From images to the surface and the tools that touch bodies.
#include <memory>
#include <optional>
#include <span>

#include "tactus/frame/schedule.h"
#include "tactus/perception/observation.h"
#include "tactus/perception/tracked_blades.h"
#include "tactus/reconstruct/doctor/mask_repair.h"
#include "tactus/reconstruct/hull_check.h"
#include "tactus/reconstruct/surface_pipeline.h"
#include "tactus/rig/sources/frame_source.h"
#include "tactus/sim/body/body_shape.h"
#include "tactus/sim/frame_clock.h"

namespace tactus {

/// Owns all that looks at images: the pipelines of the surface, the checks of masks and hull, the tracked
/// tools. observe() does the host's part of a frame. The surface itself is made by stages in the schedule of
/// the World that was constructed with this object, so a frame is one submission and the mesh never leaves
/// the devices. One thread calls it.
///
///   Perception perception(devices, scene, rig, assets);
///   World world(devices, scene, assets, &perception);
///   per frame: world.set_surface(perception.observe(&frame, dt_s)); world.step(dt_s);
class Perception {
 public:
  /// @param can_reduce prepares for a coarser hull on demand, which takes memory
  /// @throws Error naming the fault of the rig; usage Error for a rig without cameras.
  Perception(DeviceSet& devices, const Scene& scene, const Rig& rig, const BodyAssets& assets,
             bool can_reduce = false);

  /// @param frame the rig's new images, or nullptr when nothing new came. They are read until the World's
  /// next step has ended @param dt_s as World::step's
  Observation observe(const FrameSet* frame, double dt_s);
  /// After the last frame: notices that came later than their frames, as those of the check of masks.
  std::vector<Notice> last_notices();

  const TrackedBlades& tracked_blades() const { return tracked_blades_; }
  /// The hull that makes the surface at present.
  const VisualHull& hull() const { return pipeline().hull(); }
  /// Edge of a voxel of the hull that isn't reduced.
  float voxel_size_m() const { return fine_.voxel_size_m(); }
  const Box3f& workspace_m() const { return workspace_m_; }
  /// The surface of the last frame. Synchronizes.
  TriangleMesh download() { return pipeline().download(); }

  // For the World.
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

/// nullptr for a rig without cameras: a World needs none.
std::unique_ptr<Perception> make_perception(DeviceSet& devices, const Scene& scene, const Rig& rig,
                                            const BodyAssets& assets, bool can_reduce = false);

}  // namespace tactus
