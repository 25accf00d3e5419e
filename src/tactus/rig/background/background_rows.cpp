#include "tactus/rig/background/background_rows.h"

#include <algorithm>
#include <cstring>
#include <opencv2/core/hal/intrin.hpp>

namespace tactus {
namespace {

constexpr Index kWord = 32;
std::size_t padded(Index width) { return static_cast<std::size_t>(ceil_div(width, kWord) * kWord); }

/// 8 bytes of 0 or 1 to bits, the first byte lowest.
std::uint32_t bits_of(const std::uint8_t* bytes) {
  std::uint64_t eight;
  std::memcpy(&eight, bytes, sizeof eight);
  return static_cast<std::uint32_t>(eight * 0x0102040810204080ULL >> 56);
}

/// One word at a time: decide(x, count, bytes) writes 0 or 1 for pixels x to x + count.
template <class F>
void each_word(Index width, std::uint32_t* bits, F&& decide) {
  for (Index x = 0; x < width; x += kWord) {
    std::uint8_t bytes[kWord] = {};
    decide(x, min(kWord, width - x), bytes);
    *bits++ =
        bits_of(bytes) | bits_of(bytes + 8) << 8 | bits_of(bytes + 16) << 16 | bits_of(bytes + 24) << 24;
  }
}

std::uint8_t distance(std::uint8_t a, std::uint8_t b) {
  return static_cast<std::uint8_t>(std::max(a, b) - std::min(a, b));
}

/// Whether all of the pixels x to x + 32 are as the room in each channel.
bool is_room(const SmoothedRow& photo, const RoomRow& room, Index x) {
  const std::uint8_t *pb = photo.plane(0) + x, *pg = photo.plane(1) + x, *pr = photo.plane(2) + x;
  const std::uint8_t *kb = room.plane[0] + x, *kg = room.plane[1] + x, *kr = room.plane[2] + x;
  const std::uint8_t* nothing = room.nothing + x;
  std::uint8_t differ = 0;
#pragma omp simd reduction(| : differ)
  for (Index i = 0; i < kWord; ++i) {
    const std::uint8_t most =
        std::max(std::max(distance(pb[i], kb[i]), distance(pg[i], kg[i])), distance(pr[i], kr[i]));
    differ |= static_cast<std::uint8_t>(most > nothing[i] ? 1 : 0);
  }
  return differ == 0;
}

/// Distances are compared as squares and ratios as products: no division, no branch.
void decide_pixels(Index x, Index count, const SmoothedRow& photo, const RoomRow& room, const Decision& how,
                   std::uint8_t* result) {
  const std::uint8_t *pb = photo.plane(0) + x, *pg = photo.plane(1) + x, *pr = photo.plane(2) + x;
  const std::uint8_t *mb = room.plane[0] + x, *mg = room.plane[1] + x, *mr = room.plane[2] + x;
  const std::uint8_t* noise = room.noise + x;
  const float chroma2 = how.chroma2, darkest = how.darkest, brightest = how.brightest;
#pragma omp simd
  for (Index i = 0; i < count; ++i) {
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

}  // namespace

SmoothedRow::SmoothedRow(Index width_px, Index height_px)
    : width_px_(width_px),
      height_px_(height_px),
      columns_(3 * (static_cast<std::size_t>(width_px) + 2)),
      bgr_(3 * padded(width_px)) {
  for (std::vector<std::uint8_t>& plane : planes_) plane.resize(padded(width_px));
}

void SmoothedRow::load(const std::uint8_t* bgr, Index y) {
  const Index n = 3 * width_px_;
  const auto row = [&](Index at) { return bgr + static_cast<std::ptrdiff_t>(at) * n; };
  const std::uint8_t *above = row(y > 0 ? y - 1 : min(1, height_px_ - 1)), *middle = row(y),
                     *below = row(y + 1 < height_px_ ? y + 1 : max(height_px_ - 2, 0));
  std::uint16_t* sum = columns_.data() + 3;
  for (Index i = 0; i < n; ++i) sum[i] = static_cast<std::uint16_t>(above[i] + 2 * middle[i] + below[i]);
  const Index second = 3 * min(1, width_px_ - 1), last_but_one = 3 * max(width_px_ - 2, 0);
  for (Index c = 0; c < 3; ++c) {
    sum[c - 3] = sum[second + c];
    sum[n + c] = sum[last_but_one + c];
  }
  std::uint8_t* smooth = bgr_.data();
  for (Index i = 0; i < n; ++i)
    smooth[i] = static_cast<std::uint8_t>((sum[i - 3] + 2 * sum[i] + sum[i + 3] + 8) >> 4);
  for (Index x = 0; x < width_px_; x += cv::v_uint8x16::nlanes) {
    cv::v_uint8x16 b, g, r;
    cv::v_load_deinterleave(smooth + 3 * x, b, g, r);
    cv::v_store(planes_[0].data() + x, b);
    cv::v_store(planes_[1].data() + x, g);
    cv::v_store(planes_[2].data() + x, r);
  }
}

void decide_row(Index width, const SmoothedRow& photo, const RoomRow& room, const Decision& how,
                std::uint32_t* bits) {
  each_word(width, bits, [&](Index x, Index count, std::uint8_t* bytes) {
    if (count < kWord)
      decide_pixels(x, count, photo, room, how, bytes);
    else if (!is_room(photo, room, x))
      decide_pixels(x, kWord, photo, room, how, bytes);
  });
}

void key_row(Index width, const SmoothedRow& photo, Rgb8 key, float cos2, std::uint32_t* bits) {
  const int kb = key.b, kg = key.g, kr = key.r;
  const auto key2 = static_cast<float>(kb * kb + kg * kg + kr * kr) * cos2;
  each_word(width, bits, [&](Index x, Index count, std::uint8_t* bytes) {
    const std::uint8_t *pb = photo.plane(0) + x, *pg = photo.plane(1) + x, *pr = photo.plane(2) + x;
#pragma omp simd
    for (Index i = 0; i < count; ++i) {
      const int b = pb[i], g = pg[i], r = pr[i];
      const auto dot = static_cast<float>(b * kb + g * kg + r * kr);
      const auto photo2 = static_cast<float>(b * b + g * g + r * r);
      // Near black there is no direction: it is no cloth.
      const int foreground = static_cast<int>(dot * dot < key2 * photo2) | static_cast<int>(photo2 < 900.F);
      bytes[i] = static_cast<std::uint8_t>(foreground);
    }
  });
}

void threshold_row(Index width, const std::uint8_t* bytes, std::uint8_t above, std::uint32_t* bits) {
  each_word(width, bits, [&](Index x, Index count, std::uint8_t* result) {
    for (Index i = 0; i < count; ++i) result[i] = bytes[x + i] > above ? 1 : 0;
  });
}

}  // namespace tactus
