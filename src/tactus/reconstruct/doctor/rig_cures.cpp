#include <tbb/parallel_for.h>

#include <cmath>
#include <numbers>

#include "tactus/base/bits.h"
#include "tactus/geom/image/mask_cleaning.h"
#include "tactus/geom/image/mask_growth.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/reconstruct/doctor/mask_repair.h"
#include "tactus/reconstruct/doctor/pose_search.h"
#include "tactus/reconstruct/doctor/rig_examination.h"

namespace tactus {
namespace {

/// Largest recall that a trusted view loses when this one carves, too.
double lost_by_others(const SeenView& view, const SilhouetteConsistency& trusted) {
  const std::vector<double> with = trusted.recalls({&view, 1}), without = trusted.recalls();
  double lost = 0;
  for (std::size_t v = 0; v < without.size(); ++v) lost = std::max(lost, without[v] - with[v]);
  return lost;
}

}  // namespace

/// The slip undone in the files' world.
Camera Examination::slip(const RigHypothesis& h, const Camera& given) const {
  Camera in_file = given;
  in_file.T_cam_world.R = given.T_cam_world.R * transpose(input_.R_file_world);
  Camera cured = h.apply(in_file);
  cured.T_cam_world.R = cured.T_cam_world.R * input_.R_file_world;
  return cured;
}

/// A hole costs the others no recall where they see the object from the side. The space that its view alone
/// carves, deep in the others' hull, reveals it (ViewScores). Where few views look, one alone sees through a
/// gap between fingers: that is worth a word, and no fault.
void Examination::find_holes() {
  const std::optional<Box3f> box = box_of(views());
  if (!box) return;
  DeviceSet devices("cpu");
  std::vector<Camera> cameras;
  std::vector<BitMask> masks;
  for (const std::size_t c : used_) {
    cameras.push_back(diagnosis_.cameras[c]);
    masks.push_back(diagnosis_.masks[c]);
  }
  ViewScores scores(devices.context(0), cameras, {.workspace_m = *box});
  std::vector<ViewScore> found = scores.measure(devices.context(0), masks);
  for (std::size_t v = 0; v < found.size(); ++v) {
    if (!found[v].is_suspect) continue;
    // A concave object seen by few views is carved deep by one of them, too: not through a hole.
    found[v].is_suspect = false;
    std::vector<BitMask> filled = masks;
    BitMask& mask = filled[v];
    MaskCleaner(mask.width_px, mask.height_px).fill_holes(mask, mask.width_px * mask.height_px);
    if (mask == masks[v] || scores.measure(devices.context(0), filled)[v].is_suspect) continue;
    found[v].is_suspect = true;
    DoctorFinding finding{
        static_cast<int>(used_[v]),
        -1,
        "holed mask",
        "it alone carves " + number(100 * found[v].carved_alone, "%.1f") +
            " % of the hull that all others keep: fill it (--repair-masks), or learn the background again",
        0,
        0};
    finding.is_fault = used_.size() >= kDeterminedViews;
    note(finding);
  }
  std::vector<BitMask> repaired = masks;
  repair_masks(devices.context(0), scores, found, repaired);
  for (std::size_t v = 0; v < found.size(); ++v) diagnosis_.masks[used_[v]] = repaired[v];
}

/// One slip of the whole rig, or two. Among the slips that make all views agree, the one with the hull that
/// fits best into the workspace.
bool Examination::cure_all() {
  std::vector<RigHypothesis> all;
  for (const RigHypothesis& h : rig_hypotheses()) {
    if (h.unit == 1) all.push_back(h);  // a common unit changes no recall
  }
  for (const RigHypothesis& h : combined_hypotheses()) all.push_back(h);
  std::vector<Agreement> found(all.size());
  std::vector<double> within(all.size());
  tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t i) {
    std::vector<Camera> cameras = diagnosis_.cameras;
    std::vector<BitMask> masks = diagnosis_.masks;
    for (const std::size_t c : used_) {
      cameras[c] = slip(all[i], cameras[c]);
      masks[c] = flipped(masks[c], all[i].flip);
    }
    const std::vector<SeenView> views = views_of(cameras, masks);
    const std::optional<Box3f> box = box_of(views);
    if (!box) return;
    found[i] = Agreement(SilhouetteConsistency(*box, views, kCoarse).recalls());
    Box3f common;
    within[i] = overlap(*box, input_.workspace_m, common) ? volume(common) / volume(*box) : 0;
  });
  std::size_t best = all.size();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!found[i].is_consistent(limits_)) continue;
    if (best == all.size() || within[i] > within[best] + 0.2) best = i;
  }
  if (best == all.size()) return false;
  for (const std::size_t c : used_) {
    diagnosis_.cameras[c] = slip(all[best], diagnosis_.cameras[c]);
    diagnosis_.masks[c] = flipped(diagnosis_.masks[c], all[best].flip);
  }
  note({-1, -1, all[best].fault, "all cameras: " + all[best].cure, 0, 0});
  return true;
}

