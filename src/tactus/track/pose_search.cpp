#include "tactus/track/pose_search.h"

#include <algorithm>

#include "tactus/compute/cpu_for.h"

namespace tactus {
namespace {

constexpr std::size_t kCoarseFits = 6, kMostFound = 6;
constexpr double kCoarseSpacing_px = 2, kSeedSearch_px = 8;
constexpr int kCoarseSteps = 8;
/// Times PoseFit::wrong of the best coarse pose: worse poses go. A fine fit lowers that of some by a fifth,
/// and keeps poses that are 1.6 times worse than the best.
constexpr double kFarWorseTry = 2;

PoseFitSettings coarse(PoseFitSettings settings) {
  settings.spacing_px = kCoarseSpacing_px;
  return settings;
}

}  // namespace

bool is_other_pose(const Rigidd& a, const Rigidd& b, Vec3d center_m) {
  const Twist by = twist_between(a, b, center_m);
  return length(Vec3d{by[0], by[1], by[2]}) > 0.5 || length(Vec3d{by[3], by[4], by[5]}) > 0.02;
}

PoseSearch::PoseSearch(const OutlineMesh& mesh, std::span<const Camera> cameras,
                       std::span<const int> radius_px, PoseFitSettings settings)
    : mesh_(&mesh),
      radius_px_(radius_px.begin(), radius_px.end()),
      fitters_(kCoarseFits, PoseFitter(mesh, cameras, coarse(settings))) {}

std::vector<PoseSearch::Try> PoseSearch::seeds(std::span<const BitMask> masks,
                                               std::span<const BitMask> taken) const {
  const std::span<const Camera> cameras = fitters_.front().cameras();
  std::vector<std::vector<ThinPart>> parts(cameras.size());
  cpu_for(cameras.size(), 1, [&](std::size_t c) {
    if (masks[c].words.empty()) return;
    BitMask mask = masks[c];
    for (std::size_t i = 0; i < mask.words.size() && !taken.empty(); ++i) mask.words[i] &= ~taken[c].words[i];
    parts[c] = thin_parts(mask, radius_px_[c]);
  });
  const double tolerance_px = *std::max_element(radius_px_.begin(), radius_px_.end());
  std::vector<Try> all;
  for (const SeenLine& line : seen_lines(cameras, parts, tolerance_px))
    for (const Rigidd& pose : poses_along(*mesh_, line)) all.push_back({pose});
  return all;
}

void PoseSearch::sort(std::vector<Try>& tries) {
  std::stable_sort(tries.begin(), tries.end(), [](const Try& a, const Try& b) { return a.wrong < b.wrong; });
}

void PoseSearch::fit(std::span<const BitMask> masks, std::span<const SeenPoint> points,
                     std::vector<Try>& tries, std::size_t first) {
  cpu_for(tries.size() - first, 1, [&](std::size_t k) {
    Try& one = tries[first + k];
    const PoseFit fit =
        fitters_[k].fit(masks, one.T_world_model, kSeedSearch_px, nullptr, kCoarseSteps, {.points = points});
    one = {fit.T_world_model, fit.wrong};
  });
}

std::vector<Rigidd> PoseSearch::find(std::span<const BitMask> masks, std::span<const BitMask> taken,
                                     std::span<const SeenPoint> points) {
  const auto is_other = [&](const Rigidd& a, const Rigidd& b) {
    return is_other_pose(a, b, mesh_->center_m);
  };
  std::vector<Try> tries = seeds(masks, taken);
  cpu_for(fitters_.size(), 1, [&](std::size_t k) {
    for (std::size_t i = k; i < tries.size(); i += fitters_.size())
      tries[i].wrong = fitters_[k].wrong(masks, tries[i].T_world_model);
  });
  sort(tries);
  if (tries.size() > kCoarseFits) tries.resize(kCoarseFits);
  if (tries.empty()) return {};
  fit(masks, points, tries, 0);
  sort(tries);
  // Fits that went astray say nothing of poses near them.
  const double most_wrong = kFarWorseTry * tries.front().wrong;
  std::erase_if(tries, [&](const Try& t) { return t.wrong > most_wrong; });
  const std::size_t seeded = tries.size();
  for (const Rigidd& pose : turned_over(*mesh_, tries.front().T_world_model)) {
    const bool is_new = std::all_of(tries.begin(), tries.begin() + static_cast<std::ptrdiff_t>(seeded),
                                    [&](const Try& t) { return is_other(t.T_world_model, pose); });
    if (is_new) tries.push_back({pose});
  }
  fit(masks, points, tries, seeded);
  sort(tries);
  std::vector<Rigidd> found;
  for (const Try& one : tries) {
    const bool is_new = std::all_of(found.begin(), found.end(),
                                    [&](const Rigidd& f) { return is_other(one.T_world_model, f); });
    if (is_new && found.size() < kMostFound && one.wrong <= kFarWorseTry * tries.front().wrong)
      found.push_back(one.T_world_model);
  }
  return found;
}

}  // namespace tactus
