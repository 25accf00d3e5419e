#include "tactus/rig/images/undistortion.h"

#include <tbb/parallel_for.h>

#include <array>
#include <cstring>
#include <opencv2/imgproc.hpp>

#include "tactus/geom/image/mask_bounds.h"
#include "tactus/rig/images/silhouettes.h"

namespace tactus {

struct Undistortion::Maps {
  Camera pinhole;
  cv::Size photo;
  cv::Mat xy, fraction;  ///< fixed point; empty without a lens
  /// The pixels of the photo that the samples of one word of the result read, limited to the photo.
  struct Source {
    std::int16_t x0, y0, x1, y1;
    bool reaches_beyond;
  };
  std::vector<Source> sources;

  /// Pixels [begin, begin + count) of a row of the result, count <= 32.
  std::uint32_t sample(const BitMask& mask, const Source& source, Index begin, Index y, Index count) const;
};

namespace {

/// Whether the rectangle's pixels are all clear (0), all set (1), or neither (2).
int uniform(const BitMask& mask, Index x0, Index y0, Index x1, Index y1) {
  const Index words = mask.words_per_row(), first = x0 >> 5, last = x1 >> 5;
  const std::uint32_t left = ~0U << (x0 & 31), right = ~0U >> (31 - (x1 & 31));
  std::uint32_t any = 0, missing = 0;
  for (Index y = y0; y <= y1; ++y) {
    const std::uint32_t* row = mask.words.data() + static_cast<std::ptrdiff_t>(y) * words;
    for (Index w = first; w <= last; ++w) {
      const std::uint32_t asked = (w == first ? left : ~0U) & (w == last ? right : ~0U);
      any |= row[w] & asked;
      missing |= ~row[w] & asked;
    }
    if (any != 0 && missing != 0) return 2;
  }
  return any != 0 ? 1 : 0;
}

/// For each fraction of a pixel, in OpenCV's steps: whether the bilinear sample of four bits is at least a
/// half, a bit for each pattern (right 2, below 4, below right 8).
std::array<std::uint16_t, cv::INTER_TAB_SIZE2> make_sample_table() {
  constexpr int n = cv::INTER_TAB_SIZE;
  std::array<std::uint16_t, cv::INTER_TAB_SIZE2> table{};
  for (int f = 0; f < n * n; ++f) {
    const int fx = f % n, fy = f / n;
    for (int pattern = 0; pattern < 16; ++pattern) {
      const int top = (n - fx) * (pattern & 1) + fx * (pattern >> 1 & 1);
      const int bottom = (n - fx) * (pattern >> 2 & 1) + fx * (pattern >> 3);
      if (2 * ((n - fy) * top + fy * bottom) >= n * n)
        table[static_cast<std::size_t>(f)] |= static_cast<std::uint16_t>(1U << pattern);
    }
  }
  return table;
}

/// Pixels x and x + 1 of a row; the pixel x + 1 is in it, and a word follows that may be read.
std::uint32_t two_bits(const std::uint32_t* row, int x) {
  std::uint64_t words;
  std::memcpy(&words, row + (x >> 5), sizeof words);
  return static_cast<std::uint32_t>(words >> (x & 31)) & 3U;
}

}  // namespace

std::uint32_t Undistortion::Maps::sample(const BitMask& mask, const Source& source, Index begin, Index y,
                                         Index count) const {
  static const std::array<std::uint16_t, cv::INTER_TAB_SIZE2> table = make_sample_table();
  const auto* at = xy.ptr<cv::Vec2s>(y) + begin;
  const auto* part = fraction.ptr<std::uint16_t>(y) + begin;
  const Index last_x = photo.width - 1, last_y = photo.height - 1, words = mask.words_per_row();
  // The last rows have no word behind them.
  const bool is_plain = !source.reaches_beyond && source.y1 < last_y;
  const auto two = [&](Index x, Index v) {
    if (is_plain) return two_bits(mask.words.data() + static_cast<std::ptrdiff_t>(v) * words, x);
    const auto bit = [&](Index u) { return mask(clamp(u, 0, last_x), clamp(v, 0, last_y)) ? 1U : 0U; };
    return bit(x) | bit(x + 1) << 1;
  };
  std::uint32_t bits = 0;
  for (Index i = 0; i < count; ++i) {
    const std::uint32_t pattern = two(at[i][0], at[i][1]) | two(at[i][0], at[i][1] + 1) << 2;
    bits |= (static_cast<std::uint32_t>(table[part[i] & (cv::INTER_TAB_SIZE2 - 1)]) >> pattern & 1U) << i;
  }
  return bits;
}

Undistortion::Undistortion(const CalibratedCamera& calibrated)
    : maps_(std::make_unique<Maps>(Maps{undistorted_camera(calibrated),
                                        {calibrated.camera.width_px, calibrated.camera.height_px},
                                        {},
                                        {},
                                        {}})) {
  if (calibrated.lens.model == LensModel::none) return;
  const Camera& to = maps_->pinhole;
  const double limit = calibrated.lens.limit();
  cv::Mat at(to.height_px, to.width_px, CV_32FC2);
  tbb::parallel_for(Index{0}, to.height_px, [&](Index y) {
    for (Index x = 0; x < to.width_px; ++x) {
      const auto px = photo_pixel(calibrated, to, {static_cast<double>(x), static_cast<double>(y)}, limit);
      at.at<cv::Vec2f>(y, x) =
          px ? cv::Vec2f(static_cast<float>(px->x), static_cast<float>(px->y)) : cv::Vec2f(-1, -1);
    }
  });
  cv::convertMaps(at, cv::Mat(), maps_->xy, maps_->fraction, CV_16SC2);
  for (Index y = 0; y < to.height_px; ++y) {
    for (Index begin = 0; begin < to.width_px; begin += 32) {
      Maps::Source s{32767, 32767, 0, 0, false};
      for (Index x = begin; x < min(begin + 32, to.width_px); ++x) {
        const auto p = maps_->xy.at<cv::Vec2s>(y, x);
        const auto inside = [](int v, int size) { return static_cast<std::int16_t>(clamp(v, 0, size - 1)); };
        s.x0 = std::min(s.x0, inside(p[0], maps_->photo.width));
        s.y0 = std::min(s.y0, inside(p[1], maps_->photo.height));
        s.x1 = std::max(s.x1, inside(p[0] + 1, maps_->photo.width));
        s.y1 = std::max(s.y1, inside(p[1] + 1, maps_->photo.height));
        s.reaches_beyond |=
            p[0] < 0 || p[1] < 0 || p[0] + 1 >= maps_->photo.width || p[1] + 1 >= maps_->photo.height;
      }
      maps_->sources.push_back(s);
    }
  }
}
Undistortion::~Undistortion() = default;
Undistortion::Undistortion(Undistortion&&) noexcept = default;

const Camera& Undistortion::camera() const { return maps_->pinhole; }

void Undistortion::mask(const std::uint8_t* bytes, Image<std::uint8_t>& scratch, BitMask& result) const {
  if (maps_->xy.empty()) return pack_mask(bytes, maps_->photo.width, maps_->photo.height, result);
  this->bytes(bytes, scratch);
  pack_mask(scratch.pixels.data(), scratch.width_px, scratch.height_px, result);
}

void Undistortion::bytes(const std::uint8_t* bytes, Image<std::uint8_t>& result) const {
  const Camera& c = maps_->pinhole;
  if (result.width_px != c.width_px || result.height_px != c.height_px)
    result = Image<std::uint8_t>(c.width_px, c.height_px);
  const cv::Mat from(maps_->photo, CV_8U, const_cast<std::uint8_t*>(bytes));
  cv::Mat to(c.height_px, c.width_px, CV_8U, result.pixels.data());
  if (maps_->xy.empty()) return from.copyTo(to);
  // Samples lie at most half a pixel beyond the last centre: there the last pixel is the answer.
  cv::remap(from, to, maps_->xy, maps_->fraction, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
}

void Undistortion::mask(const BitMask& photo, BitMask& result) const {
  if (maps_->xy.empty()) {
    result = photo;
    return;
  }
  const Camera& c = maps_->pinhole;
  if (result.width_px != c.width_px || result.height_px != c.height_px)
    result = BitMask(c.width_px, c.height_px);
  const PixelRect set = bounds_of(photo);
  const Index words = result.words_per_row();
  const Maps::Source* source = maps_->sources.data();
  std::uint32_t* out = result.words.data();
  for (Index y = 0; y < c.height_px; ++y) {
    for (Index w = 0; w < words; ++w, ++source, ++out) {
      const Maps::Source& s = *source;
      *out = 0;
      if (s.x1 < set.min_x || s.x0 > set.max_x || s.y1 < set.min_y || s.y0 > set.max_y) continue;
      const Index begin = 32 * w, count = min(32, c.width_px - begin);
      const int same = uniform(photo, s.x0, s.y0, s.x1, s.y1);
      if (same == 1)
        *out = count == 32 ? ~0U : (1U << count) - 1U;
      else if (same == 2)
        *out = maps_->sample(photo, s, begin, y, count);
    }
  }
}

void Undistortion::color(const std::uint8_t* bgr, ColorImage& result) const {
  const Camera& c = maps_->pinhole;
  if (result.width_px != c.width_px || result.height_px != c.height_px) {
    result = ColorImage(c.width_px, c.height_px);
  }
  const cv::Mat from(maps_->photo, CV_8UC3, const_cast<std::uint8_t*>(bgr));
  cv::Mat to(c.height_px, c.width_px, CV_8UC3, result.pixels.data());
  if (maps_->xy.empty()) return cv::cvtColor(from, to, cv::COLOR_BGR2RGB);
  cv::remap(from, to, maps_->xy, maps_->fraction, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  cv::cvtColor(to, to, cv::COLOR_BGR2RGB);
}

}  // namespace tactus