std::vector<std::vector<std::size_t>> Examination::subsets(std::size_t size) const {
  std::vector<std::vector<std::size_t>> result;
  std::vector<std::size_t> chosen(size);
  std::iota(chosen.begin(), chosen.end(), 0U);
  const std::size_t n = used_.size();
  for (;;) {
    result.push_back(chosen);
    std::size_t i = size;
    while (i > 0 && chosen[i - 1] == n - size + i - 1) --i;
    if (i == 0) return result;
    ++chosen[i - 1];
    for (; i < size; ++i) chosen[i] = chosen[i - 1] + 1;
  }
}

/// The smallest set of views without which the others agree; of several, the one whose others agree best.
/// Empty when there is none. At least three views must be left, and more than half.
std::vector<std::size_t> Examination::find_excluded(std::span<const SeenView> views) const {
  for (std::size_t size = 1; size <= kMostExcluded && views.size() >= size + 3 && views.size() > 2 * size;
       ++size) {
    const std::vector<std::vector<std::size_t>> sets = subsets(size);
    std::vector<Agreement> found(sets.size());
    tbb::parallel_for(std::size_t{0}, sets.size(), [&](std::size_t i) {
      std::vector<SeenView> rest;
      for (std::size_t v = 0; v < views.size(); ++v) {
        if (std::find(sets[i].begin(), sets[i].end(), v) == sets[i].end()) rest.push_back(views[v]);
      }
      // A coarse lattice forgives more: views that it refuses need no finer one.
      found[i] = agreement(rest, kScreen);
      if (found[i].is_consistent(limits_)) found[i] = agreement(rest, size == 1 ? kFine : kCoarse);
    });
    std::size_t best = sets.size();
    for (std::size_t i = 0; i < sets.size(); ++i) {
      if (!found[i].is_consistent(limits_)) continue;
      if (best == sets.size() || found[i].mean > found[best].mean) best = i;
    }
    if (best < sets.size()) return sets[best];
  }
  return {};
}

bool Examination::cure_some() {
  const std::vector<SeenView> all = views();
  const std::vector<std::size_t> excluded = find_excluded(all);
  return !excluded.empty() && cure_excluded(excluded);
}

/// A slip of the whole rig, and cameras that are wrong besides: tried where most views would agree.
bool Examination::cure_all_and_some() {
  const std::vector<Camera> cameras = diagnosis_.cameras;
  const std::vector<BitMask> masks = diagnosis_.masks;
  for (const RigHypothesis& h : rig_hypotheses()) {
    if (h.unit != 1) continue;
    for (const std::size_t c : used_) {
      diagnosis_.cameras[c] = slip(h, cameras[c]);
      diagnosis_.masks[c] = flipped(masks[c], h.flip);
    }
    note({-1, -1, h.fault, "all cameras: " + h.cure, 0, 0});
    const std::vector<SeenView> all = views();
    const std::vector<std::size_t> excluded = find_excluded(all);
    if (!excluded.empty() && cure_excluded(excluded)) return true;
    diagnosis_.findings.pop_back();
    diagnosis_.cameras = cameras;
    diagnosis_.masks = masks;
  }
  return false;
}

bool Examination::cure_excluded(const std::vector<std::size_t>& excluded) {
  for (const std::size_t v : excluded) {
    if (cure_swap(v, excluded)) return true;
  }
  // Each camera is cured against those that agree, then joins them.
  std::vector<std::size_t> left = excluded;
  while (!left.empty()) {
    std::vector<SeenView> rest;
    const std::vector<SeenView> all = views();
    for (std::size_t v = 0; v < all.size(); ++v) {
      if (std::find(left.begin(), left.end(), v) == left.end()) rest.push_back(all[v]);
    }
    const std::optional<Box3f> box = box_of(rest);
    if (!box) return false;
    const SilhouetteConsistency trusted(*box, rest, kFine);
    if (!cure_camera(left.front(), trusted)) return false;
    left.erase(left.begin());
  }
  return true;
}

