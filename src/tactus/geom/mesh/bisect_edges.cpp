#include "tactus/geom/mesh/bisect_edges.h"

#include <algorithm>
#include <array>
#include <unordered_map>
#include <utility>

namespace tactus {
namespace {

using Triangle = std::array<Index, 3>;

class Bisection {
 public:
  Bisection(TriangleMesh mesh, std::size_t most_vertices)
      : mesh_(std::move(mesh)), most_vertices_(most_vertices) {
    mesh_.normals.clear();
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) link(static_cast<Index>(t));
  }
  /// @returns whether there was capacity
  bool run(float edge_m, const std::function<bool(const Box3f&)>& is_asked) {
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t)  // halves come behind the others
      while (edge2_m2(longest(static_cast<Index>(t))) > edge_m * edge_m &&
             is_asked(box_of(mesh_.triangles[t]))) {
        if (mesh_.positions_m.size() >= most_vertices_) return false;
        halve(static_cast<Index>(t));
      }
    return true;
  }
  TriangleMesh take() { return std::move(mesh_); }

 private:
  using Edge = std::pair<Index, Index>;  ///< the lesser vertex first
  struct Hash {
    std::size_t operator()(const Edge& e) const {
      return std::hash<std::uint64_t>()(std::uint64_t{static_cast<std::uint32_t>(e.first)} << 32U |
                                        static_cast<std::uint32_t>(e.second));
    }
  };
  static Edge edge(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }
  const Vec3f& x(Index v) const { return mesh_.positions_m[static_cast<std::size_t>(v)]; }
  Triangle& triangle(Index t) { return mesh_.triangles[static_cast<std::size_t>(t)]; }
  Box3f box_of(const Triangle& t) const {
    return {min(x(t[0]), min(x(t[1]), x(t[2]))), max(x(t[0]), max(x(t[1]), x(t[2])))};
  }
  float edge2_m2(const Edge& e) const { return dot(x(e.second) - x(e.first), x(e.second) - x(e.first)); }
  /// Where edges are as long as one another, the same one for both triangles.
  bool is_longer(const Edge& a, const Edge& b) const {
    const float la = edge2_m2(a), lb = edge2_m2(b);
    return la != lb ? la > lb : a > b;
  }
  Edge longest(Index t) {
    const auto& [a, b, c] = triangle(t);
    Edge most = edge(a, b);
    for (const Edge& e : {edge(b, c), edge(c, a)})
      if (is_longer(e, most)) most = e;
    return most;
  }
  void link(Index t) {
    for (std::size_t k = 0; k < 3; ++k) at_[edge(triangle(t)[k], triangle(t)[(k + 1) % 3])].push_back(t);
  }
  void unlink(Index t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto place = at_.find(edge(triangle(t)[k], triangle(t)[(k + 1) % 3]));
      std::erase(place->second, t);
      if (place->second.empty()) at_.erase(place);
    }
  }
  /// Halves t, or first those beyond its longest edge that have a longer one: edges only get longer on that
  /// way, so it ends.
  void halve(Index t) {
    for (;;) {
      const Edge own = longest(t);
      const std::vector<Index>& there = at_[own];
      const auto other = std::find_if(there.begin(), there.end(), [&](Index o) { return longest(o) != own; });
      if (other == there.end()) return split(own);
      t = *other;
    }
  }
  void split(const Edge& e) {
    const auto middle = static_cast<Index>(mesh_.positions_m.size());
    mesh_.positions_m.push_back(0.5F * (x(e.first) + x(e.second)));
    std::vector<Index> there = at_[e];
    std::sort(there.begin(), there.end());
    for (const Index t : there) {
      unlink(t);
      Triangle half = triangle(t);
      std::replace(triangle(t).begin(), triangle(t).end(), e.second, middle);
      std::replace(half.begin(), half.end(), e.first, middle);
      mesh_.triangles.push_back(half);
      link(t);
      link(static_cast<Index>(mesh_.triangles.size()) - 1);
    }
  }

  TriangleMesh mesh_;
  std::size_t most_vertices_;
  std::unordered_map<Edge, std::vector<Index>, Hash> at_;  ///< triangles of each edge
};

}  // namespace

std::optional<TriangleMesh> bisect_edges(TriangleMesh mesh, float edge_m,
                                         const std::function<bool(const Box3f&)>& is_asked,
                                         std::size_t most_vertices) {
  Bisection bisection(std::move(mesh), most_vertices);
  if (!bisection.run(edge_m, is_asked)) return std::nullopt;
  return bisection.take();
}

}  // namespace tactus
