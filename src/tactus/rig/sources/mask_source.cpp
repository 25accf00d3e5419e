#include <algorithm>

#include "tactus/base/error.h"
#include "tactus/geom/image/mask_rim.h"
#include "tactus/rig/images/camera_file.h"
#include "tactus/rig/images/depth_files.h"
#include "tactus/rig/images/numbered_files.h"
#include "tactus/rig/images/undistortion.h"
#include "tactus/rig/rig_file.h"
#include "tactus/rig/sources/data_sources.h"
#include "tactus/rig/sources/frame_window.h"

namespace tactus {
namespace {

/// "", or the oddity of a mask.
std::string odd_mask(const Image<std::uint8_t>& mask) {
  const auto set = std::count(mask.pixels.begin(), mask.pixels.end(), 255);
  if (std::string odd = odd_coverage(set, std::ssize(mask.pixels)); !odd.empty()) return odd;
  const double on_rim = share_of_rim(mask.width_px, mask.height_px, [&](Index x, Index y) {
    return mask.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(mask.width_px) +
                       static_cast<std::size_t>(x)] == 255;
  });
  const bool is_inverted = on_rim >= 0.95 && 2 * set > std::ssize(mask.pixels);
  return is_inverted ? "the mask is white along its rim: is its object black? It must be white" : "";
}

class MaskSource final : public FrameSource {
 public:
  MaskSource(const std::string& path, const DataOptions& options)
      : file_(read_rig_file(path)),
        depths_(path, options.depth ? file_.depths : std::vector<DepthRecording>()) {
    file_.rig.depth_cameras = depths_.cameras();
    if (options.workspace_m) file_.rig.workspace_m = *options.workspace_m;
    std::vector<int> numbers;
    for (std::size_t i = 0; i < file_.masks.size(); ++i) {
      undistort_.emplace_back(file_.calibrated[i]);
      for_camera(path, file_.rig.cameras[i].name, [&] {
        if (file_.masks[i].empty()) throw usage_error("has no 'mask', which source 'masks' needs");
        masks_.emplace_back(file_.masks[i]);
        if (!masks_[i].is_sequence()) return;
        const std::vector<int> of_camera = masks_[i].numbers();
        numbers.insert(numbers.end(), of_camera.begin(), of_camera.end());
      });
    }
    sequence_ = !numbers.empty();
    const auto& photos = file_.photos;
    const bool has_all =
        std::none_of(photos.begin(), photos.end(), [](const std::string& photo) { return photo.empty(); });
    for (std::size_t i = 0; i < photos.size() && has_all && options.colors; ++i)
      photos_.emplace_back(photos[i]);
    const std::optional<int> first = options.first_frame ? options.first_frame : file_.first_frame,
                             last = options.last_frame ? options.last_frame : file_.last_frame;
    window_ = frame_window(path, first, last,
                           sequence_ ? window_of(path, std::move(numbers), first, last) : FrameWindow{0, 0});
    tick_ = window_.first;
    fps_ = options.fps.value_or(file_.frames_per_s.value_or(30));
    bytes_.resize(masks_.size());
    labels_.resize(masks_.size());
    labels_reported_.resize(masks_.size());
    if (sequence_) return;
    // The one frame is the whole recording: its faults are reported before any work.
    for (std::size_t i = 0; i < masks_.size(); ++i)
      for_camera(path, file_.rig.cameras[i].name, [&] {
        bytes_[i] = read(i);
        ColorImage color;
        if (!photos_.empty()) read_color(i, color);
      });
  }
  const Rig& rig() const override { return file_.rig; }
  std::optional<int> frame_count() const override { return window_.last - window_.first + 1; }
  std::optional<double> fps() const override { return fps_; }
  NextFrame next(FrameSet& frame) override {
    if (tick_ > window_.last) return NextFrame::no_more_data;
    frame.tick = tick_;
    frame.time_s = tick_ / fps_;
    frame.silhouettes.resize(masks_.size());
    frame.colors.resize(photos_.size());
    notes_.clear(masks_.size());
    for (std::size_t i = 0; i < masks_.size(); ++i) {
      try {
        if (sequence_) bytes_[i] = read(i);
        const std::string odd = odd_mask(bytes_[i]);
        // Labels are told once: all of a film's masks have them.
        const bool tells = odd.empty() && !labels_[i].empty() && !labels_reported_[i];
        if (tells) labels_reported_[i] = true;
        notes_.odd(i, tells ? labels_[i] : odd);
        undistort_[i].mask(bytes_[i].pixels.data(), scratch_, frame.silhouettes[i]);
        if (!photos_.empty()) read_color(i, frame.colors[i]);
      } catch (const Error& e) {
        notes_.fail(i, e.what());
      }
    }
    const NextFrame result = notes_.finish(file_.rig, frame, status_);
    depths_.read(tick_++, frame.depths_m, status_);
    return result;
  }
  std::string status() const override { return status_; }

 private:
  Image<std::uint8_t> read(std::size_t i) {
    const Camera& c = file_.calibrated[i].camera;
    labels_[i].clear();
    return read_mask(masks_[i].file(tick_), c.width_px, c.height_px, &labels_[i]);
  }

  /// Photos come as cameras deliver them, blue first.
  void read_color(std::size_t i, ColorImage& color) {
    const Camera& c = file_.calibrated[i].camera;
    const std::string path = photos_[i].file(tick_);
    ColorImage photo = read_photo(path);
    if (photo.width_px != c.width_px || photo.height_px != c.height_px)
      throw Error(path + ": " + std::to_string(photo.width_px) + "x" + std::to_string(photo.height_px) +
                  " pixels, expected " + std::to_string(c.width_px) + "x" + std::to_string(c.height_px));
    for (Rgb8& pixel : photo.pixels) std::swap(pixel.r, pixel.b);
    undistort_[i].color(&photo.pixels.front().r, color);
  }

  RigFile file_;
  DepthFiles depths_;
  std::vector<NumberedFiles> masks_;
  std::vector<NumberedFiles> photos_;  ///< of every camera, or none
  std::vector<Undistortion> undistort_;
  std::vector<Image<std::uint8_t>> bytes_;  ///< of the newest frame
  Image<std::uint8_t> scratch_;
  std::vector<std::string> labels_;  ///< notice of read_mask for masks of labels, else ""
  std::vector<bool> labels_reported_;
  bool sequence_ = false;
  FrameWindow window_;
  int tick_ = 0;
  double fps_ = 30;
  CameraNotes notes_;
  std::string status_;
};

}  // namespace

std::unique_ptr<FrameSource> open_masks(const std::string& rig_file, const DataOptions& options) {
  return std::make_unique<MaskSource>(rig_file, options);
}

}  // namespace tactus
