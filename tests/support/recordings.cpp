#include "support/recordings.h"

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <stdexcept>

namespace tactus::test {

namespace fs = std::filesystem;

void write_calibration(const std::string& path, const Calibration& c) {
  cv::FileStorage store(path, cv::FileStorage::WRITE);
  if (!c.image_size.empty())
    store << "image_width" << c.image_size.width << "image_height" << c.image_size.height;
  store << c.intrinsics_node << c.K << "DistortionCoeffs" << c.distortion << "RotationValues" << c.R
        << "TranslationValues" << c.t;
}

void write_rig(const std::string& path, const std::vector<RigCamera>& cameras, const std::string& more) {
  std::ofstream out(path);
  out << "unit_m: 1\nimage_size_px: [64, 64]\n"
         "workspace_m: {min: [-0.5, -0.5, -0.5], max: [0.5, 0.5, 0.5]}\n"
      << more << (cameras.empty() ? "cameras: []\n" : "cameras:\n");
  for (const RigCamera& c : cameras) {
    out << "  - name: " << c.name << "\n";
    for (const auto& [key, value] : {std::pair<const char*, const std::string&>{"calibration", c.calibration},
                                     {"mask", c.mask},
                                     {"video", c.video},
                                     {"empty_room", c.empty_room}}) {
      if (!value.empty()) out << "    " << key << ": " << value << "\n";
    }
  }
}

bool write_image(const std::string& path, const cv::Mat& image) { return cv::imwrite(path, image); }

void write_picture(const std::string& path, int grey, cv::Size size) {
  cv::imwrite(path, cv::Mat(size, CV_8UC1, cv::Scalar(grey)));
}

void write_video(const std::string& path, Scene scene, int frames, cv::Size size) {
  const bool avi = path.ends_with(".avi");
  const int codec =
      avi ? cv::VideoWriter::fourcc('M', 'J', 'P', 'G') : cv::VideoWriter::fourcc('m', 'p', '4', 'v');
  cv::VideoWriter video(path, cv::CAP_FFMPEG, codec, 25, size);
  if (!video.isOpened()) throw std::runtime_error("OpenCV can't write " + path);
  const cv::Scalar room(40, 40, 40), bright(60, 220, 240);
  cv::Mat frame(size, CV_8UC3, scene == Scene::everything ? bright : room);
  if (scene == Scene::object) {
    cv::rectangle(frame, {size.width * 3 / 8, size.height * 3 / 8, size.width / 4, size.height / 4}, bright,
                  cv::FILLED);
  }
  for (int i = 0; i < frames; ++i) video.write(frame);
}

void truncate_file(const std::string& path, double part) {
  fs::resize_file(path, static_cast<std::uintmax_t>(part * static_cast<double>(fs::file_size(path))));
}

}  // namespace tactus::test
