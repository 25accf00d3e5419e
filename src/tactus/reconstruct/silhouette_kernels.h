#pragma once
/// Silhouettes on the device: words of overlapping patches of bits that answer a bilinear sample in one read,
/// and a summed-area table of "any pixel set" / "any pixel clear" cells that answers "all set, all clear or
/// mixed?" for any rectangle in four.
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
  Index raw_begin, raw_row_words;    ///< the mask as it came: 32 pixels a word
  Index bits_begin, bits_row_words;  ///< patches (kPatch...) of the padded mask; two rows of pixels a row
  Index cells_begin, cells_width, cells_height, cells_row,
      cell_shift;  ///< summed-area table; a cell is 2^shift pixels wide
};

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
      return raw.data() + c.raw_begin + clamp(padded + i - 1, 0, c.height_px - 1) * c.raw_row_words;
    };
    for (Index i = 0; i < 3; ++i) {
      const std::uint32_t* from = image_row(i);
      // One word more than there are: patches look ahead.
      b.for_range(last + 2, [&](int j) { s.row[i][j] = from[j] << 1 | from[j - 1] >> 31; });
    }
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

  static constexpr int kColumns = 32, kStrips = 8, kThreads = kColumns * kStrips;
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

/// What a silhouette says of a box of nodes; mixed when neither.
struct Footprint {
  bool outside, inside;
};

/// Where the camera sees a box of nodes with this centre and these half extents (padded node units),
/// conservatively. Seen in part: never outside; inside only when what is seen is all set (method: "Extended
/// voxel visual hull"). Without branches, like the sample.
TACTUS_HD inline Footprint classify_footprint(const HullCamera& c, const std::uint32_t* cells, Vec3f center,
                                              float half) {
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
  // Pixels that bilinear samples in the footprint read, as padded pixels, then cells.
  const Index x0 = static_cast<Index>(u0 + 1.F) >> c.cell_shift,
              x1 = ((static_cast<Index>(u1 + 1.F) + 1) >> c.cell_shift) + 1;
  const Index y0 = static_cast<Index>(v0 + 1.F) >> c.cell_shift,
              y1 = ((static_cast<Index>(v1 + 1.F) + 1) >> c.cell_shift) + 1;
  const Index top = c.cells_begin + y0 * c.cells_row, bottom = c.cells_begin + y1 * c.cells_row;
  const std::uint32_t sum = cells[bottom + x1] - cells[top + x1] - cells[bottom + x0] + cells[top + x0];
  const bool outside = in_front & whole & ((sum & 0xFFFFU) == 0);
  const bool inside = behind | (in_front & (unseen | (sum >> 16 == 0)));
  return {outside, inside};
}

}  // namespace tactus
