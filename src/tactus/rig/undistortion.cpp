#include "tactus/rig/undistortion.h"

#include <tbb/parallel_for.h>

#include <opencv2/imgproc.hpp>

#include "tactus/rig/silhouettes.h"

namespace tactus {

struct Undistortion::Maps {
  Camera pinhole;
  cv::Size photo;
  cv::Mat xy, fraction;  ///< fixed point; empty without a lens
};

Undistortion::Undistortion(const CalibratedCamera& calibrated)
    : maps_(std::make_unique<Maps>(Maps{undistorted_camera(calibrated),
                                        {calibrated.camera.width_px, calibrated.camera.height_px},
                                        {},
                                        {}})) {
  if (calibrated.lens.model == LensModel::none) return;
  const Camera& to = maps_->pinhole;
  const double limit = calibrated.lens.limit();
  cv::Mat at(to.height_px, to.width_px, CV_32FC2);
  tbb::parallel_for(Index{0}, to.height_px, [&](Index y) {
    for (Index x = 0; x < to.width_px; ++x) {
      const auto px = photo_pixel(calibrated, to, {static_cast<double>(x), static_cast<double>(y)}, limit);
      at.at<cv::Vec2f>(y, x) =
          px ? cv::Vec2f(static_cast<float>(px->x), static_cast<float>(px->y)) : cv::Vec2f(-1, -1);
    }
  });
  cv::convertMaps(at, cv::Mat(), maps_->xy, maps_->fraction, CV_16SC2);
}
Undistortion::~Undistortion() = default;
Undistortion::Undistortion(Undistortion&&) noexcept = default;

const Camera& Undistortion::camera() const { return maps_->pinhole; }

void Undistortion::mask(const std::uint8_t* bytes, Image<std::uint8_t>& scratch, BitMask& result) const {
  if (maps_->xy.empty()) return pack_mask(bytes, maps_->photo.width, maps_->photo.height, result);
  const cv::Size size = maps_->xy.size();
  if (scratch.width_px != size.width || scratch.height_px != size.height) {
    scratch = Image<std::uint8_t>(size.width, size.height);
  }
  cv::Mat to(size, CV_8U, scratch.pixels.data());
  // Samples lie at most half a pixel beyond the last centre: there the last pixel is the answer.
  cv::remap(cv::Mat(maps_->photo, CV_8U, const_cast<std::uint8_t*>(bytes)), to, maps_->xy, maps_->fraction,
            cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  pack_mask(scratch.pixels.data(), size.width, size.height, result);
}

void Undistortion::color(const std::uint8_t* bgr, ColorImage& result) const {
  const Camera& c = maps_->pinhole;
  if (result.width_px != c.width_px || result.height_px != c.height_px) {
    result = ColorImage(c.width_px, c.height_px);
  }
  const cv::Mat from(maps_->photo, CV_8UC3, const_cast<std::uint8_t*>(bgr));
  cv::Mat to(c.height_px, c.width_px, CV_8UC3, result.pixels.data());
  if (maps_->xy.empty()) return cv::cvtColor(from, to, cv::COLOR_BGR2RGB);
  cv::remap(from, to, maps_->xy, maps_->fraction, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  cv::cvtColor(to, to, cv::COLOR_BGR2RGB);
}

}  // namespace tactus
