#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <opencv2/core.hpp>

#include "tactus/base/error.h"
#include "tactus/rig/images/numbered_files.h"
#include "tactus/rig/images/undistortion.h"
#include "tactus/rig/rig_file.h"
#include "tactus/rig/sources/data_sources.h"
#include "tactus/rig/sources/film_opening.h"
#include "tactus/rig/sources/frame_window.h"

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
  if (const int reported = video.frame_count(); reported > 0) return reported;
  int count = 1;
  while (video.skip()) ++count;
  return count;
}

/// Result of the search for a frame at a time.
struct Found {
  enum class What : std::uint8_t { frame, ended, gap } what = What::ended;
  double off_s = 0;  ///< gap: how far the nearest frame is
};

/// A film that is gone through by its time stamps. A picture is made only of frames that may be wanted.
class TimedFilm {
 public:
  explicit TimedFilm(FilmReader film) : film_(std::move(film)) { advance(); }
  /// Time of the next frame; none at the end.
  std::optional<double> next_s() const { return next_s_; }
  /// Goes to the next frame.
  void advance() {
    if (film_.skip())
      next_s_ = film_.time_s();
    else
      next_s_.reset();
  }
  /// The frame whose time is nearest, when it is within `most_s`. Times don't fall from call to call.
  Found nearest(double time_s, double most_s, FilmFrame& photo) {
    while (next_s_ && *next_s_ <= time_s) {
      if (time_s - *next_s_ <= most_s) take(photo);
      passed_s_ = *next_s_;
      advance();
    }
    const double before_s = passed_s_ ? time_s - *passed_s_ : HUGE_VAL;
    const double after_s = next_s_ ? *next_s_ - time_s : HUGE_VAL;
    if (after_s < before_s && after_s <= most_s) {
      take(photo);
      passed_s_ = *next_s_;
      advance();
      return {has_photo_ ? Found::What::frame : Found::What::ended};
    }
    if (before_s <= most_s && has_photo_) return {Found::What::frame};
    return {next_s_ ? Found::What::gap : Found::What::ended, std::min(before_s, after_s)};
  }
  double fps() const { return film_.fps(); }

 private:
  void take(FilmFrame& photo) { has_photo_ = film_.picture(photo); }
  FilmReader film_;
  std::optional<double> next_s_, passed_s_;
  bool has_photo_ = false;  ///< of the frame at `passed_s_`
};

