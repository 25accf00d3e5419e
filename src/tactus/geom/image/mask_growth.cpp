#include "tactus/geom/image/mask_growth.h"

namespace tactus {
namespace {

/// One step in all four directions, 32 pixels at a time.
void grow_one_step(const BitMask& mask, BitMask& out) {
  const auto row_words = static_cast<std::size_t>(mask.words_per_row());
  const std::size_t count = mask.words.size();
  const std::uint32_t in_last = mask.width_px % 32 == 0 ? ~0U : (1U << mask.width_px % 32) - 1U;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t in_row = i % row_words;
    const std::uint32_t word = mask.words[i];
    std::uint32_t grown = word | word << 1 | word >> 1;
    if (in_row > 0) grown |= mask.words[i - 1] >> 31;
    if (in_row + 1 < row_words) grown |= mask.words[i + 1] << 31;
    if (i >= row_words) grown |= mask.words[i - row_words];
    if (i + row_words < count) grown |= mask.words[i + row_words];
    out.words[i] = in_row + 1 < row_words ? grown : grown & in_last;
  }
}

}  // namespace

void grow_mask(const BitMask& mask, int steps, BitMask& out) {
  out = mask;
  BitMask before = steps > 1 ? mask : BitMask();
  for (int step = 0; step < steps; ++step) {
    if (step > 0) std::swap(before, out);
    grow_one_step(step == 0 ? mask : before, out);
  }
}

}  // namespace tactus
