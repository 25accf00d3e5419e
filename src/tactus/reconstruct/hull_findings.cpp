#include "tactus/reconstruct/hull_findings.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "tactus/reconstruct/components.h"

namespace tactus {
namespace {

constexpr const char* kAskDoctor = "; `tactus doctor RIG` looks for the cause";

std::string number(const char* format, double value) {
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}
std::string whole_percent(double share) { return number("%.0f", 100 * share) + " %"; }

std::string box_text(const Box3f& box) {
  char text[160];
  std::snprintf(text, sizeof text, "(%.3g,%.3g,%.3g) to (%.3g,%.3g,%.3g) m", static_cast<double>(box.min.x),
                static_cast<double>(box.min.y), static_cast<double>(box.min.z),
                static_cast<double>(box.max.x), static_cast<double>(box.max.y),
                static_cast<double>(box.max.z));
  return text;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Median absolute deviation from the median.
double deviation(const std::vector<double>& values) {
  const double middle = median(values);
  std::vector<double> off;
  for (const double v : values) off.push_back(std::abs(v - middle));
  return median(std::move(off));
}

/// Recall, or IoU where that is lower: missing parts lower recall, excess parts lower IoU, too.
double score(const ViewQuality& v) { return std::min(v.recall, v.iou); }

void find_odd_views(std::span<const Camera> cameras, const HullQuality& quality, const HullLimits& limits,
                    std::vector<HullFinding>& findings) {
  std::vector<double> scores;
  for (const ViewQuality& v : quality.views) {
    if (v.is_used) scores.push_back(score(v));
  }
  if (scores.size() < 3) return;
  const double middle = median(scores);
  const double allowed = std::max(limits.recall_drop, limits.drop_in_deviations * deviation(scores));
  for (std::size_t c = 0; c < quality.views.size(); ++c) {
    const ViewQuality& v = quality.views[c];
    const double least = std::max(middle - allowed, limits.least_recall) - v.too_thin;
    if (!v.is_used || score(v) >= least) continue;
    const bool too_large = v.recall <= v.iou + 0.02;
    const std::string what =
        too_large ? "its mask is too large there, or the camera stands or looks elsewhere"
                  : "its mask lacks what the hull has: a hole, or the camera stands or looks elsewhere";
    findings.push_back({HullFault::view_differs, static_cast<int>(c), false,
                        "camera '" + cameras[c].name + "': the hull covers " + whole_percent(v.recall) +
                            " of its mask (IoU " + number("%.2f", v.iou) + "), the middle of all views is " +
                            whole_percent(middle) + ": " + what + kAskDoctor});
  }
}

/// Finds masks with a larger share outside of the workspace's image than those of the other views. Not where
/// the workspace cuts the object: then all masks show more.
void find_masks_outside(std::span<const Camera> cameras, const HullQuality& quality, const HullLimits& limits,
                        std::vector<HullFinding>& findings) {
  std::vector<double> shares;
  for (const ViewQuality& v : quality.views) {
    if (v.is_used) shares.push_back(v.outside);
  }
  if (shares.size() < 3 || quality.on_faces > limits.on_faces) return;
  const double middle = median(shares),
               allowed = std::max(limits.outside, limits.drop_in_deviations * deviation(shares));
  for (std::size_t c = 0; c < quality.views.size(); ++c) {
    const ViewQuality& v = quality.views[c];
    if (!v.is_used || v.outside <= middle + allowed) continue;
    findings.push_back(
        {HullFault::mask_outside, static_cast<int>(c), false,
         "camera '" + cameras[c].name + "': " + whole_percent(v.outside) +
             " of its mask lie outside the image of the workspace, in the middle of all views " +
             whole_percent(middle) +
             ": its mask is too large there, or the camera stands or looks elsewhere" + kAskDoctor});
  }
}

struct Summary {
  std::ptrdiff_t used = 0, elsewhere = 0;
  double mean = 0;  ///< score; 0 for views that look elsewhere
  double too_thin = 0;
};
Summary summary_of(const HullQuality& quality) {
  Summary s;
  for (const ViewQuality& v : quality.views) {
    s.used += v.is_used ? 1 : 0;
    s.elsewhere += v.looks_elsewhere ? 1 : 0;
    s.mean += v.is_used ? score(v) : 0;
    s.too_thin += v.is_used ? v.too_thin : 0;
  }
  const auto views = static_cast<double>(std::max<std::ptrdiff_t>(s.used + s.elsewhere, 1));
  s.mean /= views;
  s.too_thin /= views;
  return s;
}

std::optional<HullFinding> find_fatal(const HullQuality& quality, const Summary& sum,
                                      const Box3f& workspace_m, const HullLimits& limits) {
  const auto fatal = [](HullFault fault, const std::string& text) {
    return HullFinding{fault, -1, true, text + kAskDoctor};
  };
  if (quality.vertices == 0)
    return fatal(HullFault::empty,
                 "nothing is left of what the masks show: their cones do not meet in the workspace " +
                     box_text(workspace_m) +
                     "; poses, unit or workspace are wrong (--workspace auto takes it from the cones)");
  if (2 * sum.elsewhere > sum.used + sum.elsewhere)
    return fatal(HullFault::looks_elsewhere,
                 std::to_string(sum.elsewhere) + " of " + std::to_string(quality.views.size()) +
                     " cameras show something, but do not look at the workspace " + box_text(workspace_m) +
                     ": poses, unit or workspace are wrong (--workspace auto takes it from the cones)");
  // One cone alone is always cut by the workspace.
  if (sum.used > 1 && quality.on_faces > limits.fatal_on_faces)
    return fatal(HullFault::fills_workspace,
                 whole_percent(quality.on_faces) + " of the surface are faces of the workspace " +
                     box_text(workspace_m) +
                     ": the masks carve next to nothing there; the cameras look elsewhere, or the workspace "
                     "is much too small");
  if (sum.used > 0 && sum.mean < limits.fatal_recall - sum.too_thin)
    return fatal(HullFault::covers_no_view,
                 "the hull covers " + whole_percent(sum.mean) +
                     " of the masks, the mean of all views: they contradict one another" +
                     (quality.on_faces > limits.on_faces ? ", or the workspace cuts the object" : ""));
  return {};
}

}  // namespace

std::vector<HullFinding> judge_hull(std::span<const Camera> cameras, const HullQuality& quality,
                                    const Box3f& workspace_m, const HullLimits& limits) {
  std::vector<HullFinding> findings;
  const Summary sum = summary_of(quality);
  if (!quality.something_seen) {  // or elsewhere: the object may come into the workspace later
    if (sum.elsewhere > 1 && sum.elsewhere > sum.used)
      findings.push_back(
          {HullFault::looks_elsewhere, -1, false,
           std::to_string(sum.elsewhere) + " of " + std::to_string(quality.views.size()) +
               " cameras show something, and nothing of it where the workspace " + box_text(workspace_m) +
               " is: the object is elsewhere, or lenses, poses, unit or workspace are wrong" + kAskDoctor});
    return findings;
  }
  if (const std::optional<HullFinding> fatal = find_fatal(quality, sum, workspace_m, limits)) return {*fatal};
  if (sum.used > 1 && quality.on_faces > limits.on_faces)
    findings.push_back({HullFault::cut_by_workspace, -1, false,
                        whole_percent(quality.on_faces) + " of the surface lie on faces of the workspace " +
                            box_text(workspace_m) + ", which cuts the object (--workspace auto)"});
  for (std::size_t c = 0; c < quality.views.size(); ++c) {
    if (quality.views[c].looks_elsewhere)
      findings.push_back(
          {HullFault::looks_elsewhere, static_cast<int>(c), false,
           "camera '" + cameras[c].name +
               "' shows something, but does not look at the workspace: its pose or unit is wrong" +
               kAskDoctor});
  }
  find_odd_views(cameras, quality, limits, findings);
  find_masks_outside(cameras, quality, limits, findings);
  if (findings.empty() && sum.used > 1 && sum.mean < limits.mean_recall - sum.too_thin)
    findings.push_back(
        {HullFault::views_contradict, -1, false,
         "the hull covers " + whole_percent(sum.mean) +
             " of the masks, the mean of all views; 95 % and more where rig and masks are right" +
             kAskDoctor});
  return findings;
}

Index few_cameras(std::size_t cameras) {
  const auto n = static_cast<Index>(cameras);
  return std::min(n, std::max(3, (n + 1) / 2));
}

std::vector<HullFinding> find_components_seen_by_few(std::span<const Camera> cameras,
                                                     const TriangleMesh& mesh, Index few) {
  std::vector<HullFinding> findings;
  const MeshComponents parts = find_components(mesh);
  if (parts.components.size() < 2) return findings;
  std::vector<Index> by_few(parts.components.size()), vertices(parts.components.size());
  for (std::size_t i = 0; i < mesh.positions_m.size(); ++i) {
    if (parts.of_vertex[i] < 0) continue;
    const auto component = static_cast<std::size_t>(parts.of_vertex[i]);
    Index views = 0;
    for (const Camera& camera : cameras) {
      const Pixel at = project(camera, vec_cast<double>(mesh.positions_m[i]));
      views += at.z_m > 0 && at.u_px >= -0.5 && at.v_px >= -0.5 && at.u_px < camera.width_px - 0.5 &&
                       at.v_px < camera.height_px - 0.5
                   ? 1
                   : 0;
    }
    ++vertices[component];
    by_few[component] += views < few ? 1 : 0;
  }
  const auto is_seen_by_few = [&](std::size_t p) { return 2 * by_few[p] > vertices[p]; };
  bool any_well_seen = false;
  for (std::size_t p = 0; p < vertices.size(); ++p) any_well_seen |= !is_seen_by_few(p);
  for (std::size_t p = 0; p < vertices.size() && any_well_seen; ++p) {
    const MeshComponent& component = parts.components[p];
    if (!is_seen_by_few(p) || component.volume_m3 <= 0) continue;
    char where[96];
    std::snprintf(where, sizeof where, "(%.3g,%.3g,%.3g) m", component.centroid_m.x, component.centroid_m.y,
                  component.centroid_m.z);
    findings.push_back({HullFault::body_seen_by_few, -1, false,
                        "a separate component at " + std::string(where) + " is seen by fewer than " +
                            std::to_string(few) + " of " + std::to_string(cameras.size()) +
                            " cameras and may be a phantom: raise reconstruction.min_views (--min-views), or "
                            "shrink the workspace"});
  }
  return findings;
}

WeakDirection weak_direction(std::span<const Camera> cameras, std::span<const Vec3f> points_m) {
  Vec3d middle;
  for (const Vec3f p : points_m)
    middle = middle + 1.0 / static_cast<double>(points_m.size()) * vec_cast<double>(p);
  std::vector<Vec3d> sights;
  for (const Camera& camera : cameras) sights.push_back(normalized(camera.center_world() - middle));
  constexpr int kDirections = 2000;  // over a half sphere, 3 degrees apart (Fibonacci's lattice)
  WeakDirection weakest;
  weakest.sine = 2;
  const auto look_at = [&](Vec3d d) {
    double sine = 0;
    for (const Vec3d& sight : sights) sine = std::max(sine, length(cross(d, sight)));
    if (sine < weakest.sine) weakest = {d, sine, 0};
  };
  for (const Vec3d& sight : sights) look_at(sight);
  for (int k = 0; k < kDirections; ++k) {
    const double z = (k + 0.5) / kDirections, r = std::sqrt(1 - z * z), a = 2.399963229728653 * k;
    look_at({r * std::cos(a), r * std::sin(a), z});
  }
  double low = 1e300, high = -1e300;
  for (const Vec3f p : points_m) {
    const double along = dot(vec_cast<double>(p), weakest.direction);
    low = std::min(low, along);
    high = std::max(high, along);
  }
  weakest.extent_m = high - low;
  return weakest;
}

std::optional<HullFinding> find_bad_bounds(std::span<const Camera> cameras, std::span<const Vec3f> points_m) {
  // Cameras within 30 degrees of one line leave a hull that is at least twice as long along it.
  constexpr double kLeastSine = 0.5;
  if (cameras.empty() || points_m.empty()) return {};
  const WeakDirection weak = weak_direction(cameras, points_m);
  if (cameras.size() > 2 && weak.sine >= kLeastSine) return {};
  char where[96];
  std::snprintf(where, sizeof where, "%.2g m along (%.2f, %.2f, %.2f)", weak.extent_m, weak.direction.x,
                weak.direction.y, weak.direction.z);
  const std::string reach(where);
  HullFinding finding{HullFault::bounded_badly, -1, false, ""};
  if (cameras.size() == 1)
    finding.text =
        "one camera bounds nothing along its line of sight: its cone is no hull, and ends at the workspace "
        "(" +
        reach + "): place cameras around the object";
  else
    finding.text =
        (cameras.size() == 2 ? std::string("two cameras bound the object badly")
                             : "all " + std::to_string(cameras.size()) +
                                   " cameras look along nearly one line and bound the object badly") +
        ": the hull reaches " + reach +
        ", which none of them sees from the side; its volume can be several times the object's, "
        "whatever the IoU: place cameras around the object";
  return finding;
}

bool any_fatal(std::span<const HullFinding> findings) {
  return std::any_of(findings.begin(), findings.end(), [](const HullFinding& f) { return f.is_fatal; });
}

std::string findings_text(std::span<const HullFinding> findings) {
  std::string text;
  for (const HullFinding& f : findings) text += (text.empty() ? "" : "; ") + f.text;
  return text;
}

}  // namespace tactus
