#include "tactus/geom/mesh/surface_samples.h"

#include <cmath>

#include "tactus/base/at.h"

namespace tactus {
namespace {

/// Samples of a triangle: the middles of n^2 equal ones.
void add_samples(const std::array<Vec3f, 3>& x_m, const std::array<Index, 3>& corners, int n,
                 std::vector<SurfaceSamples::Sample>& samples) {
  const Vec3f across = cross(x_m[1] - x_m[0], x_m[2] - x_m[0]);
  const float length_m2 = length(across), step = 1 / static_cast<float>(n);
  if (!(length_m2 > 0)) return;
  SurfaceSamples::Sample s{{}, (1 / length_m2) * across, 0.5F * length_m2 * step * step, corners, {}};
  const auto add = [&](float u, float v) {
    s.shares = {1 - u - v, u, v};
    s.x_m = s.shares.x * x_m[0] + s.shares.y * x_m[1] + s.shares.z * x_m[2];
    samples.push_back(s);
  };
  for (int i = 0; i < n; ++i)
    for (int j = 0; i + j < n; ++j) {
      const float u = (static_cast<float>(i) + 1.F / 3) * step, v = (static_cast<float>(j) + 1.F / 3) * step;
      add(u, v);
      if (i + j + 1 < n) add(u + step / 3, v + step / 3);
    }
}

}  // namespace

SurfaceSamples::SurfaceSamples(const TriangleMesh& mesh, float reach_m, const Box3f& box_m)
    : reach_m_(reach_m), cell_m_(0.5F * reach_m) {
  constexpr float kFinest = 0.4F;  // sides of a sample's area, over the reach
  constexpr int kMostAlong = 12;
  constexpr float kMostCells = 96;  // along an axis
  std::vector<Sample> all;
  Box3f held{{1e30F, 1e30F, 1e30F}, {-1e30F, -1e30F, -1e30F}};
  for (const auto& t : mesh.triangles) {
    const std::array<Vec3f, 3> x_m{mesh.positions_m[at(t[0])], mesh.positions_m[at(t[1])],
                                   mesh.positions_m[at(t[2])]};
    const Vec3f low = min(x_m[0], min(x_m[1], x_m[2])), high = max(x_m[0], max(x_m[1], x_m[2]));
    const Vec3f apart = max(box_m.min - high, low - box_m.max);
    if (!(max(apart.x, max(apart.y, apart.z)) <= 0)) continue;
    const float longest_m =
        max(length(x_m[1] - x_m[0]), max(length(x_m[2] - x_m[1]), length(x_m[0] - x_m[2])));
    const float along = std::ceil(longest_m / (kFinest * reach_m));
    add_samples(x_m, t, static_cast<int>(clamp(along, 1.F, static_cast<float>(kMostAlong))), all);
    held = {min(held.min, low), max(held.max, high)};
  }
  first_.assign(2, 0);
  if (all.empty()) return;
  low_m_ = held.min;
  const Vec3f extent_m = held.max - held.min;
  cell_m_ = max(cell_m_, max(extent_m.x, max(extent_m.y, extent_m.z)) / kMostCells);
  const auto cells = [&](float m) { return static_cast<Index>(m / cell_m_) + 1; };
  cells_ = {cells(extent_m.x), cells(extent_m.y), cells(extent_m.z)};
  first_.assign(at(std::int64_t{cells_.x} * cells_.y * cells_.z) + 1, 0);
  const auto place = [&](Vec3f x_m) {
    const Vec3i c = cell_of(x_m);
    return at((std::int64_t{c.z} * cells_.y + c.y) * cells_.x + c.x);
  };
  for (const Sample& s : all) ++first_[place(s.x_m) + 1];
  for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  samples_.resize(all.size());
  for (const Sample& s : all) samples_[next[place(s.x_m)]++] = s;
}

Vec3i SurfaceSamples::cell_of(Vec3f p_m) const {
  const auto along = [&](float from_low_m, Index count) {
    const float cell = std::floor(from_low_m / cell_m_);
    return cell > 0.F ? static_cast<Index>(std::min(cell, static_cast<float>(count - 1))) : 0;  // NaN: 0
  };
  const Vec3f q = p_m - low_m_;
  return {along(q.x, cells_.x), along(q.y, cells_.y), along(q.z, cells_.z)};
}

}  // namespace tactus
