#include "tactus/run/film_look.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "tactus/base/at.h"
#include "tactus/geom/mesh/surface_samples.h"

namespace tactus {
namespace {

constexpr float kReach = 2.5F;   // of averages, in edges of the surface: teeth of triangles don't show
constexpr float kEdge = 0.35F;   // share of wet surface at the film's edge
constexpr float kWet_m = 3e-5F;  // film that wets; half as much is half wet
constexpr float kFinest = 0.1F;  // edges beside the film's edge, over the reach
constexpr int kMostRounds = 4;

float wetness(float film_m) { return clamp(film_m / kWet_m, 0.F, 1.F); }

/// Bounds of all wet or stained vertices; empty (min > max) where all is dry.
Box3f wet_box(const TriangleMesh& surface, const ViewFilm& film) {
  Box3f box{{1e30F, 1e30F, 1e30F}, {-1e30F, -1e30F, -1e30F}};
  for (std::size_t v = 0; v < film.film_m.size(); ++v)
    if (film.film_m[v] > 0 || film.stain_m[v] > 0)
      box = {min(box.min, surface.positions_m[v]), max(box.max, surface.positions_m[v])};
  return box;
}

bool holds(const Box3f& box, Vec3f p) {
  const Vec3f out = max(box.min - p, p - box.max);
  return max(out.x, max(out.y, out.z)) <= 0;
}

float mean_edge_m(const TriangleMesh& surface, const Box3f& box) {
  double sum = 0;
  int count = 0;
  for (const auto& t : surface.triangles) {
    if (!holds(box, surface.positions_m[at(t[0])])) continue;
    for (std::size_t k = 0; k < 3; ++k, ++count)
      sum += double{length(surface.positions_m[at(t[k])] - surface.positions_m[at(t[(k + 1) % 3])])};
  }
  return count > 0 ? static_cast<float>(sum / count) : 0;
}

/// Averages of heights and stains at vertices.
class FilmField {
 public:
  FilmField(const TriangleMesh& surface, const ViewFilm& film, float reach_m, const Box3f& box)
      : film_m_(film.film_m), stain_m_(film.stain_m), samples_(surface, reach_m, box) {}

  struct Value {
    float film_m = 0, stain_m = 0, edge_m = 0;
  };
  Value at_point(Vec3f p_m, Vec3f normal) const {
    float all = 0, wet = 0, film = 0, stain = 0;
    Vec3f slope_all{}, slope_wet{};
    samples_.around(p_m, normal, [&](const SurfaceSamples::Sample& s, float weight, Vec3f slope) {
      float wet_here = 0, film_here = 0, stain_here = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const float share = k == 0 ? s.shares.x : k == 1 ? s.shares.y : s.shares.z;
        wet_here += share * wetness(film_m_[at(s.corners.at(k))]);
        film_here += share * film_m_[at(s.corners.at(k))];
        stain_here += share * stain_m_[at(s.corners.at(k))];
      }
      all += weight, wet += weight * wet_here, film += weight * film_here, stain += weight * stain_here;
      slope_all += slope, slope_wet += wet_here * slope;
    });
    const float reach_m = samples_.reach_m();
    if (!(all > 0)) return {0, 0, -reach_m};
    const float share = wet / all;
    Vec3f slope = (1 / all) * (slope_wet - share * slope_all);
    slope = slope - dot(slope, normal) * normal;
    // Far from the edge there is no slope; near it, an edge seldom is blunter than 1 over the reach.
    const float steep = max(length(slope), 0.3F / reach_m);
    return {wet > 0 ? film / wet : 0, stain / all, clamp((share - kEdge) / steep, -reach_m, reach_m)};
  }

