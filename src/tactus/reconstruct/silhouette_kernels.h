#pragma once
/// Silhouettes on the device: padded bit rows that answer a bilinear sample in two reads, and a summed-area
/// table of "any pixel set" / "any pixel clear" cells that answers "all set, all clear or mixed?" for any
/// rectangle in four.
#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"

namespace tactus {

/// One camera as the hull sees it: projects *padded node indices* of the grid (not metres) to pixels, and
/// says where its silhouette lies in the shared arrays.
struct HullCamera {
  /// u_px = (row[0] . (x,y,z,1)) / (row[2] . (x,y,z,1)), v_px likewise with row[1].
  Vec3f row[3];
  float offset[3];
  Index width_px, height_px;
  Index raw_begin, raw_row_words;    ///< the mask as it came: 32 pixels a word
  Index bits_begin, bits_row_words;  ///< padded rows: word k of a row holds padded pixels 16k .. 16k+31
  Index cells_begin, cells_width, cells_height,
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
  const bool visible = in_front & (u >= -0.5F) & (u <= u_max) & (v >= -0.5F) & (v <= v_max);
  // Padded pixel s is image pixel s-1; the border pixels are repeated once on each side.
  const float us = (visible ? u : 0.F) + 1.F, vs = (visible ? v : 0.F) + 1.F;
  const Index s = static_cast<Index>(us), r = static_cast<Index>(vs);
  const float fu = us - static_cast<float>(s), fv = vs - static_cast<float>(r);
  const Index word = c.bits_begin + r * c.bits_row_words + (s >> 4);
  const std::uint32_t top = bits[word] >> (s & 15), bottom = bits[word + c.bits_row_words] >> (s & 15);
  const float t0 = static_cast<float>(static_cast<Index>(top & 1U)),
              t1 = static_cast<float>(static_cast<Index>(top >> 1 & 1U));
  const float b0 = static_cast<float>(static_cast<Index>(bottom & 1U)),
              b1 = static_cast<float>(static_cast<Index>(bottom >> 1 & 1U));
  const float t = fma(fu, t1 - t0, t0), b = fma(fu, b1 - b0, b0);
  return visible ? fma(fv, b - t, t) - 0.5F : 0.5F;
}

/// Widens the rows of all masks: one index is one word of one padded row.
struct PadSilhouettes {
  View<const HullCamera> cameras;
  View<const std::uint32_t> raw;
  View<const Vec2i> rows;  ///< (camera, padded row), one per block
  View<std::uint32_t> bits;

  static constexpr int kThreads = 64;
  static constexpr int kGrain = 32;
  struct Shared {};

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Vec2i at = rows[b.index()];
    const HullCamera& c = cameras[at.x];
    const Index y = clamp(at.y - 1, 0, c.height_px - 1);
    const std::uint32_t* row = raw.data() + c.raw_begin + y * c.raw_row_words;
    std::uint32_t* out = bits.data() + c.bits_begin + at.y * c.bits_row_words;
    const std::uint32_t last = row[(c.width_px - 1) >> 5] >> ((c.width_px - 1) & 31) & 1U;
    for (Index first = 0; first < c.bits_row_words; first += kThreads) {
      b.for_each_thread([&](int t) {
        const Index k = first + t;
        if (k >= c.bits_row_words) return;
        // Padded pixels 16k..16k+31 are image pixels 16k-1..16k+30: one word, funnelled from two.
        const Index low = k / 2 - ((k & 1) == 0 ? 1 : 0);
        const std::uint32_t a = low >= 0 && low < c.raw_row_words ? row[low] : (low < 0 ? row[0] << 31 : 0U);
        const std::uint32_t d = low + 1 < c.raw_row_words ? row[low + 1] : 0U;
        const int shift = (k & 1) == 0 ? 31 : 15;
        std::uint32_t word = a >> shift | d << (32 - shift);
        const Index valid =
            c.width_px + 1 - 16 * k;  // padded pixels from here on repeat the last image pixel
        if (valid < 32) {
          const std::uint32_t beyond = valid <= 0 ? ~0U : ~0U << valid;
          word = (word & ~beyond) | (last != 0 ? beyond : 0U);
        }
        out[k] = word;
      });
    }
  }
};

/// One row of cells: low half of a cell: 1 when any of its pixels is set; high half: 1 when any is clear;
/// summed along the row. Column 0 and row 0 of the table stay 0.
struct SumCellRows {
  View<const HullCamera> cameras;
  View<const std::uint32_t> bits;
  View<const Vec2i> rows;  ///< (camera, cell row), one per block
  View<std::uint32_t> cells;

