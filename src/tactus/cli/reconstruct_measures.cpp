#include "tactus/cli/reconstruct_measures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tactus/geom/image/mask_metrics.h"
#include "tactus/geom/image/rasterize.h"

namespace tactus {
namespace {

/// How the mesh's silhouettes agree with one set of masks, over the views that have one.
struct Agreement {
  double iou_sum = 0, iou_min = 1, recall_sum = 0;
  int views = 0;
  void add(double iou, double recall) {
    iou_sum += iou;
    iou_min = std::min(iou_min, iou);
    recall_sum += recall;
    ++views;
  }
  void add_to(nlohmann::json& json) const {
    json["iou_mean"] = views > 0 ? iou_sum / views : 0;
    json["iou_min"] = views > 0 ? iou_min : 0;
    json["recall"] = views > 0 ? recall_sum / views : 0;
  }
};

}  // namespace

double surface_rms_m(const TriangleMesh& mesh, const FigureShape& truth) {
  double sum = 0;
  for (const Vec3f p : mesh.positions_m) sum += sqr(static_cast<double>(truth.distance_m(p)));
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(mesh.positions_m.size(), 1)));
}

nlohmann::json measure(const TriangleMesh& mesh, const Rig& rig, const FrameSet& frame,
                       std::span<const BitMask> given) {
  const MeshTopology t = topology(mesh);
  Agreement with_given, with_repaired;
  nlohmann::json views = nlohmann::json::array();
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    if (given[c].words.empty()) continue;
    const BitMask seen = render_silhouette(mesh, rig.cameras[c]);
    if (seen.area_px() == 0 && given[c].area_px() == 0) continue;  // nothing agrees with nothing
    const double overlap = iou(seen, given[c]), covered = recall(seen, given[c]);
    with_given.add(overlap, covered);
    views.push_back({{"camera", rig.cameras[c].name}, {"iou", overlap}, {"recall", covered}});
    const double repaired = iou(seen, frame.silhouettes[c]);
    with_repaired.add(repaired, recall(seen, frame.silhouettes[c]));
    if (given[c].words != frame.silhouettes[c].words) views.back()["iou_repaired"] = repaired;
  }
  nlohmann::json json{{"vertices", mesh.positions_m.size()},
                      {"triangles", mesh.triangles.size()},
                      {"boundary_edges", t.boundary_edges},
                      {"nonmanifold_edges", t.nonmanifold_edges},
                      {"euler", t.euler},
                      {"components", t.components},
                      {"volume_m3", volume_m3(mesh)}};
  with_given.add_to(json);
  if (given.data() != frame.silhouettes.data()) with_repaired.add_to(json["repaired"]);
  json["views"] = std::move(views);
  if (frame.truth_volume_m3) json["truth_volume_m3"] = *frame.truth_volume_m3;
  return json;
}

std::string repaired_text(const nlohmann::json& row) {
  if (!row.contains("repaired")) return "";
  char text[120];
  std::snprintf(text, sizeof text,
                "IoU with the repaired masks %.4f, at least %.4f; as they came %.4f and %.4f",
                row["repaired"]["iou_mean"].get<double>(), row["repaired"]["iou_min"].get<double>(),
                row["iou_mean"].get<double>(), row["iou_min"].get<double>());
  return text;
}

std::string cost_text(int resolution, const Box3f& workspace_m) {
  constexpr int kLarge = 1024;
  if (resolution <= kLarge) return "";
  const auto e = vec_cast<double>(workspace_m.extent());
  const double of_cube = (e.x * e.y + e.y * e.z + e.z * e.x) / (3 * sqr(std::max({e.x, e.y, e.z}))),
               size = resolution / 2048.;
  char text[160];
  std::snprintf(text, sizeof text, "resolution %d: about %.2g GB, and %.0f s a frame on one core", resolution,
                4.8 * of_cube * sqr(size), 34 * of_cube * std::pow(size, 2.3));
  return text;
}

}  // namespace tactus
