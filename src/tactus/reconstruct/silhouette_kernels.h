#pragma once
/// Silhouettes on the device: words of overlapping patches of bits that answer a bilinear sample in one read,
/// and two ways to answer "all set, all clear or mixed?" for a rectangle in four: a summed-area table of "any
/// pixel set" / "any pixel clear" cells for large ones; for small ones, to the pixel, the contents of windows
/// of 4x4 and of 8x8 pixels.
#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"

namespace tactus {

/// A word holds a patch of 10 x 3 pixels, row by row. Patches start every 8 x 2 pixels, so the four pixels
/// round any point lie in one.
inline constexpr int kPatchRowBits = 10;

/// One camera as the hull sees it: projects *padded node indices* of the grid (not metres) to pixels, and
/// says where its silhouette lies in the shared arrays.
struct HullCamera {
  /// u_px = (row[0] . (x,y,z,1)) / (row[2] . (x,y,z,1)), v_px likewise with row[1].
  Vec3f row[3];
  float offset[3];
  Index width_px, height_px;
  Index raw_begin;                   ///< the mask as it came: 32 pixels a word
  Index bits_begin, bits_row_words;  ///< patches (kPatch...) of the padded mask; two rows of pixels a row
  Index cells_begin, cells_width, cells_height, cells_row,
      cell_shift;  ///< summed-area table; a cell is 2^shift pixels wide
  /// Words of 16 windows in a row, "any set" in the low half, "any clear" in the high; a plane of 4x4
  /// windows, one of 8x8. Window (x,y) reaches right and down from there.
  Index windows_begin;  ///< negative: there are none
  TACTUS_HD Index raw_row_words() const { return (width_px + 31) >> 5; }
  TACTUS_HD Index windows_row() const { return 2 * raw_row_words(); }
};
/// Rectangles up to twice the largest window are answered to the pixel.
inline constexpr Index kSmallWindow = 4, kLargestWindow = 8;

/// Homogeneous image point of a padded node or of a point between nodes.
TACTUS_HD inline Vec3f project_node(const HullCamera& c, Vec3f node) {
  return {fma(c.row[0].x, node.x, fma(c.row[0].y, node.y, fma(c.row[0].z, node.z, c.offset[0]))),
          fma(c.row[1].x, node.x, fma(c.row[1].y, node.y, fma(c.row[1].z, node.z, c.offset[1]))),
          fma(c.row[2].x, node.x, fma(c.row[2].y, node.y, fma(c.row[2].z, node.z, c.offset[2])))};
}

/// The one mask function: bilinear coverage of the silhouette at a homogeneous image point, minus 1/2, so
/// that >= 0 is inside. Where the camera doesn't look (outside the image, behind it) it knows nothing, and
/// nothing is carved: 1/2. Written without branches so that a loop over nodes vectorises.
TACTUS_HD inline float sample_silhouette(const HullCamera& c, const std::uint32_t* bits, Vec3f h) {
  const bool in_front = h.z > 1e-6F;
  const float inverse_z = 1.F / (in_front ? h.z : 1.F);
  const float u = h.x * inverse_z, v = h.y * inverse_z;
  const float u_max = static_cast<float>(c.width_px) - 0.5F, v_max = static_cast<float>(c.height_px) - 0.5F;
  const float u_seen = clamp(u, -0.5F, u_max), v_seen = clamp(v, -0.5F, v_max);
  const float at_least = (in_front & (u == u_seen) & (v == v_seen)) ? -0.5F : 0.5F;
  // Padded pixel s is image pixel s-1; the border pixels are repeated once on each side.
  const float us = u_seen + 1.F, vs = v_seen + 1.F;
  const Index s = static_cast<Index>(us), r = static_cast<Index>(vs);
  const float fu = us - static_cast<float>(s), fv = vs - static_cast<float>(r);
  const std::uint32_t patch =
      bits[c.bits_begin + (r >> 1) * c.bits_row_words + (s >> 3)] >> ((s & 7) + kPatchRowBits * (r & 1));
  const auto bit = [patch](int i) { return static_cast<float>(static_cast<Index>(patch >> i & 1U)); };
  const float top_left = bit(0), bottom_left = bit(kPatchRowBits);
  const float t = fma(fu, bit(1) - top_left, top_left),
              b = fma(fu, bit(kPatchRowBits + 1) - bottom_left, bottom_left);
  return max(fma(fv, b - t, t) - 0.5F, at_least);
}

/// Cuts all masks into patches and sums them up along the rows of cells: one block is one row of cells. A
/// cell counts 1 in its low half when any of its pixels is set, and 1 in its high half when any is clear.
/// Reads a word on either side of each raw row.
struct PrepareSilhouettes {
  View<const HullCamera> cameras;
  View<const std::uint32_t> raw;
  View<const Vec2i> cell_rows;  ///< (camera, cell row), one per block
  View<std::uint32_t> bits, cells;

