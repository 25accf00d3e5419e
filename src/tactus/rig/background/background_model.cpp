#include "tactus/rig/background/background_model.h"

#ifdef TACTUS_WITH_OPENCV_VIDEO
#include <opencv2/video/background_segm.hpp>
#endif

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <vector>

#include "tactus/base/error.h"
#include "tactus/base/safe_file.h"
#include "tactus/media/picture.h"
#include "tactus/rig/background/background_edges.h"
#include "tactus/rig/background/background_exposure.h"
#include "tactus/rig/background/background_rows.h"
#include "tactus/rig/images/image_reading.h"

namespace tactus {
namespace {

constexpr std::size_t kMostPhotos = 31;
constexpr double kLevelsOfSpread = 16;  ///< stored per grey level
/// One row in so many is adapted per photo, in turn.
constexpr Index kAdaptedRows = 16;
/// Pixels of the mask that are so far inside the contour are surely subject [pixels].
constexpr int kEdge = 2;
/// Nearer to the subject nothing is learnt [pixels].
constexpr int kKeptAway = 5;

}  // namespace

struct BackgroundModel::State {
  State(Index width, Index height)
      : width_px(width),
        height_px(height),
        photo_row(width, height),
        cleaner(width, height),
        near_subject(width, height),
        core(width, height),
        band(width, height),
        exposure_fit(width, height) {
    for (auto& plane : room) plane.resize(pixels());
    for (auto& plane : shown) plane.resize(pixels());
    for (auto& plane : fine) plane.resize(pixels());
    spread.assign(pixels(), 0);
    noise.assign(pixels(), 0);
    nothing.assign(pixels(), 0);
  }
  std::size_t pixels() const {
    return static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  }
  /// To the nearest; std::lround is a call for each pixel.
  static Index rounded(double positive) { return static_cast<Index>(positive + 0.5); }
  void set_room(std::size_t i, int channel, double mean) {
    const auto c = static_cast<std::size_t>(channel);
    fine[c][i] = static_cast<std::uint16_t>(rounded(clamp(mean, 0.0, 255.0) * 256));
    room[c][i] = static_cast<std::uint8_t>(std::min((fine[c][i] + 128) >> 8, 255));
  }
  void set_spread(std::size_t i, double levels) {
    spread[i] = static_cast<std::uint8_t>(rounded(clamp(kLevelsOfSpread * levels, 0.0, 255.0)));
  }
  std::size_t row_begin(Index y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px);
  }
  void set_up_noise(const BackgroundOptions& o);
  void set_up_exposure(const std::uint8_t* bgr);
  /// The room as the camera shows it in the last photo.
  const std::uint8_t* plane(std::size_t channel) const {
    return is_as_learnt ? room[channel].data() : shown[channel].data();
  }
  void subtract(const std::uint8_t* bgr, const BackgroundOptions& o, BitMask& mask);
  void subtract_by_opencv(const std::uint8_t* bgr, const BackgroundOptions& o, BitMask& mask);
  void clean(const std::uint8_t* bgr, const BackgroundOptions& o, BitMask& mask);
  PhotoOfRoom photo_of_room(const std::uint8_t* bgr) const {
    return {bgr, {plane(0), plane(1), plane(2)}, noise.data()};
  }
  void adapt(const std::uint8_t* bgr, double adapt_s, double dt_s);

  Index width_px, height_px;
  std::vector<double> sum, sum2;
  double count = 0;
  std::vector<std::vector<std::uint8_t>> photos;
  std::vector<std::uint8_t> room[3], spread, noise, nothing;  ///< as RoomRow
  std::vector<std::uint16_t> fine[3];                         ///< the room in 1/256 grey level
  double noise_of = -1, spread_of = -1, noise_gain = 1;
  Exposure exposure;
  std::vector<std::uint8_t> shown[3];  ///< the room at that exposure
  bool is_as_learnt = true;            ///< at the exposure of the empty room
  SmoothedRow photo_row;
  cv::Mat learnt;
  MaskCleaner cleaner;
  BitMask near_subject, core, band;
  ExposureFit exposure_fit;
  Index next_row = 0;
  bool was_learnt = false;
#ifdef TACTUS_WITH_OPENCV_VIDEO
  cv::Ptr<cv::BackgroundSubtractor> other;
#endif
  BackgroundMethod other_method = BackgroundMethod::model;
};

