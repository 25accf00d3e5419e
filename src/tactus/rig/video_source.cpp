#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <opencv2/core.hpp>

#include "tactus/base/error.h"
#include "tactus/rig/data_sources.h"
#include "tactus/rig/film_opening.h"
#include "tactus/rig/frame_window.h"
#include "tactus/rig/numbered_files.h"
#include "tactus/rig/rig_file.h"
#include "tactus/rig/undistortion.h"

namespace tactus {
namespace {

std::string size_text(int width_px, int height_px) {
  return std::to_string(width_px) + "x" + std::to_string(height_px);
}

FilmReader open_video(const std::string& path, const Camera& camera) {
  FilmReader video = open_film(path);
  const int w = video.width_px(), h = video.height_px();
  if (w != camera.width_px || h != camera.height_px) {
    throw Error(path + ": the video has " + size_text(w, h) + " pixels, the rig's image_size_px is " +
                size_text(camera.width_px, camera.height_px));
  }
  return video;
}

/// Frames of a video: as its header says, or counted where that says nothing. A header may promise more than
/// a damaged file holds; such frames fail when they are read.
int count_frames(const std::string& path, const Camera& camera) {
  FilmReader video = open_video(path, camera);
  if (!video.skip()) throw Error(path + ": no frame of the video can be read");
  if (const int told = video.frame_count(); told > 0) return told;
  int count = 1;
  while (video.skip()) ++count;
  return count;
}

/// One camera's reader; cameras share nothing, so they run side by side.
struct Reader {
  Reader(const CalibratedCamera& calibrated, const std::string& video_path, const std::string& empty_room)
      : undistort(calibrated),
        model(calibrated.camera.width_px, calibrated.camera.height_px),
        path(video_path),
        frame_count(count_frames(video_path, calibrated.camera)),
        video(open_video(video_path, calibrated.camera)),
        size(calibrated.camera.width_px, calibrated.camera.height_px) {
    learn_room(empty_room, calibrated.camera);
  }
  /// A film, a still picture, or what `tactus background` wrote.
  void learn_room(const std::string& empty_room, const Camera& camera) {
    const std::string end = empty_room.substr(std::min(empty_room.rfind('.'), empty_room.size()));
    if (end == ".png" || end == ".jpg" || end == ".jpeg" || end == ".bmp") return model.read(empty_room);
    FilmReader room = open_video(empty_room, camera);
    int n = 0;
    for (; room.read(photo) && fits(); ++n) model.learn(photo.bgr.data());
    if (n == 0) throw Error(empty_room + ": no frame of the empty room can be read");
  }
  /// A damaged stream may change its size on the way.
  bool fits() const { return photo.width_px == size.width && photo.height_px == size.height; }
  Undistortion undistort;
  BackgroundModel model;
  std::string path;
  int frame_count;
  FilmReader video;
  FilmFrame photo;
  cv::Size size;     ///< of the photos
  BitMask bits;      ///< of the newest photo, with the lens
  AlphaImage alpha;  ///< likewise
};

class VideoSource final : public FrameSource {
 public:
  VideoSource(const std::string& path, const DataOptions& options)
      : file_(read_rig_file(path)),
        depths_(path, options.depth ? file_.depths : std::vector<DepthRecording>()),
        colors_(options.colors),
        alphas_(options.alphas) {
    file_.rig.depth_cameras = depths_.cameras();
    if (options.workspace_m) file_.rig.workspace_m = *options.workspace_m;
    for (std::size_t i = 0; i < file_.videos.size(); ++i) {
      for_camera(path, file_.rig.cameras[i].name, [&] {
        for (const auto& [key, value] : {std::pair<std::string, const std::string&>("video", file_.videos[i]),
                                         {"empty_room", file_.backgrounds[i]}}) {
          if (value.empty()) throw usage_error("has no '" + key + "', which source 'videos' needs");
        }
        readers_.push_back(
            std::make_unique<Reader>(file_.calibrated[i], file_.videos[i], file_.backgrounds[i]));
      });
    }
    const FrameWindow held{0, shortest() - 1};
    window_ = frame_window(path, options.first_frame ? options.first_frame : file_.first_frame,
                           options.last_frame ? options.last_frame : file_.last_frame, held,
                           lengths_.empty() ? "" : " (" + lengths_ + ")");
    tick_ = window_.first;
    const double own_fps = readers_.front()->video.fps();  // 0, or odd, in damaged headers
    fps_ =
        options.fps.value_or(file_.frames_per_s.value_or(own_fps >= 0.001 && own_fps <= 1e5 ? own_fps : 30));
    for (const auto& r : readers_) {
      for (int i = 0; i < tick_; ++i) r->video.skip();
    }
  }
  const Rig& rig() const override { return file_.rig; }
  std::optional<int> frame_count() const override { return window_.last - window_.first + 1; }
  std::optional<double> fps() const override { return fps_; }
  NextFrame next(FrameSet& frame) override {
    if (tick_ > window_.last) return NextFrame::no_more_data;
    frame.tick = tick_;
    frame.time_s = tick_ / fps_;
    frame.silhouettes.resize(readers_.size());
    frame.colors.resize(colors_ ? readers_.size() : 0);
    frame.alphas.resize(alphas_ ? readers_.size() : 0);
    notes_.clear(readers_.size());
    tbb::parallel_for(std::size_t{0}, readers_.size(), [&](std::size_t i) { read(i, frame); });
    const NextFrame result = notes_.finish(file_.rig, frame, status_);
    depths_.read(tick_, frame.depths_m, status_);
    if (tick_ == window_.first && !lengths_.empty()) status_ += (status_.empty() ? "" : "; ") + lengths_;
    ++tick_;
    return result;
  }
  std::string status() const override { return status_; }

