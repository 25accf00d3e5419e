#include "tactus/rig/camera_file.h"

#include <filesystem>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "tactus/base/error.h"
#include "tactus/rig/image_reading.h"
#include "tactus/rig/numbered_files.h"
#include "tactus/rig/silhouettes.h"

namespace tactus {
namespace {

/// "; did you mean 'x'?" or the list of what the file holds.
std::string suggest_node(const cv::FileStorage& store, const std::string& node) {
  std::vector<std::string> names;
  for (const cv::FileNode& n : store.root()) names.push_back(n.name());
  return names.empty() ? "; the file holds nothing" : suggestion(node, names);
}

cv::Mat matrix(const cv::FileStorage& store, const std::string& file, const std::string& node) {
  cv::Mat m;
  try {
    store[node] >> m;
  } catch (const cv::Exception&) {
    m.release();
  }
  if (m.empty()) throw Error(file + ": no matrix '" + node + "'" + suggest_node(store, node));
  m.convertTo(m, CV_64F);
  if (!cv::checkRange(m)) throw Error(file + ": '" + node + "' holds a value that is not finite");
  return m;
}

void expect(bool right, const std::string& file, const std::string& node, const cv::Mat& m,
            const std::string& shape) {
  if (!right) {
    throw Error(file + ": '" + node + "' is " + std::to_string(m.rows) + "x" + std::to_string(m.cols) +
                ", expected " + shape);
  }
}

/// Only an upper triangle with positive focal lengths over (0 0 1) maps the space before a camera to pixels.
void check_intrinsics(const cv::Mat& K, const std::string& file, const std::string& node) {
  const auto at = [&](int row, int column) { return K.at<double>(row, column); };
  if (at(1, 0) == 0 && at(2, 0) == 0 && at(2, 1) == 0 && at(2, 2) == 1 && at(0, 0) > 0 && at(1, 1) > 0)
    return;
  std::ostringstream text;
  for (int i = 0; i < 3; ++i) text << (i == 0 ? "" : "; ") << at(i, 0) << " " << at(i, 1) << " " << at(i, 2);
  throw Error(file + ": '" + node + "' is [" + text.str() +
              "], expected [fx s cx; 0 fy cy; 0 0 1] with focal lengths fx, fy > 0");
}

/// OpenCV's calibration programs write the size of their pictures beside the matrices.
void check_calibrated_size(const cv::FileStorage& store, const std::string& file, Index width_px,
                           Index height_px) {
  const cv::FileNode w = store["image_width"], h = store["image_height"];
  if (!w.isInt() || !h.isInt()) return;
  const int width = static_cast<int>(w), height = static_cast<int>(h);
  if (width == width_px && height == height_px) return;
  throw Error(file + ": calibrated for images of " + std::to_string(width) + "x" + std::to_string(height) +
              " pixels (image_width, image_height), the rig's image_size_px is " + std::to_string(width_px) +
              "x" + std::to_string(height_px));
}

}  // namespace

CalibratedCamera read_calibration(const std::string& file, const CalibrationNodes& nodes, double unit_m,
                                  Index width_px, Index height_px) {
  if (!std::filesystem::is_regular_file(file))
    throw Error(file + ": no such calibration" + suggest_file(file));
  cv::FileStorage store;
  try {
    store.open(file, cv::FileStorage::READ);
  } catch (const cv::Exception&) {
    store.release();
  }
  if (!store.isOpened()) throw Error(file + ": not an OpenCV XML or YAML file");
  check_calibrated_size(store, file, width_px, height_px);
  const cv::Mat K = matrix(store, file, nodes.intrinsics);
  expect(K.rows == 3 && K.cols == 3, file, nodes.intrinsics, K, "3x3");
  check_intrinsics(K, file, nodes.intrinsics);
  const cv::Mat d = matrix(store, file, nodes.distortion);
  const auto n = d.total();
  expect(n == 2 || n == 4 || n == 5 || n == 8 || n == 12 || n == 14, file, nodes.distortion, d,
         "2, 4, 5, 8, 12 or 14 coefficients");
  cv::Mat R = matrix(store, file, nodes.rotation);
  expect(R.total() == 3 || (R.rows == 3 && R.cols == 3), file, nodes.rotation, R, "3x1 or 3x3");
  if (R.total() == 3) cv::Rodrigues(R.clone(), R);
  const cv::Mat t = matrix(store, file, nodes.translation);
  expect(t.total() == 3, file, nodes.translation, t, "3x1");
  CalibratedCamera result;
  Camera& c = result.camera;
  c.name = std::filesystem::path(file).filename();
  c.width_px = width_px;
  c.height_px = height_px;
  c.fx_px = K.at<double>(0, 0);
  c.fy_px = K.at<double>(1, 1);
  c.cx_px = K.at<double>(0, 2);
  c.cy_px = K.at<double>(1, 2);
  c.skew_px = K.at<double>(0, 1);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) c.T_cam_world.R(i, j) = R.at<double>(i, j);
    c.T_cam_world.t[i] = unit_m * t.ptr<double>()[i];
  }
  try {
    result.lens = make_lens(LensModel::brown, {d.ptr<double>(), n});
    check_camera(c);
  } catch (const Error& e) {
    throw Error(file + ": " + e.what());
  }
  return result;
}

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
