#pragma once
/// Colours of a surface from photographs: a depth map per camera decides visibility, then every vertex takes
/// its colour from the cameras that look most like the viewer (Shao et al. 2019, "Texture mapping"; weights
/// after Buehler et al. 2001, "Unstructured lumigraph rendering").
#include "tactus/base/vec.h"
#include "tactus/compute/atomic.h"
#include "tactus/compute/kernel.h"
#include "tactus/geom/camera/camera_bits.h"
#include "tactus/geom/camera/photo_choice.h"
#include "tactus/geom/image/image.h"

namespace tactus {

/// A camera as the texture sees it: world metres to pixels, and where its depth map and photo lie.
struct TextureCamera {
  /// u_px = (row[0] . (p,1)) / (row[2] . (p,1)), v_px likewise with row[1]; row[2] . (p,1) is z [m].
  Vec3f row[3];
  float offset[3];
  Vec3f eye_m, axis;  ///< world
  Index width_px, height_px;
  Index photo_begin;
  Index map_begin, map_width, map_height;
  float texels_per_px;  ///< texel (i, j) of the map is centred on pixel (i, j) / texels_per_px

  TACTUS_HD Vec3f project(Vec3f p_m) const {
    return {dot(row[0], p_m) + offset[0], dot(row[1], p_m) + offset[1], dot(row[2], p_m) + offset[2]};
  }
};

/// Vectors of a block's threads, component by component, so that loops over threads vectorise.
template <int kThreads>
struct VectorLanes {
  float x[kThreads], y[kThreads], z[kThreads];
  TACTUS_HD Vec3f operator[](int t) const { return {x[t], y[t], z[t]}; }
  TACTUS_HD void set(int t, Vec3f v) {
    x[t] = v.x;
    y[t] = v.y;
    z[t] = v.z;
  }
  template <class Block>
  TACTUS_HD void load(const Block& b, View<const Vec3f> from, Index first, int count) {
    b.for_own(count, [&](int t) {
      x[t] = from[first + t].x;
      y[t] = from[first + t].y;
      z[t] = from[first + t].z;
    });
  }
};

/// Draws the vertices that face away from each camera into its map: the largest 1/z of every texel, as bits.
/// A point that faces the camera is hidden where something has its far side before it; its own body's far
/// side is behind it, so the map never shades the surface it was made of. A texel is about as wide as the
/// mesh's edges: once widened, the map has no holes between neighbouring vertices.
struct DrawDepthMaps {
  View<const TextureCamera> cameras;
  View<const Vec3f> positions_m, normals;
  Count vertex_count;
  View<std::uint32_t> maps;

  static constexpr int kThreads = 128;
  static constexpr int kGrain = 2;
  static constexpr float kNear_m = 1e-3F;
  struct Shared {
    VectorLanes<kThreads> p, n;
    Index texel[kThreads];
    std::uint32_t inverse_z[kThreads];
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index first = b.index() * kThreads, total = vertex_count.get();
    if (first >= total) return;
    const int count = min(total - first, Index{kThreads});
    s.p.load(b, positions_m, first, count);
    s.n.load(b, normals, first, count);
    for (Index c = 0; c < cameras.size(); ++c) {
      const TextureCamera camera = cameras[c];
      b.for_own(count, [&](int t) {
        const Vec3f p = s.p[t], h = camera.project(p);
        const bool in_front = h.z > kNear_m;
        const float inverse_z = 1.F / (in_front ? h.z : 1.F), scale = camera.texels_per_px * inverse_z;
        const float x = h.x * scale + 0.5F, y = h.y * scale + 0.5F;
        const bool inside = (x >= 0.F) & (y >= 0.F) & (x < static_cast<float>(camera.map_width)) &
                            (y < static_cast<float>(camera.map_height));
        const bool away = dot(s.n[t], camera.eye_m - p) < 0.F;
        const bool draws = in_front & inside & away;
        const Index at =
            static_cast<Index>(draws ? y : 0.F) * camera.map_width + static_cast<Index>(draws ? x : 0.F);
        s.texel[t] = draws ? camera.map_begin + at : -1;
        s.inverse_z[t] = std::bit_cast<std::uint32_t>(inverse_z);
      });
      b.for_own(count, [&](int t) {
        if (s.texel[t] >= 0) atomic_max(maps[s.texel[t]], s.inverse_z[t]);
      });
    }
  }
};

/// Widens the surfaces in the maps by a texel on every side, so that a texel is open only where nothing near
/// it hides. One block is one row of one map.
struct WidenDepthMaps {
  View<const TextureCamera> cameras;
  View<const Vec2i> rows;  ///< (camera, row of its map)
  View<const std::uint32_t> drawn;
  View<std::uint32_t> maps;