 private:
  /// Frames that all cameras have: after the shortest video its camera would miss every tick, so there it
  /// ends. Says so in `lengths_`, which the first frame's status repeats.
  int shortest() {
    const auto by_length = [](const auto& a, const auto& b) { return a->frame_count < b->frame_count; };
    const auto [least, most] = std::minmax_element(readers_.begin(), readers_.end(), by_length);
    const auto told = [&](const auto& reader) {
      return "camera '" + file_.rig.cameras[static_cast<std::size_t>(reader - readers_.begin())].name +
             "' has " + std::to_string((*reader)->frame_count);
    };
    if ((*least)->frame_count < (*most)->frame_count) {
      lengths_ = "the videos differ in length: " + told(least) + " frames, " + told(most);
    }
    return (*least)->frame_count;
  }
  void read(std::size_t i, FrameSet& frame) {
    Reader& r = *readers_[i];
    if (!r.video.read(r.photo)) {
      notes_.fail(i, r.path + ": frame " + std::to_string(tick_) +
                         " can't be read; the file is cut short or damaged");
      return;
    }
    if (!r.fits()) {
      notes_.fail(i, r.path + ": frame " + std::to_string(tick_) + " has " +
                         size_text(r.photo.width_px, r.photo.height_px) + " pixels, expected " +
                         size_text(r.size.width, r.size.height));
      return;
    }
    r.model.classify(r.photo.bgr.data(), file_.background, r.bits, 1 / fps_);
    notes_.odd(i, odd_coverage(r.bits.area_px(), std::int64_t{r.size.width} * r.size.height));
    r.undistort.mask(r.bits, frame.silhouettes[i]);
    if (alphas_) {
      r.model.alpha(r.photo.bgr.data(), file_.background, r.bits, r.alpha);
      r.undistort.bytes(r.alpha.pixels.data(), frame.alphas[i]);
    }
    if (colors_) r.undistort.color(r.photo.bgr.data(), frame.colors[i]);
  }

  RigFile file_;
  DepthFiles depths_;
  bool colors_, alphas_;
  std::vector<std::unique_ptr<Reader>> readers_;
  FrameWindow window_;
  int tick_ = 0;
  double fps_ = 30;
  CameraNotes notes_;
  std::string lengths_, status_;
};

}  // namespace

std::unique_ptr<FrameSource> open_videos(const std::string& rig_file, const DataOptions& options) {
  return std::make_unique<VideoSource>(rig_file, options);
}

}  // namespace tactus
