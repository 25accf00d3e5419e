#pragma once
/// The cheap check of every tick: how much of each mask the hull covers, and how much of it lies on the faces
/// of the workspace. It looks at up to 8192 vertices and at one pixel in a tile of masks, so its cost does
/// not grow with the resolution.
#include <span>
#include <vector>

#include "tactus/geom/image.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/reconstruct/hull_check_kernels.h"
#include "tactus/reconstruct/hull_findings.h"
#include "tactus/reconstruct/visual_hull.h"

namespace tactus {

/// Owned by whoever steps frames. Per frame: `submit` when the mesh is made, `quality` or `news` when its
/// result is wanted.
class HullCheck {
 public:
  /// Most vertices that are looked at.
  static constexpr Index kSamples = 8192;
  /// @throws Error as VisualHull's constructor about cameras and workspace.
  HullCheck(ExecContext& ctx, std::span<const Camera> cameras, const Box3f& workspace_m, float voxel_size_m);

  /// Starts the check of a mesh against the masks that the user gave (not repaired, not grown; 0x0: missed).
  /// Asynchronous; the masks are not needed afterwards.
  void submit(ExecContext& ctx, const DeviceMesh& mesh, std::span<const BitMask> given) {
    prepare(given);
    measure(ctx, mesh);
  }
  /// Its two halves: what the host does, and what may be recorded.
  void prepare(std::span<const BitMask> given);
  void measure(ExecContext& ctx, const DeviceMesh& mesh);
  /// Waits. Recall counts tiles (IoU is set to it): those of the mask that lie in the image of the workspace,
  /// whose four quarter points are set.
  HullQuality quality(ExecContext& ctx);
  /// Waits, judges, and returns what was not found before since construction: a fault is told once.
  std::vector<HullFinding> news(ExecContext& ctx);
  /// The texts of `news`. @throws Error when one is fatal and no frame before was well: then the rig is
  /// wrong. (Later the object may have left.)
  std::string tell(ExecContext& ctx);

 private:
  void find_workspace_tiles();
  std::vector<HullFinding> pieces(ExecContext& ctx, const HullQuality& quality);
  void take_mask(std::size_t camera, const BitMask& mask);
  void find_content(std::span<const BitMask> given);
  /// First word of a camera's tiles.
  std::size_t begin_of(std::size_t camera) const {
    return camera < layout_.size() ? static_cast<std::size_t>(layout_[camera].word_begin)
                                   : mask_tiles_.size();
  }

  std::vector<Camera> cameras_;
  Box3f workspace_m_;
  Vec3f low_m_{}, high_m_{};
  std::vector<CheckCamera> layout_;
  std::vector<Index> tile_px_;
  std::vector<std::uint32_t> in_workspace_;  ///< tiles whose rays meet the workspace
  std::vector<std::uint32_t> mask_tiles_;
  bool something_seen_ = false, was_well_ = false;
  std::vector<HullFinding> told_;
  DeviceMesh mesh_;         ///< of the last `submit`
  double seen_by_few_ = 0;  ///< share of its surface
  Index ticks_to_pieces_ = 0;
  Buffer<CheckCamera> device_cameras_;
  Buffer<std::uint32_t> tiles_;
  Buffer<CheckSums> sums_;
  HostBuffer<std::uint32_t> covered_;
  HostBuffer<CheckSums> host_sums_;
  HostBuffer<Index> vertices_;
};

}  // namespace tactus
