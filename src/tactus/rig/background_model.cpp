#include "tactus/rig/background_model.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/background_segm.hpp>
#include <vector>

#include "tactus/base/error.h"

namespace tactus {
namespace {

constexpr std::size_t kMostPhotos = 31;
constexpr double kLevelsOfSpread = 16;  ///< stored per grey level
/// One row in so many is adapted per photo, in turn.
constexpr Index kAdaptedRows = 16;
/// Nearer to the subject nothing is learnt [pixels].
constexpr int kKeptAway = 5;

/// 8 bytes of 0 or 1 to bits, the first byte lowest.
std::uint32_t bits_of(const std::uint8_t* bytes) {
  std::uint64_t eight;
  std::memcpy(&eight, bytes, sizeof eight);
  return static_cast<std::uint32_t>(eight * 0x0102040810204080ULL >> 56);
}

struct Decision {
  float chroma2, darkest, brightest;
};

/// One row. Distances are compared as squares and ratios as products: no division, no branch.
void decide_row(Index width, const std::uint8_t* const* photo, const std::uint8_t* const* room,
                const std::uint8_t* noise, const Decision& d, std::uint8_t* result) {
  const std::uint8_t *pb = photo[0], *pg = photo[1], *pr = photo[2], *mb = room[0], *mg = room[1],
                     *mr = room[2];
  const float chroma2 = d.chroma2, darkest = d.darkest, brightest = d.brightest;
#pragma omp simd
  for (Index i = 0; i < width; ++i) {
    const int b = pb[i], g = pg[i], r = pr[i], kb = mb[i], kg = mg[i], kr = mr[i], n = noise[i];
    const int dot = b * kb + g * kg + r * kr, photo2 = b * b + g * g + r * r,
              room2 = kb * kb + kg * kg + kr * kr + 1;
    const int away2 = photo2 - 2 * dot + room2 - 1;
    const auto df = static_cast<float>(dot), rf = static_cast<float>(room2);
    const float off2 = static_cast<float>(photo2) * rf - df * df;  // times room2
    const int foreground = static_cast<int>(away2 > n * n) &
                           (static_cast<int>(off2 > chroma2 * rf) | static_cast<int>(df < darkest * rf) |
                            static_cast<int>(df > brightest * rf));
    result[i] = static_cast<std::uint8_t>(foreground);
  }
}

/// Foreground where the colour's direction is off the key's: |p|^2 |k|^2 cos^2 > (p.k)^2.
void key_row(Index width, const std::uint8_t* const* photo, Rgb8 key, float cos2, std::uint8_t* result) {
  const std::uint8_t *pb = photo[0], *pg = photo[1], *pr = photo[2];
  const int kb = key.b, kg = key.g, kr = key.r;
  const auto key2 = static_cast<float>(kb * kb + kg * kg + kr * kr) * cos2;
#pragma omp simd
  for (Index i = 0; i < width; ++i) {
    const int b = pb[i], g = pg[i], r = pr[i];
    const auto dot = static_cast<float>(b * kb + g * kg + r * kr);
    const auto photo2 = static_cast<float>(b * b + g * g + r * r);
    // Near black there is no direction: it is no cloth.
    const int foreground = static_cast<int>(dot * dot < key2 * photo2) | static_cast<int>(photo2 < 900.F);
    result[i] = static_cast<std::uint8_t>(foreground);
  }
}

}  // namespace

struct BackgroundModel::State {
  State(Index width, Index height)
      : width_px(width),
        height_px(height),
        row(static_cast<std::size_t>(ceil_div(width, 32)) * 32),
        cleaner(width, height),
        near_subject(width, height) {
    for (auto& plane : room) plane.resize(pixels());
    for (auto& plane : photo_planes) plane.create(height, width, CV_8U);
    for (auto& plane : fine) plane.resize(pixels());
    spread.assign(pixels(), 0);
    noise.assign(pixels(), 0);
    bytes.assign(row, 0);
  }
  std::size_t pixels() const {
    return static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  }
  void set_room(std::size_t i, int channel, double mean) {
    const auto c = static_cast<std::size_t>(channel);
    fine[c][i] = static_cast<std::uint16_t>(std::lround(clamp(mean, 0.0, 255.0) * 256));
    room[c][i] = static_cast<std::uint8_t>(std::min((fine[c][i] + 128) >> 8, 255));
  }
  void set_spread(std::size_t i, double levels) {
    spread[i] = static_cast<std::uint8_t>(std::lround(clamp(kLevelsOfSpread * levels, 0.0, 255.0)));
  }
  void set_up_noise(const BackgroundOptions& o);
  void adapt(const BitMask& mask, double adapt_s, double dt_s);

