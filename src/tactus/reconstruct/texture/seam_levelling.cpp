#include "tactus/reconstruct/texture/seam_levelling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>

#include "tactus/base/error.h"

namespace tactus {
namespace {

// Weights of the energy: a seam's step 1. A gain falls off over sqrt(kSmooth / kKeep) = 20 edges and more:
// without it, the light of one side of a body would creep around to the other.
constexpr double kSmooth = 0.2, kKeep = 5e-4;
constexpr int kMostIterations = 1000;
constexpr double kResidual = 1e-3;      // of the right-hand side's norm
constexpr double kDarkest = 1.0 / 256;  // linear; darker is background or noise

double to_linear(std::uint8_t srgb) {
  static const std::array<double, 256> table = [] {
    std::array<double, 256> t{};
    for (std::size_t i = 0; i < t.size(); ++i) {
      const double s = static_cast<double>(i) / 255;
      t[i] = s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
    }
    return t;
  }();
  return table[srgb];
}

Vec3d to_linear(Rgb8 c) { return {to_linear(c.r), to_linear(c.g), to_linear(c.b)}; }

std::uint8_t to_srgb(double linear) {
  const double v = std::clamp(linear, 0.0, 1.0);
  return static_cast<std::uint8_t>(
      std::lround(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055)));
}

Rgb8 multiplied(Rgb8 c, Vec3d gain) {
  const Vec3d v = to_linear(c);
  return {to_srgb(v.x * gain.x), to_srgb(v.y * gain.y), to_srgb(v.z * gain.z)};
}

Vec3d exp_each(Vec3d v) { return {std::exp(v.x), std::exp(v.y), std::exp(v.z)}; }

/// Neighbours of each vertex, one list after another.
struct Lists {
  std::vector<std::size_t> first;
  std::vector<std::size_t> to;
  /// @param pairs both ways are entered
  Lists(std::size_t count, const std::vector<std::array<std::size_t, 2>>& pairs) : first(count + 1, 0) {
    for (const auto& [a, b] : pairs) {
      ++first[a + 1];
      ++first[b + 1];
    }
    std::partial_sum(first.begin(), first.end(), first.begin());
    to.resize(2 * pairs.size());
    std::vector<std::size_t> next(first.begin(), first.end() - 1);
    for (const auto& [a, b] : pairs) {
      to[next[a]++] = b;
      to[next[b]++] = a;
    }
  }
  template <class F>
  void for_each(std::size_t i, F&& f) const {
    for (std::size_t k = first[i]; k < first[i + 1]; ++k) f(to[k]);
  }
};

Lists edges_of(const TriangleMesh& mesh) {
  std::vector<std::array<std::size_t, 2>> edges;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k)
      edges.push_back({static_cast<std::size_t>(t[k]), static_cast<std::size_t>(t[(k + 1) % 3])});
  }
  return {mesh.positions_m.size(), edges};
}

/// Linear colour at each vertex.
std::vector<Vec3d> colors_at_vertices(const TexturedMesh& t) {
  const auto texel = [](float at, Index size) {
    return std::clamp(static_cast<Index>(at * static_cast<float>(size)), 0, size - 1);
  };
  std::vector<Vec3d> colors;
  for (std::size_t i = 0; i < t.uv.size(); ++i) {
    colors.push_back(t.photo[i] < 0 ? to_linear(t.colors[i])
                                    : to_linear(t.atlas(texel(t.uv[i].x, t.atlas.width_px),
                                                        texel(t.uv[i].y, t.atlas.height_px))));
  }
  return colors;
}

double brightness(Vec3d c) { return (c.x + c.y + c.z) / 3; }

using Pairs = std::vector<std::array<std::size_t, 2>>;

/// Pairs of vertices at one place that are cut from different photos.
Pairs twins_of(const TexturedMesh& t) {
  const std::vector<Vec3f>& at = t.mesh.positions_m;
  std::vector<std::size_t> order(at.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto key = [&](std::size_t i) { return std::array{at[i].x, at[i].y, at[i].z}; };
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return key(a) != key(b) ? key(a) < key(b) : a < b; });
  Pairs twins;
  for (std::size_t i = 0; i < order.size(); ++i) {
    for (std::size_t j = i + 1; j < order.size() && key(order[j]) == key(order[i]); ++j) {
      if (t.photo[order[i]] != t.photo[order[j]]) twins.push_back({order[i], order[j]});
    }
  }
  return twins;
}