  static constexpr int kThreads = 32;
  static constexpr int kGrain = 16;
  static constexpr Index kMaxCells = 1024, kMaxRawWords = 512;
  struct Shared {
    std::uint32_t row[3][kMaxRawWords + 1];              ///< of padded pixels, 32 to a word
    std::uint32_t any[kMaxRawWords], all[kMaxRawWords];  ///< of the rows of a cell
    std::uint32_t before[kMaxRawWords];                  ///< sum of the cells before this word's
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec2i at = cell_rows[b.index()];
    const HullCamera c = cameras[at.x];
    const Index begin = at.y << c.cell_shift, end = begin + (1 << c.cell_shift);
    const Index words = ((c.width_px + 1) >> 5) + 1;  // of padded pixels
    for (Index padded = begin; padded < end && padded < c.height_px + 2; padded += 2) {
      pad_rows(b, s, c, padded);
      b.for_range(words, [&](int j) {
        const bool first = padded == begin;
        s.any[j] = s.row[0][j] | s.row[1][j] | (first ? 0U : s.any[j]);
        s.all[j] = s.row[0][j] & s.row[1][j] & (first ? ~0U : s.all[j]);
      });
      cut_patches(b, s, c, padded);
    }
    sum_cells(b, s, c, cells.data() + c.cells_begin + (at.y + 1) * c.cells_row);
    if (at.y != 0) return;
    b.for_range(c.cells_row, [&](int i) { cells[c.cells_begin + i] = 0; });
  }

  /// Three rows of the mask with its border pixels repeated beyond its ends: padded pixel p is image pixel
  /// p-1.
  template <class Block>
  TACTUS_HD void pad_rows(const Block& b, Shared& s, const HullCamera& c, Index padded) const {
    const Index last = (c.width_px - 1) >> 5;
    const auto image_row = [&](Index i) {
      return raw.data() + c.raw_begin + clamp(padded + i - 1, 0, c.height_px - 1) * c.raw_row_words();
    };
    const std::uint32_t *from0 = image_row(0), *from1 = image_row(1), *from2 = image_row(2);
    // One word more than there are: patches look ahead. All three at once: a GPU waits for them once.
    b.for_range(last + 2, [&](int j) {
      s.row[0][j] = from0[j] << 1 | from0[j - 1] >> 31;
      s.row[1][j] = from1[j] << 1 | from1[j - 1] >> 31;
      s.row[2][j] = from2[j] << 1 | from2[j - 1] >> 31;
    });
    b.for_threads(3, [&](int i) {
      const std::uint32_t* from = image_row(i);
      std::uint32_t* row = s.row[i];
      row[0] = (row[0] & ~1U) | (from[0] & 1U);
      const bool set = (from[last] >> ((c.width_px - 1) & 31) & 1U) != 0;
      const std::uint32_t beyond = ~1U << (c.width_px & 31);  // padded pixel `width` is the last of the image
      std::uint32_t& word = row[c.width_px >> 5];
      word = set ? word | beyond : word & ~beyond;
      if (c.width_px >> 5 == last) row[last + 1] = set ? ~0U : 0U;
    });
  }