  Index width_px, height_px;
  std::size_t row;  ///< bytes of a row of decisions, whole words
  std::vector<double> sum, sum2;
  double count = 0;
  std::vector<std::vector<std::uint8_t>> photos;
  std::vector<std::uint8_t> room[3], spread, noise;
  std::vector<std::uint16_t> fine[3];  ///< the room in 1/256 grey level
  double noise_of = -1, spread_of = -1;
  cv::Mat smooth, photo_planes[3], learnt;
  std::vector<std::uint8_t> bytes;
  MaskCleaner cleaner;
  BitMask near_subject;
  Index next_row = 0;
  double since_row_s = 0;
  bool was_learnt = false;
  cv::Ptr<cv::BackgroundSubtractor> other;
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
      picture.data[3 * i + c] = s.room[c][i];
      picture.data[3 * (s.pixels() + i) + c] = s.spread[i];
    }
  }
  bool written = false;
  try {
    written = cv::imwrite(file, picture);
  } catch (const cv::Exception&) {
    written = false;
  }
  if (!written) throw Error(file + ": can't be written; expected a folder that is there and a name in .png");
}

void BackgroundModel::read(const std::string& file) {
  State& s = *state_;
  const cv::Mat picture = cv::imread(file, cv::IMREAD_COLOR);
  if (picture.empty()) throw Error(file + ": no such picture of a room, or not an image");
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

/// The distance within which each pixel is background whatever its colour.
void BackgroundModel::State::set_up_noise(const BackgroundOptions& o) {
  if (noise_of == o.noise && spread_of == o.spread) return;
  noise_of = o.noise;
  spread_of = o.spread;
  for (std::size_t i = 0; i < pixels(); ++i)
    noise[i] = static_cast<std::uint8_t>(
        std::lround(clamp(std::max(o.noise, o.spread * spread[i] / kLevelsOfSpread), 0.0, 255.0)));
}

/// Some rows follow the photo, with the step of an exponential of this time constant; not near the subject.
void BackgroundModel::State::adapt(const BitMask& mask, double adapt_s, double dt_s) {
  if (!(adapt_s > 0) || !(dt_s > 0)) return;
  since_row_s += dt_s;
  near_subject.words = mask.words;
  cleaner.dilate(near_subject, kKeptAway);
  const double share = 1 - std::exp(-dt_s * kAdaptedRows / adapt_s);
  const int weight = static_cast<int>(std::lround(clamp(share, 0.0, 1.0) * 65536));
  for (Index y = next_row; y < height_px; y += kAdaptedRows) {
    for (Index x = 0; x < width_px; ++x) {
      if (near_subject(x, y)) continue;
      const auto i =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) + static_cast<std::size_t>(x);
      for (std::size_t c = 0; c < 3; ++c) {
        const int wanted = photo_planes[c].data[i] * 256, is = fine[c][i];
        const int step = static_cast<int>((static_cast<std::int64_t>(wanted - is) * weight) / 65536);
        fine[c][i] = static_cast<std::uint16_t>(is + step);
        room[c][i] = static_cast<std::uint8_t>(std::min((fine[c][i] + 128) >> 8, 255));
      }
    }
  }
  next_row = (next_row + 1) % kAdaptedRows;
}