  static constexpr int kThreads = 64;
  static constexpr int kGrain = 32;
  struct Shared {};
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Vec2i at = rows[b.index()];
    const TextureCamera c = cameras[at.x];
    const std::uint32_t* row = drawn.data() + c.map_begin + at.y * c.map_width;
    const std::uint32_t *above = at.y > 0 ? row - c.map_width : row,
                        *below = at.y + 1 < c.map_height ? row + c.map_width : row;
    std::uint32_t* out = maps.data() + c.map_begin + at.y * c.map_width;
    for (Index first = 0; first < c.map_width; first += kThreads) {
      b.for_own(min(c.map_width - first, Index{kThreads}), [&](int t) {
        const Index x = first + t, left = max(x - 1, 0), right = min(x + 1, c.map_width - 1);
        const auto column = [&](Index i) { return max(row[i], max(above[i], below[i])); };
        out[x] = max(column(x), max(column(left), column(right)));
      });
    }
  }
};

/// Sets the lowest bit of texels within about a texel of the body's outline, and beyond it: a photo there
/// shows the wall, too. (The lowest bit of 1/z is worth 1e-7 of it.) One block is one row of one map.
struct MarkOutlines {
  View<const TextureCamera> cameras;
  View<const Vec2i> rows;  ///< (camera, row of its map)
  View<const std::uint32_t> widened;
  View<std::uint32_t> maps;

  static constexpr int kThreads = 64;
  static constexpr int kGrain = 32;
  static constexpr std::uint32_t kOutline = 1;
  struct Shared {};
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Vec2i at = rows[b.index()];
    const TextureCamera c = cameras[at.x];
    const std::uint32_t* row[5];
    for (Index k = 0; k < 5; ++k)
      row[k] = widened.data() + c.map_begin + clamp(at.y + k - 2, 0, c.map_height - 1) * c.map_width;
    std::uint32_t* out = maps.data() + c.map_begin + at.y * c.map_width;
    for (Index first = 0; first < c.map_width; first += kThreads) {
      b.for_own(min(c.map_width - first, Index{kThreads}), [&](int t) {
        const Index x = first + t, end = c.map_width - 1;
        const auto column = [&](Index i) {
          return min(min(min(row[0][i], row[1][i]), min(row[3][i], row[4][i])), row[2][i]);
        };
        const std::uint32_t least = min(min(min(column(max(x - 2, 0)), column(max(x - 1, 0))),
                                            min(column(min(x + 1, end)), column(min(x + 2, end)))),
                                        column(x));
        out[x] = (row[2][x] & ~kOutline) | (least == 0 ? kOutline : 0U);
      });
    }
  }
};

/// Colour of a vertex and, in the top byte, the number + 1 of the camera that gave most of it; 0: no camera
/// sees it; kFilled: from its neighbours.
struct VertexColor {
  static constexpr std::uint32_t kFilled = 255;
  TACTUS_HD static std::uint32_t pack(std::uint32_t r, std::uint32_t g, std::uint32_t b, std::uint32_t from) {
    return r | g << 8 | b << 16 | from << 24;
  }
  TACTUS_HD static std::uint32_t from(std::uint32_t color) { return color >> 24; }
};

/// How much a camera counts for a point (PhotoChoice has the formula).
struct PhotoScore {
  View<const std::uint32_t> maps;
  float bias_m;  ///< a surface that much nearer hides
  float hard;    ///< 1: seen or not, as for k = 1; 0: fading

  static constexpr float kLeastCosine = PhotoChoice::kLeastCosine, kFullCosine = PhotoChoice::kFullCosine;
  static constexpr float kOutlineWeight = PhotoChoice::kOutlineWeight;
  static constexpr float kEpsilon = PhotoChoice::kEpsilon;

  /// @param n unit normal  @param look unit, from the viewer to the point
  TACTUS_HD float operator()(const TextureCamera& c, Vec3f p, Vec3f n, Vec3f look) const {
    const Vec3f h = c.project(p), to_camera = c.eye_m - p;
    const bool in_front = h.z > 1e-3F;
    const float inverse_z = 1.F / (in_front ? h.z : 1.F);
    const float u = h.x * inverse_z, v = h.y * inverse_z;
    const float u_end = static_cast<float>(c.width_px - 1), v_end = static_cast<float>(c.height_px - 1);
    const float border_px = min(min(u, u_end - u), min(v, v_end - v));
    const float cosine = dot(n, to_camera) / max(tactus::sqrt(dot(to_camera, to_camera)), 1e-6F);
    const float ramp = 1.F / (kFullCosine - kLeastCosine);
    const float facing = clamp((cosine - kLeastCosine) * ramp, 0.F, 1.F);
    const float framed = clamp(border_px * (1.F / PhotoChoice::kBorderPx), 0.F, 1.F);
    const float seen = visibility(c, u, v, h.z);
    const float f = as_float(in_front) * facing * framed * seen;
    const float choice = as_float(f > 0.F) * max(as_float(seen > kOutlineWeight), kOutlineWeight);
    const float fade = fma(hard, choice - f, f);
    return fade / max(1.F - dot(c.axis, look) + kEpsilon, kEpsilon);
  }