  /// Patches read the rows as bytes: patch k starts with byte k.
  template <class Block>
  TACTUS_HD void cut_patches(const Block& b, const Shared& s, const HullCamera& c, Index padded) const {
    std::uint32_t* out = bits.data() + c.bits_begin + (padded >> 1) * c.bits_row_words;
    const auto* row0 = reinterpret_cast<const std::uint8_t*>(s.row[0]);
    const auto* row1 = reinterpret_cast<const std::uint8_t*>(s.row[1]);
    const auto* row2 = reinterpret_cast<const std::uint8_t*>(s.row[2]);
    const auto ten_bits = [](const std::uint8_t* row, int k) {
      return std::uint32_t{row[k]} | (row[k + 1] & 3U) << 8;
    };
    b.for_range(((c.width_px + 1) >> 3) + 1, [&](int k) {
      out[k] =
          ten_bits(row0, k) | ten_bits(row1, k) << kPatchRowBits | ten_bits(row2, k) << 2 * kPatchRowBits;
    });
  }

  /// Sums a row of cells, a word of 32 pixels at a time: its cells' flags are spread a cell apart, and one
  /// multiplication makes their running sums.
  template <class Block>
  TACTUS_HD void sum_cells(const Block& b, Shared& s, const HullCamera& c, std::uint32_t* out) const {
    const int shift = c.cell_shift, cell_px = 1 << shift;
    const Index cells_per_word = 32 / cell_px, words = ceil_div(c.cells_width, cells_per_word);
    // A one at the first pixel of every cell; cells are 4, 8 or 16 pixels wide, so a sum fits in a cell's
    // bits.
    const std::uint32_t ones = ~0U / ((1U << cell_px) - 1U), last_cell = 32 - cell_px;
    const auto flags = [&](std::uint32_t pixels) {
      for (int reach = 1; reach < cell_px; reach *= 2) pixels |= pixels >> reach;
      return pixels & ones;
    };
    b.for_range(words, [&](int word) {
      s.any[word] = flags(s.any[word]) * ones;
      s.all[word] = flags(~s.all[word]) * ones;
      s.before[word] = s.any[word] >> last_cell | s.all[word] >> last_cell << 16;
    });
    b.on_one_thread([&] {
      std::uint32_t sum = 0;
      for (Index word = 0; word < words; ++word) {
        const std::uint32_t here = s.before[word];
        s.before[word] = sum;
        sum += here;
      }
      out[0] = 0;
    });
    if (shift == 2) spread_sums<8>(b, s, words, out + 1);
    if (shift == 3) spread_sums<4>(b, s, words, out + 1);
    if (shift == 4) spread_sums<2>(b, s, words, out + 1);
  }

  template <int kCells, class Block>
  TACTUS_HD static void spread_sums(const Block& b, const Shared& s, Index words, std::uint32_t* out) {
    constexpr int kCellPx = 32 / kCells;
    constexpr std::uint32_t kSum = (1U << kCellPx) - 1U;
    b.template for_groups<kCells>(
        words, [](int) { return true; },
        [&](int word, int t) {
          const int at = t * kCellPx;
          out[word * kCells + t] =
              s.before[word] + (s.any[word] >> at & kSum) + ((s.all[word] >> at & kSum) << 16);
        });
  }
};

/// Sums the rows downwards. One block is 32 columns of one camera, each cut into strips that are summed side
/// by side.
struct SumCellColumns {
  View<const HullCamera> cameras;
  View<const Vec2i> columns;  ///< (camera, first column)
  View<std::uint32_t> cells;

  static constexpr int kColumns = 32, kStrips = 16, kThreads = kColumns * kStrips;
  struct Shared {
    std::uint32_t sum[kStrips][kColumns];
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec2i at = columns[b.index()];
    const HullCamera c = cameras[at.x];
    std::uint32_t* table = cells.data() + c.cells_begin + at.y;
    const Index strip_rows = ceil_div(c.cells_height + 1, kStrips);
    const auto all = [](int) { return true; };
    const auto each_row_of_strips = [&](auto&& f) {
      for (Index i = 0; i < strip_rows; ++i) {
        b.template for_own_groups<kColumns>(kStrips, all, [&](int strip, int t) {
          const Index r = strip * strip_rows + i;
          if (r <= c.cells_height) f(s.sum[strip][t], table[r * c.cells_row + t]);
        });
      }
    };
    b.template for_own_groups<kColumns>(kStrips, all, [&](int strip, int t) { s.sum[strip][t] = 0; });
    each_row_of_strips([](std::uint32_t& sum, std::uint32_t& cell) { sum += cell; });
    b.barrier();
    b.for_threads(kColumns, [&](int t) {
      std::uint32_t before = 0;
      for (auto& strip : s.sum) {
        const std::uint32_t here = strip[t];
        strip[t] = before;
        before += here;
      }
    });
    each_row_of_strips([](std::uint32_t& sum, std::uint32_t& cell) { cell = sum += cell; });
  }
};

/// Makes the windows: a block is one row of them.
struct PrepareWindows {
  View<const HullCamera> cameras;
  View<const std::uint32_t> raw;
  View<const Vec2i> rows;     ///< (camera, row), one per block
  View<std::uint32_t> cells;  ///< the windows lie among them

