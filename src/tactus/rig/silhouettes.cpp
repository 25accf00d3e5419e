#include "tactus/rig/silhouettes.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace tactus {
namespace {

cv::Mat disc(int radius_px) {
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius_px + 1, 2 * radius_px + 1});
}

void keep_largest(cv::Mat& mask) {
  cv::Mat labels, stats, centers;
  const int n = cv::connectedComponentsWithStats(mask, labels, stats, centers, 8);
  int best = 0;
  for (int i = 1; i < n; ++i) {
    if (best == 0 || stats.at<int>(i, cv::CC_STAT_AREA) > stats.at<int>(best, cv::CC_STAT_AREA)) best = i;
  }
  if (best > 0) mask = labels == best;
}

/// Fills background components smaller than `area_px` that do not touch the border.
void fill_holes(cv::Mat& mask, int area_px) {
  cv::Mat background = ~mask, labels, stats, centers;
  const int n = cv::connectedComponentsWithStats(background, labels, stats, centers, 4);
  std::vector<std::uint8_t> fill(static_cast<std::size_t>(n), 0);
  for (int i = 1; i < n; ++i) {
    const int* s = stats.ptr<int>(i);
    const bool at_border = s[cv::CC_STAT_LEFT] == 0 || s[cv::CC_STAT_TOP] == 0 ||
                           s[cv::CC_STAT_LEFT] + s[cv::CC_STAT_WIDTH] == mask.cols ||
                           s[cv::CC_STAT_TOP] + s[cv::CC_STAT_HEIGHT] == mask.rows;
    fill[static_cast<std::size_t>(i)] = !at_border && s[cv::CC_STAT_AREA] < area_px ? 255 : 0;
  }
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      mask.at<std::uint8_t>(y, x) |= fill[static_cast<std::size_t>(labels.at<int>(y, x))];
    }
  }
}

}  // namespace

void pack_mask(const std::uint8_t* bytes, Index width_px, Index height_px, BitMask& mask) {
  if (mask.width_px != width_px || mask.height_px != height_px) mask = BitMask(width_px, height_px);
  std::fill(mask.words.begin(), mask.words.end(), 0U);
  for (Index y = 0; y < height_px; ++y) {
    for (Index x = 0; x < width_px; ++x) {
      if (*bytes++ >= 128) mask.set(x, y);
    }
  }
}

BitMask threshold_silhouette(const ColorImage& photo, const ThresholdOptions& options) {
  cv::Mat mask(photo.height_px, photo.width_px, CV_8U);
  for (Index y = 0; y < photo.height_px; ++y) {
    for (Index x = 0; x < photo.width_px; ++x) {
      const Rgb8 c = photo(x, y);
      const bool bright = std::max({c.r, c.g, c.b}) >= 255 * options.threshold;
      mask.at<std::uint8_t>(y, x) = bright ? 255 : 0;
    }
  }
  if (options.dilate_px > 0) cv::dilate(mask, mask, disc(options.dilate_px));
  if (options.erode_px > 0) cv::erode(mask, mask, disc(options.erode_px));
  keep_largest(mask);
  fill_holes(mask, options.largest_hole_px);
  BitMask result;
  pack_mask(mask.data, photo.width_px, photo.height_px, result);
  return result;
}

struct BackgroundModel::State {
  cv::Mat sum;  ///< CV_32FC3
  float count = 0;
};

BackgroundModel::BackgroundModel(Index width_px, Index height_px) : state_(std::make_unique<State>()) {
  state_->sum = cv::Mat::zeros(height_px, width_px, CV_32FC3);
}
BackgroundModel::~BackgroundModel() = default;
BackgroundModel::BackgroundModel(BackgroundModel&&) noexcept = default;

void BackgroundModel::learn(const std::uint8_t* bgr) {
  const std::size_t n = state_->sum.total() * 3;
  auto* sum = reinterpret_cast<float*>(state_->sum.data);
  for (std::size_t i = 0; i < n; ++i) sum[i] += static_cast<float>(bgr[i]);
  state_->count += 1;
}

void BackgroundModel::classify(const std::uint8_t* bgr, const BackgroundOptions& o,
                               std::uint8_t* result) const {
  const cv::Mat& sum = state_->sum;
  const auto* mean = reinterpret_cast<const float*>(sum.data);
  const float scale = 1 / std::max(1.0F, state_->count);
  const auto chroma2 = static_cast<float>(o.chroma * o.chroma);
  const auto noise2 = static_cast<float>(o.noise * o.noise);
  const auto low = static_cast<float>(o.darkest_shadow), high = static_cast<float>(o.brightest);
  // Smoothing the photo's noise away before the decision keeps edges truer than cleaning the mask afterwards.
  cv::Mat photo;
  cv::GaussianBlur(cv::Mat(sum.rows, sum.cols, CV_8UC3, const_cast<std::uint8_t*>(bgr)), photo, {3, 3}, 0);
  cv::Mat mask(sum.rows, sum.cols, CV_8U, result);
  const std::uint8_t* p = photo.data;
  for (std::size_t i = 0; i < sum.total(); ++i) {
    const float b = scale * mean[3 * i], g = scale * mean[3 * i + 1], r = scale * mean[3 * i + 2];
    const float pb = p[3 * i], pg = p[3 * i + 1], pr = p[3 * i + 2];
    const float ratio = (b * pb + g * pg + r * pr) / (b * b + g * g + r * r + 1);
    const float off = (pb - ratio * b) * (pb - ratio * b) + (pg - ratio * g) * (pg - ratio * g) +
                      (pr - ratio * r) * (pr - ratio * r);
    const float away = (pb - b) * (pb - b) + (pg - g) * (pg - g) + (pr - r) * (pr - r);
    const bool foreground = (away > noise2) & ((off > chroma2) | (ratio < low) | (ratio > high));
    result[i] = foreground ? 255 : 0;
  }
  if (o.open_px > 0) cv::morphologyEx(mask, mask, cv::MORPH_OPEN, disc(o.open_px));
  if (o.close_px > 0) cv::morphologyEx(mask, mask, cv::MORPH_CLOSE, disc(o.close_px));
  cv::Mat whole = mask.clone();
  keep_largest(whole);
  fill_holes(whole, o.largest_hole_px);
  whole.copyTo(mask);
}

}  // namespace tactus
