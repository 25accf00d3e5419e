#pragma once
/// Finer triangles where they are asked for.
#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// The origins of the vertices that refine_edges() made.
struct EdgeRefinement {
  std::vector<std::array<Index, 2>> ends;  ///< of each new vertex, in their order: the edge that it halves
  std::vector<Index> parent;               ///< per triangle: the old one that it is a part of
};

/// Halves each edge for which `wants(a, b)`, a < b, so triangles still fit together. A new vertex lies on the
/// curve that the normals of its edge's ends ask for (PN triangles, Vlachos 2001); it has their mean. Between
/// two that are on a crease, where vertices of several normals share a place, it lies in the middle.
/// @param mesh with normals @param is_crease per vertex; grows with them
template <class F>
EdgeRefinement refine_edges(TriangleMesh& mesh, std::vector<std::uint8_t>& is_crease, F&& wants);

namespace refine {

/// New vertices of edges that were asked about.
class Halves {
 public:
  explicit Halves(std::size_t edges);
  /// Where the place of an edge's new vertex is kept; kUnknown for one that wasn't asked about.
  Index& of(Index a, Index b);
  static constexpr Index kUnknown = -2, kWhole = -1;

 private:
  struct Place {
    std::uint64_t edge = 0;
    Index vertex = kUnknown;
  };
  std::vector<Place> places_;
};

Vec3f middle_m(const TriangleMesh& mesh, Index a, Index b, bool is_curved);
/// @param half new vertices on the edges from corner k to the next; kWhole: none
void divide(const TriangleMesh& mesh, const std::array<Index, 3>& corners, const std::array<Index, 3>& half,
            std::vector<std::array<Index, 3>>& parts);

}  // namespace refine

template <class F>
EdgeRefinement refine_edges(TriangleMesh& mesh, std::vector<std::uint8_t>& is_crease, F&& wants) {
  const auto at = [](Index i) { return static_cast<std::size_t>(i); };
  EdgeRefinement made;
  refine::Halves halves(3 * mesh.triangles.size());
  std::vector<std::array<Index, 3>> triangles, parts;
  triangles.reserve(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::array<Index, 3> corners = mesh.triangles[t];
    std::array<Index, 3> half{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = std::min(corners[k], corners[(k + 1) % 3]),
                  b = std::max(corners[k], corners[(k + 1) % 3]);
      Index& known = halves.of(a, b);
      if (known == refine::Halves::kUnknown) {
        known = refine::Halves::kWhole;
        if (wants(a, b)) {
          known = static_cast<Index>(mesh.positions_m.size());
          const bool both = is_crease[at(a)] != 0 && is_crease[at(b)] != 0;
          mesh.positions_m.push_back(refine::middle_m(mesh, a, b, !both));
          mesh.normals.push_back(normalized(mesh.normals[at(a)] + mesh.normals[at(b)], mesh.normals[at(a)]));
          is_crease.push_back(both ? 1 : 0);
          made.ends.push_back({a, b});
        }
      }
      half[k] = known;
    }
    parts.clear();
    refine::divide(mesh, corners, half, parts);
    triangles.insert(triangles.end(), parts.begin(), parts.end());
    made.parent.resize(triangles.size(), static_cast<Index>(t));
  }
  mesh.triangles = std::move(triangles);
  return made;
}

}  // namespace tactus