  static constexpr int kThreads = 64;
  static constexpr int kGrain = 16;
  struct Shared {
    /// OR and AND of the rows of a window, for both sizes; one word more than a row has: windows look ahead.
    std::uint32_t any[2][PrepareSilhouettes::kMaxRawWords + 1], all[2][PrepareSilhouettes::kMaxRawWords + 1];
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec2i at = rows[b.index()];
    const HullCamera c = cameras[at.x];
    const Index words = c.raw_row_words(), last = words - 1;
    const std::uint32_t beyond = (c.width_px & 31) == 0 ? 0U : ~0U << (c.width_px & 31);
    b.for_range(words, [&](int j) {
      std::uint32_t any = 0, all = ~0U;
      for (Index i = 0; i < kLargestWindow; ++i) {
        const std::uint32_t word = raw[c.raw_begin + min(at.y + i, c.height_px - 1) * words + j];
        any |= word;
        all &= word;
        if (i == kSmallWindow - 1) {
          s.any[0][j] = any;
          s.all[0][j] = all;
        }
      }
      s.any[1][j] = any;
      s.all[1][j] = all;
    });
    // Beyond the image there is nothing that could speak against a window.
    b.for_threads(2, [&](int size) {
      s.any[size][last] &= ~beyond;
      s.all[size][last] |= beyond;
      s.any[size][words] = 0;
      s.all[size][words] = ~0U;
    });
    write(b, s.any[0], s.all[0], c.windows_begin + at.y * c.windows_row(), kSmallWindow, words);
    write(b, s.any[1], s.all[1], c.windows_begin + (c.height_px + at.y) * c.windows_row(), kLargestWindow,
          words);
  }