BackgroundModel::BackgroundModel(Index width_px, Index height_px)
    : state_(std::make_unique<State>(width_px, height_px)) {}
BackgroundModel::~BackgroundModel() = default;
BackgroundModel::BackgroundModel(BackgroundModel&&) noexcept = default;
BackgroundModel& BackgroundModel::operator=(BackgroundModel&&) noexcept = default;

void BackgroundModel::learn(const std::uint8_t* bgr) {
  State& s = *state_;
  if (s.sum.empty()) {
    s.sum.assign(3 * s.pixels(), 0);
    s.sum2.assign(s.pixels(), 0);
  }
  if (s.photos.size() < kMostPhotos) s.photos.emplace_back(bgr, bgr + 3 * s.pixels());  // for MOG2 and KNN
  s.count += 1;
  for (std::size_t i = 0; i < s.pixels(); ++i) {
    double squares = 0, means = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double value = bgr[3 * i + c];
      s.sum[3 * i + c] += value;
      squares += value * value;
    }
    s.sum2[i] += squares;
    for (std::size_t c = 0; c < 3; ++c) {
      const double mean = s.sum[3 * i + c] / s.count;
      means += mean * mean;
      s.set_room(i, static_cast<int>(c), mean);
    }
    s.set_spread(i, std::sqrt(std::max(s.sum2[i] / s.count - means, 0.0)));
  }
  s.was_learnt = true;
  s.noise_of = -1;
}

void BackgroundModel::collect(const std::uint8_t* bgr) {
  State& s = *state_;
  if (s.photos.size() < kMostPhotos) s.photos.emplace_back(bgr, bgr + 3 * s.pixels());
}

void BackgroundModel::finish_median() {
  State& s = *state_;
  if (s.photos.empty()) throw Error("background: no photo was collected");
  const std::size_t n = s.photos.size(), middle = n / 2;
  std::vector<std::uint8_t> values(n);
  for (std::size_t i = 0; i < s.pixels(); ++i) {
    double deviation2 = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto sort_middle = [&] {
        std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(middle), values.end());
        return values[middle];
      };
      for (std::size_t k = 0; k < n; ++k) values[k] = s.photos[k][3 * i + c];
      const int median = sort_middle();
      for (std::size_t k = 0; k < n; ++k)
        values[k] = static_cast<std::uint8_t>(std::abs(s.photos[k][3 * i + c] - median));
      deviation2 += sqr(1.4826 * sort_middle());  // of a normal distribution
      s.set_room(i, static_cast<int>(c), median);
    }
    s.set_spread(i, std::sqrt(deviation2));
  }
  s.was_learnt = true;
  s.noise_of = -1;
}

void BackgroundModel::write(const std::string& file) const {
  const State& s = *state_;
  if (!s.was_learnt) throw Error(file + ": nothing was learnt yet");
  cv::Mat picture(2 * s.height_px, s.width_px, CV_8UC3);
  for (std::size_t i = 0; i < s.pixels(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      picture.data[3 * i + c] = s.room[2 - c][i];
      picture.data[3 * (s.pixels() + i) + c] = s.spread[i];
    }
  }
  if (!file.ends_with(".png"))
    throw Error(file + ": can't be written; expected a folder that is there and a name in .png");
  const std::vector<std::uint8_t> png = encode_png(picture.cols, picture.rows, 3, 8, picture.data);
  write_file(file, {reinterpret_cast<const char*>(png.data()), png.size()});
}

void BackgroundModel::read(const std::string& file) {
  State& s = *state_;
  const cv::Mat picture = read_image(file, ReadAs::color);
  const bool has_spread = picture.rows == 2 * s.height_px;
  if (picture.cols != s.width_px || (picture.rows != s.height_px && !has_spread))
    throw Error(file + ": " + std::to_string(picture.cols) + "x" + std::to_string(picture.rows) +
                " pixels, expected " + std::to_string(s.width_px) + "x" + std::to_string(s.height_px) +
                " (a still picture) or twice the height (with spreads, as `tactus background` writes it)");
  s.photos.assign(1, {picture.data, picture.data + 3 * s.pixels()});
  for (std::size_t i = 0; i < s.pixels(); ++i) {
    for (int c = 0; c < 3; ++c) s.set_room(i, c, picture.data[3 * i + static_cast<std::size_t>(c)]);
    s.spread[i] = has_spread ? picture.data[3 * (s.pixels() + i)] : std::uint8_t{0};
  }
  s.was_learnt = true;
  s.noise_of = -1;
}