/// Two cameras have each other's masks.
bool Examination::cure_swap(std::size_t view, const std::vector<std::size_t>& excluded) {
  const std::vector<SeenView> all = views();
  std::size_t best_other = all.size();
  double best_mean = 0;
  for (std::size_t other = 0; other < all.size(); ++other) {
    if (other == view) continue;
    const bool only_two =
        std::all_of(excluded.begin(), excluded.end(), [&](std::size_t e) { return e == view || e == other; });
    const BitMask &a = *all[view].mask, &b = *all[other].mask;
    if (!only_two || a.width_px != b.width_px || a.height_px != b.height_px) continue;
    std::vector<SeenView> swapped = all;
    std::swap(swapped[view].mask, swapped[other].mask);
    const Agreement found = agreement(swapped, kFine);
    if (!found.is_consistent(limits_) || found.mean <= best_mean) continue;
    best_mean = found.mean;
    best_other = other;
  }
  if (best_other == all.size()) return false;
  const std::size_t a = used_[std::min(view, best_other)], b = used_[std::max(view, best_other)];
  std::swap(diagnosis_.masks[a], diagnosis_.masks[b]);
  note({static_cast<int>(a), static_cast<int>(b), "swapped",
        "cameras '" + input_.cameras[a].name + "' and '" + input_.cameras[b].name +
            "' have each other's masks (or calibrations): exchange them",
        0, 0});
  return true;
}

bool Examination::cure_camera(std::size_t view, const SilhouetteConsistency& trusted) {
  if (name_copy(view) || try_slips(view, trusted) || try_late(view, trusted) || try_motion(view, trusted))
    return true;
  name_mask(view, trusted);
  return true;
}

bool Examination::try_slips(std::size_t view, const SilhouetteConsistency& trusted) {
  const std::size_t c = used_[view];
  const std::span<const RigHypothesis> slips = rig_hypotheses();
  std::vector<Agreement> found(slips.size());
  tbb::parallel_for(std::size_t{0}, slips.size(), [&](std::size_t i) {
    const BitMask mask = flipped(diagnosis_.masks[c], slips[i].flip);
    const SeenView seen{slip(slips[i], diagnosis_.cameras[c]), &mask};
    found[i] = Agreement(trusted.recalls({&seen, 1}));
  });
  std::size_t best = slips.size();
  for (std::size_t i = 0; i < slips.size(); ++i) {
    if (found[i].is_consistent(limits_) && (best == slips.size() || found[i].mean > found[best].mean))
      best = i;
  }
  if (best == slips.size()) return false;
  diagnosis_.cameras[c] = slip(slips[best], diagnosis_.cameras[c]);
  diagnosis_.masks[c] = flipped(diagnosis_.masks[c], slips[best].flip);
  note({static_cast<int>(c), -1, slips[best].fault, slips[best].cure, 0, 0});
  return true;
}

bool Examination::try_late(std::size_t view, const SilhouetteConsistency& trusted) {
  const std::size_t c = used_[view];
  double best_mean = 0;
  int best = 0;
  for (std::size_t k = 1; k < input_.ticks.size(); ++k) {
    const BitMask& mask = input_.ticks[k][c];
    if (mask.words.empty()) continue;
    const SeenView seen{diagnosis_.cameras[c], &mask};
    const Agreement found(trusted.recalls({&seen, 1}));
    if (!found.is_consistent(limits_) || found.mean <= best_mean) continue;
    best_mean = found.mean;
    best = static_cast<int>(k);
  }
  if (best == 0) return false;
  diagnosis_.masks[c] = input_.ticks[static_cast<std::size_t>(best)][c];
  diagnosis_.late_by_ticks[c] = best;
  note({static_cast<int>(c), -1, "late",
        "it shows what the others showed " + std::to_string(best) +
            " frames before: shift its recording by as many",
        0, 0});
  return true;
}

