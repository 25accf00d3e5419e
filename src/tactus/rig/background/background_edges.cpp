#include "tactus/rig/background/background_edges.h"

#include <array>
#include <bit>
#include <cmath>

#include "tactus/base/math.h"

namespace tactus {
namespace {

/// Eight directions at two distances: band pixels are up to 2 px inside the decision's contour, and up to the
/// closing's radius outside.
constexpr Index kAround[][2] = {{3, 0}, {-3, 0}, {0, 3}, {0, -3}, {2, 2}, {-2, 2}, {2, -2}, {-2, -2},
                                {6, 0}, {-6, 0}, {0, 6}, {0, -6}, {4, 4}, {-4, 4}, {4, -4}, {-4, -4}};
/// The subject differs from the room by so many times the noise.
constexpr int kContrast = 2;

/// Light of a grey level, 0 to 1023. Cameras store its root (about the 2.2th), and it is light that mixes:
/// half a dark subject before a white wall is a light grey.
std::array<int, 256> make_light() {
  std::array<int, 256> light{};
  for (std::size_t v = 0; v < light.size(); ++v)
    light[v] = static_cast<int>(std::lround(1023 * std::pow(static_cast<double>(v) / 255, 2.2)));
  return light;
}

/// The mixture of a pixel in light: alpha = along / contrast2.
struct Mixture {
  int along = 0, contrast2 = 0;
  bool is_known = false;  ///< there is subject around, and it doesn't look like the room
};

Mixture mixture(const PhotoOfRoom& photo, const BitMask& core, Index x, Index y) {
  static const std::array<int, 256> light = make_light();
  const Index width = core.width_px;
  int subject[3] = {}, count = 0;
  for (const auto& [dx, dy] : kAround) {
    const Index u = x + dx, v = y + dy;
    if (u < 0 || v < 0 || u >= width || v >= core.height_px || !core(u, v)) continue;
    const std::uint8_t* p = photo.bgr + 3 * (static_cast<std::ptrdiff_t>(v) * width + u);
    for (int c = 0; c < 3; ++c) subject[c] += p[c];
    ++count;
  }
  if (count == 0) return {};
  const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(y) * width + x;
  int grey_levels2 = 0;
  Mixture mixed;
  for (int c = 0; c < 3; ++c) {
    const int room = photo.room[c][at], beside = subject[c] / count, p = photo.bgr[3 * at + c];
    const int difference = light[static_cast<std::size_t>(beside)] - light[static_cast<std::size_t>(room)];
    grey_levels2 += sqr(beside - room);
    mixed.along += (light[static_cast<std::size_t>(p)] - light[static_cast<std::size_t>(room)]) * difference;
    mixed.contrast2 += sqr(difference);
  }
  mixed.is_known = grey_levels2 > sqr(kContrast * photo.noise[at]);
  return mixed;
}

/// f(x, y) for every set pixel of `with` that is clear in `without`.
template <class F>
void for_each_pixel(const BitMask& with, const BitMask& without, F&& f) {
  const Index words = with.words_per_row();
  for (Index y = 0; y < with.height_px; ++y) {
    for (Index w = 0; w < words; ++w) {
      const auto i = static_cast<std::size_t>(y * words + w);
      for (std::uint32_t bits = with.words[i] & ~without.words[i]; bits != 0; bits &= bits - 1)
        f(32 * w + std::countr_zero(bits), y);
    }
  }
}

}  // namespace

void refine_edges(const PhotoOfRoom& photo, const BitMask& core, BitMask& mask) {
  for_each_pixel(mask, core, [&](Index x, Index y) {
    const Mixture mixed = mixture(photo, core, x, y);
    if (mixed.is_known && 2 * mixed.along < mixed.contrast2) mask.clear(x, y);
  });
}

void edge_alpha(const PhotoOfRoom& photo, const BitMask& core, const BitMask& band, const BitMask& mask,
                AlphaImage& alpha) {
  for (Index y = 0; y < mask.height_px; ++y) {
    for (Index x = 0; x < mask.width_px; ++x) alpha(x, y) = static_cast<std::uint8_t>(mask(x, y) ? 255 : 0);
  }
  for_each_pixel(band, core, [&](Index x, Index y) {
    const Mixture mixed = mixture(photo, core, x, y);
    if (!mixed.is_known) return;
    const int along = clamp(mixed.along, 0, mixed.contrast2);
    alpha(x, y) = static_cast<std::uint8_t>(std::lround(255.0 * along / mixed.contrast2));
  });
}

}  // namespace tactus
