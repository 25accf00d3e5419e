#include "tactus/reconstruct/doctor/rig_doctor.h"

#include <cmath>

#include "tactus/base/error.h"
#include "tactus/reconstruct/doctor/frontier_points.h"
#include "tactus/reconstruct/doctor/rig_examination.h"
#include "tactus/reconstruct/hull_findings.h"

namespace tactus {

bool Examination::cameras_stand_within() const {
  std::size_t within = 0;
  const Box3f& w = input_.workspace_m;
  for (const std::size_t c : used_) {
    const auto p = vec_cast<float>(diagnosis_.cameras[c].center_world());
    within +=
        p.x > w.min.x && p.y > w.min.y && p.z > w.min.z && p.x < w.max.x && p.y < w.max.y && p.z < w.max.z
            ? 1U
            : 0U;
  }
  return 2 * within > used_.size();
}

namespace {
constexpr const char* kFocalFault = "focal length";
}

/// The finding of frontier points about focal lengths. @param cured out: the cameras with the better focal
/// lengths
std::optional<DoctorFinding> Examination::focal_finding(std::vector<Camera>& cured) const {
  cured = diagnosis_.cameras;
  const std::optional<FocalFit> fit = better_focal_lengths(views());
  if (!fit) return {};
  std::vector<Camera> cameras;
  for (std::size_t v = 0; v < used_.size(); ++v) {
    Camera& camera = cured[used_[v]];
    cameras.push_back(camera);
    if (fit->view >= 0 && static_cast<std::size_t>(fit->view) != v) continue;
    camera.fx_px *= fit->factor;
    camera.fy_px *= fit->factor;
    camera.skew_px *= fit->factor;
  }
  DoctorFinding finding{
      fit->view < 0 ? -1 : static_cast<int>(used_[static_cast<std::size_t>(fit->view)]),
      -1,
      kFocalFault,
      fit->text(cameras) + ": multiply fx and fy by " + number(fit->factor, "%.3f") + " (" +
          number(2 * fit->deviation, "%.3f") +
          " at 2 sigma), or calibrate the lens again with pictures of the film's size and zoom",
      0,
      0};
  // Poses that are a little wrong may pass for a few percent.
  constexpr double kFault = 0.08;
  finding.is_fault = used_.size() >= kDeterminedViews && std::abs(fit->factor - 1) >= kFault;
  return finding;
}

/// Recall forgives focal lengths that are wrong alike: the hull is smaller or larger, and looks the same.
void Examination::check_focal_lengths() {
  std::vector<Camera> cured;
  const std::optional<DoctorFinding> finding = focal_finding(cured);
  if (!finding) return;
  if (finding->is_fault) diagnosis_.cameras = cured;
  note(*finding);
}

bool Examination::cure_focal_lengths() {
  std::vector<Camera> cured;
  std::optional<DoctorFinding> finding = focal_finding(cured);
  if (!finding || !agreement(views_of(cured, diagnosis_.masks), kFine).is_consistent(limits_)) return false;
  diagnosis_.cameras = cured;
  finding->is_fault = true;
  note(*finding);
  return true;
}

/// Worth a word: a hull that one or two cameras leave says nothing of the workspace.
bool Examination::is_bounded_badly(const SilhouetteConsistency& hull) {
  std::vector<Camera> cameras;
  for (const std::size_t c : used_) cameras.push_back(diagnosis_.cameras[c]);
  const std::optional<HullFinding> bad = find_bad_bounds(cameras, hull.points_m());
  if (!bad) return false;
  DoctorFinding finding{-1, -1, "too few directions", bad->text, 0, 0};
  finding.is_fault = false;
  note(finding);
  return true;
}

/// Whether the workspace holds the hull of all cones, and whether a unit explains that it does not.
void Examination::check_workspace(const Agreement& after) {
  const std::vector<SeenView> all = views();
  const std::optional<Box3f> box = box_of(all);
  if (!box) return;
  const SilhouetteConsistency hull(*box, all, kCoarse);
  if (hull.sample_count() == 0 || is_bounded_badly(hull)) return;
  // Samples that few cameras see are mostly no part of the object, but of cones that nothing bounds.
  std::vector<Vec3f> points_m;
  const Index few = few_cameras(all.size());
  for (const Vec3f p : hull.points_m()) {
    Index views = 0;
    for (const SeenView& view : all) {
      const Pixel at = project(view.camera, vec_cast<double>(p));
      views += at.z_m > 0 && at.u_px >= -0.5 && at.v_px >= -0.5 && at.u_px < view.camera.width_px - 0.5 &&
                       at.v_px < view.camera.height_px - 0.5
                   ? 1
                   : 0;
    }
    if (views >= few) points_m.push_back(p);
  }
  if (points_m.empty()) return;
  const auto share_within = [&](double unit) {
    std::size_t within = 0;
    for (const Vec3f p : points_m) {
      const Vec3f q = static_cast<float>(unit) * p;
      const Box3f& w = input_.workspace_m;
      within += q.x >= w.min.x && q.y >= w.min.y && q.z >= w.min.z && q.x <= w.max.x && q.y <= w.max.y &&
                        q.z <= w.max.z
                    ? 1U
                    : 0U;
    }
    return static_cast<double>(within) / static_cast<double>(points_m.size());
  };
  const double held = share_within(1);
  if (held >= 0.98 && !cameras_stand_within()) return;
  if (held < 0.05 || cameras_stand_within()) {
    const RigHypothesis* best = nullptr;
    for (const RigHypothesis& h : rig_hypotheses()) {
      const double size = h.unit * std::cbrt(volume(*box) / volume(input_.workspace_m));
      if (h.unit == 1 || size > 1.3 || share_within(h.unit) < 0.9) continue;
      if (best == nullptr || h.unit > best->unit) best = &h;
    }
    if (best != nullptr) {
      for (Camera& c : diagnosis_.cameras) c.T_cam_world.t = best->unit * c.T_cam_world.t;
      note({-1, -1, "unit of t",
            "all cameras: " + best->cure + ", or the numbers of 'workspace_m' by " + number(1 / best->unit),
            after.mean, after.mean});
      return;
    }
  }
  if (held >= 0.98) return;
  const Vec3f low = box->min, high = box->max;
  char text[200];
  std::snprintf(
      text, sizeof text,
      "what the cones name lies in (%.3g,%.3g,%.3g) to (%.3g,%.3g,%.3g) m: --workspace auto, or these",
      static_cast<double>(low.x), static_cast<double>(low.y), static_cast<double>(low.z),
      static_cast<double>(high.x), static_cast<double>(high.y), static_cast<double>(high.z));
  DoctorFinding finding{-1,   -1,         "the workspace holds " + percent(held) + " of the object",
                        text, after.mean, after.mean};
  finding.is_fault = held < 0.9;
  diagnosis_.workspace_m = *box;
  note(finding);
}

void Examination::decide(const Agreement& after) {
  const bool faulty = std::any_of(diagnosis_.findings.begin(), diagnosis_.findings.end(),
                                  [](const DoctorFinding& f) { return f.is_fault; });
  const bool doubts = doubts_focal_lengths(diagnosis_);
  diagnosis_.verdict = faulty                                        ? Verdict::faulty
                       : used_.size() >= kDeterminedViews && !doubts ? Verdict::well
                                                                     : Verdict::unsure;
  if (faulty) {
    diagnosis_.why = "something is wrong";
  } else if (doubts) {
    diagnosis_.why =
        "the silhouettes agree, but better with other focal lengths; poses that are a little wrong look "
        "alike";
    diagnosis_.help =
        "an object of known size: its hull is too large or too small by as much as focal lengths are; or a "
        "depth "
        "camera";
  } else if (diagnosis_.verdict == Verdict::well) {
    diagnosis_.why = "the silhouettes of " + std::to_string(used_.size()) + " views agree (recall " +
                     number(after.mean, "%.3f") + ", at least " + number(after.least, "%.3f") + ")";
  } else {
    diagnosis_.why = "the silhouettes agree, but " + std::to_string(used_.size()) +
                     " views do not determine a rig: " + std::to_string(used_.size() * (used_.size() - 1)) +
                     " equations for " + std::to_string(6 * std::max<std::size_t>(used_.size(), 2) - 7) +
                     " unknowns";
    diagnosis_.help =
        "metric evidence: a distance between two cameras (--distance cam1 cam3 2.83), a board that "
        "all see (--corners), or a depth camera; or more cameras";
  }
}

Diagnosis examine_rig(const DoctorInput& input, const DoctorLimits& limits) {
  if (input.cameras.empty() || input.ticks.empty()) throw Error("doctor: no cameras or no masks");
  for (const std::vector<BitMask>& masks : input.ticks) {
    if (masks.size() != input.cameras.size())
      throw Error("doctor: " + std::to_string(masks.size()) + " masks for " +
                  std::to_string(input.cameras.size()) + " cameras");
    for (std::size_t c = 0; c < masks.size(); ++c) {
      const Camera& camera = input.cameras[c];
      if (!masks[c].words.empty() &&
          (masks[c].width_px != camera.width_px || masks[c].height_px != camera.height_px))
        throw Error("camera '" + camera.name + "': the mask has " + std::to_string(masks[c].width_px) + "x" +
                    std::to_string(masks[c].height_px) + " pixels, its calibration says " +
                    std::to_string(camera.width_px) + "x" + std::to_string(camera.height_px));
    }
  }
  return Examination(input, limits).run();
}

std::string common_slip(const DoctorInput& input, const DoctorLimits& limits) {
  const std::optional<DoctorFinding> slip = Examination(input, limits).common_slip();
  return slip ? slip->fault + "; " + slip->cure : "";
}

bool doubts_focal_lengths(const Diagnosis& diagnosis) {
  return std::any_of(diagnosis.findings.begin(), diagnosis.findings.end(),
                     [](const DoctorFinding& f) { return f.fault == kFocalFault && !f.is_fault; });
}

const char* verdict_name(Verdict verdict) {
  return verdict == Verdict::well ? "well" : verdict == Verdict::faulty ? "faulty" : "unsure";
}

}  // namespace tactus
