#include "tactus/rig/picture_reader.h"

#include <cstdlib>
#include <opencv2/core.hpp>

#include "tactus/base/error.h"
#include "tactus/rig/sources/film_opening.h"

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
    try {
      if (is_v4l_)
        film_ = FilmReader::device(what_, {settings_.width_px, settings_.height_px, settings_.fps});
      else
        film_ = is_stream_ ? FilmReader::stream(what_) : FilmReader(what_);
    } catch (const Error& error) {
      throw Error("'" + what_ +
                  "' can't be opened: no such device, stream or film, or another program has it (" +
                  error.what() + ")");
    }
  }
  bool read_once(cv::Mat& bgr) {
    if (!film_ || !film_->read(frame_)) return false;
    view_of(frame_).copyTo(bgr);
    return true;
  }
  std::string what_;
  PictureSettings settings_;
  bool is_v4l_, is_stream_;
  std::optional<FilmReader> film_;
  FilmFrame frame_;
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
