#pragma once
/// Small recordings, good and bad, made when a test runs.
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace tactus::test {

/// A camera at (0, 0, -4 m) that looks along +z; its picture has 64x64 pixels.
struct Calibration {
  cv::Mat K = (cv::Mat_<double>(3, 3) << 60, 0, 31.5, 0, 60, 31.5, 0, 0, 1);
  cv::Mat distortion = cv::Mat::zeros(5, 1, CV_64F);
  cv::Mat R = cv::Mat::eye(3, 3, CV_64F);
  cv::Mat t = (cv::Mat_<double>(3, 1) << 0, 0, 4);
  cv::Size image_size{};  ///< written as OpenCV's programs do, unless empty
  std::string intrinsics_node = "CameraMatrix";
};
void write_calibration(const std::string& path, const Calibration& calibration = {});

/// What a test camera's line in the rig file says; "" is left out.
struct RigCamera {
  std::string name{}, mask{}, video{}, empty_room{}, calibration = "camera.yaml";
};
/// A rig of 64x64 pixels before a cube of 1 m. `more`: further lines of the file.
void write_rig(const std::string& path, const std::vector<RigCamera>& cameras, const std::string& more = "");

/// False when OpenCV can't write it.
bool write_image(const std::string& path, const cv::Mat& image);
/// One grey. The extension chooses the format.
void write_picture(const std::string& path, int grey, cv::Size size = {64, 64});
enum class Scene { empty_room, object, everything };  ///< what is before the camera
/// 25 frames a second; .avi holds motion JPEG, .mp4 MPEG-4.
void write_video(const std::string& path, Scene scene, int frames, cv::Size size = {64, 64});
/// Cuts a file to a part of its length.
void truncate_file(const std::string& path, double part);

}  // namespace tactus::test
