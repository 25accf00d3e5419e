#include "tactus/view/image_files.h"

#include <cmath>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/safe_file.h"
#include "tactus/media/h264_encoder.h"
#include "tactus/media/mp4_muxer.h"
#include "tactus/media/picture.h"
#include "tactus/view/mp4_check.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string& path, const std::string& why) {
  throw Error("can't write '" + path + "': " + why);
}

cv::Mat view_of(ColorImage& image) { return {image.height_px, image.width_px, CV_8UC3, image.pixels.data()}; }

}  // namespace

std::vector<std::uint8_t> encode_png(const ColorImage& image) {
  if (image.empty()) throw Error("can't encode a PNG: the image is empty");
  return encode_png(image.width_px, image.height_px, 3, 8, image.pixels.data());
}

void write_png(const std::string& path, const ColorImage& image) {
  if (image.empty()) fail(path, "the image is empty");
  const std::vector<std::uint8_t> bytes = encode_png(image);
  write_file(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

void draw_text(ColorImage& image, const std::string& text, Index x_px, Index y_px, float height_px,
               Rgb8 color) {
  if (image.empty() || text.empty()) return;
  cv::Mat view = view_of(image);
  const double scale = static_cast<double>(height_px) / 22.0;  // Hershey capitals are 22 px high at scale 1
  const int thick = std::max(1, static_cast<int>(height_px / 13.F));
  const cv::Point at(x_px, y_px);
  const bool light = color.r + color.g + color.b > 3 * 127;
  cv::putText(view, text, at, cv::FONT_HERSHEY_DUPLEX, scale, cv::Scalar::all(light ? 30 : 245), thick + 2,
              cv::LINE_AA);
  cv::putText(view, text, at, cv::FONT_HERSHEY_DUPLEX, scale, cv::Scalar(color.r, color.g, color.b), thick,
              cv::LINE_AA);
}

Index text_width_px(const std::string& text, float height_px) {
  constexpr double kTried = 10;  // scale at which the line is measured
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_DUPLEX, kTried, 1, nullptr);
  return static_cast<Index>(std::ceil(size.width * static_cast<double>(height_px) / (22 * kTried)));
}

void draw_text_within(ColorImage& image, const std::string& text, Index x_px, Index y_px, float height_px,
                      Index most_px, Rgb8 color) {
  const auto wide_px = static_cast<float>(std::max<Index>(text_width_px(text, height_px), 1));
  const float share = std::min(1.F, static_cast<float>(std::max<Index>(most_px, 1)) / wide_px);
  draw_text(image, text, x_px, y_px, share * height_px, color);
}

void draw_line_of_text(ColorImage& image, const std::string& text, Index margin_px, float height_px) {
  draw_text_within(image, text, margin_px, image.height_px - margin_px, height_px,
                   image.width_px - 2 * margin_px, {255, 255, 255});
}

struct VideoWriter::Impl {
  explicit Impl(const std::string& to) : path(to), file(to, ".mp4") {}
  std::string path, codec;
  TemporaryFile file;
  Index width_px = 0, height_px = 0;
  int frames = 0;
  bool finished = false;
  std::unique_ptr<H264Encoder> encoder;
  std::unique_ptr<Mp4Muxer> muxer;
  double fps = 0;

  void add(const ColorImage& frame) {
    const cv::Mat rgb(frame.height_px, frame.width_px, CV_8UC3, const_cast<Rgb8*>(frame.pixels.data()));
    cv::Mat i420;
    cv::cvtColor(rgb, i420, cv::COLOR_RGB2YUV_I420);
    try {
      muxer->add(encoder->encode(i420.data, std::lround(1000 * frames / fps)));
    } catch (const Error& error) {
      fail(path, error.what());
    }
    ++frames;
  }

  void finish() {
    if (std::exchange(finished, true)) return;
    if (frames == 0) return;
    try {
      muxer->finish();
    } catch (const Error& error) {
      fail(path, error.what());
    }
    const std::string wrong = what_is_wrong_with_mp4(file.fd(), frames);
    if (!wrong.empty()) fail(path, wrong + "; is the disk full?");
    file.commit();
  }
};

VideoWriter::VideoWriter(const std::string& path, Index width_px, Index height_px, double fps) {
  if (fs::path(path).extension() != ".mp4") fail(path, "a video's name must end in '.mp4'");
  if (width_px <= 0 || height_px <= 0 || width_px % 2 != 0 || height_px % 2 != 0) {
    fail(path, "frames of " + std::to_string(width_px) + "x" + std::to_string(height_px) +
                   " px, expected even, positive sides");
  }
  if (!(fps >= 1 && fps <= 240)) fail(path, "fps is " + std::to_string(fps) + ", expected 1 to 240");
  impl_ = std::make_unique<Impl>(path);
  impl_->width_px = width_px;
  impl_->height_px = height_px;
  impl_->fps = fps;
  impl_->codec = "avc1";
  try {
    impl_->encoder = std::make_unique<H264Encoder>(width_px, height_px, fps);
  } catch (const Error& error) {
    fail(path, error.what());
  }
  impl_->muxer = std::make_unique<Mp4Muxer>(impl_->file.fd(), width_px, height_px, fps);
}

VideoWriter::VideoWriter(VideoWriter&&) noexcept = default;

VideoWriter::~VideoWriter() {
  if (impl_ == nullptr) return;
  try {
    impl_->finish();
  } catch (const std::exception& error) {
    log_warning(error.what());
  }
}

void VideoWriter::add(const ColorImage& frame) {
  if (impl_->finished) fail(impl_->path, "a frame after the video was finished");
  if (frame.width_px != impl_->width_px || frame.height_px != impl_->height_px) {
    fail(impl_->path, "a frame of " + std::to_string(frame.width_px) + "x" + std::to_string(frame.height_px) +
                          " px in a video of " + std::to_string(impl_->width_px) + "x" +
                          std::to_string(impl_->height_px));
  }
  impl_->add(frame);
}

void VideoWriter::finish() { impl_->finish(); }
int VideoWriter::frame_count() const { return impl_->frames; }
const std::string& VideoWriter::codec() const { return impl_->codec; }

}  // namespace tactus
