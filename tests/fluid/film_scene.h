#pragma once
/// A film on a flat sheet, for tests.
#include <cmath>
#include <functional>
#include <numeric>
#include <random>
#include <set>
#include <vector>

#include "tactus/fluid/film/film.h"
#include "tactus/multi_device/device_set.h"

namespace tactus::test {

/// A sheet in the plane z = 0 of triangles that are nearly equilateral: columns spacing_m apart along x,
/// every other row shifted by half of that.
struct Sheet {
  std::vector<Vec3f> x_m;
  std::vector<Index> corners;
  std::vector<IndexRange> lists;
  std::vector<Index> incident;

  Sheet(float length_m, float width_m, float spacing_m, float jitter = 0, bool shifted = true) {
    const float row_m = shifted ? spacing_m * std::sqrt(0.75F) : spacing_m;
    const auto nx = static_cast<Index>(std::lround(length_m / spacing_m)) + 1,
               ny = static_cast<Index>(std::lround(width_m / row_m)) + 1;
    std::mt19937 random(7);
    std::uniform_real_distribution<float> noise(-jitter * spacing_m, jitter * spacing_m);
    for (Index j = 0; j < ny; ++j)
      for (Index i = 0; i < nx; ++i) {
        const float shift = shifted && j % 2 == 1 ? 0.5F * spacing_m : 0;
        x_m.push_back({static_cast<float>(i) * spacing_m + shift + noise(random),
                       static_cast<float>(j) * row_m - 0.5F * width_m + noise(random), 0});
      }
    for (Index j = 0; j + 1 < ny; ++j)
      for (Index i = 0; i + 1 < nx; ++i) {
        const Index a = j * nx + i, b = a + 1, c = a + nx, d = c + 1;
        if (j % 2 == 0)
          corners.insert(corners.end(), {a, b, c, b, d, c});
        else
          corners.insert(corners.end(), {a, b, d, a, d, c});
      }
    link();
  }
  /// The area of each vertex's cell: a third of its triangles.
  std::vector<double> areas_m2() const {
    std::vector<double> area(x_m.size(), 0.0);
    for (std::size_t k = 0; k < corners.size(); k += 3) {
      const auto at = [&](std::size_t i) { return x_m[static_cast<std::size_t>(corners[k + i])]; };
      for (std::size_t i = 0; i < 3; ++i)
        area[static_cast<std::size_t>(corners[k + i])] +=
            double{length(cross(at(1) - at(0), at(2) - at(0)))} / 6;
    }
    return area;
  }
  void link() {
    std::vector<std::vector<Index>> of(x_m.size());
    for (std::size_t k = 0; k < corners.size(); ++k)
      of[static_cast<std::size_t>(corners[k])].push_back(static_cast<Index>(k / 3));
    lists.clear();
    incident.clear();
    for (const std::vector<Index>& list : of) {
      const auto begin = static_cast<Index>(incident.size());
      incident.insert(incident.end(), list.begin(), list.end());
      lists.push_back({begin, static_cast<Index>(incident.size())});
    }
  }
};

/// The film with the sheet and a frame's parameters on a device.
class SheetFilm {
 public:
  SheetFilm(ExecContext& ctx, const Sheet& sheet, const FilmSettings& settings, float slope_deg, float dt_s)
      : ctx_(ctx),
        x_(to_device(ctx, sheet.x_m)),
        corners_(to_device(ctx, sheet.corners)),
        lists_(to_device(ctx, sheet.lists)),
        incident_(to_device(ctx, sheet.incident)),
        film(ctx, settings, x_.size(), corners_.size() / 3, incident_.size()),
        areas_m2_(sheet.areas_m2()),
        dt_s_(dt_s) {
    tilt(slope_deg);
  }
  /// Down is towards +x and, more or less, -z.
  void tilt(float slope_deg) {
    const float rad = slope_deg * kPi / 180;
    const FrameParams f{
        .dt_s = dt_s_, .gravity_m_s2 = 9.81F * Vec3f{std::sin(rad), 0, -std::cos(rad)}, .substeps = 1};
    frame_ = to_device(ctx_, std::vector<FrameParams>{f});
  }
  FilmSurface surface() const {
    return {x_.size(),           corners_.size() / 3,   x_.const_view(), corners_.const_view(),
            lists_.const_view(), incident_.const_view()};
  }
  void move(const std::vector<Vec3f>& x_m) { x_ = to_device(ctx_, x_m); }
  View<const FrameParams> frame() const { return frame_.const_view(); }
  void step() { film.step(ctx_, surface(), frame_.const_view()); }
  std::vector<std::int64_t> volumes() { return to_host(ctx_, film.volumes()); }
  void set_volumes(const std::vector<std::int64_t>& v) { film.set_volumes(ctx_, v); }
  std::vector<float> heights_m() { return to_host(ctx_, film.heights_m()); }
  FilmPasses passes() { return to_host(ctx_, film.passes())[0]; }
  /// Fills each cell to the height at its vertex.
  void fill(const Sheet& sheet, const std::function<double(Vec3f)>& height_m) {
    std::vector<std::int64_t> v;
    for (std::size_t i = 0; i < areas_m2_.size(); ++i)
      v.push_back(std::llround(height_m(sheet.x_m[i]) * areas_m2_[i] * double{kFilmUnits_1_m3}));
    set_volumes(v);
  }

 private:
  ExecContext& ctx_;
  Buffer<Vec3f> x_;
  Buffer<Index> corners_;
  Buffer<IndexRange> lists_;
  Buffer<Index> incident_;
  Buffer<FrameParams> frame_;

 public:
  Film film;

 private:
  std::vector<double> areas_m2_;
  float dt_s_;
};

inline double volume_m3(const std::vector<std::int64_t>& units) {
  return static_cast<double>(std::accumulate(units.begin(), units.end(), std::int64_t{0})) *
         double{kFilmUnit_m3};
}

/// How many pieces the wet vertices make.
inline int wet_pieces(const Sheet& sheet, const std::vector<float>& h) {
  std::vector<Index> root(h.size());
  std::iota(root.begin(), root.end(), 0);
  const std::function<Index(Index)> find = [&](Index v) {
    while (root[static_cast<std::size_t>(v)] != v) v = root[static_cast<std::size_t>(v)];
    return v;
  };
  for (std::size_t k = 0; k < sheet.corners.size(); ++k) {
    const Index a = sheet.corners[k], b = sheet.corners[k - k % 3 + (k + 1) % 3];
    if (h[static_cast<std::size_t>(a)] > 0 && h[static_cast<std::size_t>(b)] > 0)
      root[static_cast<std::size_t>(find(a))] = find(b);
  }
  std::set<Index> roots;
  for (std::size_t i = 0; i < h.size(); ++i)
    if (h[i] > 0) roots.insert(find(static_cast<Index>(i)));
  return static_cast<int>(roots.size());
}

}  // namespace tactus::test
