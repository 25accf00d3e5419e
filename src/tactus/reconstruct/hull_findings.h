#pragma once
/// Judges the rig and the masks by the hull that was made of them: the measurements, and the verdict.
///
/// The hull lies inside the cone of every silhouette, so its projection hardly leaves a mask, and the measure
/// is recall: the share of a mask that the projected hull covers. A mask that is too large loses recall in
/// its own view alone. A hole, a wrong pose or a late camera takes from the hull and so from the recall of
/// all the other views.
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

struct ViewQuality {
  bool is_used = false;  ///< a mask was there, and large enough to be judged
  double recall = 1;     ///< share of the mask that the projected hull covers, 0 to 1
  double iou = 1;        ///< of the mask and the projected hull
  double outside = 0;    ///< share of the mask outside the image of the workspace
  double too_thin = 0;   ///< share of the mask that a grid of this spacing may lose
  /// The mask shows something, and all of it is outside.
  bool looks_elsewhere = false;
};

struct HullQuality {
  Index vertices = 0;
  bool something_seen = false;  ///< most masks show something where the workspace is
  double on_faces = 0;          ///< share of the surface that lies on the faces of the workspace
  std::vector<ViewQuality> views;
};

enum class HullFault : std::uint8_t {
  empty,             ///< the masks show something, the hull is empty
  fills_workspace,   ///< nothing was carved away
  covers_no_view,    ///< the hull covers less than half of the masks
  cut_by_workspace,  ///< the surface ends at the faces of the workspace
  view_differs,      ///< one mask is not explained as the others are
  mask_outside,      ///< one mask shows more outside the workspace than the others do
  looks_elsewhere,   ///< one camera does not look at the workspace
  views_contradict,  ///< no view is odd, yet their masks are poorly covered
  body_seen_by_few,  ///< a separate component that few cameras see
  focal_length,      ///< frontier points fit with other focal lengths
  bounded_badly,     ///< one or two cameras, or all on one line of sight
};

struct HullFinding {
  HullFault fault = HullFault::empty;
  int camera = -1;        ///< of faults of one view
  bool is_fatal = false;  ///< nothing can be right
  std::string text;       ///< the fault, its extent and its remedy
};

/// Limits of the verdict. Recall of healthy rigs is 0.95 to 1 in every view (docs/robustness.md).
struct HullLimits {
  double fatal_recall = 0.5;      ///< mean of the views (or IoU): below it nothing can be right
  double fatal_on_faces = 0.6;    ///< of the surface: the hull is the workspace
  double on_faces = 0.1;          ///< of the surface: the hull is cut
  double recall_drop = 0.06;      ///< below the median of all views, ...
  double drop_in_deviations = 5;  ///< ... and that many median absolute deviations
  double least_recall = 0.7;      ///< below it a view is odd, independent of the others
  double mean_recall = 0.93;      ///< below it the views contradict one another
  double outside = 0.025;         ///< of a mask, above the median of all views
};

/// @param workspace_m that the hull was made in, for the texts
std::vector<HullFinding> judge_hull(std::span<const Camera> cameras, const HullQuality& quality,
                                    const Box3f& workspace_m, const HullLimits& limits = {});

/// Components of the mesh of which more than half is seen by fewer than `few` cameras, while another
/// component is seen by more. Host; for meshes that are there anyway.
std::vector<HullFinding> find_components_seen_by_few(std::span<const Camera> cameras,
                                                     const TriangleMesh& mesh, Index few);
/// Fewer cameras than this are few: half of them, at least three where there are so many.
Index few_cameras(std::size_t cameras);

/// Along which direction cameras bound an object worst. A silhouette bounds the object across its line of
/// sight.
struct WeakDirection {
  Vec3d direction;      ///< unit
  double sine = 1;      ///< of the angle to the line of sight that is most across it; 0: nothing bounds it
  double extent_m = 0;  ///< of the points along it
};
/// @param points_m of the hull, at least one
WeakDirection weak_direction(std::span<const Camera> cameras, std::span<const Vec3f> points_m);
/// One or two cameras leave a hull that is larger than the object, and so do more that look along nearly one
/// line: IoU doesn't see it. None where three or more look from around.
std::optional<HullFinding> find_bad_bounds(std::span<const Camera> cameras, std::span<const Vec3f> points_m);

bool any_fatal(std::span<const HullFinding> findings);
/// "a; b"
std::string findings_text(std::span<const HullFinding> findings);

}  // namespace tactus
