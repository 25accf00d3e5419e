#pragma once
/// The cheap check of every tick: how much of each mask the hull covers, and how much of it lies on the faces
/// of the workspace. It looks at up to 8192 vertices and at one pixel in a tile of masks, so its cost does
/// not grow with the resolution. At the first tick, and where that leaves a doubt, the host draws the whole
/// mesh into all images; the latter more and more seldom, and beside the frames that follow.
#include <memory>
#include <span>
#include <vector>

#include "tactus/base/worker.h"
#include "tactus/geom/image/image.h"
#include "tactus/geom/mesh/mesh_view.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/reconstruct/hull_check_kernels.h"
#include "tactus/reconstruct/hull_findings.h"
#include "tactus/reconstruct/visual_hull.h"

namespace tactus {

/// Owned by the code that steps frames. Per frame: `submit` when the mesh is made, then `report` or `judge`.
class HullCheck {
 public:
  /// Most vertices that are looked at.
  static constexpr Index kSamples = 8192;
  /// @throws Error as VisualHull's constructor about cameras and workspace.
  /// @param has_depth depth cameras bound the hull, too
  HullCheck(ExecContext& ctx, std::span<const Camera> cameras, const Box3f& workspace_m, float voxel_size_m,
            bool has_depth = false);

  /// Starts the check of a mesh against the masks that the user gave (not repaired, not grown; 0x0: missed).
  /// Asynchronous; masks are copied, the mesh stays where it is.
  void submit(ExecContext& ctx, const MeshView& mesh, std::span<const BitMask> given) {
    prepare(given);
    measure(ctx, mesh);
  }
  /// Its two halves: the host's work, and the launches, which may be recorded.
  /// @param carved of each camera, or none: its mask as it carved, without tools. Their pixels are explained,
  /// and where there are some, whole masks judge the rig by a lattice of samples (silhouette_consistency.h).
  void prepare(std::span<const BitMask> given, std::span<const BitMask> carved = {});
  void measure(ExecContext& ctx, const MeshView& mesh);
  /// Waits. Recall counts tiles (IoU is set to it): those of the mask that lie in the image of the workspace,
  /// whose four quarter points are set.
  HullQuality quality(ExecContext& ctx);
  /// Waits, judges, and returns the findings that are new since construction: a fault comes once.
  std::vector<HullFinding> news(ExecContext& ctx);
  /// After the last frame: waits for the frame that the host still examines, and returns its new findings.
  std::vector<HullFinding> last_news();
  /// The texts of `news`. @throws Error when one is fatal and no frame before was well: then the rig is
  /// wrong. (Later the object may have left.)
  std::string report(ExecContext& ctx);
  /// The texts of all that is found in this frame, told before or not, however long it takes. @throws
  /// likewise.
  std::string judge(ExecContext& ctx);

 private:
  void find_workspace_tiles();
  void take_mask(std::size_t camera, const BitMask& mask);
  void find_content();
  bool is_doubtful(const HullQuality& quality) const;
  std::vector<HullFinding> find(ExecContext& ctx, bool is_reduced);
  /// Those of the findings that `reported_` does not have yet; adds them to it.
  std::vector<HullFinding> fresh(const std::vector<HullFinding>& found);
  TriangleMesh to_host_mesh(ExecContext& ctx) const;
  BitMask within_workspace(std::size_t camera, BitMask mask) const;
  /// The host's measurements of one frame.
  struct Exam {
    HullQuality quality;
    bool exactly = false, has_phantoms = false, has_tools = false, is_first = false;
    TriangleMesh mesh = {};
    std::vector<BitMask> given = {};
    std::vector<HullFinding> found = {};
  };
  void examine(Exam& exam) const;
  std::vector<HullFinding> take(Exam& exam);
  void measure_exactly(Exam& exam) const;
  void measure_whole_masks(Exam& exam) const;
  void find_bounds(Exam& exam);
  void find_focal_lengths(Exam& exam);
  void name_cause(Exam& exam) const;
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
  std::vector<double> voxel_px_;             ///< image of a voxel in the middle of the workspace
  std::vector<std::uint32_t> in_workspace_;  ///< tiles whose rays meet the workspace
  std::vector<std::uint32_t> mask_tiles_;    ///< in the image of the workspace
  std::vector<BitMask> given_;
  struct Content {
    Index tiles = 0, within = 0;  ///< of the mask, and those of them in the image of the workspace
  };
  std::vector<Content> content_;
  bool something_seen_ = false, was_well_ = false;
  bool has_depth_ = false, bounds_reported_ = false, cause_asked_ = false, focal_asked_ = false;
  bool has_tools_ = false;                  ///< taken out of masks in this frame
  std::vector<std::uint32_t> taken_tiles_;  ///< that have a pixel of them
  std::vector<HullFinding> reported_;
  MeshView mesh_;           ///< of the last `submit`
  double seen_by_few_ = 0;  ///< share of its surface
  Index ticks_to_host_ = 0, host_interval_ = 1;
  Buffer<CheckCamera> device_cameras_;
  Buffer<std::uint32_t> tiles_;
  Buffer<CheckSums> sums_;
  HostBuffer<std::uint32_t> covered_;
  HostBuffer<CheckSums> host_sums_;
  HostBuffer<Index> vertices_;
  std::unique_ptr<Exam> waiting_;  ///< the worker looks at it
  Index ticks_to_answer_ = 0;
  Worker worker_{1};  ///< last: it uses the others
};

}  // namespace tactus