 private:
  const std::vector<float> film_m_, stain_m_;
  SurfaceSamples samples_;
};

/// Points by cubic cells as wide as a reach.
class ParticleCells {
 public:
  ParticleCells(std::span<const Vec3f> points_m, float reach_m) : points_m_(points_m), reach_m_(reach_m) {
    for (std::size_t k = 0; k < points_m.size(); ++k) {
      if (!(length(points_m[k]) < 1e6F)) continue;
      const Cell cell = cell_of(points_m[k]);
      of_[cell].push_back(k);
      for_around(cell, [&](const Cell& c) { is_near_[hash(c)] = 1; });
      box_ = {min(box_.min, points_m[k]), max(box_.max, points_m[k])};
    }
    const Vec3f reach{reach_m, reach_m, reach_m};
    box_ = {box_.min - reach, box_.max + reach};
  }
  bool any_near(Vec3f p_m) const {
    if (of_.empty() || !holds(box_, p_m)) return false;
    const Cell cell = cell_of(p_m);
    if (is_near_[hash(cell)] == 0) return false;
    bool any = false;
    for_around(cell, [&](const Cell& c) {
      const auto there = of_.find(c);
      if (any || there == of_.end()) return;
      any = std::any_of(there->second.begin(), there->second.end(),
                        [&](std::size_t i) { return length(points_m_[i] - p_m) < reach_m_; });
    });
    return any;
  }

 private:
  using Cell = std::array<int, 3>;
  Cell cell_of(Vec3f p_m) const {
    const auto part = [&](float x) { return static_cast<int>(std::floor(x / reach_m_)); };
    return {part(p_m.x), part(p_m.y), part(p_m.z)};
  }
  template <class F>
  static void for_around(const Cell& c, F&& f) {
    for (int k = 0; k < 27; ++k) f(Cell{c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1});
  }
  static std::size_t hash(const Cell& c) {
    const auto word = [](int x) { return static_cast<std::uint32_t>(x); };
    return (word(c[0]) * 73856093U ^ word(c[1]) * 19349663U ^ word(c[2]) * 83492791U) % kHashes;
  }
  static constexpr std::size_t kHashes = 1 << 18;

  std::span<const Vec3f> points_m_;
  float reach_m_;
  Box3f box_{{1e30F, 1e30F, 1e30F}, {-1e30F, -1e30F, -1e30F}};
  std::map<Cell, std::vector<std::size_t>> of_;
  std::vector<std::uint8_t> is_near_ = std::vector<std::uint8_t>(kHashes);  ///< most places are near none
};

}  // namespace

bool wet_under(const TriangleMesh& surface, std::span<const Vec3f> particles_m, float spacing_m,
               std::vector<float>& film_m) {
  constexpr float kUnder_m = 3e-4F;  // as a film that runs off leaves it
  const ParticleCells near(particles_m, spacing_m);
  bool any = false;
  for (std::size_t v = 0; v < surface.positions_m.size(); ++v) {
    if (!near.any_near(surface.positions_m[v])) continue;
    film_m[v] = max(film_m[v], kUnder_m);
    any = true;
  }
  return any;
}

void lay_film(TriangleMesh& surface, std::vector<std::uint8_t>& is_crease, ViewFilm& film,
              const std::function<void(const EdgeRefinement&)>& refined) {
  Box3f box = wet_box(surface, film);
  film.edge_m.assign(film.film_m.size(), -1);
  if (box.min.x > box.max.x) return;
  const float reach_m = kReach * mean_edge_m(surface, box);
  if (!(reach_m > 0)) return;
  const Vec3f margin{reach_m, reach_m, reach_m};
  box = {box.min - margin, box.max + margin};
  const FilmField field(surface, film, reach_m, box);
  const auto lay = [&](std::size_t v) {
    FilmField::Value value{0, 0, -reach_m};
    if (holds(box, surface.positions_m[v]))
      value = field.at_point(surface.positions_m[v], surface.normals[v]);
    film.film_m[v] = value.film_m, film.stain_m[v] = value.stain_m, film.edge_m[v] = value.edge_m;
  };
  for (std::size_t v = 0; v < film.film_m.size(); ++v) lay(v);
  for (int round = 0; round < kMostRounds; ++round) {
    const EdgeRefinement made = refine_edges(surface, is_crease, [&](Index a, Index b) {
      const float long_m = length(surface.positions_m[at(a)] - surface.positions_m[at(b)]);
      const float near_m = min(std::abs(film.edge_m[at(a)]), std::abs(film.edge_m[at(b)]));
      return long_m > 2 * kFinest * reach_m && near_m < long_m && near_m < 0.9F * reach_m;
    });
    if (made.ends.empty()) break;
    const std::size_t first = film.film_m.size();
    for (std::vector<float>* m : {&film.film_m, &film.stain_m, &film.edge_m})
      m->resize(surface.positions_m.size());
    for (std::size_t v = first; v < film.film_m.size(); ++v) lay(v);
    refined(made);
  }
}

}  // namespace tactus
