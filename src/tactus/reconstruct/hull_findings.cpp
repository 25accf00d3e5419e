#include "tactus/reconstruct/hull_findings.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tactus/reconstruct/components.h"

namespace tactus {
namespace {

constexpr const char* kAskDoctor = "; `tactus doctor RIG` looks for the cause";

std::string number(const char* format, double value) {
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}
std::string percent(double share) { return number("%.0f", 100 * share) + " %"; }

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

/// Recall, or IoU where that is lower: recall sees what is missing, IoU also what is too much.
double score(const ViewQuality& v) { return std::min(v.recall, v.iou); }

void find_odd_views(std::span<const Camera> cameras, const HullQuality& quality, const HullLimits& limits,
                    std::vector<HullFinding>& findings) {
  std::vector<double> scores;
  for (const ViewQuality& v : quality.views) {
    if (v.is_used) scores.push_back(score(v));
  }
  if (scores.size() < 3) return;
  const double middle = median(scores);
  std::vector<double> off;
  for (const double s : scores) off.push_back(std::abs(s - middle));
  const double allowed = std::max(limits.recall_drop, limits.drop_in_deviations * median(off));
  for (std::size_t c = 0; c < quality.views.size(); ++c) {
    const ViewQuality& v = quality.views[c];
    if (!v.is_used || score(v) >= middle - allowed) continue;
    const bool too_large = v.recall <= v.iou + 0.02;
    const std::string what =
        too_large ? "its mask is too large there, or the camera stands or looks elsewhere"
                  : "its mask lacks what the hull has: a hole, or the camera stands or looks elsewhere";
    findings.push_back({HullFault::view_differs, static_cast<int>(c), false,
                        "camera '" + cameras[c].name + "': the hull covers " + percent(v.recall) +
                            " of its mask (IoU " + number("%.2f", v.iou) + "), the middle of all views is " +
                            percent(middle) + ": " + what + kAskDoctor});
  }
}

}  // namespace

std::vector<HullFinding> judge_hull(std::span<const Camera> cameras, const HullQuality& quality,
                                    const Box3f& workspace_m, const HullLimits& limits) {
  std::vector<HullFinding> findings;
  const auto fatal = [&](HullFault fault, const std::string& text) {
    findings.push_back({fault, -1, true, text + kAskDoctor});
    return findings;
  };
  if (!quality.something_seen) return findings;
  if (quality.vertices == 0)
    return fatal(HullFault::empty,
                 "nothing is left of what the masks show: their cones do not meet in the "
                 "workspace " +
                     box_text(workspace_m) +
                     "; poses, unit or workspace are wrong (--workspace auto takes it from "
                     "the cones)");
  if (quality.on_faces > limits.fatal_on_faces)
    return fatal(HullFault::fills_workspace,
                 percent(quality.on_faces) + " of the surface are faces of the workspace " +
                     box_text(workspace_m) +
                     ": the masks carve next to nothing there; the cameras look elsewhere, or the workspace "
                     "is much too small");
  double best = 0;
  bool any = false;
  for (const ViewQuality& v : quality.views) {
    if (!v.is_used) continue;
    any = true;
    best = std::max(best, v.recall);
  }
  if (any && best < limits.fatal_recall)
    return fatal(HullFault::covers_no_view,
                 "the hull covers at most " + percent(best) +
                     " of any mask: the views contradict one another" +
                     (quality.on_faces > limits.on_faces ? ", or the workspace cuts the object" : ""));
  if (quality.on_faces > limits.on_faces)
    findings.push_back({HullFault::cut_by_workspace, -1, false,
                        percent(quality.on_faces) + " of the surface lie on faces of the workspace " +
                            box_text(workspace_m) + ", which cuts the object (--workspace auto)"});
  find_odd_views(cameras, quality, limits, findings);
  return findings;
}

Index few_cameras(std::size_t cameras) {
  const auto n = static_cast<Index>(cameras);
  return std::min(n, std::max(3, (n + 1) / 2));
}

std::vector<HullFinding> find_pieces_seen_by_few(std::span<const Camera> cameras, const TriangleMesh& mesh,
                                                 Index few) {
  std::vector<HullFinding> findings;
  const MeshComponents parts = find_components(mesh);
  if (parts.pieces.size() < 2) return findings;
  std::vector<Index> by_few(parts.pieces.size()), vertices(parts.pieces.size());
  for (std::size_t i = 0; i < mesh.positions_m.size(); ++i) {
    if (parts.of_vertex[i] < 0) continue;
    const auto piece = static_cast<std::size_t>(parts.of_vertex[i]);
    Index views = 0;
    for (const Camera& camera : cameras) {
      const Pixel at = project(camera, vec_cast<double>(mesh.positions_m[i]));
      views += at.z_m > 0 && at.u_px >= -0.5 && at.v_px >= -0.5 && at.u_px < camera.width_px - 0.5 &&
                       at.v_px < camera.height_px - 0.5
                   ? 1
                   : 0;
    }
    ++vertices[piece];
    by_few[piece] += views < few ? 1 : 0;
  }
  const auto is_seen_by_few = [&](std::size_t p) { return 2 * by_few[p] > vertices[p]; };
  bool any_well_seen = false;
  for (std::size_t p = 0; p < vertices.size(); ++p) any_well_seen |= !is_seen_by_few(p);
  for (std::size_t p = 0; p < vertices.size() && any_well_seen; ++p) {
    const MeshComponent& piece = parts.pieces[p];
    if (!is_seen_by_few(p) || piece.volume_m3 <= 0) continue;
    char where[96];
    std::snprintf(where, sizeof where, "(%.3g,%.3g,%.3g) m", piece.centroid_m.x, piece.centroid_m.y,
                  piece.centroid_m.z);
    findings.push_back({HullFault::body_seen_by_few, -1, false,
                        "a separate piece at " + std::string(where) + " is seen by fewer than " +
                            std::to_string(few) + " of " + std::to_string(cameras.size()) +
                            " cameras and may be a phantom: raise reconstruction.min_views (--min-views), or "
                            "shrink the workspace"});
  }
  return findings;
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