/// Places of the seams that are levelled: both sides show the same.
struct Seams {
  Pairs twins;
  std::vector<Vec3d> steps;  ///< logarithm of the second's colour over the first's
};

Seams seams_of(const TexturedMesh& t, const Lists& edges, double most_ratio) {
  const std::vector<Vec3d> colors = colors_at_vertices(t);
  const Pairs all = twins_of(t);
  const Lists twins(t.uv.size(), all);
  Seams seams;
  for (const auto& [a, b] : all) {
    // Photos don't fit one another to the pixel: the mean over the neighbours along the same seam.
    Vec3d first = colors[a], second = colors[b];
    edges.for_each(a, [&, b = b](std::size_t i) {
      twins.for_each(i, [&](std::size_t j) {
        if (t.photo[j] != t.photo[b]) return;
        first += colors[i];
        second += colors[j];
      });
    });
    const double x = brightness(first), y = brightness(second);
    if (std::min(brightness(colors[a]), brightness(colors[b])) < kDarkest ||
        std::max(x, y) > most_ratio * std::min(x, y))
      continue;
    const auto log_ratio = [](double of, double to) {
      return std::log(std::max(to, kDarkest) / std::max(of, kDarkest));
    };
    seams.twins.push_back({a, b});
    seams.steps.push_back(
        {log_ratio(first.x, second.x), log_ratio(first.y, second.y), log_ratio(first.z, second.z)});
  }
  return seams;
}

double dot_all(const std::vector<Vec3d>& a, const std::vector<Vec3d>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += dot(a[i], b[i]);
  return sum;
}

/// Logarithms of the gains: conjugate gradients (Hestenes & Stiefel 1952) on the energy's normal equations,
/// all channels at once.
std::vector<Vec3d> solve_gains(std::size_t n, const Lists& edges, const Seams& seams) {
  const Lists twins(n, seams.twins);
  const auto apply = [&](const std::vector<Vec3d>& x, std::vector<Vec3d>& y) {
    for (std::size_t i = 0; i < n; ++i) {
      Vec3d sum = kKeep * x[i];
      edges.for_each(i, [&](std::size_t j) { sum += kSmooth * (x[i] - x[j]); });
      twins.for_each(i, [&](std::size_t j) { sum += x[i] - x[j]; });
      y[i] = sum;
    }
  };
  std::vector<Vec3d> x(n), r(n), p, Ap(n);
  for (std::size_t k = 0; k < seams.twins.size(); ++k) {
    r[seams.twins[k][0]] += seams.steps[k];
    r[seams.twins[k][1]] -= seams.steps[k];
  }
  p = r;
  double rr = dot_all(r, r);
  const double enough = sqr(kResidual) * rr;
  for (int k = 0; k < kMostIterations && rr > enough; ++k) {
    apply(p, Ap);
    const double step = rr / dot_all(p, Ap);
    for (std::size_t i = 0; i < n; ++i) {
      x[i] += step * p[i];
      r[i] -= step * Ap[i];
    }
    const double next = dot_all(r, r);
    for (std::size_t i = 0; i < n; ++i) p[i] = r[i] + (next / rr) * p[i];
    rr = next;
  }
  return x;
}

double step_rms(const Seams& seams, const std::vector<Vec3d>& gains) {
  double sum = 0;
  for (std::size_t k = 0; k < seams.twins.size(); ++k) {
    const auto [a, b] = seams.twins[k];
    const Vec3d step = seams.steps[k] + gains[b] - gains[a];
    sum += dot(step, step) / 3;
  }
  return seams.twins.empty() ? 0 : std::sqrt(sum / static_cast<double>(seams.twins.size()));
}

/// The logarithm of the gain of every pixel that a triangle covers, and of two pixels around them.
class GainMap {
 public:
  explicit GainMap(const ColorImage& atlas)
      : width_(atlas.width_px),
        height_(atlas.height_px),
        gain_(atlas.pixels.size()),
        known_(gain_.size(), 0) {}