double BackgroundModel::mean_spread() const {
  double sum = 0;
  for (const std::uint8_t v : state_->spread) sum += v / kLevelsOfSpread;
  return sum / static_cast<double>(state_->pixels());
}

/// The distance within which each pixel is background in any colour.
void BackgroundModel::State::set_up_noise(const BackgroundOptions& o) {
  // A camera that amplifies its signal amplifies its noise; steps of 1/8 are enough.
  double gain = 1;
  for (const ColorExposure& e : exposure) gain = std::max(gain, std::round(8 * e.gain) / 8);
  if (noise_of == o.noise && spread_of == o.spread && noise_gain == gain) return;
  noise_of = o.noise;
  spread_of = o.spread;
  noise_gain = gain;
  for (std::size_t i = 0; i < pixels(); ++i) {
    noise[i] = static_cast<std::uint8_t>(
        std::lround(clamp(gain * std::max(o.noise, o.spread * spread[i] / kLevelsOfSpread), 0.0, 255.0)));
    nothing[i] = static_cast<std::uint8_t>(noise[i] / std::numbers::sqrt3);
  }
}

/// The room as a camera of the photo's gain and offset shows it.
void BackgroundModel::State::set_up_exposure(const std::uint8_t* bgr) {
  exposure = exposure_fit.fit(bgr, {room[0].data(), room[1].data(), room[2].data()}, near_subject);
  is_as_learnt = exposure == Exposure{};
  if (is_as_learnt) return;
  for (std::size_t c = 0; c < 3; ++c) {
    const int gain = static_cast<int>(std::lround(exposure[c].gain * 256));
    const int offset = static_cast<int>(std::lround(exposure[c].offset * 256)) + 128;
    const std::uint8_t* from = room[c].data();
    std::uint8_t* to = shown[c].data();
    const auto n = static_cast<std::ptrdiff_t>(pixels());
#pragma omp simd
    for (std::ptrdiff_t i = 0; i < n; ++i) {
      const int level = (from[i] * gain + offset) >> 8;
      to[i] = static_cast<std::uint8_t>(std::min(std::max(level, 0), 255));
    }
  }
}

/// Some rows follow the photo, with the step of an exponential of this time constant; not near the subject.
void BackgroundModel::State::adapt(const std::uint8_t* bgr, double adapt_s, double dt_s) {
  if (!(adapt_s > 0) || !(dt_s > 0)) return;
  const double share = 1 - std::exp(-dt_s * kAdaptedRows / adapt_s);
  const int weight = static_cast<int>(std::lround(clamp(share, 0.0, 1.0) * 65536));
  for (Index y = next_row; y < height_px; y += kAdaptedRows) {
    photo_row.load(bgr, y);
    for (Index x = 0; x < width_px; ++x) {
      if (near_subject(x, y)) continue;
      const std::size_t i = row_begin(y) + static_cast<std::size_t>(x);
      for (std::size_t c = 0; c < 3; ++c) {
        const double seen = photo_row.plane(c)[x];
        const int wanted =
            static_cast<int>(std::lround(clamp(256 * exposure[c].room_of(seen), 0.0, 65280.0)));
        const int is = fine[c][i];
        const int step = static_cast<int>((static_cast<std::int64_t>(wanted - is) * weight) / 65536);
        fine[c][i] = static_cast<std::uint16_t>(is + step);
        room[c][i] = static_cast<std::uint8_t>(std::min((fine[c][i] + 128) >> 8, 255));
      }
    }
  }
  next_row = (next_row + 1) % kAdaptedRows;
}

void BackgroundModel::State::subtract(const std::uint8_t* bgr, const BackgroundOptions& o, BitMask& mask) {
  if (o.method == BackgroundMethod::model) set_up_exposure(bgr);
  set_up_noise(o);
  const Decision decision{static_cast<float>(sqr(noise_gain * o.chroma)),
                          static_cast<float>(o.darkest_shadow), static_cast<float>(o.brightest)};
  const double cosine = std::cos(o.key_degrees * std::numbers::pi / 180);
  std::uint32_t* bits = mask.words.data();
  for (Index y = 0; y < height_px; ++y, bits += mask.words_per_row()) {
    photo_row.load(bgr, y);
    const std::size_t i = row_begin(y);
    if (o.method == BackgroundMethod::key)
      key_row(width_px, photo_row, o.key, static_cast<float>(cosine * cosine), bits);
    else
      decide_row(width_px, photo_row,
                 {{plane(0) + i, plane(1) + i, plane(2) + i}, noise.data() + i, nothing.data() + i}, decision,
                 bits);
  }
}

