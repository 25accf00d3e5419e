#include "tactus/rig/images/silhouettes.h"

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

}  // namespace tactus
