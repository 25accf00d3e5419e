#include "tactus/geom/image/mask_cleaning.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace tactus {
namespace {

/// Half the width of the row `dy` of a disc.
int half_width(int radius, int dy) {
  return static_cast<int>(std::lround(std::sqrt(static_cast<double>(radius * radius - dy * dy))));
}

/// row |= row shifted by `by` < 32 pixels to both sides.
void widen(std::uint32_t* row, std::uint32_t* before, Index words, int by) {
  std::copy_n(row, words, before);
  for (Index j = 0; j < words; ++j) row[j] |= before[j] << by | before[j] >> by;
  for (Index j = 1; j < words; ++j) row[j] |= before[j - 1] >> (32 - by);
  for (Index j = 0; j + 1 < words; ++j) row[j] |= before[j + 1] << (32 - by);
}

/// First pixel at or after x whose bit is `value`, or width.
Index next_pixel(const std::uint32_t* row, Index x, Index width, bool value) {
  const std::uint32_t flip = value ? 0U : ~0U;
  while (x < width) {
    const std::uint32_t left = (row[x >> 5] ^ flip) >> (x & 31);
    if (left != 0) return min(x + std::countr_zero(left), width);
    x = (x | 31) + 1;
  }
  return width;
}

/// Sets or clears pixels [begin, end).
void write_run(std::uint32_t* row, Index begin, Index end, bool value) {
  for (Index x = begin; x < end;) {
    const Index stop = min((x | 31) + 1, end);
    const std::uint32_t bits = (stop - x == 32 ? ~0U : (1U << (stop - x)) - 1U) << (x & 31);
    row[x >> 5] = value ? row[x >> 5] | bits : row[x >> 5] & ~bits;
    x = stop;
  }
}

}  // namespace

MaskCleaner::MaskCleaner(Index width_px, Index height_px)
    : width_px_(width_px),
      height_px_(height_px),
      row_words_(ceil_div(width_px, 32)),
      row_begin_(static_cast<std::size_t>(height_px) + 1) {
  runs_.reserve(16 * static_cast<std::size_t>(height_px));
}

void MaskCleaner::invert(BitMask& mask) const {
  for (std::uint32_t& word : mask.words) word = ~word;
  if ((width_px_ & 31) == 0) return;
  const std::uint32_t real = (1U << (width_px_ & 31)) - 1U;
  for (Index y = 0; y < height_px_; ++y)
    mask.words[static_cast<std::size_t>((y + 1) * row_words_ - 1)] &= real;
}

void MaskCleaner::dilate(BitMask& mask, int radius_px) {
  if (radius_px <= 0) return;
  const auto image = static_cast<std::size_t>(row_words_) * static_cast<std::size_t>(height_px_);
  const auto row = static_cast<std::size_t>(row_words_);
  widened_.resize(2 * image + row);
  std::uint32_t* wide = widened_.data();
  std::uint32_t* sum = wide + image;
  std::uint32_t* before = sum + image;
  std::copy(mask.words.begin(), mask.words.end(), wide);
  std::fill_n(sum, image, 0U);
  // From the disc's top row inwards its rows get wider: each width is made from the one before.
  int reach = 0;
  for (int dy = radius_px; dy >= 0; --dy) {
    for (const int wanted = half_width(radius_px, dy); reach < wanted;) {
      const int by = std::min({wanted - reach, reach + 1, 31});
      for (Index y = 0; y < height_px_; ++y)
        widen(wide + static_cast<std::size_t>(y) * row, before, row_words_, by);
      reach += by;
    }
    const auto shift = static_cast<std::size_t>(std::min<Index>(dy, height_px_)) * row;
    for (std::size_t i = 0; i + shift < image; ++i) sum[i] |= wide[i + shift];
    for (std::size_t i = shift; i < image; ++i) sum[i] |= wide[i - shift];
  }
  std::copy_n(sum, image, mask.words.begin());
  if ((width_px_ & 31) == 0) return;
  const std::uint32_t real = (1U << (width_px_ & 31)) - 1U;
  for (Index y = 0; y < height_px_; ++y)
    mask.words[static_cast<std::size_t>((y + 1) * row_words_ - 1)] &= real;
}

