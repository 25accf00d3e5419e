#pragma once
/// The examination behind rig_doctor.h: its knowledge of the rig, and the cures that it tries. For the files
/// of this folder.
#include <algorithm>
#include <cstdio>
#include <numeric>
#include <optional>

#include "tactus/reconstruct/doctor/rig_doctor.h"
#include "tactus/reconstruct/doctor/workspace_from_cones.h"

namespace tactus {

/// Samples of the lattices: of verdicts, of searches over sets of views, of their first look, of poses.
inline constexpr int kFine = 128, kCoarse = 64, kScreen = 40, kSearch = 48;
inline constexpr std::size_t kMostExcluded = 3;
inline constexpr double kNearlyConsistent = 0.9;

inline std::string percent(double share) {
  char text[16];
  std::snprintf(text, sizeof text, "%.0f %%", 100 * share);
  return text;
}
inline std::string number(double value, const char* format = "%.3g") {
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

/// Recalls of the views of a rig.
struct Agreement {
  std::vector<double> recall;
  double mean = 0, least = 0;
  Agreement() = default;
  explicit Agreement(std::vector<double> of_views) : recall(std::move(of_views)) {
    if (recall.empty()) return;
    mean = std::accumulate(recall.begin(), recall.end(), 0.0) / static_cast<double>(recall.size());
    least = *std::min_element(recall.begin(), recall.end());
  }
  bool is_consistent(const DoctorLimits& limits) const {
    return !recall.empty() && mean >= limits.mean_recall && least >= limits.least_recall;
  }
};

inline bool overlap(const Box3f& a, const Box3f& b, Box3f& common) {
  for (int i = 0; i < 3; ++i) {
    common.min[i] = std::max(a.min[i], b.min[i]);
    common.max[i] = std::min(a.max[i], b.max[i]);
    if (!(common.min[i] < common.max[i])) return false;
  }
  return true;
}

inline double volume(const Box3f& box) {
  const Vec3f e = box.extent();
  return static_cast<double>(e.x) * static_cast<double>(e.y) * static_cast<double>(e.z);
}

/// The examination of one rig. Views change as cures are found.
class Examination {
 public:
  Examination(const DoctorInput& input, const DoctorLimits& limits) : input_(input), limits_(limits) {
    diagnosis_.cameras = input.cameras;
    diagnosis_.masks = input.ticks.front();
    diagnosis_.workspace_m = input.workspace_m;
    diagnosis_.late_by_ticks.assign(input.cameras.size(), 0);
    for (std::size_t c = 0; c < count(); ++c) {
      if (diagnosis_.masks[c].words.empty()) continue;
      const std::int64_t set = diagnosis_.masks[c].area_px(),
                         all = std::int64_t{diagnosis_.masks[c].width_px} * diagnosis_.masks[c].height_px;
      if (set == 0 || set == all) {
        note({static_cast<int>(c), -1, set == 0 ? "the mask is all black" : "the mask is all white",
              "look at this camera's picture and background", 0, 0});
        dead_.push_back(c);
      } else {
        used_.push_back(c);
      }
    }
  }

  Diagnosis run() {
    const Agreement before = agreement(views(), kFine);
    diagnosis_.recall_before = full(before);
    bool explained = (turn_inverted_masks() ? agreement(views(), kFine) : before).is_consistent(limits_);
    if (explained) find_holes();
    if (explained) check_focal_lengths();
    if (!explained && used_.size() >= 3)
      explained = cure_all() || cure_some() || cure_all_and_some() || cure_order() || cure_focal_lengths() ||
                  name_leaks();
    const Agreement after = agreement(views(), kFine);
    diagnosis_.recall_after = full(after);
    for (DoctorFinding& f : diagnosis_.findings) {
      f.recall_before = before.mean;
      f.recall_after = after.mean;
    }
    if (explained)
      check_workspace(after);
    else if (used_.size() >= 2)
      note({-1, -1, "the views contradict one another", advice(), before.mean, after.mean});
    decide(after);
    return diagnosis_;
  }

  /// One slip of the whole rig that explains all, if views contradict one another without it.
  std::optional<DoctorFinding> common_slip() {
    if (used_.size() < 3 || agreement(views(), kCoarse).is_consistent(limits_) || !cure_all()) return {};
    return diagnosis_.findings.back();
  }

 private:
  std::size_t count() const { return input_.cameras.size(); }
  void note(DoctorFinding finding) { diagnosis_.findings.push_back(std::move(finding)); }

  std::vector<SeenView> views() const { return views_of(diagnosis_.cameras, diagnosis_.masks); }
  std::vector<SeenView> views_of(const std::vector<Camera>& cameras,
                                 const std::vector<BitMask>& masks) const {
    std::vector<SeenView> result;
    for (const std::size_t c : used_) result.push_back({cameras[c], &masks[c]});
    return result;
  }
  /// Recall per camera, 1 where there is no mask.
  std::vector<double> full(const Agreement& a) const {
    std::vector<double> result(count(), 1);
    for (std::size_t v = 0; v < used_.size() && v < a.recall.size(); ++v) result[used_[v]] = a.recall[v];
    return result;
  }

  /// Where the cones of the views meet; within the workspace where they leave it open.
  std::optional<Box3f> box_of(std::span<const SeenView> views, int turns = 2) const {
    std::vector<Camera> cameras;
    std::vector<const BitMask*> masks;
    for (const SeenView& v : views) {
      cameras.push_back(v.camera);
      masks.push_back(v.mask);
    }
    const std::optional<ConeBox> cones = workspace_from_cones(cameras, masks, turns);
    if (!cones) return {};
    Box3f common;
    if (!cones->is_bounded && overlap(cones->box_m, input_.workspace_m, common)) return common;
    return cones->box_m;
  }
  /// All recalls 0 when the cones don't meet.
  Agreement agreement(std::span<const SeenView> views, int samples) const {
    const std::optional<Box3f> box = box_of(views, samples > kScreen ? 2 : 0);
    if (!box) return Agreement(std::vector<double>(views.size(), 0));
    return Agreement(SilhouetteConsistency(*box, views, samples).recalls());
  }

  bool looks_inverted(std::size_t camera) const;
  bool turn_inverted_masks();
  std::vector<Agreement> agreements(const std::vector<std::vector<std::size_t>>& orders) const;
  bool cure_order();
  void take_order(const std::vector<std::size_t>& order);
  bool name_copy(std::size_t view);
  std::string advice() const;
  void find_holes();
  bool cure_all();
  bool cure_some();
  bool cure_all_and_some();
  std::vector<std::size_t> find_excluded(std::span<const SeenView> views) const;
  std::vector<std::vector<std::size_t>> subsets(std::size_t size) const;
  bool cure_excluded(const std::vector<std::size_t>& excluded);
  bool cure_swap(std::size_t view, const std::vector<std::size_t>& excluded);
  bool cure_camera(std::size_t view, const SilhouetteConsistency& trusted);
  bool try_slips(std::size_t view, const SilhouetteConsistency& trusted);
  bool try_late(std::size_t view, const SilhouetteConsistency& trusted);
  bool try_motion(std::size_t view, const SilhouetteConsistency& trusted);
  void name_mask(std::size_t view, const SilhouetteConsistency& trusted);
  bool name_leaks();
  std::optional<DoctorFinding> focal_finding(std::vector<Camera>& cured) const;
  void check_focal_lengths();
  bool cure_focal_lengths();
  bool is_bounded_badly(const SilhouetteConsistency& hull);
  Camera slip(const RigHypothesis& h, const Camera& given) const;
  void check_workspace(const Agreement& after);
  /// Most of them: then the workspace is larger than the rig.
  bool cameras_stand_within() const;
  void decide(const Agreement& after);

  const DoctorInput& input_;
  DoctorLimits limits_;
  Diagnosis diagnosis_;
  std::vector<std::size_t> used_, dead_;  ///< cameras
};

}  // namespace tactus