 private:
  /// 0 or 1, without a branch: loops over vertices vectorise.
  TACTUS_HD static float as_float(bool b) { return static_cast<float>(static_cast<Index>(b)); }
  /// 1 where the camera sees the point, 0 from about a texel before the surface that hides it. Near the
  /// outline of the body it is almost 0: used where there is nothing better.
  TACTUS_HD float visibility(const TextureCamera& c, float u_px, float v_px, float z_m) const {
    const float x = clamp(u_px * c.texels_per_px, 0.F, static_cast<float>(c.map_width - 2)),
                y = clamp(v_px * c.texels_per_px, 0.F, static_cast<float>(c.map_height - 2));
    const Index i = static_cast<Index>(x), j = static_cast<Index>(y);
    const float fx = x - static_cast<float>(i), fy = y - static_cast<float>(j);
    const float hidden_from = 1.F / max(z_m - bias_m, 1e-3F);
    const Index at = c.map_begin + j * c.map_width + i;
    const std::uint32_t* texels = maps.data();
    const auto open = [&](Index texel) {
      return as_float(std::bit_cast<float>(texels[texel]) <= hidden_from);
    };
    const float open00 = open(at), open10 = open(at + 1), open01 = open(at + c.map_width),
                open11 = open(at + c.map_width + 1);
    const float top = fma(fx, open10 - open00, open00), bottom = fma(fx, open11 - open01, open01);
    const auto inner = [&](Index texel) {
      return static_cast<float>(static_cast<Index>(~texels[texel] & MarkOutlines::kOutline));
    };
    const float inner00 = inner(at), inner10 = inner(at + 1), inner01 = inner(at + c.map_width),
                inner11 = inner(at + c.map_width + 1);
    const float inner_top = fma(fx, inner10 - inner00, inner00),
                inner_bottom = fma(fx, inner11 - inner01, inner01);
    const float inside = clamp(2.F * fma(fy, inner_bottom - inner_top, inner_top) - 1.F, 0.F, 1.F);
    const float within = max(inside, kOutlineWeight);
    return clamp(3.F * fma(fy, bottom - top, top) - 2.F, 0.F, 1.F) * within;
  }
};

/// Colour of every vertex from its best k cameras (PhotoChoice has the formula).
struct ColorVertices {
  View<const TextureCamera> cameras;
  View<const Vec3f> positions_m, normals;
  Count vertex_count;
  PhotoScore score;
  View<const Rgb8> photos;
  CameraBits live;  ///< cameras that have a photo of this tick
  bool has_eye;
  Vec3f eye_m;  ///< of the viewer; without: every point is looked at along its normal
  Index k;
  View<std::uint32_t> colors;

  static constexpr int kThreads = 64;
  struct Shared {
    VectorLanes<kThreads> p, n, look;  ///< look: unit, from the viewer to the point
    float score[kMaxCameras][kThreads];
    float weight[PhotoChoice::kMostBlended][kThreads];  ///< of the best, the next best ...
    Index chosen[PhotoChoice::kMostBlended][kThreads];
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index first = b.index() * kThreads, total = vertex_count.get();
    if (first >= total) return;
    const int count = min(total - first, Index{kThreads});
    s.p.load(b, positions_m, first, count);
    s.n.load(b, normals, first, count);
    b.for_own(count, [&](int t) {
      const Vec3f look = has_eye ? s.p[t] - eye_m : -s.n[t];
      s.look.set(t, (1.F / max(tactus::sqrt(dot(look, look)), 1e-6F)) * look);
    });
    for (Index c = 0; c < cameras.size(); ++c) {
      const TextureCamera camera = cameras[c];
      const float is_live = (live & camera_bit(c)) != 0 ? 1.F : 0.F;
      b.for_own(count, [&](int t) { s.score[c][t] = is_live * score(camera, s.p[t], s.n[t], s.look[t]); });
    }
    for (Index rank = 0; rank < k; ++rank) take_best(b, s, count, rank);
    if (k > 1) subtract_next(b, s, count);
    b.for_own(count, [&](int t) { colors[first + t] = blend(s, t); });
  }

