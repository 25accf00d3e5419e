#include "tactus/rig/picture_reader.h"

#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>

#include "tactus/base/error.h"

namespace tactus {
namespace {

class VideoReader final : public PictureReader {
 public:
  VideoReader(const std::string& what, const PictureSettings& settings)
      : what_(what),
        settings_(settings),
        is_v4l_(what.starts_with("/dev/video")),
        is_stream_(what.find("://") != what.npos) {
    if (settings.trigger != PictureTrigger::none && is_device())
      throw usage_error("'" + what + "' has no trigger; expected 'live.sync: time', or a GenICam camera");
    if (settings.is_depth)
      throw usage_error("'" + what + "' gives no distances; expected a GenICam camera, aravis:ID");
    // What FFmpeg prints would stand beside our own message; who set the level keeps it.
    ::setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
    open();
  }
  bool read(cv::Mat& bgr) override {
    if (read_once(bgr)) return true;
    open();  // a film begins again, a stream may be back
    return read_once(bgr);
  }
  bool is_device() const override { return is_v4l_ || is_stream_; }

 private:
  void open() {
    video_.open(what_, is_v4l_ ? cv::CAP_V4L2 : cv::CAP_FFMPEG);
    if (!video_.isOpened())
      throw Error("'" + what_ +
                  "' can't be opened: no such device, stream or film, or another program has it");
    if (!is_v4l_) return;
    video_.set(cv::CAP_PROP_FRAME_WIDTH, settings_.width_px);
    video_.set(cv::CAP_PROP_FRAME_HEIGHT, settings_.height_px);
    video_.set(cv::CAP_PROP_FPS, settings_.fps);
    video_.set(cv::CAP_PROP_BUFFERSIZE, 1);  // the newest picture, not those that wait
  }
  bool read_once(cv::Mat& bgr) {
    try {
      return video_.read(bgr);
    } catch (const cv::Exception&) {
      return false;
    }
  }
  std::string what_;
  PictureSettings settings_;
  bool is_v4l_, is_stream_;
  cv::VideoCapture video_;
};

}  // namespace

std::unique_ptr<PictureReader> open_pictures(const std::string& what, const PictureSettings& settings) {
  constexpr std::string_view kGenicam = "aravis:";
  if (what.starts_with(kGenicam)) return open_genicam(what.substr(kGenicam.size()), settings);
  return std::make_unique<VideoReader>(what, settings);
}

#ifndef TACTUS_WITH_ARAVIS
std::unique_ptr<PictureReader> open_genicam(const std::string&, const PictureSettings&) {
  throw Error("GenICam cameras need " + genicam_missing() + "; install it and build again");
}
std::string genicam_missing() { return "Aravis (libaravis-dev): no GenICam cameras"; }
#endif

}  // namespace tactus