/// One camera's reader; cameras share nothing, so they run side by side.
struct Reader {
  Reader(const CalibratedCamera& calibrated, const std::string& video_path, const std::string& empty_room)
      : undistort(calibrated),
        model(calibrated.camera.width_px, calibrated.camera.height_px),
        path(video_path),
        frame_count(count_frames(video_path, calibrated.camera)),
        video(open_video(video_path, calibrated.camera)),
        fps(video.fps() >= 0.001 && video.fps() <= 1e5 ? video.fps() : 0),  // 0, or odd, in damaged headers
        size(calibrated.camera.width_px, calibrated.camera.height_px) {
    learn_room(empty_room, calibrated.camera);
  }
  /// Learns the room from a film, a still picture, or a picture that `tactus background` wrote.
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
  TimedFilm video;
  double fps;  ///< mean; 0: not known
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
    choose_reference();
    const FrameWindow held{0, shortest() - 1};
    window_ = frame_window(path, options.first_frame ? options.first_frame : file_.first_frame,
                           options.last_frame ? options.last_frame : file_.last_frame, held,
                           lengths_.empty() ? "" : " (" + lengths_ + ")");
    tick_ = window_.first;
    const std::optional<double> reported_fps = options.fps ? options.fps : file_.frames_per_s;
    by_stamps_ = !reported_fps;
    fps_ = reported_fps.value_or(reference().fps > 0 ? reference().fps : 30);
    for (int i = 0; i < tick_; ++i) lead();
  }
  const Rig& rig() const override { return file_.rig; }
  std::optional<int> frame_count() const override { return window_.last - window_.first + 1; }
  std::optional<double> fps() const override { return fps_; }
  NextFrame next(FrameSet& frame) override {
    if (tick_ > window_.last) return NextFrame::no_more_data;
    frame.tick = tick_;
    lead();
    frame.time_s = by_stamps_ ? film_s_ : tick_ / fps_;
    frame.silhouettes.resize(readers_.size());
    frame.colors.resize(colors_ ? readers_.size() : 0);
    frame.alphas.resize(alphas_ ? readers_.size() : 0);
    notes_.clear(readers_.size());
    tbb::parallel_for(std::size_t{0}, readers_.size(), [&](std::size_t i) { read(i, frame); });
    const NextFrame result = notes_.finish(file_.rig, frame, status_);
    depths_.read(tick_, frame.depths_m, status_);
    for (const std::string& reported : {rates_, lengths_}) {
      if (tick_ == window_.first && !reported.empty()) status_ += (status_.empty() ? "" : "; ") + reported;
    }
    ++tick_;
    return result;
  }
  std::string status() const override { return status_; }

 private:
  /// Rates within this part of each other are the same.
  static constexpr double kSameRate = 1e-3;
  Reader& reference() { return *readers_[reference_]; }
  std::string camera_text(std::size_t i) const { return "camera '" + file_.rig.cameras[i].name + "'"; }

  /// Ticks are the frames of the slowest film; of the others, the frames that are nearest in time go with
  /// them. Films begin at the same moment. Says in `rates_` where rates differ.
  void choose_reference() {
    double slowest = HUGE_VAL, fastest = 0;
    std::size_t fastest_camera = 0;
    for (std::size_t i = 0; i < readers_.size(); ++i) {
      const double fps = readers_[i]->fps;
      if (!(fps > 0)) continue;
      if (fps < slowest * (1 - kSameRate)) {
        slowest = fps;
        reference_ = i;
      }
      if (fps > fastest * (1 + kSameRate)) {
        fastest = fps;
        fastest_camera = i;
      }
    }
    most_off_s_ = 0.75 / (reference().fps > 0 ? reference().fps : 30);
    if (fastest <= slowest * (1 + kSameRate)) return;
    rates_ = "the videos differ in their frames per second: " + camera_text(reference_) + " has " +
             number_text(slowest) + ", " + camera_text(fastest_camera) + " " + number_text(fastest) +
             "; frames are paired by their time stamps";
  }
  /// Frames of the reference that all cameras have one for, by the headers: after the shortest video its
  /// camera would miss every tick, so there it ends. Says so in `lengths_`, which the first frame's status
  /// repeats.
  int shortest() {
    const double fps = reference().fps;
    const auto ticks_of = [&](const Reader& r) {
      if (!(fps > 0) || !(r.fps > 0) || std::abs(r.fps / fps - 1) <= kSameRate) return r.frame_count;
      const double last_s = (r.frame_count - 1) / r.fps;
      return static_cast<int>(std::min(std::floor((last_s + most_off_s_) * fps), 1e9)) + 1;
    };
    const auto by_length = [&](const auto& a, const auto& b) { return ticks_of(*a) < ticks_of(*b); };
    const auto [least, most] = std::minmax_element(readers_.begin(), readers_.end(), by_length);
    const int least_ticks = ticks_of(**least), most_ticks = ticks_of(**most);
    // The end of a film of another rate is known to a frame.
    if (least_ticks < most_ticks && (rates_.empty() || most_ticks - least_ticks > 1)) {
      lengths_ =
          "the videos differ in length: " + camera_text(static_cast<std::size_t>(least - readers_.begin())) +
          " has " + std::to_string((*least)->frame_count) + " frames, " +
          camera_text(static_cast<std::size_t>(most - readers_.begin())) + " has " +
          std::to_string((*most)->frame_count);
    }
    return least_ticks;
  }
  /// The time of the next tick: the stamp of the reference's next frame that was not a tick. Where its film
  /// is cut short, time goes on at its rate.
  void lead() {
    const double interval_s = 1 / (reference().fps > 0 ? reference().fps : 30);
    const std::optional<double> next_s = next_lead_s();
    film_s_ = next_s.value_or(is_first_ ? 0 : film_s_ + interval_s);
    is_first_ = false;
  }
  /// Time of the reference's first frame after the last tick; none at its end. The frame at the tick was
  /// taken when that tick was read.
  std::optional<double> next_lead_s() {
    TimedFilm& film = reference().video;
    while (!is_first_ && film.next_s() && *film.next_s() <= film_s_) film.advance();
    return film.next_s();
  }
  void read(std::size_t i, FrameSet& frame) {
    Reader& r = *readers_[i];
    const Found found = r.video.nearest(film_s_, most_off_s_, r.photo);
    if (found.what == Found::What::ended) {
      notes_.fail(i, r.path + ": frame " + std::to_string(tick_) +
                         " can't be read; the file is cut short or damaged");
      return;
    }
    if (found.what == Found::What::gap) {
      notes_.fail(i, r.path + ": no frame at " + number_text(film_s_) + " s; the nearest is " +
                         number_text(found.off_s) + " s off");
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
  std::size_t reference_ = 0;
  double film_s_ = 0;      ///< the tick's time since the films began, by their stamps
  double most_off_s_ = 0;  ///< frames further from it are not its
  bool is_first_ = true, by_stamps_ = true;
  CameraNotes notes_;
  std::string rates_, lengths_, status_;
};

}  // namespace

std::unique_ptr<FrameSource> open_videos(const std::string& rig_file, const DataOptions& options) {
  return std::make_unique<VideoSource>(rig_file, options);
}

}  // namespace tactus