void BackgroundModel::classify(const std::uint8_t* bgr, const BackgroundOptions& o, BitMask& mask,
                               double dt_s) {
  State& s = *state_;
  if (mask.width_px != s.width_px || mask.height_px != s.height_px) mask = BitMask(s.width_px, s.height_px);
  const cv::Mat photo(s.height_px, s.width_px, CV_8UC3, const_cast<std::uint8_t*>(bgr));
  const bool by_other = o.method == BackgroundMethod::mog2 || o.method == BackgroundMethod::knn;
  if (by_other) {
    if (!s.other || s.other_method != o.method) {
      s.other_method = o.method;
      if (o.method == BackgroundMethod::mog2)
        s.other = cv::createBackgroundSubtractorMOG2(200, 40, true);
      else
        s.other = cv::createBackgroundSubtractorKNN(200, 400, true);
      for (std::vector<std::uint8_t>& room : s.photos)
        s.other->apply(cv::Mat(s.height_px, s.width_px, CV_8UC3, room.data()), s.learnt);
    }
    s.other->apply(photo, s.learnt, 0);
  } else {
    // Smoothing the photo's noise away before the decision keeps edges truer than cleaning the mask
    // afterwards.
    cv::GaussianBlur(photo, s.smooth, {3, 3}, 0);
    cv::split(s.smooth, s.photo_planes);
    s.set_up_noise(o);
  }
  const Decision decision{static_cast<float>(o.chroma * o.chroma), static_cast<float>(o.darkest_shadow),
                          static_cast<float>(o.brightest)};
  const double cosine = std::cos(o.key_degrees * std::numbers::pi / 180);
  const std::size_t words = s.row / 32;
  for (Index y = 0; y < s.height_px; ++y) {
    const std::size_t first = static_cast<std::size_t>(y) * static_cast<std::size_t>(s.width_px);
    if (by_other) {
      for (Index x = 0; x < s.width_px; ++x)
        s.bytes[static_cast<std::size_t>(x)] =
            s.learnt.data[first + static_cast<std::size_t>(x)] > 200 ? 1 : 0;
    } else {
      const std::uint8_t* planes[] = {s.photo_planes[0].data + first, s.photo_planes[1].data + first,
                                      s.photo_planes[2].data + first};
      const std::uint8_t* room[] = {s.room[0].data() + first, s.room[1].data() + first,
                                    s.room[2].data() + first};
      if (o.method == BackgroundMethod::key)
        key_row(s.width_px, planes, o.key, static_cast<float>(cosine * cosine), s.bytes.data());
      else
        decide_row(s.width_px, planes, room, s.noise.data() + first, decision, s.bytes.data());
    }
    std::uint32_t* out = mask.words.data() + static_cast<std::size_t>(y) * words;
    for (std::size_t w = 0; w < words; ++w) {
      const std::uint8_t* b = s.bytes.data() + 32 * w;
      out[w] = bits_of(b) | bits_of(b + 8) << 8 | bits_of(b + 16) << 16 | bits_of(b + 24) << 24;
    }
  }
  s.cleaner.clean(mask, {o.open_px, o.close_px, o.largest_hole_px, o.least_part});
  if (!by_other) s.adapt(mask, o.adapt_s, dt_s);
}

BackgroundMethod background_method(const std::string& word) {
  static const std::string kWords[] = {"model", "key", "mog2", "knn"};
  const auto* at = std::find(std::begin(kWords), std::end(kWords), word);
  if (at == std::end(kWords))
    throw usage_error("background.method '" + word + "': expected model, key, mog2 or knn" +
                      suggestion(word, kWords));
  return static_cast<BackgroundMethod>(at - std::begin(kWords));
}

}  // namespace tactus
