#include "tactus/rig/client_camera.h"

#include <algorithm>
#include <opencv2/core.hpp>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/rig/background/background_film.h"
#include "tactus/rig/images/camera_file.h"
#include "tactus/rig/images/numbered_files.h"
#include "tactus/rig/images/undistortion.h"
#include "tactus/rig/picture_reader.h"
#include "tactus/rig/wire/photo_coder.h"

namespace tactus {
namespace {

/// Ten seconds of 30 a second: 12 MB of 640x480 masks.
constexpr std::size_t kMostPlayed = 300;

/// Numbers of a recording's frames that are played.
std::vector<int> played_numbers(const NumberedFiles& files, const RigFile& file) {
  if (!files.is_sequence()) return {0};
  std::vector<int> numbers;
  for (const int n : files.numbers()) {
    if (n >= file.first_frame.value_or(n) && n <= file.last_frame.value_or(n) && numbers.size() < kMostPlayed)
      numbers.push_back(n);
  }
  if (numbers.empty()) throw usage_error("'frames' leaves none of '" + files.pattern() + "'");
  return numbers;
}

/// A film has no trigger: its player numbers the pictures.
PictureTrigger trigger_of(LiveSync sync, const std::string& device) {
  if (device.empty() || sync == LiveSync::time) return PictureTrigger::none;
  return sync == LiveSync::trigger ? PictureTrigger::hardware : PictureTrigger::software;
}

/// Masks or distances from files, read beforehand.
class PlayedCamera final : public ClientCamera {
 public:
  PlayedCamera(const RigFile& file, std::size_t camera, const Options& options) {
    const NumberedFiles masks(file.masks[camera]);
    const CalibratedCamera& calibrated = file.calibrated[camera];
    const Undistortion undistort(calibrated);
    const bool has_photo = options.photos && !file.photos[camera].empty();
    PhotoCoder coder;
    Image<std::uint8_t> scratch;
    for (const int n : played_numbers(masks, file)) {
      CameraImages images;
      std::string labels;
      const auto bytes =
          read_mask(masks.file(n), calibrated.camera.width_px, calibrated.camera.height_px, &labels);
      if (!labels.empty() && frames_.empty())
        log_warning("camera '" + file.rig.cameras[camera].name + "': " + labels);
      undistort.mask(bytes.pixels.data(), scratch, images.mask);
      if (has_photo)
        add_photo(NumberedFiles(file.photos[camera]).file(n), undistort, options.photo_quality, coder,
                  images);
      frames_.push_back(std::move(images));
    }
  }
  PlayedCamera(const RigFile& file, const std::string& rig_path, const DepthRecording& depth) {
    const DepthFiles files(rig_path, {depth});
    std::vector<DepthImage> depths_m;
    for (const int n : played_numbers(NumberedFiles(depth.images), file)) {
      std::string status;
      files.read(n, depths_m, status);
      if (!status.empty()) throw Error(status);
      frames_.emplace_back().depth_m = depths_m[0];
    }
  }
  std::string grab(std::int64_t number, CameraImages& images) override {
    images = frames_[static_cast<std::size_t>(number) % frames_.size()];
    return "";
  }
  bool has_own_pace() const override { return false; }

 private:
  static void add_photo(const std::string& file, const Undistortion& undistort, int quality,
                        PhotoCoder& coder, CameraImages& images) {
    const ColorImage photo = read_photo(file);
    std::vector<std::uint8_t> bgr;
    for (const Rgb8& p : photo.pixels) bgr.insert(bgr.end(), {p.b, p.g, p.r});
    ColorImage color;
    undistort.color(bgr.data(), color);
    coder.pack(color, images.mask, quality, images);
  }
  std::vector<CameraImages> frames_;
};

/// A camera of the system, a stream or a film, before a known room.
class FilmedCamera final : public ClientCamera {
 public:
  FilmedCamera(const RigFile& file, std::size_t camera, const Options& options, const std::string& device)
      : undistort_(file.calibrated[camera]),
        model_(file.calibrated[camera].camera.width_px, file.calibrated[camera].camera.height_px),
        background_(file.background),
        options_(options),
        name_(device.empty() ? file.videos[camera] : device),
        fps_(file.live.fps),
        size_(file.calibrated[camera].camera.width_px, file.calibrated[camera].camera.height_px) {
    const std::string& room = file.backgrounds[camera];
    if (room.empty() && background_.method != BackgroundMethod::key)
      throw usage_error("has no 'empty_room', which silhouettes are separated from");
    if (!room.empty()) learn(room);
    pictures_ = open_pictures(name_, {size_.width, size_.height, fps_, trigger_of(file.live.sync, device)});
  }
  std::string grab(std::int64_t, CameraImages& images) override {
    if (!pictures_->read(photo_)) return name_ + " gives no picture";
    if (photo_.type() != CV_8UC3 || !photo_.isContinuous() || photo_.cols != size_.width ||
        photo_.rows != size_.height)
      return name_ + " gives pictures of " + std::to_string(photo_.cols) + "x" + std::to_string(photo_.rows) +
             " pixels, expected " + std::to_string(size_.width) + "x" + std::to_string(size_.height);
    model_.classify(photo_.data, background_, bits_, 1 / fps_);
    undistort_.mask(bits_, images.mask);
    if (options_.alpha) {
      model_.alpha(photo_.data, background_, bits_, alpha_);
      undistort_.bytes(alpha_.pixels.data(), images.alpha);
    }
    images.photo_jpeg.clear();
    if (options_.photos) {
      undistort_.color(photo_.data, color_);
      coder_.pack(color_, images.mask, options_.photo_quality, images);
    }
    return "";
  }
  bool has_own_pace() const override { return pictures_->is_device(); }
  std::optional<std::int64_t> number() const override { return pictures_->number(); }