  static constexpr int kThreads = 64;
  static constexpr int kGrain = 8;
  static constexpr Index kMaxCells = 1024;
  struct Shared {
    std::uint32_t value[kMaxCells];
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec2i at = rows[b.index()];
    const HullCamera& c = cameras[at.x];
    const Index size = 1 << c.cell_shift;
    const Index row_begin = at.y * size, row_end = min(row_begin + size, c.height_px + 2);
    for (Index first = 0; first < c.cells_width; first += kThreads) {
      b.for_each_thread([&](int t) {
        const Index cell = first + t;
        if (cell >= c.cells_width) return;
        const Index pixel = cell << c.cell_shift;
        const Index count = min(size, c.width_px + 2 - pixel);
        const std::uint32_t wanted = (1U << count) - 1U;  // a cell is at most 16 pixels wide
        const std::uint32_t* word = bits.data() + c.bits_begin + row_begin * c.bits_row_words + (pixel >> 4);
        std::uint32_t any = 0, all = ~0U;
        for (Index r = row_begin; r < row_end; ++r, word += c.bits_row_words) {
          any |= *word >> (pixel & 15);
          all &= *word >> (pixel & 15);
        }
        s.value[cell] = ((any & wanted) != 0 ? 1U : 0U) | ((all & wanted) != wanted ? 1U << 16 : 0U);
      });
    }
    b.for_each_thread([&](int t) {
      if (t != 0) return;
      std::uint32_t sum = 0;
      for (Index cell = 0; cell < c.cells_width; ++cell) s.value[cell] = sum += s.value[cell];
    });
    std::uint32_t* out = cells.data() + c.cells_begin + (at.y + 1) * (c.cells_width + 1);
    for (Index first = 0; first <= c.cells_width; first += kThreads) {
      b.for_each_thread([&](int t) {
        const Index cell = first + t;
        if (cell > c.cells_width) return;
        out[cell] = cell == 0 ? 0U : s.value[cell - 1];
        if (at.y == 0) out[cell - (c.cells_width + 1)] = 0;
      });
    }
  }
};

/// Sums the rows downwards. One block is 32 columns of one camera.
struct SumCellColumns {
  View<const HullCamera> cameras;
  View<const Vec2i> columns;  ///< (camera, first column)
  View<std::uint32_t> cells;

  static constexpr int kThreads = 32;
  struct Shared {};

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Vec2i at = columns[b.index()];
    const HullCamera& c = cameras[at.x];
    b.for_each_thread([&](int t) {
      const Index column = at.y + t;
      if (column > c.cells_width) return;
      std::uint32_t* cell = cells.data() + c.cells_begin + column;
      std::uint32_t sum = 0;
      for (Index r = 0; r <= c.cells_height; ++r, cell += c.cells_width + 1) *cell = sum += *cell;
    });
  }
};

/// What a silhouette says of a box of nodes.
enum class Footprint : std::uint8_t { outside, inside, mixed };

/// Where the camera sees a box of nodes with this centre and these half extents (padded node units),
/// conservatively. Seen in part: never outside; inside only when what is seen is all set (method: "Extended
/// voxel visual hull").
TACTUS_HD inline Footprint classify_footprint(const HullCamera& c, const std::uint32_t* cells, Vec3f center,
                                              Vec3f half) {
  const auto reach = [half](Vec3f row) {
    return abs(row.x) * half.x + abs(row.y) * half.y + abs(row.z) * half.z;
  };
  const Vec3f h = project_node(c, center);
  const float depth_reach = reach(c.row[2]);
  if (h.z + depth_reach <= 1e-6F) return Footprint::inside;  // wholly behind the camera: it knows nothing
  const float nearest = h.z - depth_reach;
  if (nearest <= 1e-6F * depth_reach) return Footprint::mixed;
  const float u = h.x / h.z, v = h.y / h.z;
  // |u(p) - u| <= |(row0 - u row2) . d| / z(p); 0.02 px cover the rounding of both.
  const float du = reach(c.row[0] - u * c.row[2]) / nearest + 0.02F;
  const float dv = reach(c.row[1] - v * c.row[2]) / nearest + 0.02F;
  const float u_end = static_cast<float>(c.width_px) - 0.5F, v_end = static_cast<float>(c.height_px) - 0.5F;
  if (u + du < -0.5F || u - du > u_end || v + dv < -0.5F || v - dv > v_end)
    return Footprint::inside;  // not seen
  const bool in_part = u - du < -0.5F || u + du > u_end || v - dv < -0.5F || v + dv > v_end;
  // Pixels that bilinear samples in the footprint read, as padded pixels, then cells.
  const Index x0 = static_cast<Index>(max(u - du, -0.5F) + 1.F) >> c.cell_shift;
  const Index x1 = ((static_cast<Index>(min(u + du, u_end) + 1.F) + 1) >> c.cell_shift) + 1;
  const Index y0 = static_cast<Index>(max(v - dv, -0.5F) + 1.F) >> c.cell_shift;
  const Index y1 = ((static_cast<Index>(min(v + dv, v_end) + 1.F) + 1) >> c.cell_shift) + 1;
  const std::uint32_t* table = cells + c.cells_begin;
  const Index stride = c.cells_width + 1;
  const std::uint32_t sum =
      table[y1 * stride + x1] - table[y0 * stride + x1] - table[y1 * stride + x0] + table[y0 * stride + x0];
  if (sum >> 16 == 0) return Footprint::inside;
  return (sum & 0xFFFFU) == 0 && !in_part ? Footprint::outside : Footprint::mixed;
}

}  // namespace tactus