#ifdef TACTUS_WITH_OPENCV_VIDEO
void BackgroundModel::State::subtract_by_opencv(const std::uint8_t* bgr, const BackgroundOptions& o,
                                                BitMask& mask) {
  if (!other || other_method != o.method) {
    other_method = o.method;
    if (o.method == BackgroundMethod::mog2)
      other = cv::createBackgroundSubtractorMOG2(200, 40, true);
    else
      other = cv::createBackgroundSubtractorKNN(200, 400, true);
    for (std::vector<std::uint8_t>& photo : photos)
      other->apply(cv::Mat(height_px, width_px, CV_8UC3, photo.data()), learnt);
  }
  other->apply(cv::Mat(height_px, width_px, CV_8UC3, const_cast<std::uint8_t*>(bgr)), learnt, 0);
  std::uint32_t* bits = mask.words.data();
  for (Index y = 0; y < height_px; ++y, bits += mask.words_per_row())
    threshold_row(width_px, learnt.data + row_begin(y), 200, bits);  // 127 marks shadow
}
#else
void BackgroundModel::State::subtract_by_opencv(const std::uint8_t*, const BackgroundOptions&, BitMask&) {
  throw Error("background: 'mog2' and 'knn' need " + subtractors_missing() + "; install it and build again");
}
#endif

void BackgroundModel::State::clean(const std::uint8_t* bgr, const BackgroundOptions& o, BitMask& mask) {
  cleaner.erode(mask, o.open_px);
  cleaner.dilate(mask, o.open_px);
  if (o.method == BackgroundMethod::model) {
    core.words = mask.words;
    cleaner.erode(core, kEdge);
  }
  cleaner.dilate(mask, o.close_px);
  cleaner.erode(mask, o.close_px);
  if (o.method == BackgroundMethod::model) refine_edges(photo_of_room(bgr), core, mask);
  cleaner.keep_parts(mask, o.least_part);
  cleaner.fill_holes(mask, o.largest_hole_px);
}

void BackgroundModel::classify(const std::uint8_t* bgr, const BackgroundOptions& o, BitMask& mask,
                               double dt_s) {
  State& s = *state_;
  if (mask.width_px != s.width_px || mask.height_px != s.height_px) mask = BitMask(s.width_px, s.height_px);
  const bool by_opencv = o.method == BackgroundMethod::mog2 || o.method == BackgroundMethod::knn;
  if (by_opencv)
    s.subtract_by_opencv(bgr, o, mask);
  else
    s.subtract(bgr, o, mask);
  s.clean(bgr, o, mask);
  if (by_opencv) return;
  s.near_subject.words = mask.words;
  s.cleaner.dilate(s.near_subject, kKeptAway);
  s.adapt(bgr, o.adapt_s, dt_s);
}

void BackgroundModel::alpha(const std::uint8_t* bgr, const BackgroundOptions& o, const BitMask& mask,
                            AlphaImage& alpha) {
  State& s = *state_;
  if (alpha.width_px != s.width_px || alpha.height_px != s.height_px)
    alpha = AlphaImage(s.width_px, s.height_px);
  s.set_up_noise(o);
  s.core.words = s.band.words = mask.words;
  s.cleaner.erode(s.core, kEdge);
  if (o.method == BackgroundMethod::key)
    s.band.words = s.core.words;  // the room isn't known
  else
    s.cleaner.dilate(s.band, kEdge);
  edge_alpha(s.photo_of_room(bgr), s.core, s.band, mask, alpha);
}

BackgroundMethod background_method(const std::string& word) {
  static const std::string kWords[] = {"model", "key", "mog2", "knn"};
  const auto* at = std::find(std::begin(kWords), std::end(kWords), word);
  if (at == std::end(kWords))
    throw usage_error("background.method '" + word + "': expected model, key, mog2 or knn" +
                      suggestion(word, kWords));
  return static_cast<BackgroundMethod>(at - std::begin(kWords));
}

std::string subtractors_missing() {
#ifdef TACTUS_WITH_OPENCV_VIDEO
  return "";
#else
  return "OpenCV's video module (libopencv-video-dev): no background methods mog2 and knn";
#endif
}

}  // namespace tactus
