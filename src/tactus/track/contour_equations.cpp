#include "tactus/track/contour_equations.h"

#include <algorithm>
#include <cmath>

namespace tactus {
namespace {

constexpr double kBin_px = 4;         // half of a correlation length
constexpr double kMostBins = 48;      // of a picture: larger ones hold more points
constexpr double kLeastWeight = 0.3;  // of all points of a bin
constexpr double kSameSide = 0.8;     // cosine between the normals of a bin

constexpr double kStepLength_px = 8;  // longer steps are the same all along a bin and its neighbours
/// Variance that all contours of a picture have in common, over the field's: masks too fat or too thin.
constexpr double kCommon = 0.25;

double distance2(Vec2d a, Vec2d b) { return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y); }

/// Masks are rounded to pixels: by 1 / sqrt(12). Where a contour runs along pixels, that is the same over so
/// many of them as it takes to reach the next row.
double stepped_px(Vec2d normal) {
  const double x = std::abs(normal.x), y = std::abs(normal.y),
               slope = std::min(x, y) / std::max({x, y, 1e-9});
  return std::max(1 - kStepLength_px * slope, 0.0) / std::sqrt(12.0);
}

}  // namespace

void ContourEquations::fill_bins(std::span<const ContourPoint> points, Vec2d shift_px, double length_px) {
  bins_.clear();
  Vec2d before{}, begin_normal{};
  double way_px = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ContourPoint& p = points[i];
    const double step_px = i > 0 ? std::sqrt(distance2(p.px, before)) : 0;
    way_px += step_px;
    const double turn = p.normal.x * begin_normal.x + p.normal.y * begin_normal.y;
    const bool same_side =
        turn > kSameSide * std::sqrt(distance2(p.normal, {}) * distance2(begin_normal, {}));
    if (bins_.empty() || !p.follows || way_px >= length_px || !same_side) {
      Bin& bin = bins_.emplace_back();
      bin.follows = p.follows && bins_.size() > 1;
      begin_normal = p.normal;
      way_px = 0;
    }
    before = p.px;
    Bin& bin = bins_.back();
    const double w = p.weight;
    bin.weight += w;
    bin.px = bin.px + w * p.px;
    bin.normal = bin.normal + w * p.normal;
    bin.gain += w * p.gain;
    bin.off_px += w * (p.off_px - p.normal.x * shift_px.x - p.normal.y * shift_px.y);
    for (int k = 0; k < 6; ++k) bin.j[k] += w * p.j[k];
  }
  std::size_t kept = 0;
  bool has_before = false;
  for (Bin& bin : bins_) {
    const bool is_kept = bin.weight > kLeastWeight;
    if (is_kept) {
      const double share = 1 / bin.weight;
      bin.px = share * bin.px;
      bin.normal = share * bin.normal;
      bin.gain *= share;
      bin.off_px *= share;
      for (double& x : bin.j) x *= share;
      bin.stepped_px = stepped_px(bin.normal);
      bin.follows = bin.follows && has_before;
      bins_[kept++] = bin;
    }
    has_before = is_kept;
  }
  bins_.resize(kept);
}

void ContourEquations::add_moments(const ContourNoise& noise) {
  moments_ = {};
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    const Bin& b = bins_[i];
    moments_.squares += b.off_px * b.off_px;
    moments_.square_gains += b.gain * b.gain;
    moments_.shares += 1 / b.weight;
    if (!b.follows) continue;
    const Bin& a = bins_[i - 1];
    const double ratio2 = distance2(a.px, b.px) / (noise.correlation_px * noise.correlation_px);
    moments_.products += a.off_px * b.off_px;
    moments_.product_gains += a.gain * b.gain * std::exp(-ratio2);
  }
}

void ContourEquations::assemble(std::span<const ContourPoint> points, double spacing_px, Vec2d shift_px,
                                const ContourNoise& noise) {
  const double length_px = spacing_px * static_cast<double>(points.size());
  fill_bins(points, shift_px, std::max(kBin_px, length_px / kMostBins));
  add_moments(noise);
  moments_.length_px = length_px;
  moments_.bins = static_cast<int>(bins_.size());
  const int n = static_cast<int>(bins_.size());
  covariance_.reset(n, n);
  rows_.reset(n, kUnknowns + 1);
  const double variance = noise.contour_px * noise.contour_px,
               per_px2 = 1 / (noise.correlation_px * noise.correlation_px);
  for (int i = 0; i < n; ++i) {
    const Bin& b = bins_[static_cast<std::size_t>(i)];
    for (int k = 0; k < i; ++k) {
      const Bin& other = bins_[static_cast<std::size_t>(k)];
      const double ratio2 = per_px2 * distance2(b.px, other.px);
      const double gains = variance * b.gain * other.gain;
      covariance_(i, k) = kCommon * gains;
      if (ratio2 < 9) covariance_(i, k) += (gains + b.stepped_px * other.stepped_px) * std::exp(-ratio2);
    }
    covariance_(i, i) =
        variance * b.gain * b.gain * (1 + kCommon) + b.stepped_px * b.stepped_px + noise.white_px2 / b.weight;
    double* row = rows_.row(i);
    std::copy(b.j, b.j + 6, row);
    row[6] = b.normal.x;
    row[7] = b.normal.y;
    row[8] = b.off_px;
  }
  factorize(covariance_);
  solve_lower(covariance_, rows_);
  for (int a = 0; a < kUnknowns; ++a) {
    right[a] = 0;
    for (int c = 0; c < kUnknowns; ++c) information[a][c] = 0;
  }
  for (int i = 0; i < n; ++i) {
    const double* row = rows_.row(i);
    moments_.surprise += row[8] * row[8] + 2 * std::log(covariance_(i, i));
    for (int a = 0; a < kUnknowns; ++a) {
      for (int c = 0; c < kUnknowns; ++c) information[a][c] += row[a] * row[c];
      right[a] += row[a] * row[8];
    }
  }
}

}  // namespace tactus
