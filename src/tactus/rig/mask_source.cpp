#include <cstdio>
#include <filesystem>

#include "tactus/base/error.h"
#include "tactus/rig/data_sources.h"
#include "tactus/rig/rig_file.h"

namespace tactus {
namespace {

/// The pattern with its one %d or %0Nd replaced; the pattern itself when it has none.
std::string numbered(const std::string& pattern, int number) {
  const auto percent = pattern.find('%');
  if (percent == std::string::npos) return pattern;
  const auto end = pattern.find('d', percent);
  const std::string width = end == std::string::npos ? "x" : pattern.substr(percent + 1, end - percent - 1);
  if (width.find_first_not_of("0123456789") != std::string::npos || width.size() > 2) {
    throw usage_error(pattern + ": expected one %d or %04d in the pattern");
  }
  std::string digits = std::to_string(number);
  const std::size_t n = width.empty() ? 0 : static_cast<std::size_t>(std::stoi(width));
  if (digits.size() < n) digits.insert(0, n - digits.size(), '0');
  return pattern.substr(0, percent) + digits + pattern.substr(end + 1);
}

class MaskSource final : public FrameSource {
 public:
  MaskSource(const std::string& path, const DataOptions& options)
      : file_(read_rig_file(path)), has_photos_(options.colors) {
    if (options.workspace_m) file_.rig.workspace_m = *options.workspace_m;
    for (std::size_t i = 0; i < file_.masks.size(); ++i) {
      if (file_.masks[i].empty()) {
        throw usage_error(path + ": camera '" + file_.rig.cameras[i].name + "' has no 'mask'");
      }
      has_photos_ = has_photos_ && !file_.photos[i].empty();
      sequence_ |= file_.masks[i].find('%') != std::string::npos;
      undistort_.emplace_back(file_.calibrated[i]);
    }
    tick_ = options.first_frame.value_or(file_.first_frame);
    last_ = options.last_frame.value_or(file_.last_frame);
  }
  const Rig& rig() const override { return file_.rig; }
  std::optional<int> frame_count() const override { return sequence_ ? std::nullopt : std::optional<int>(1); }
  NextFrame next(FrameSet& frame) override {
    if (done_ || (last_ >= 0 && tick_ > last_)) return NextFrame::no_more_data;
    bool any = !sequence_;
    for (const std::string& m : file_.masks) any |= std::filesystem::exists(numbered(m, tick_));
    if (!any) return NextFrame::no_more_data;
    done_ = !sequence_;
    frame.tick = tick_;
    frame.time_s = tick_ / file_.frames_per_s;
    ++tick_;
    frame.silhouettes.resize(file_.masks.size());
    frame.colors.clear();
    try {
      for (std::size_t i = 0; i < file_.masks.size(); ++i) {
        const Camera& c = file_.rig.cameras[i];
        const auto bytes = read_mask(numbered(file_.masks[i], tick_ - 1), c.width_px, c.height_px);
        undistort_[i].mask(bytes.pixels.data(), scratch_, frame.silhouettes[i]);
      }
      if (has_photos_) read_photos(frame);
    } catch (const Error& e) {
      if (!sequence_) throw;
      status_ = e.what();
      return NextFrame::bad_frame;
    }
    status_ = odd_masks(file_.rig, frame);
    return NextFrame::success;
  }
  std::string status() const override { return status_; }

 private:
  void read_photos(FrameSet& frame) {
    frame.colors.resize(file_.photos.size());
    for (std::size_t i = 0; i < file_.photos.size(); ++i) {
      const Camera& c = file_.rig.cameras[i];
      const std::string path = numbered(file_.photos[i], tick_ - 1);
      ColorImage photo = read_photo(path);
      if (photo.width_px != c.width_px || photo.height_px != c.height_px)
        throw Error(path + ": " + std::to_string(photo.width_px) + "x" + std::to_string(photo.height_px) +
                    " pixels, expected " + std::to_string(c.width_px) + "x" + std::to_string(c.height_px));
      for (Rgb8& pixel : photo.pixels) std::swap(pixel.r, pixel.b);  // as cameras deliver it
      undistort_[i].color(&photo.pixels.front().r, frame.colors[i]);
    }
  }

  RigFile file_;
  bool has_photos_;  ///< of every camera, and wanted
  std::vector<Undistortion> undistort_;
  Image<std::uint8_t> scratch_;
  bool sequence_ = false, done_ = false;
  int tick_ = 0, last_ = -1;
  std::string status_;
};

}  // namespace

std::unique_ptr<FrameSource> open_masks(const std::string& rig_file, const DataOptions& options) {
  return std::make_unique<MaskSource>(rig_file, options);
}

}  // namespace tactus
