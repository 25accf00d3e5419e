#include "tactus/rig/data_writers.h"

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/core/persistence.hpp>

#include "tactus/base/error.h"
#include "tactus/base/safe_file.h"
#include "tactus/media/picture.h"

namespace tactus {
namespace {

/// Grey, of 8 or 16 bits.
void write_image(const std::string& file, const cv::Mat& image) {
  const std::vector<std::uint8_t> bytes =
      encode_png(image.cols, image.rows, 1, image.depth() == CV_16U ? 16 : 8, image.data);
  write_file(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace

void write_calibration(const std::string& file, const Camera& c) {
  cv::Mat K = (cv::Mat_<double>(3, 3) << c.fx_px, c.skew_px, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1);
  cv::Mat R(3, 3, CV_64F), t(3, 1, CV_64F);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) R.at<double>(i, j) = c.T_cam_world.R(i, j);
    t.at<double>(i) = c.T_cam_world.t[i];
  }
  std::string text;
  try {
    cv::FileStorage store(".yaml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
    store << "image_width" << c.width_px << "image_height" << c.height_px << "CameraMatrix" << K
          << "DistortionCoeffs" << cv::Mat::zeros(5, 1, CV_64F) << "RotationValues" << R
          << "TranslationValues" << t;
    text = store.releaseAndGetString();
  } catch (const cv::Exception& e) {
    throw Error(file + ": OpenCV can't write it: " + e.msg);
  }
  write_file(file, text);
}

void write_mask(const std::string& file, const BitMask& mask) {
  AlphaImage bytes(mask.width_px, mask.height_px);
  for (Index y = 0; y < mask.height_px; ++y) {
    for (Index x = 0; x < mask.width_px; ++x) bytes(x, y) = static_cast<std::uint8_t>(mask(x, y) ? 255 : 0);
  }
  write_alpha(file, bytes);
}

void write_alpha(const std::string& file, const AlphaImage& alpha) {
  write_image(
      file, cv::Mat(alpha.height_px, alpha.width_px, CV_8U, const_cast<std::uint8_t*>(alpha.pixels.data())));
}

void write_depth(const std::string& file, const DepthImage& distance_m) {
  cv::Mat image(distance_m.height_px, distance_m.width_px, CV_16U);
  for (Index y = 0; y < distance_m.height_px; ++y) {
    for (Index x = 0; x < distance_m.width_px; ++x) {
      const float units = distance_m(x, y) * 1e4F;
      image.at<std::uint16_t>(y, x) =
          static_cast<std::uint16_t>(units > 0 && units < 65535.5F ? std::lround(units) : 0);
    }
  }
  write_image(file, image);
}

}  // namespace tactus
