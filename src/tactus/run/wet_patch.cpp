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
      if (depth_m(a) > 0) corners.push_back(vertex(a, a));
      if ((depth_m(a) > 0) != (depth_m(b) > 0)) corners.push_back(vertex(std::min(a, b), std::max(a, b)));
    }
    for (std::size_t k = 2; k < corners.size(); ++k)
      wet.triangles.push_back({corners[0], corners[k - 1], corners[k]});
  }

  TriangleMesh wet;
  std::vector<float> film_m, stain_m;

 private:
  static std::size_t at(Index v) { return static_cast<std::size_t>(v); }
  float depth_m(Index v) const {
    return std::max(film_.film_m[at(v)], film_.stain_m[at(v)] - kThinnestStain_m);
  }
  /// At a, or where depth is 0 between a and b.
  Index vertex(Index a, Index b) {
    const auto [place, is_new] = numbers_.try_emplace({a, b}, static_cast<Index>(film_m.size()));
    if (!is_new) return place->second;
    const float share = a == b ? 0 : depth_m(a) / (depth_m(a) - depth_m(b));
    const auto between = [&](const auto& values) {
      return values[at(a)] + share * (values[at(b)] - values[at(a)]);
    };
    const Vec3f normal = normalized(between(surface_.normals));
    film_m.push_back(std::max(between(film_.film_m), 0.F));
    stain_m.push_back(between(film_.stain_m));
    wet.positions_m.push_back(between(surface_.positions_m) + (kAbove_m + film_m.back()) * normal);
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
}

}  // namespace tactus
