#pragma once
/// Silhouettes on the device: padded bit rows that answer a bilinear sample in two reads, and a summed-area
/// table of "any pixel set" / "any pixel clear" cells that answers "all set, all clear or mixed?" for any
/// rectangle in four.
#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"

namespace tactus {

/// Rows of bits and cells are as long as whole passes of this many lanes, so that no lane needs a guard.
inline constexpr Index kMaskLanes = 32;

/// One camera as the hull sees it: projects *padded node indices* of the grid (not metres) to pixels, and
/// says where its silhouette lies in the shared arrays.
struct HullCamera {
  /// u_px = (row[0] . (x,y,z,1)) / (row[2] . (x,y,z,1)), v_px likewise with row[1].
  Vec3f row[3];
  float offset[3];
  Index width_px, height_px;
  Index raw_begin, raw_row_words;    ///< the mask as it came: 32 pixels a word
  Index bits_begin, bits_row_words;  ///< padded rows: word k of a row holds padded pixels 16k .. 16k+31
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
  const Index word = c.bits_begin + r * c.bits_row_words + (s >> 4);
  const std::uint32_t top = bits[word] >> (s & 15), bottom = bits[word + c.bits_row_words] >> (s & 15);
  const auto bit = [](std::uint32_t w, int i) { return static_cast<float>(static_cast<Index>(w >> i & 1U)); };
  const float t = fma(fu, bit(top, 1) - bit(top, 0), bit(top, 0)),
              b = fma(fu, bit(bottom, 1) - bit(bottom, 0), bit(bottom, 0));
  return max(fma(fv, b - t, t) - 0.5F, at_least);
}

/// Widens the rows of all masks and sums them up along the rows of cells: one block is one row of cells. A
/// cell counts 1 in its low half when any of its pixels is set, and 1 in its high half when any is clear.
/// Column 0 and row 0 of the table are 0. Reads a word on either side of each raw row.
struct PrepareSilhouettes {
  View<const HullCamera> cameras;
  View<const std::uint32_t> raw;
  View<const Vec2i> cell_rows;  ///< (camera, cell row), one per block
  View<std::uint32_t> bits, cells;

  static constexpr int kThreads = kMaskLanes;
  static constexpr int kGrain = 16;
  static constexpr Index kMaxCells = 1024, kMaxRawWords = 512;
  struct Shared {
    std::uint32_t any[2][kMaxRawWords], all[2][kMaxRawWords];  ///< of the rows of a cell: even and odd words
    std::uint32_t value[kMaxCells];
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec2i at = cell_rows[b.index()];
    const HullCamera c = cameras[at.x];
    const Index begin = at.y << c.cell_shift, end = min(begin + (1 << c.cell_shift), c.height_px + 2);
    for (Index padded = begin; padded < end; ++padded) pad_row(b, s, c, padded, padded == begin);
    sum_cells(b, s, c, cells.data() + c.cells_begin + (at.y + 1) * c.cells_row);
    if (at.y != 0) return;
    for (Index first = 0; first < c.cells_row; first += 8) {
      b.for_threads(8, [&](int t) { cells[c.cells_begin + first + t] = 0; });
    }
  }

  template <class Block>
  TACTUS_HD void pad_row(const Block& b, Shared& s, const HullCamera& c, Index padded,
                         bool first_of_cell) const {
    const Index y = clamp(padded - 1, 0, c.height_px - 1);
    const std::uint32_t* row = raw.data() + c.raw_begin + y * c.raw_row_words;
    std::uint32_t* out = bits.data() + c.bits_begin + padded * c.bits_row_words;
    const auto put = [&](Index j, std::uint32_t even, std::uint32_t odd) {
      out[2 * j] = even;
      out[2 * j + 1] = odd;
      s.any[0][j] = even | (first_of_cell ? 0U : s.any[0][j]);
      s.any[1][j] = odd | (first_of_cell ? 0U : s.any[1][j]);
      s.all[0][j] = even & (first_of_cell ? ~0U : s.all[0][j]);
      s.all[1][j] = odd & (first_of_cell ? ~0U : s.all[1][j]);
    };
    // Word k holds padded pixels 16k..16k+31: image pixels 16k-1..16k+30.
    const Index last = (c.width_px - 1) >> 5;
    for (Index first = 0; first < last; first += kThreads) {
      b.for_each_thread([&](int t) {
        const Index j = first + t;
        const std::uint32_t before = j == 0 ? row[0] << 31 : row[j - 1];
        put(j, before >> 31 | row[j] << 1, row[j] >> 15 | row[j + 1] << 17);
      });
    }
    // The last words repeat the last pixel of the image.
    const bool last_pixel = (row[last] >> ((c.width_px - 1) & 31) & 1U) != 0;
    const auto repeat_last = [last_pixel](std::uint32_t word, Index valid) {
      const std::uint32_t beyond = valid >= 32 ? 0U : ~0U << clamp(valid, 0, 31);
      return last_pixel ? word | beyond : word & ~beyond;
    };
    b.for_threads(2, [&](int t) {
      const Index j = last + t;
      const std::uint32_t before = j == 0 ? row[0] << 31 : row[j - 1], word = row[j];
      put(j, repeat_last(before >> 31 | word << 1, c.width_px + 1 - 32 * j),
          repeat_last(word >> 15 | row[j + 1] << 17, c.width_px - 15 - 32 * j));
    });
  }

  template <class Block>
  TACTUS_HD void sum_cells(const Block& b, Shared& s, const HullCamera& c, std::uint32_t* out) const {
    const Index shift = c.cell_shift;
    const std::uint32_t wanted =
        (1U << (1 << shift)) - 1U;  // pixels beyond the image repeat the last: no special case
    for (Index first = 0; first < c.cells_width; first += kThreads) {
      b.for_each_thread([&](int t) {
        const Index cell = first + t, pixel = cell << shift, word = pixel >> 4;
        const std::uint32_t any = s.any[word & 1][word >> 1] >> (pixel & 15),
                            all = s.all[word & 1][word >> 1] >> (pixel & 15);
        s.value[cell] = ((any & wanted) != 0 ? 1U : 0U) | ((~all & wanted) != 0 ? 1U << 16 : 0U);
      });
    }
    b.on_one_thread([&] {
      std::uint32_t sum = 0;
      for (Index cell = 0; cell < c.cells_width; ++cell) s.value[cell] = sum += s.value[cell];
      out[0] = 0;
    });
    for (Index first = 0; first < c.cells_width; first += kThreads) {
      b.for_each_thread([&](int t) { out[first + t + 1] = s.value[first + t]; });
    }
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
    b.template for_groups<kColumns>(kStrips, all, [&](int strip, int t) {
      const Index end = min((strip + 1) * strip_rows, c.cells_height + 1);
      std::uint32_t sum = 0;
      for (Index r = strip * strip_rows; r < end; ++r) sum += table[r * c.cells_row + t];
      s.sum[strip][t] = sum;
    });
    b.template for_groups<kColumns>(kStrips, all, [&](int strip, int t) {
      const Index end = min((strip + 1) * strip_rows, c.cells_height + 1);
      std::uint32_t sum = 0;
      for (int before = 0; before < strip; ++before) sum += s.sum[before][t];
      for (Index r = strip * strip_rows; r < end; ++r)
        table[r * c.cells_row + t] = sum += table[r * c.cells_row + t];
    });
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
