#include "tactus/view/edge_smoothing.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdlib>

namespace tactus {
namespace {

constexpr int kSearchPx = 8;
constexpr int kBrightnessStep = 40;  // of 1020: fainter edges don't look jagged

int brightness(Rgb8 c) { return c.r + 2 * c.g + c.b; }

Rgb8 mix(Rgb8 a, Rgb8 b, float t) {
  const auto channel = [t](std::uint8_t x, std::uint8_t y) {
    return static_cast<std::uint8_t>(static_cast<float>(x) + t * static_cast<float>(y - x) + 0.5F);
  };
  return {channel(a.r, b.r), channel(a.g, b.g), channel(a.b, b.b)};
}

/// Pixels from `at` along `step` for which the pair across the edge keeps its mean; `end_sum`: the sum there.
int search(const Rgb8* at, std::ptrdiff_t step, std::ptrdiff_t across, int sum, int limit, int room,
           int& end_sum) {
  int n = 0;
  do {
    ++n;
    const Rgb8* p = at + n * step;
    end_sum = brightness(p[0]) + brightness(p[across]);
  } while (n < room && std::abs(end_sum - sum) < limit);
  return n;
}

Rgb8 smoothed(const Rgb8* at, std::ptrdiff_t row, int to_left, int to_right, int to_top, int to_bottom) {
  const int c = brightness(*at), n = brightness(at[-row]), s = brightness(at[row]);
  const int w = brightness(at[-1]), e = brightness(at[1]);
  const int low = std::min({c, n, s, w, e}), high = std::max({c, n, s, w, e});
  if (high - low < std::max(kBrightnessStep, high / 8)) return *at;
  const bool horizontal = std::abs(n + s - 2 * c) >= std::abs(w + e - 2 * c);
  const int before = horizontal ? n : w, after = horizontal ? s : e;
  const bool first = std::abs(before - c) >= std::abs(after - c);
  const std::ptrdiff_t across = (horizontal ? row : 1) * (first ? -1 : 1);
  const std::ptrdiff_t along = horizontal ? 1 : row;
  const int other = first ? before : after;
  const int sum = c + other, limit = std::max(1, std::abs(c - other) / 2);
  int back_sum = 0, forth_sum = 0;
  const int back =
      search(at, -along, across, sum, limit, std::min(kSearchPx, horizontal ? to_left : to_top), back_sum);
  const int forth = search(at, along, across, sum, limit,
                           std::min(kSearchPx, horizontal ? to_right : to_bottom), forth_sum);
  // Beyond its nearer end the edge has crossed to one side: blend only where it crossed into this pixel.
  const int end_sum = back < forth ? back_sum : forth_sum;
  if ((c < other) == (end_sum < sum)) return *at;
  const float t = 0.5F - static_cast<float>(std::min(back, forth)) / static_cast<float>(back + forth);
  return mix(*at, at[across], std::max(0.F, t));
}

}  // namespace

void smooth_edges(const ColorImage& in, ColorImage& out) {
  out = in;
  const Index w = in.width_px, h = in.height_px;
  tbb::parallel_for(tbb::blocked_range<Index>(1, std::max<Index>(1, h - 1), 16), [&](const auto& rows) {
    for (Index y = rows.begin(); y < rows.end(); ++y) {
      for (Index x = 1; x + 1 < w; ++x) out(x, y) = smoothed(&in(x, y), w, x, w - 1 - x, y, h - 1 - y);
    }
  });
}

}  // namespace tactus