  void draw(const std::array<Vec2<double>, 3>& px, const std::array<Vec3d, 3>& gains) {
    const auto cross2 = [](Vec2<double> a, Vec2<double> b, Vec2<double> c) {
      return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    };
    const double area = cross2(px[0], px[1], px[2]);
    if (std::abs(area) < 1e-12) return;
    const auto [x0, x1] = std::minmax({px[0].x, px[1].x, px[2].x});
    const auto [y0, y1] = std::minmax({px[0].y, px[1].y, px[2].y});
    const auto first = [](double v) { return std::max(static_cast<Index>(std::ceil(v - 0.5)), 0); };
    for (Index y = first(y0); y < height_ && y + 0.5 <= y1; ++y) {
      for (Index x = first(x0); x < width_ && x + 0.5 <= x1; ++x) {
        const Vec2<double> at{x + 0.5, y + 0.5};
        const double a = cross2(px[1], px[2], at) / area, b = cross2(px[2], px[0], at) / area;
        if (std::min({a, b, 1 - a - b}) < 0) continue;
        set(x, y, a * gains[0] + b * gains[1] + (1 - a - b) * gains[2]);
      }
    }
  }
  /// Filtering reaches over a triangle's edge: pixels beside known gains get the mean of those.
  void widen() {
    std::vector<std::uint8_t> was = known_;
    for (Index y = 1; y + 1 < height_; ++y) {
      for (Index x = 1; x + 1 < width_; ++x) {
        if (was[at(x, y)] != 0) continue;
        Vec3d sum{};
        double count = 0;
        for (const std::size_t i : {at(x - 1, y), at(x + 1, y), at(x, y - 1), at(x, y + 1)}) {
          if (was[i] == 0) continue;
          sum += vec_cast<double>(gain_[i]);
          ++count;
        }
        if (count > 0) set(x, y, (1 / count) * sum);
      }
    }
  }
  void multiply(ColorImage& atlas) const {
    for (std::size_t i = 0; i < gain_.size(); ++i) {
      if (known_[i] != 0) atlas.pixels[i] = multiplied(atlas.pixels[i], exp_each(vec_cast<double>(gain_[i])));
    }
  }

 private:
  std::size_t at(Index x, Index y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  void set(Index x, Index y, Vec3d gain) {
    gain_[at(x, y)] = vec_cast<float>(gain);
    known_[at(x, y)] = 1;
  }
  Index width_, height_;
  std::vector<Vec3f> gain_;
  std::vector<std::uint8_t> known_;
};

void apply_gains(TexturedMesh& t, const std::vector<Vec3d>& gains) {
  GainMap map(t.atlas);
  for (const auto& triangle : t.mesh.triangles) {
    std::array<Vec2<double>, 3> px;
    std::array<Vec3d, 3> gain;
    bool photographed = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto v = static_cast<std::size_t>(triangle[k]);
      px[k] = {static_cast<double>(t.uv[v].x) * t.atlas.width_px,
               static_cast<double>(t.uv[v].y) * t.atlas.height_px};
      gain[k] = gains[v];
      photographed = photographed && t.photo[v] >= 0;
    }
    if (photographed) map.draw(px, gain);
  }
  map.widen();
  map.widen();
  map.multiply(t.atlas);
  for (std::size_t i = 0; i < t.colors.size(); ++i) {
    if (t.photo[i] < 0) t.colors[i] = multiplied(t.colors[i], exp_each(gains[i]));
  }
}

}  // namespace

SeamSteps level_seams(TexturedMesh& textured, const SeamLevelling& options) {
  const std::size_t vertices = textured.mesh.positions_m.size();
  if (textured.uv.size() != vertices || textured.colors.size() != vertices ||
      textured.photo.size() != vertices)
    throw Error("seams: " + std::to_string(vertices) + " vertices with " +
                std::to_string(textured.uv.size()) + " places in the atlas, " +
                std::to_string(textured.colors.size()) + " colours and " +
                std::to_string(textured.photo.size()) + " photos");
  const Lists edges = edges_of(textured.mesh);
  const Seams seams = seams_of(textured, edges, options.most_ratio);
  std::vector<Vec3d> gains(vertices);
  SeamSteps steps{seams.twins.size(), step_rms(seams, gains), 0};
  if (steps.before == 0) return steps;
  gains = solve_gains(vertices, edges, seams);
  const double most = std::log(options.most_gain);
  for (Vec3d& g : gains) g = max(min(g, Vec3d{most, most, most}), Vec3d{-most, -most, -most});
  apply_gains(textured, gains);
  steps.after = step_rms(seams, gains);
  return steps;
}

}  // namespace tactus
