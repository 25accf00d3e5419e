#include "tactus/run/wet_patch.h"

#include <algorithm>
#include <map>
#include <utility>

namespace tactus {
namespace {

constexpr float kAbove_m = 1e-4F;  ///< the surface below isn't to be seen through the film
constexpr float kThinnestStain_m = 1e-6F;

class WetPatch {
 public:
  WetPatch(const TriangleMesh& surface, const ViewFilm& film) : surface_(surface), film_(film) {}
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
  static std::size_t at(Index v) { return static_cast<std::size_t>(v); }
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
    const float height_m = edge_m.back() > 0 ? film_m.back() : 0;
    wet.positions_m.push_back(between(surface_.positions_m) + (kAbove_m + height_m) * normal);
    wet.normals.push_back(normal);
    return place->second;
  }

  const TriangleMesh& surface_;
  const ViewFilm& film_;
  std::map<std::pair<Index, Index>, Index> numbers_;
};

}  // namespace

void keep_wet(TriangleMesh& surface, ViewFilm& film) {
  WetPatch patch(surface, film);
  for (const auto& t : surface.triangles) patch.add(t);
  surface = std::move(patch.wet);
  film.film_m = std::move(patch.film_m);
  film.stain_m = std::move(patch.stain_m);
  film.edge_m = std::move(patch.edge_m);
}

}  // namespace tactus
