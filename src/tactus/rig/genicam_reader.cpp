// GenICam cameras through Aravis.
#include <arv.h>

#include <array>
#include <opencv2/imgproc.hpp>

#include "tactus/base/error.h"
#include "tactus/rig/picture_reader.h"

namespace tactus {
namespace {

/// Buffers that the stream fills while one is looked at.
constexpr int kBuffers = 4;
constexpr guint64 kLongest_us = 500'000;
/// GigE Vision numbers pictures from 1 to 65535 and begins again.
constexpr std::int64_t kNumbers = 65535;

/// The error of a call, thrown when there is one.
class Outcome {
 public:
  explicit Outcome(std::string what) : what_(std::move(what)) {}
  ~Outcome() { g_clear_error(&error_); }
  Outcome(const Outcome&) = delete;
  Outcome& operator=(const Outcome&) = delete;
  GError** operator&() { return &error_; }  // NOLINT(google-runtime-operator)
  bool ok() const { return error_ == nullptr; }
  void check() const {
    if (error_ != nullptr) throw Error(what_ + ": " + error_->message);
  }

 private:
  std::string what_;
  GError* error_ = nullptr;
};

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
template <class T>
using Owned = std::unique_ptr<T, Unref>;

/// OpenCV's names of Bayer patterns begin at the second pixel of the second row.
std::optional<int> bayer_code(ArvPixelFormat format) {
  switch (format) {
    case ARV_PIXEL_FORMAT_BAYER_RG_8:
      return cv::COLOR_BayerBG2BGR;
    case ARV_PIXEL_FORMAT_BAYER_BG_8:
      return cv::COLOR_BayerRG2BGR;
    case ARV_PIXEL_FORMAT_BAYER_GR_8:
      return cv::COLOR_BayerGB2BGR;
    case ARV_PIXEL_FORMAT_BAYER_GB_8:
      return cv::COLOR_BayerGR2BGR;
    default:
      return {};
  }
}

bool has_three_channels(ArvPixelFormat format) {
  return format == ARV_PIXEL_FORMAT_RGB_8_PACKED || format == ARV_PIXEL_FORMAT_BGR_8_PACKED;
}

bool is_known(ArvPixelFormat format) {
  return format == ARV_PIXEL_FORMAT_MONO_8 || has_three_channels(format) || bayer_code(format);
}

class GenicamReader final : public PictureReader {
 public:
  GenicamReader(const std::string& id, const PictureSettings& settings)
      : name_("GenICam camera '" + id + "'"), trigger_(settings.trigger), is_depth_(settings.is_depth) {
    Outcome found(name_);
    camera_.reset(arv_camera_new(id.empty() ? nullptr : id.c_str(), &found));
    found.check();
    if (!camera_) throw Error(name_ + ": no such camera");
    Outcome set(name_);
    arv_camera_set_region(camera_.get(), 0, 0, settings.width_px, settings.height_px, &set);
    set.check();
    is_depth_ ? choose_distances() : choose_colours();
    set_pace(settings);
    start();
  }
  ~GenicamReader() override { arv_camera_stop_acquisition(camera_.get(), nullptr); }
  GenicamReader(const GenicamReader&) = delete;
  GenicamReader& operator=(const GenicamReader&) = delete;

  /// Takes the newest of the pictures that wait. A software trigger is fired first.
  bool read(cv::Mat& bgr) override {
    if (trigger_ == PictureTrigger::software) {
      drop_waiting();  // the picture of an earlier trigger, which came too late for its own call
      Outcome fired(name_);
      arv_camera_software_trigger(camera_.get(), &fired);
      fired.check();
    }
    ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream_.get(), kLongest_us);
    while (ArvBuffer* newer = buffer == nullptr ? nullptr : arv_stream_try_pop_buffer(stream_.get())) {
      arv_stream_push_buffer(stream_.get(), buffer);
      buffer = newer;
    }
    if (buffer == nullptr) return false;
    const bool ok = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
    if (ok) count(static_cast<std::int64_t>(arv_buffer_get_frame_id(buffer)));
    const std::string trouble = ok ? (is_depth_ ? copy_distances(buffer, bgr) : convert(buffer, bgr)) : "";
    arv_stream_push_buffer(stream_.get(), buffer);
    if (!trouble.empty()) throw Error(name_ + ": " + trouble);
    return ok;
  }
  std::optional<std::int64_t> number() const override {
    return trigger_ == PictureTrigger::hardware ? std::optional<std::int64_t>(number_) : std::nullopt;
  }
  bool is_device() const override { return true; }

