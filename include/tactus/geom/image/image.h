#pragma once
/// Images on the host, row by row from the top-left pixel.
#include <cstdint>
#include <vector>

#include "tactus/base/vec.h"

namespace tactus {

template <class T>
struct Image {
  Index width_px = 0, height_px = 0;
  std::vector<T> pixels;

  Image() = default;
  Image(Index width, Index height, T value = {})
      : width_px(width),
        height_px(height),
        pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), value) {}
  T& operator()(Index x, Index y) {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) +
                  static_cast<std::size_t>(x)];
  }
  const T& operator()(Index x, Index y) const {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) +
                  static_cast<std::size_t>(x)];
  }
  bool empty() const { return pixels.empty(); }
};

struct Rgb8 {
  std::uint8_t r = 0, g = 0, b = 0;
  friend bool operator==(const Rgb8&, const Rgb8&) = default;
};
using ColorImage = Image<Rgb8>;
/// Distance along the pixel's ray [m] (radial, not z); 0 or NaN: no measurement.
using DepthImage = Image<float>;
/// Share of a pixel that the subject covers, 0 to 255.
using AlphaImage = Image<std::uint8_t>;

/// A silhouette: one bit a pixel, set inside. Rows are padded to whole words; padding bits are 0.
struct BitMask {
  Index width_px = 0, height_px = 0;
  std::vector<std::uint32_t> words;  ///< pixel x of row y is bit x%32 of word y*words_per_row() + x/32

  BitMask() = default;
  BitMask(Index width, Index height)
      : width_px(width),
        height_px(height),
        words(static_cast<std::size_t>(height) * static_cast<std::size_t>((width + 31) / 32)) {}
  Index words_per_row() const { return (width_px + 31) / 32; }
  bool operator()(Index x, Index y) const { return (words[index(x, y)] >> (x & 31) & 1U) != 0; }
  void set(Index x, Index y) { words[index(x, y)] |= 1U << (x & 31); }
  void clear(Index x, Index y) { words[index(x, y)] &= ~(1U << (x & 31)); }
  /// Number of set pixels.
  std::int64_t area_px() const {
    std::int64_t n = 0;
    for (const std::uint32_t w : words) n += __builtin_popcount(w);
    return n;
  }
  friend bool operator==(const BitMask&, const BitMask&) = default;

 private:
  std::size_t index(Index x, Index y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(words_per_row()) +
           static_cast<std::size_t>(x >> 5);
  }
};

}  // namespace tactus