bool Examination::try_motion(std::size_t view, const SilhouetteConsistency& trusted) {
  const std::size_t c = used_[view];
  SeenView seen{diagnosis_.cameras[c], &diagnosis_.masks[c]};
  Agreement found;
  // A camera that stands or looks elsewhere carves space that the others keep; a leak carves nothing.
  if (lost_by_others(seen, trusted) < 0.005) return false;
  for (const int samples : {kSearch, kFine}) {
    const SilhouetteConsistency hull(trusted.box_m(), trusted.trusted(), samples);
    seen.camera = search_pose(hull, seen).camera;
    found = Agreement(trusted.recalls({&seen, 1}));
    if (found.is_consistent(limits_)) break;
    if (samples == kSearch && found.mean < kNearlyConsistent) return false;  // a finer lattice won't mend it
  }
  if (!found.is_consistent(limits_)) return false;
  const Camera& found_camera = seen.camera;
  const Camera& given = diagnosis_.cameras[c];
  const double shift_m = length(found_camera.center_world() - given.center_world());
  const Mat3d turn = found_camera.T_cam_world.R * transpose(given.T_cam_world.R);
  const double cosine = 0.5 * (turn.row[0].x + turn.row[1].y + turn.row[2].z - 1);
  const double turn_deg = std::acos(clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
  const Camera cured = found_camera;
  diagnosis_.cameras[c] = cured;
  note({static_cast<int>(c), -1, "moved or turned",
        "calibrate this camera again; its silhouette fits when it is turned by " + number(turn_deg, "%.2f") +
            " degrees and moved by " + number(1000 * shift_m, "%.0f") + " mm",
        0, 0});
  return true;
}

/// Many masks that show background, too: each has compact areas that no other view keeps, and elsewhere ends
/// where the common hull does. A wrong calibration leaves rims instead.
bool Examination::name_leaks() {
  constexpr double kLeastExcess = 0.03, kLeastCompact = 0.3, kMostOpen = 0.4;
  const std::vector<SeenView> all = views();
  const std::optional<Box3f> box = box_of(all);
  if (!box) return false;
  const SilhouetteConsistency hull(*box, all, kFine);
  if (hull.sample_count() == 0) return false;
  std::vector<DoctorFinding> leaks;
  std::vector<BitMask> trimmed = diagnosis_.masks;
  for (const std::size_t c : used_) {
    const BitMask possible = hull.silhouette(diagnosis_.cameras[c]);
    BitMask excess = diagnosis_.masks[c];
    for (std::size_t w = 0; w < excess.words.size(); ++w) excess.words[w] &= ~possible.words[w];
    const auto area = static_cast<double>(excess.area_px()),
               of_mask = static_cast<double>(diagnosis_.masks[c].area_px());
    if (area < kLeastExcess * of_mask) continue;
    MaskCleaner cleaner(possible.width_px, possible.height_px);
    BitMask compact = excess, inner = possible, beside;
    const Camera& camera = diagnosis_.cameras[c];
    const double away_m = length(camera.center_world() - vec_cast<double>(box->center()));
    cleaner.erode(compact, std::max(2, static_cast<int>(2 * camera.fx_px * hull.spacing_m() / away_m)));
    cleaner.erode(inner, 1);
    grow_mask(excess, 2, beside);
    std::int64_t rim = 0, open = 0;
    for (std::size_t w = 0; w < possible.words.size(); ++w) {
      const std::uint32_t edge = possible.words[w] & ~inner.words[w];
      rim += popcount(edge);
      open += popcount(edge & beside.words[w]);
    }
    if (static_cast<double>(compact.area_px()) < kLeastCompact * area ||
        static_cast<double>(open) > kMostOpen * static_cast<double>(rim))
      return false;
    for (std::size_t w = 0; w < trimmed[c].words.size(); ++w) trimmed[c].words[w] &= possible.words[w];
    leaks.push_back({static_cast<int>(c), -1, "leaking mask",
                     percent(area / of_mask) +
                         " of the mask show what no other view keeps: background was kept; learn the "
                         "background again, or clear it",
                     0, 0});
  }
  if (leaks.empty()) return false;
  diagnosis_.masks = std::move(trimmed);
  for (DoctorFinding& leak : leaks) note(std::move(leak));
  return true;
}

/// A mask that no pose explains: pixels beyond the others' hull are a leak, missing pixels are a hole.
void Examination::name_mask(std::size_t view, const SilhouetteConsistency& trusted) {
  const std::size_t c = used_[view];
  const SeenView seen{diagnosis_.cameras[c], &diagnosis_.masks[c]};
  const double lost = lost_by_others(seen, trusted);
  const double excess = 1 - trusted.covered(seen);
  const BitMask possible = trusted.silhouette(diagnosis_.cameras[c]);
  BitMask& mask = diagnosis_.masks[c];
  DoctorFinding finding{static_cast<int>(c), -1, "", "", 0, 0};
  constexpr double kPure = 0.3;  // the smaller of the two, over the larger
  if (lost <= kPure * excess) {
    finding.fault = "leaking mask";
    finding.cure = percent(excess) +
                   " of the mask show what no other view keeps: background was kept; learn "
                   "the background again, or clear it";
    for (std::size_t w = 0; w < mask.words.size(); ++w) mask.words[w] &= possible.words[w];
  } else if (excess <= kPure * lost) {
    finding.fault = "holed mask";
    finding.cure = "the mask lacks what all others keep (they lose up to " + percent(lost) +
                   "): fill it (--repair-masks), or learn the background again";
    for (std::size_t w = 0; w < mask.words.size(); ++w) mask.words[w] |= possible.words[w];
  } else {
    finding.fault = "contradicts the others";
    finding.cure = "no slip explains it: look at its mask, calibrate it again, or leave it out";
    mask = {};
  }
  note(finding);
}

}  // namespace tactus