 private:
  template <class Block>
  TACTUS_HD void write(const Block& b, const std::uint32_t* any, const std::uint32_t* all, Index begin,
                       Index window, Index words) const {
    const auto spread = [window](std::uint64_t pixels) {
      for (Index reach = 1; reach < window; reach *= 2) pixels |= pixels >> reach;
      return pixels;
    };
    b.for_range(words, [&](int j) {
      const std::uint64_t set = spread(any[j] | std::uint64_t{any[j + 1]} << 32);
      const std::uint64_t clear = spread(~(all[j] | std::uint64_t{all[j + 1]} << 32));
      const auto low = static_cast<std::uint32_t>(set), high = static_cast<std::uint32_t>(clear);
      cells[begin + 2 * j] = (low & 0xFFFFU) | high << 16;
      cells[begin + 2 * j + 1] = low >> 16 | (high & 0xFFFF0000U);
    });
  }
};

/// State of a box of nodes in an image; mixed when neither.
struct Footprint {
  bool outside, inside;
};
/// The same as bits. (A struct in a loop that does not vectorise it away costs the loop its vectors.)
inline constexpr std::uint32_t kInsideFootprint = 1, kOutsideFootprint = 2;

/// a where the mask has ones, b elsewhere. A choice with ?: becomes a branch when there are several, and then
/// no loop vectorises.
template <class T>
TACTUS_HD constexpr T select_bits(T mask, T a, T b) {
  return b ^ ((a ^ b) & mask);
}

/// Where the camera sees a box of nodes with this centre and these half extents (padded node units),
/// conservatively. Seen in part: never outside; inside only when the seen part is all set (method: "Extended
/// voxel visual hull"). Without branches, like the sample.
TACTUS_HD TACTUS_ALWAYS_INLINE inline std::uint32_t classify_footprint(const HullCamera& c,
                                                                       const std::uint32_t* cells,
                                                                       Vec3f center, float half) {
  const auto reach = [half](Vec3f row) { return half * (abs(row.x) + abs(row.y) + abs(row.z)); };
  const Vec3f h = project_node(c, center);
  const float depth_reach = reach(c.row[2]), nearest = h.z - depth_reach;
  const bool behind = h.z + depth_reach <= 1e-6F, in_front = nearest > 1e-6F * depth_reach;
  const float z = in_front ? h.z : 1.F, inverse_nearest = 1.F / (in_front ? nearest : 1.F);
  const float u = h.x / z, v = h.y / z;
  // |u(p) - u| <= |(row0 - u row2) . d| / z(p); 0.02 px cover the rounding of both.
  const float du = fma(reach(c.row[0] - u * c.row[2]), inverse_nearest, 0.02F);
  const float dv = fma(reach(c.row[1] - v * c.row[2]), inverse_nearest, 0.02F);
  const float u_end = static_cast<float>(c.width_px) - 0.5F, v_end = static_cast<float>(c.height_px) - 0.5F;
  const float u0 = clamp(u - du, -0.5F, u_end), u1 = clamp(u + du, -0.5F, u_end);
  const float v0 = clamp(v - dv, -0.5F, v_end), v1 = clamp(v + dv, -0.5F, v_end);
  const bool unseen = (u + du < -0.5F) | (u - du > u_end) | (v + dv < -0.5F) | (v - dv > v_end);
  const bool whole = (u0 == u - du) & (u1 == u + du) & (v0 == v - dv) & (v1 == v + dv);
  // Pixels that bilinear samples in the footprint read, as padded pixels: of cells, or of the image.
  const Index px0 = static_cast<Index>(u0 + 1.F), px1 = static_cast<Index>(u1 + 1.F) + 1;
  const Index py0 = static_cast<Index>(v0 + 1.F), py1 = static_cast<Index>(v1 + 1.F) + 1;
  const Index x0 = max(px0 - 1, 0), x1 = min(px1 - 1, c.width_px - 1);
  const Index y0 = max(py0 - 1, 0), y1 = min(py1 - 1, c.height_px - 1);
  const Index span = max(x1 - x0, y1 - y0) + 1;
  // All ones or zeros. Comparisons would become branches again.
  const Index is_small = ~((2 * kLargestWindow - span) >> 31 | c.windows_begin >> 31);
  const Index is_large = (2 * kSmallWindow - span) >> 31;
  // Two windows along each axis cover the span: one begins where it begins, one ends where it ends.
  const Index window = select_bits(is_large, kLargestWindow, kSmallWindow);
  const Index right = max(x0, x1 - window + 1), lower = max(y0, y1 - window + 1);
  const Index plane = c.windows_begin + (is_large & (c.height_px * c.windows_row()));
  const Index top = select_bits(is_small, plane + y0 * c.windows_row(),
                                c.cells_begin + (py0 >> c.cell_shift) * c.cells_row);
  const Index bottom = select_bits(is_small, plane + lower * c.windows_row(),
                                   c.cells_begin + ((py1 >> c.cell_shift) + 1) * c.cells_row);
  const Index first = select_bits(is_small, x0 >> 4, px0 >> c.cell_shift);
  const Index last = select_bits(is_small, right >> 4, (px1 >> c.cell_shift) + 1);
  const std::uint32_t a = cells[top + first], b = cells[top + last], d = cells[bottom + first],
                      e = cells[bottom + last];
  const std::uint32_t held = ((a | d) >> (x0 & 15) | (b | e) >> (right & 15)) & 0x10001U;
  const std::uint32_t counts = select_bits(static_cast<std::uint32_t>(is_small), held, e - b - d + a);
  const bool outside = in_front & whole & ((counts & 0xFFFFU) == 0);
  const bool inside = behind | (in_front & (unseen | (counts >> 16 == 0)));
  return static_cast<std::uint32_t>(inside) * kInsideFootprint |
         static_cast<std::uint32_t>(outside) * kOutsideFootprint;
}

}  // namespace tactus