 private:
  /// Moves the highest score of every thread to `rank`; the first of equals wins. Weight 0: there is none.
  template <class Block>
  TACTUS_HD void take_best(const Block& b, Shared& s, int count, Index rank) const {
    b.for_own(count, [&](int t) {
      s.weight[rank][t] = s.score[0][t];
      s.chosen[rank][t] = 0;
    });
    for (Index c = 1; c < cameras.size(); ++c) {
      b.for_own(count, [&](int t) {
        const bool better = s.score[c][t] > s.weight[rank][t];
        s.weight[rank][t] = better ? s.score[c][t] : s.weight[rank][t];
        s.chosen[rank][t] = better ? c : s.chosen[rank][t];
      });
    }
    b.for_own(count, [&](int t) { s.score[s.chosen[rank][t]][t] = 0; });
  }
  template <class Block>
  TACTUS_HD void subtract_next(const Block& b, Shared& s, int count) const {
    for (Index c = 1; c < cameras.size(); ++c)
      b.for_own(count, [&](int t) { s.score[0][t] = max(s.score[0][t], s.score[c][t]); });
    for (Index rank = 0; rank < k; ++rank) {
      // Equals keep a trace of their weight, so that the sum is never 0 where somebody sees.
      b.for_own(count, [&](int t) {
        s.weight[rank][t] = max(s.weight[rank][t] - s.score[0][t], 1e-6F * s.weight[rank][t]);
      });
    }
  }

  TACTUS_HD std::uint32_t blend(const Shared& s, int t) const {
    Vec3f sum{};
    float total = 0;
    for (Index rank = 0; rank < k; ++rank) {
      const float w = s.weight[rank][t];
      if (!(w > 0.F)) break;
      sum += w * photo_at(cameras[s.chosen[rank][t]], s.p[t]);
      total += w;
    }
    if (!(total > 0.F)) return 0;
    const Vec3f mean = (1.F / total) * sum;
    const auto byte = [](float x) { return static_cast<std::uint32_t>(clamp(x + 0.5F, 0.F, 255.F)); };
    return VertexColor::pack(byte(mean.x), byte(mean.y), byte(mean.z),
                             static_cast<std::uint32_t>(s.chosen[0][t] + 1));
  }

  /// Bilinear colour, 0..255.
  TACTUS_HD Vec3f photo_at(const TextureCamera& c, Vec3f p) const {
    const Vec3f h = c.project(p);
    const float u = clamp(h.x / h.z, 0.F, static_cast<float>(c.width_px - 1)),
                v = clamp(h.y / h.z, 0.F, static_cast<float>(c.height_px - 1));
    const Index x = min(static_cast<Index>(u), max(c.width_px - 2, 0)),
                y = min(static_cast<Index>(v), max(c.height_px - 2, 0));
    const float fu = u - static_cast<float>(x), fv = v - static_cast<float>(y);
    const Index at = c.photo_begin + y * c.width_px + x;
    const Index right = c.width_px > 1 ? 1 : 0, below = c.height_px > 1 ? c.width_px : 0;
    const auto color = [&](Index i) {
      const Rgb8 rgb = photos[i];
      return Vec3f{static_cast<float>(rgb.r), static_cast<float>(rgb.g), static_cast<float>(rgb.b)};
    };
    const Vec3f top = color(at) + fu * (color(at + right) - color(at));
    const Vec3f bottom = color(at + below) + fu * (color(at + below + right) - color(at + below));
    return top + fv * (bottom - top);
  }
};

/// Adds the colours of a triangle's coloured corners to those that no camera sees: 16 bits each for red,
/// green, blue and their number.
struct AddNeighbourColors {
  static constexpr int kGrain = 1024;
  View<const Vec3i> triangles;
  View<const std::uint32_t> colors;
  View<std::uint64_t> sums;
  TACTUS_HD void operator()(Index i) const {
    const Vec3i t = triangles[i];
    const std::uint32_t color[3] = {colors[t.x], colors[t.y], colors[t.z]};
    if (color[0] != 0 && color[1] != 0 && color[2] != 0) return;
    std::uint64_t sum = 0;
    for (const std::uint32_t c : color) {
      if (c == 0) continue;
      sum += (c & 0xFFU) | static_cast<std::uint64_t>(c >> 8 & 0xFFU) << 16 |
             static_cast<std::uint64_t>(c >> 16 & 0xFFU) << 32 | std::uint64_t{1} << 48;
    }
    if (sum == 0) return;
    for (int corner = 0; corner < 3; ++corner) {
      if (color[corner] == 0) atomic_add(sums[t[corner]], sum);
    }
  }
};
struct FillColors {
  View<std::uint64_t> sums;
  View<std::uint32_t> colors;
  TACTUS_HD void operator()(Index i) const {
    const std::uint64_t sum = sums[i];
    if (colors[i] != 0 || sum == 0) return;
    const auto n = static_cast<std::uint32_t>(sum >> 48);
    const auto mean = [n](std::uint64_t field) {
      return (static_cast<std::uint32_t>(field & 0xFFFFU) + n / 2) / n;
    };
    colors[i] = VertexColor::pack(mean(sum), mean(sum >> 16), mean(sum >> 32), VertexColor::kFilled);
    sums[i] = 0;
  }
};

}  // namespace tactus