 private:
  void set_pace(const PictureSettings& settings) {
    Outcome set(name_);
    switch (trigger_) {
      case PictureTrigger::software:
        arv_camera_set_trigger(camera_.get(), "Software", &set);
        break;
      case PictureTrigger::hardware:
        arv_camera_set_trigger(camera_.get(), "Line1", &set);
        break;
      case PictureTrigger::none:
        arv_camera_clear_triggers(camera_.get(), nullptr);
        arv_camera_set_frame_rate(camera_.get(), settings.fps, &set);
        break;
    }
    set.check();
  }
  /// Keeps the pixel format that the camera is set to; one that is not known here becomes Mono8.
  void choose_colours() {
    Outcome set(name_);
    const ArvPixelFormat format = arv_camera_get_pixel_format(camera_.get(), &set);
    set.check();
    if (!is_known(format)) arv_camera_set_pixel_format(camera_.get(), ARV_PIXEL_FORMAT_MONO_8, &set);
    set.check();
  }
  void choose_distances() {
    Outcome set(name_);
    arv_camera_set_pixel_format_from_string(camera_.get(), "Coord3D_C16", &set);
    if (set.ok()) return;
    Outcome other(name_);
    arv_camera_set_pixel_format(camera_.get(), ARV_PIXEL_FORMAT_MONO_16, &other);
    other.check();
  }
  void start() {
    Outcome done(name_);
    stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, &done));
    done.check();
    const std::size_t bytes = arv_camera_get_payload(camera_.get(), &done);
    done.check();
    for (int i = 0; i < kBuffers; ++i) arv_stream_push_buffer(stream_.get(), arv_buffer_new(bytes, nullptr));
    arv_camera_start_acquisition(camera_.get(), &done);
    done.check();
  }
  void drop_waiting() {
    while (ArvBuffer* late = arv_stream_try_pop_buffer(stream_.get()))
      arv_stream_push_buffer(stream_.get(), late);
  }
  /// Numbers that begin again go on here.
  void count(std::int64_t id) {
    if (id < last_id_) wraps_ += kNumbers;
    last_id_ = id;
    number_ = wraps_ + id;
  }
  static std::string copy_distances(ArvBuffer* buffer, cv::Mat& distances) {
    const int width = arv_buffer_get_image_width(buffer), height = arv_buffer_get_image_height(buffer);
    const ArvPixelFormat format = arv_buffer_get_image_pixel_format(buffer);
    if (format != ARV_PIXEL_FORMAT_MONO_16 && format != ARV_PIXEL_FORMAT_COORD3D_C_16)
      return "its pixel format is unknown; expected Coord3D_C16 or Mono16";
    std::size_t bytes = 0;
    auto* data = const_cast<void*>(arv_buffer_get_image_data(buffer, &bytes));
    if (bytes < 2 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
      return "its picture is cut short";
    cv::Mat(height, width, CV_16UC1, data).copyTo(distances);
    return "";
  }
  static std::string convert(ArvBuffer* buffer, cv::Mat& bgr) {
    const int width = arv_buffer_get_image_width(buffer), height = arv_buffer_get_image_height(buffer);
    const ArvPixelFormat format = arv_buffer_get_image_pixel_format(buffer);
    std::size_t bytes = 0;
    auto* data = const_cast<void*>(arv_buffer_get_image_data(buffer, &bytes));
    const bool has_colors = has_three_channels(format);
    const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    if (bytes < pixels * (has_colors ? 3 : 1)) return "its picture is cut short";
    const cv::Mat raw(height, width, has_colors ? CV_8UC3 : CV_8UC1, data);
    if (format == ARV_PIXEL_FORMAT_MONO_8)
      cv::cvtColor(raw, bgr, cv::COLOR_GRAY2BGR);
    else if (format == ARV_PIXEL_FORMAT_RGB_8_PACKED)
      cv::cvtColor(raw, bgr, cv::COLOR_RGB2BGR);
    else if (format == ARV_PIXEL_FORMAT_BGR_8_PACKED)
      raw.copyTo(bgr);
    else if (const auto code = bayer_code(format))
      cv::cvtColor(raw, bgr, *code);
    else
      return "its pixel format is unknown; expected Mono8, RGB8, BGR8 or Bayer of 8 bits";
    return "";
  }
  std::string name_;
  PictureTrigger trigger_;
  bool is_depth_;
  Owned<ArvCamera> camera_;
  Owned<ArvStream> stream_;
  std::int64_t last_id_ = 0, wraps_ = 0, number_ = 0;
};

}  // namespace

std::unique_ptr<PictureReader> open_genicam(const std::string& id, const PictureSettings& settings) {
  return std::make_unique<GenicamReader>(id, settings);
}
std::string genicam_missing() { return ""; }

}  // namespace tactus
