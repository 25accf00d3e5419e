#include "tactus/rig/camera_file.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tactus/base/error.h"
#include "tactus/rig/image_reading.h"

namespace tactus {

ColorImage read_photo(const std::string& file) {
  const cv::Mat bgr = read_image(file, cv::IMREAD_COLOR);
  ColorImage result(bgr.cols, bgr.rows);
  for (int y = 0; y < bgr.rows; ++y) {
    for (int x = 0; x < bgr.cols; ++x) {
      const auto& p = bgr.at<cv::Vec3b>(y, x);
      result(x, y) = {p[2], p[1], p[0]};
    }
  }
  return result;
}

Image<std::uint8_t> read_mask(const std::string& file, Index width_px, Index height_px) {
  cv::Mat image = read_image(file, cv::IMREAD_UNCHANGED);
  if (image.cols != width_px || image.rows != height_px) {
    throw Error(file + ": " + std::to_string(image.cols) + "x" + std::to_string(image.rows) +
                " pixels, the rig's image_size_px is " + std::to_string(width_px) + "x" +
                std::to_string(height_px));
  }
  if (image.depth() == CV_16U) image.convertTo(image, CV_8U, 1.0 / 257);
  std::vector<cv::Mat> channels;
  cv::split(image, channels);
  cv::Mat value = channels[0];
  double least_alpha = 255;
  if (channels.size() == 4) cv::minMaxLoc(channels[3], &least_alpha);
  if (least_alpha < 128) {
    value = channels[3];
  } else {
    for (std::size_t i = 1; i < std::min<std::size_t>(3, channels.size()); ++i) {
      value = cv::max(value, channels[i]);
    }
  }
  Image<std::uint8_t> result(width_px, height_px);
  for (int y = 0; y < value.rows; ++y) {
    for (int x = 0; x < value.cols; ++x) result(x, y) = value.at<std::uint8_t>(y, x) >= 128 ? 255 : 0;
  }
  return result;
}

}  // namespace tactus