 private:
  void learn(const std::string& room) {
    const std::string end = room.substr(std::min(room.rfind('.'), room.size()));
    if (end == ".png" || end == ".jpg" || end == ".jpeg" || end == ".bmp") return model_.read(room);
    LearntRoom learnt = tactus::learn_room(room, false);
    if (learnt.width_px != size_.width || learnt.height_px != size_.height)
      throw Error(room + ": the film has " + std::to_string(learnt.width_px) + "x" +
                  std::to_string(learnt.height_px) + " pixels, the camera " + std::to_string(size_.width) +
                  "x" + std::to_string(size_.height));
    model_ = std::move(learnt.model);
  }
  Undistortion undistort_;
  BackgroundModel model_;
  BackgroundOptions background_;
  Options options_;
  std::string name_;
  double fps_;
  cv::Size size_;
  std::unique_ptr<PictureReader> pictures_;
  cv::Mat photo_;
  BitMask bits_;
  AlphaImage alpha_;
  ColorImage color_;
  PhotoCoder coder_;
};

/// A camera that measures distances.
class MeasuredCamera final : public ClientCamera {
 public:
  MeasuredCamera(const DepthRecording& depth, const std::string& device, const LiveSettings& live)
      : undistort_(depth.calibrated, depth.encoding),
        raw_(depth.calibrated.camera.width_px, depth.calibrated.camera.height_px),
        name_(device),
        pictures_(open_pictures(
            device, {raw_.width_px, raw_.height_px, live.fps, trigger_of(live.sync, device), true})) {}
  std::string grab(std::int64_t /*number*/, CameraImages& images) override {
    if (!pictures_->read(distances_)) return name_ + " gives no distances";
    if (distances_.type() != CV_16UC1 || distances_.cols != raw_.width_px ||
        distances_.rows != raw_.height_px)
      return name_ + " gives distances of another size than " + std::to_string(raw_.width_px) + "x" +
             std::to_string(raw_.height_px) + " pixels";
    std::copy_n(distances_.ptr<std::uint16_t>(), raw_.pixels.size(), raw_.pixels.begin());
    undistort_.radial_m(raw_, images.depth_m);
    return "";
  }
  bool has_own_pace() const override { return true; }
  std::optional<std::int64_t> number() const override { return pictures_->number(); }

 private:
  DepthUndistortion undistort_;
  Image<std::uint16_t> raw_;
  std::string name_;
  std::unique_ptr<PictureReader> pictures_;
  cv::Mat distances_;
};

}  // namespace

std::unique_ptr<ClientCamera> open_client_camera(const RigFile& file, const std::string& rig_path,
                                                 const std::string& name,
                                                 const ClientCamera::Options& options) {
  std::unique_ptr<ClientCamera> camera;
  std::vector<std::string> names;
  for (const Camera& c : file.rig.cameras) names.push_back(c.name);
  for (const DepthRecording& d : file.depths) names.push_back(d.calibrated.camera.name);
  const auto at = static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  if (at == names.size())
    throw usage_error(rig_path + ": no camera '" + name + "'" + suggestion(name, names));
  for_camera(rig_path, name, [&] {
    if (at >= file.rig.cameras.size()) {
      const DepthRecording& depth = file.depths[at - file.rig.cameras.size()];
      const std::string device = options.device.empty() ? depth.device : options.device;
      if (device.empty())
        camera = std::make_unique<PlayedCamera>(file, rig_path, depth);
      else
        camera = std::make_unique<MeasuredCamera>(depth, device, file.live);
      return;
    }
    const std::string device = options.device.empty() ? file.devices[at] : options.device;
    if (!device.empty() || !file.videos[at].empty())
      camera = std::make_unique<FilmedCamera>(file, at, options, device);
    else if (!file.masks[at].empty() && options.alpha)
      throw usage_error("plays masks, which have no soft edges; expected a 'device' or 'video' for --alpha");
    else if (!file.masks[at].empty())
      camera = std::make_unique<PlayedCamera>(file, at, options);
    else
      throw usage_error("has no 'device', 'video' or 'mask' to send");
  });
  return camera;
}

}  // namespace tactus
