#include <tbb/parallel_for.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/videoio.hpp>

#include "tactus/base/error.h"
#include "tactus/rig/data_sources.h"
#include "tactus/rig/rig_file.h"

namespace tactus {
namespace {

cv::VideoCapture open_video(const std::string& path, const Camera& camera) {
  if (!std::filesystem::is_regular_file(path)) throw Error(path + ": no such video");
  cv::VideoCapture video(path);
  if (!video.isOpened()) throw Error(path + ": not a video that can be read");
  const int w = static_cast<int>(video.get(cv::CAP_PROP_FRAME_WIDTH));
  const int h = static_cast<int>(video.get(cv::CAP_PROP_FRAME_HEIGHT));
  if (w != camera.width_px || h != camera.height_px) {
    throw Error(path + ": " + std::to_string(w) + "x" + std::to_string(h) + " pixels, expected " +
                std::to_string(camera.width_px) + "x" + std::to_string(camera.height_px));
  }
  return video;
}

/// One camera's reader; cameras share nothing, so they run side by side.
struct Reader {
  Reader(const CalibratedCamera& calibrated, const std::string& video_path, const std::string& empty_room)
      : undistort(calibrated),
        model(calibrated.camera.width_px, calibrated.camera.height_px),
        video(open_video(video_path, calibrated.camera)),
        bytes(calibrated.camera.width_px, calibrated.camera.height_px) {
    cv::VideoCapture room = open_video(empty_room, calibrated.camera);
    int n = 0;
    for (; room.read(photo); ++n) model.learn(photo.data);
    if (n == 0) throw Error(empty_room + ": no frame of the empty room can be read");
  }
  Undistortion undistort;
  BackgroundModel model;
  cv::VideoCapture video;
  cv::Mat photo;
  Image<std::uint8_t> bytes, scratch;
  bool read = false;
};

class VideoSource final : public FrameSource {
 public:
  VideoSource(const std::string& path, const DataOptions& options)
      : file_(read_rig_file(path)), colors_(options.colors) {
    if (options.workspace_m) file_.rig.workspace_m = *options.workspace_m;
    int shortest = 1 << 30;
    for (std::size_t i = 0; i < file_.videos.size(); ++i) {
      for (const auto& [key, value] : {std::pair<std::string, const std::string&>("video", file_.videos[i]),
                                       {"empty_room", file_.backgrounds[i]}}) {
        if (value.empty()) {
          throw usage_error(path + ": camera '" + file_.rig.cameras[i].name + "' has no '" + key + "'");
        }
      }
      readers_.push_back(
          std::make_unique<Reader>(file_.calibrated[i], file_.videos[i], file_.backgrounds[i]));
      const int n = static_cast<int>(readers_.back()->video.get(cv::CAP_PROP_FRAME_COUNT));
      if (i > 0 && n != shortest) {
        note_ = "the videos differ in length: camera '" + file_.rig.cameras[i].name + "' has " +
                std::to_string(n) + " frames, an earlier one " + std::to_string(shortest);
      }
      shortest = std::min(shortest, n);
    }
    tick_ = options.first_frame.value_or(file_.first_frame);
    last_ = options.last_frame.value_or(file_.last_frame);
    if (last_ < 0 || last_ >= shortest) last_ = shortest - 1;
    if (tick_ < 0 || tick_ > last_) {
      throw usage_error(path + ": first frame " + std::to_string(tick_) + ", expected 0 to " +
                        std::to_string(last_));
    }
    count_ = last_ - tick_ + 1;
    for (const auto& r : readers_) {
      for (int i = 0; i < tick_; ++i) r->video.grab();
    }
  }
  const Rig& rig() const override { return file_.rig; }
  std::optional<int> frame_count() const override { return count_; }
  NextFrame next(FrameSet& frame) override {
    if (tick_ > last_) return NextFrame::no_more_data;
    frame.tick = tick_;
    frame.time_s = tick_ / file_.frames_per_s;
    ++tick_;
    frame.silhouettes.resize(readers_.size());
    frame.colors.resize(colors_ ? readers_.size() : 0);
    tbb::parallel_for(std::size_t{0}, readers_.size(), [&](std::size_t i) { read(i, frame); });
    for (std::size_t i = 0; i < readers_.size(); ++i) {
      if (readers_[i]->read) continue;
      status_ = file_.videos[i] + ": frame " + std::to_string(frame.tick) + " can't be read";
      return NextFrame::bad_frame;
    }
    status_ = odd_masks(file_.rig, frame);
    if (!note_.empty()) status_ += (status_.empty() ? "" : "; ") + note_;
    return NextFrame::success;
  }
  std::string status() const override { return status_; }

 private:
  void read(std::size_t i, FrameSet& frame) {
    Reader& r = *readers_[i];
    r.read = r.video.read(r.photo);
    if (!r.read) return;
    r.model.classify(r.photo.data, file_.background, r.bytes.pixels.data());
    r.undistort.mask(r.bytes.pixels.data(), r.scratch, frame.silhouettes[i]);
    if (colors_) r.undistort.color(r.photo.data, frame.colors[i]);
  }

  RigFile file_;
  bool colors_;
  std::vector<std::unique_ptr<Reader>> readers_;
  int tick_ = 0, last_ = -1, count_ = 0;
  std::string note_, status_;
};

}  // namespace

std::unique_ptr<FrameSource> open_videos(const std::string& rig_file, const DataOptions& options) {
  return std::make_unique<VideoSource>(rig_file, options);
}

}  // namespace tactus
