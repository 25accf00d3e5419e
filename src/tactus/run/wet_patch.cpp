#include "tactus/run/wet_patch.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "tactus/base/at.h"

namespace tactus {
namespace {

constexpr float kAbove_m = 1e-4F;  ///< the surface below isn't to be seen through the film
constexpr float kThinnestStain_m = 1e-6F;

/// The vertices at each place where a surface has a crease: several, with a normal each.
std::vector<std::vector<Index>> creases(const TriangleMesh& surface) {
  const auto key = [&](Index v) {
    const Vec3f p = surface.positions_m[at(v)];
    return std::array{p.x, p.y, p.z};
  };
  std::vector<Index> order(surface.positions_m.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return key(a) < key(b); });
  std::vector<std::vector<Index>> all;
  for (std::size_t k = 0; k < order.size();) {
    std::size_t end = k + 1;
    while (end < order.size() && key(order[end]) == key(order[k])) ++end;
    if (end > k + 1)
      all.emplace_back(order.begin() + static_cast<std::ptrdiff_t>(k),
                       order.begin() + static_cast<std::ptrdiff_t>(end));
    k = end;
  }
  return all;
}

/// How far a film's surface is above each vertex. At a crease it is one surface if both sides are wet: as
/// high above each of them as its film. If one is dry, the film ends at the crease: nothing hangs in the air.
std::vector<Vec3f> lifts(const TriangleMesh& surface, ViewFilm& film) {
  std::vector<Vec3f> lift;
  const auto height_m = [&](Index v) { return kAbove_m + (film.edge_m[at(v)] > 0 ? film.film_m[at(v)] : 0); };
  for (std::size_t v = 0; v < surface.positions_m.size(); ++v)
    lift.push_back(height_m(static_cast<Index>(v)) * surface.normals[v]);
  for (const std::vector<Index>& crease : creases(surface)) {
    if (std::any_of(crease.begin(), crease.end(), [&](Index v) { return film.edge_m[at(v)] <= 0; }))
      for (const Index v : crease) film.edge_m[at(v)] = std::min(film.edge_m[at(v)], 0.F);
    constexpr int kRounds = 8;  // sides at right angles are right after one
    Vec3f corner{};
    for (int round = 0; round < kRounds; ++round)
      for (const Index v : crease)
        corner += (height_m(v) - dot(corner, surface.normals[at(v)])) * surface.normals[at(v)];
    for (const Index v : crease) lift[at(v)] = corner;
  }
  return lift;
}

class WetPatch {
 public:
  WetPatch(const TriangleMesh& surface, const ViewFilm& film, const std::vector<Vec3f>& lift)
      : surface_(surface), film_(film), lift_(lift) {}
  void add(const std::array<Index, 3>& triangle) {
    std::vector<Index> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = triangle.at(k), b = triangle.at((k + 1) % 3);
      if (inside_m(a) > 0) corners.push_back(vertex(a, a));
      if ((inside_m(a) > 0) != (inside_m(b) > 0)) corners.push_back(vertex(std::min(a, b), std::max(a, b)));
    }
    for (std::size_t k = 2; k < corners.size(); ++k)
      wet.triangles.push_back({corners[0], corners[k - 1], corners[k]});
  }

  TriangleMesh wet;
  std::vector<float> film_m, stain_m, edge_m;

 private:
  /// > 0 where something is drawn.
  float inside_m(Index v) const {
    const float dried_m = film_.stain_m[at(v)];
    return dried_m > kThinnestStain_m ? std::max(film_.edge_m[at(v)], dried_m) : film_.edge_m[at(v)];
  }
  /// At a, or where that is 0 between a and b.
  Index vertex(Index a, Index b) {
    const auto [place, is_new] = numbers_.try_emplace({a, b}, static_cast<Index>(film_m.size()));
    if (!is_new) return place->second;
    const float share = a == b ? 0 : inside_m(a) / (inside_m(a) - inside_m(b));
    const auto between = [&](const auto& values) {
      return values[at(a)] + share * (values[at(b)] - values[at(a)]);
    };
    const Vec3f normal = normalized(between(surface_.normals));
    film_m.push_back(between(film_.film_m));
    stain_m.push_back(between(film_.stain_m));
    edge_m.push_back(between(film_.edge_m));
    // Along the film's edge it is 0 thick.
    wet.positions_m.push_back(between(surface_.positions_m) + (a == b ? lift_[at(a)] : kAbove_m * normal));
    wet.normals.push_back(normal);
    return place->second;
  }

  const TriangleMesh& surface_;
  const ViewFilm& film_;
  const std::vector<Vec3f>& lift_;
  std::map<std::pair<Index, Index>, Index> numbers_;
};

}  // namespace

void keep_wet(TriangleMesh& surface, ViewFilm& film) {
  const std::vector<Vec3f> lift = lifts(surface, film);
  WetPatch patch(surface, film, lift);
  for (const auto& t : surface.triangles) patch.add(t);
  surface = std::move(patch.wet);
  film.film_m = std::move(patch.film_m);
  film.stain_m = std::move(patch.stain_m);
  film.edge_m = std::move(patch.edge_m);
}

}  // namespace tactus
