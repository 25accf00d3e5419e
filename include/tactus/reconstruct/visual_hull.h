#pragma once
/// The visual hull of silhouettes as a closed triangle mesh: Shao et al. 2019, "3D reconstruction of real
/// objects", with coarse-to-fine classification and vertices on the silhouettes themselves. Cost follows the
/// surface. With depth cameras it is the extended hull: space in front of a measured surface is carved away,
/// too, so concavities that no silhouette shows are there [P 1-2].
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"
#include "tactus/geom/mesh/mesh.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {

class Readback;
struct MeshView;
struct Stage;

struct HullOptions {
  Box3f workspace_m;      ///< bounds of the reconstruction, world frame
  Index resolution = 64;  ///< voxels along the longest side of the workspace; voxels are cubes
  /// Silhouettes grow by this many pixels before they carve: the error of calibration and segmentation.
  /// Cameras that disagree by less then keep parts that only one of them shows.
  int slack_px = 0;
  /// A point is outside when more than so many cameras see background there: the k-of-n hull with
  /// k = n - tolerated_views. 0 is the visual hull; 0 to 7, fewer than cameras. One bad mask of m carves
  /// nothing, but every contour that fewer cameras see stays uncut: the hull grows.
  Index tolerated_views = 0;
  /// Space that fewer cameras look at is outside, 0 to 64; at most one less than there are cameras (with
  /// those of depth) counts. Two is the least with which a point has a bound along every ray: space that one
  /// camera alone sees is a cone that ends at the workspace, a phantom. Three would cut parts of a capacity
  /// that four cameras in a half circle see. A camera that missed the tick still counts.
  Index min_views = 2;
  /// Capacity for the surface on each device; a frame that needs more has an incomplete mesh, and its report
  /// names the option to raise. Bricks have 8^3 voxels; those that may hold surface count, and where devices
  /// share the work, those near a border count twice. 0: from the resolution, enough for several times the
  /// sides of the workspace.
  Index max_active_bricks = 0;
  Index max_vertices = 0;   ///< 0: from the resolution
  Index max_triangles = 0;  ///< 0: twice max_vertices
  float depth_jump_m =
      0.1F;  ///< neighbouring depth pixels that differ by more are mixed ("flying") and not used
  /// Bytes that others will allocate on the first device beside the hull, for each vertex of its capacity: a
  /// resolution that leaves too little for them is refused, too.
  double beside_vertex_bytes = 0;
};

/// A capacity that a frame exceeded.
struct HullOverflow {
  std::string what;  ///< "vertices"
  Index wanted = 0, capacity = 0;
  std::string option;  ///< of HullOptions; `wanted` or more cures it
  /// "123 vertices, capacity for 10: raise max_vertices to 123 or more". @param as the users' name of the
  /// option
  std::string text(const std::string& as) const;
  std::string text() const { return text(option); }
};

/// How the last frame went.
struct HullReport {
  Index vertices = 0, triangles = 0, active_bricks = 0;
  std::optional<HullOverflow> overflow;  ///< the mesh is then incomplete
  std::string depth;  ///< empty, or why the depth of a camera was not used (the silhouettes were)
};

class VisualHull {
 public:
  /// @throws Error: no or more than 64 cameras, a bad camera, an empty workspace, a resolution that is not
  /// positive or that needs more memory than there is (with the memory it would need). `depth_cameras`: at
  /// most 32, images of at least 2x2 pixels.
  VisualHull(DeviceSet& devices, std::span<const Camera> cameras, const HullOptions& options,
             std::span<const Camera> depth_cameras = {});
  ~VisualHull();
  VisualHull(VisualHull&&) noexcept;

  /// Sends one silhouette per camera to every device. An empty mask (0x0) is a camera that missed the tick:
  /// it carves nothing. Likewise one depth image per depth camera: radial distance [m]; only finite values
  /// above 0 are measurements; an empty image or none at all is a camera that missed the tick. Depth that
  /// contradicts the silhouettes (wrong unit, z as radial distance) or holds no measurement is not used; the
  /// report says so. Asynchronous; all is copied before it returns. @throws Error when a size contradicts its
  /// camera or a number of images that of the cameras.
  void upload(std::span<const BitMask> silhouettes, std::span<const DepthImage> depths_m = {});
  /// Makes the mesh of the uploaded images. Asynchronous.
  void reconstruct();
  /// The first half of `reconstruct`, to time it: finds which nodes are inside every silhouette and not in
  /// front of a measured surface. Asynchronous.
  void carve();
  /// The second: makes the mesh of the nodes that `carve` found. Asynchronous.
  void extract();
  /// The same as stages of a frame: "hull/upload" calls `upload`, which is to send new images; then the nodes
  /// inside every silhouette and not in front of a measured surface are found, and made a mesh.
  std::vector<Stage> stages(std::function<void()> upload);
  static constexpr const char* kMesh = "hull/mesh";  ///< the resource that they write

  /// In the memory of the first device, without normals.
  MeshView mesh() const;
  /// Waits for the frame.
  HullReport report();
  /// Counts of the mesh are read back with the frame's other records; then report() doesn't wait.
  void add_reports(Readback& readback);
  HullReport report(const Readback& readback) const;
  /// Waits for the frame and copies its mesh to the host (without normals).
  TriangleMesh download();

  float voxel_size_m() const;
  /// Memory on all devices together, but for lists of a few kB. Grows with the area of the workspace's sides
  /// in voxels, not with its volume: 8 bytes per 8192 voxels is all that the empty ones take.
  std::int64_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tactus
