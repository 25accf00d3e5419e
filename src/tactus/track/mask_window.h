#pragma once
/// The part of a mask around a tool, read between its pixels.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "tactus/geom/image/image.h"

namespace tactus {

/// Keeps its memory: some kilobytes, as pixels stay packed.
class MaskWindow {
 public:
  /// Copies the words that show pixels from `low_px` to `high_px`; none where less than two rows are in the
  /// mask.
  void open(const BitMask& mask, Vec2d low_px, Vec2d high_px) {
    close();
    const auto begin = [](double x, Index size) {
      return static_cast<Index>(std::floor(std::clamp(x, 0.0, static_cast<double>(size))));
    };
    const auto end = [](double x, Index size) {
      return static_cast<Index>(std::ceil(std::clamp(x + 1, 0.0, static_cast<double>(size))));
    };
    const Index first_word = begin(low_px.x, mask.width_px) / 32,
                row_words = ceil_div(end(high_px.x, mask.width_px), 32) - first_word;
    y_px_ = begin(low_px.y, mask.height_px);
    const Index height = end(high_px.y, mask.height_px) - y_px_;
    if (row_words < 1 || height < 2) return;
    x_px_ = 32 * first_word;
    row_words_ = row_words;
    width_px_ = 32 * row_words;
    height_px_ = height;
    // `at` reads two words from each, the last one, too.
    words_.resize(static_cast<std::size_t>(row_words) * static_cast<std::size_t>(height) + 1);
    for (Index y = 0; y < height; ++y)
      std::copy_n(
          mask.words.begin() + static_cast<std::ptrdiff_t>(y_px_ + y) * mask.words_per_row() + first_word,
          row_words, words_.begin() + static_cast<std::ptrdiff_t>(y) * row_words);
  }
  void close() { width_px_ = height_px_ = 0; }
  bool is_open() const { return width_px_ > 0; }
  Index x_px() const { return x_px_; }
  Index y_px() const { return y_px_; }

  /// Bilinear between four pixels, from the window's first one on; 0 outside.
  double at(double x, double y) const {
    if (!(x >= 0 && y >= 0 && x < width_px_ - 1 && y < height_px_ - 1)) return 0;
    const auto x0 = static_cast<Index>(x), y0 = static_cast<Index>(y);
    const auto fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
    const std::uint32_t* word = words_.data() + static_cast<std::ptrdiff_t>(y0) * row_words_ + (x0 >> 5);
    const float upper = between(word, x0 & 31, fx), lower = between(word + row_words_, x0 & 31, fx);
    return static_cast<double>(upper + fy * (lower - upper));
  }

 private:
  /// Linear between a pixel of a word and the next pixel, which may be in the next word.
  static float between(const std::uint32_t* word, Index bit, float share) {
    constexpr float kFirst[] = {0, 1, 0, 1}, kChange[] = {0, -1, 1, 0};
    std::uint64_t both;
    std::memcpy(&both, word, sizeof both);
    const std::uint64_t pair = both >> bit & 3U;
    return kFirst[pair] + share * kChange[pair];
  }

  std::vector<std::uint32_t> words_;
  Index x_px_ = 0, y_px_ = 0, row_words_ = 0, width_px_ = 0, height_px_ = 0;
};

}  // namespace tactus
