#include "tactus/rig/images/camera_file.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "tactus/base/error.h"
#include "tactus/rig/images/image_reading.h"

namespace tactus {

ColorImage read_photo(const std::string& file) {
  const cv::Mat bgr = read_image(file, ReadAs::color);
  ColorImage result(bgr.cols, bgr.rows);
  for (int y = 0; y < bgr.rows; ++y) {
    for (int x = 0; x < bgr.cols; ++x) {
      const auto& p = bgr.at<cv::Vec3b>(y, x);
      result(x, y) = {p[2], p[1], p[0]};
    }
  }
  return result;
}

namespace {

/// The value of white: the largest one of an integer type, 1 in floats.
double white_of(const cv::Mat& image, const std::string& file) {
  switch (image.depth()) {
    case CV_8U:
      return 255;
    case CV_16U:
      return 65535;
    case CV_32F:
    case CV_64F:
      return 1;
    default:
      throw Error(file + ": a mask of signed or 32-bit integers; expected 8 or 16 bits, or floats");
  }
}

/// Alpha where any of it is transparent, else the brightest channel; as floats.
cv::Mat brightness_of(const cv::Mat& image, double white) {
  std::vector<cv::Mat> channels;
  cv::split(image, channels);
  cv::Mat value = channels[0];
  double least_alpha = white;
  if (channels.size() == 4) cv::minMaxLoc(channels[3], &least_alpha);
  if (least_alpha < 0.5 * white) {
    value = channels[3];
  } else {
    for (std::size_t i = 1; i < std::min<std::size_t>(3, channels.size()); ++i)
      value = cv::max(value, channels[i]);
  }
  cv::Mat floats;
  value.convertTo(floats, CV_32F);
  return floats;
}

constexpr std::size_t kMostLabels = 16;

/// The values of an image where they are few; else none.
std::vector<float> few_values(const cv::Mat& value) {
  std::vector<float> values;
  for (int y = 0; y < value.rows; ++y) {
    for (int x = 0; x < value.cols; ++x) {
      const float v = value.at<float>(y, x);
      const auto at = std::lower_bound(values.begin(), values.end(), v);
      if (at != values.end() && *at == v) continue;
      if (values.size() > kMostLabels) return {};
      values.insert(at, v);
    }
  }
  return values;
}

/// The least value that is foreground in an image where nothing is half as bright as white.
float least_label(const cv::Mat& value, float brightest, double white, const std::string& file,
                  std::string* notice) {
  const std::string white_is = "; white is " + number_text(white);
  const std::vector<float> labels = few_values(value);
  if (labels.empty() || labels.front() != 0)
    throw Error(file + ": grey values up to " + number_text(static_cast<double>(brightest)) +
                " tell no foreground from background" + white_is);
  std::string names;
  for (const float v : labels)
    names += (names.empty() ? "" : v == labels.back() ? " and " : ", ") + number_text(static_cast<double>(v));
  if (notice != nullptr)
    *notice = "the mask has values " + names + white_is + ": all but 0 is taken as foreground";
  return labels[1];
}

}  // namespace

Image<std::uint8_t> read_mask(const std::string& file, Index width_px, Index height_px, std::string* notice) {
  const cv::Mat image = read_image(file, ReadAs::as_is);
  if (image.cols != width_px || image.rows != height_px) {
    throw Error(file + ": " + std::to_string(image.cols) + "x" + std::to_string(image.rows) +
                " pixels, the rig's image_size_px is " + std::to_string(width_px) + "x" +
                std::to_string(height_px));
  }
  const double white = white_of(image, file);
  const cv::Mat value = brightness_of(image, white);
  double brightest = 0;
  cv::minMaxLoc(value, nullptr, &brightest);
  auto least = static_cast<float>(0.5 * white);
  if (brightest > 0 && brightest < 0.5 * white)
    least = least_label(value, static_cast<float>(brightest), white, file, notice);
  Image<std::uint8_t> result(width_px, height_px);
  for (int y = 0; y < value.rows; ++y) {
    for (int x = 0; x < value.cols; ++x) result(x, y) = value.at<float>(y, x) >= least ? 255 : 0;
  }
  return result;
}

}  // namespace tactus