void MaskCleaner::erode(BitMask& mask, int radius_px) {
  if (radius_px <= 0) return;
  invert(mask);
  dilate(mask, radius_px);
  invert(mask);
}

Index MaskCleaner::root(Index run) {
  while (runs_[static_cast<std::size_t>(run)].parent != run) {
    Index& parent = runs_[static_cast<std::size_t>(run)].parent;
    parent = runs_[static_cast<std::size_t>(parent)].parent;
    run = parent;
  }
  return run;
}

void MaskCleaner::join(Index a, Index b) {
  a = root(a);
  b = root(b);
  if (a == b) return;
  Run &low = runs_[static_cast<std::size_t>(min(a, b))], &high = runs_[static_cast<std::size_t>(max(a, b))];
  high.parent = min(a, b);
  low.area += high.area;
  low.at_border |= high.at_border;
}

/// Runs of set or clear pixels, joined with those of the row above that touch them; `reach`: 1 over corners,
/// too.
void MaskCleaner::find_runs(const BitMask& mask, bool value, Index reach) {
  runs_.clear();
  Index above = 0;
  for (Index y = 0; y < height_px_; ++y) {
    const std::uint32_t* row = mask.words.data() + static_cast<std::ptrdiff_t>(y) * row_words_;
    const auto row_first = static_cast<Index>(runs_.size());
    row_begin_[static_cast<std::size_t>(y)] = row_first;
    above = y > 0 ? row_begin_[static_cast<std::size_t>(y) - 1] : 0;
    for (Index x = next_pixel(row, 0, width_px_, value); x < width_px_;) {
      const Index end = next_pixel(row, x, width_px_, !value), self = static_cast<Index>(runs_.size());
      runs_.push_back(
          {y, x, end, self, end - x, x == 0 || end == width_px_ || y == 0 || y + 1 == height_px_});
      while (above < row_first && runs_[static_cast<std::size_t>(above)].end + reach <= x) ++above;
      for (Index a = above; a < row_first && runs_[static_cast<std::size_t>(a)].begin < end + reach; ++a)
        join(self, a);
      x = next_pixel(row, end, width_px_, value);
    }
  }
}

void MaskCleaner::keep_parts(BitMask& mask, double least_part) {
  find_runs(mask, true, 1);
  std::int64_t largest = 0;
  Index best = -1;
  for (Index i = 0; i < std::ssize(runs_); ++i) {
    const Run& run = runs_[static_cast<std::size_t>(i)];
    if (run.parent != i || run.area <= largest) continue;
    largest = run.area;
    best = i;
  }
  const double least = least_part * static_cast<double>(largest);
  for (Index i = 0; i < std::ssize(runs_); ++i) {
    const Index part = root(i);
    const bool stays =
        part == best ||
        (least_part < 1 && static_cast<double>(runs_[static_cast<std::size_t>(part)].area) >= least);
    if (stays) continue;
    const Run& run = runs_[static_cast<std::size_t>(i)];
    write_run(mask.words.data() + static_cast<std::ptrdiff_t>(run.y) * row_words_, run.begin, run.end, false);
  }
}

void MaskCleaner::fill_holes(BitMask& mask, int largest_hole_px) {
  if (largest_hole_px <= 0) return;
  find_runs(mask, false, 0);
  for (Index i = 0; i < std::ssize(runs_); ++i) {
    const Run& hole = runs_[static_cast<std::size_t>(root(i))];
    if (hole.at_border || hole.area >= largest_hole_px) continue;
    const Run& run = runs_[static_cast<std::size_t>(i)];
    write_run(mask.words.data() + static_cast<std::ptrdiff_t>(run.y) * row_words_, run.begin, run.end, true);
  }
}

void MaskCleaner::clean(BitMask& mask, const MaskCleaning& how) {
  erode(mask, how.open_px);
  dilate(mask, how.open_px);
  dilate(mask, how.close_px);
  erode(mask, how.close_px);
  keep_parts(mask, how.least_part);
  fill_holes(mask, how.largest_hole_px);
}

}  // namespace tactus
