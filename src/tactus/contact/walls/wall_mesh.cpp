#include "tactus/contact/walls/wall_mesh.h"

#include <algorithm>

#include "tactus/base/error.h"

namespace tactus {
namespace {

constexpr Vec3i kUnused{-1, -1, -1};

}  // namespace

WallMesh::WallMesh(float longest_m, Capacity capacity) : longest_m_(longest_m), capacity_(capacity) {
  if (!(longest_m > 0))
    throw Error("wall mesh: edges are at most " + std::to_string(longest_m) + " m, must be > 0");
}

void WallMesh::apply(const WallChange& change) {
  for (const WallChange::Vertex& v : change.vertices) {
    if (v.vertex >= capacity_.vertices) {
      is_full_ = true;
      continue;
    }
    if (at(v.vertex) >= points_.size()) {
      points_.resize(at(v.vertex) + 1);
      rest_m_.resize(points_.size());
    }
    points_[at(v.vertex)] = v.to;
    rest_m_[at(v.vertex)] = v.rest_m;
  }
  const auto known = static_cast<Index>(points_.size());
  for (const WallChange::Triangle& t : change.triangles) {
    if (t.triangle >= capacity_.surface) {
      is_full_ = true;
      continue;
    }
    if (at(t.triangle) >= coarse_.size()) {
      coarse_.resize(at(t.triangle) + 1, kUnused);
      parts_.resize(coarse_.size());
    }
    drop(t.triangle);
    const auto& [a, b, c] = t.vertices;
    const bool is_used = !(a == b && b == c) && std::max({a, b, c}) < known;  // else is_full
    coarse_[at(t.triangle)] = is_used ? Vec3i{a, b, c} : kUnused;
  }
  for (const WallChange::Triangle& t : change.triangles)
    if (t.triangle < capacity_.surface) divide(t.triangle);
}

void WallMesh::drop(Index triangle) {
  Parts& parts = parts_[at(triangle)];
  for (const Index t : parts.triangles) fine_[at(t)] = kUnused;
  free_fine_.insert(free_fine_.end(), parts.triangles.begin(), parts.triangles.end());
  free_added_.insert(free_added_.end(), parts.added.begin(), parts.added.end());
  parts = {};
}

/// A vertex that two pieces of a triangle share is one vertex. Halving makes few of them, so they are looked
/// through.
Index WallMesh::add_vertex(Index triangle, float b, float c) {
  Parts& parts = parts_[at(triangle)];
  for (const Index known : parts.added)
    if (added_[at(known)].b == b && added_[at(known)].c == c) return capacity_.vertices + known;
  Index place = static_cast<Index>(added_.size());
  if (!free_added_.empty()) {
    place = free_added_.back();
    free_added_.pop_back();
  } else if (place >= capacity_.added) {
    is_full_ = true;
    return -1;
  } else {
    added_.emplace_back();
  }
  added_[at(place)] = {coarse_[at(triangle)], b, c};
  parts.added.push_back(place);
  return capacity_.vertices + place;
}

void WallMesh::add_triangle(Index triangle, const std::array<Corner, 3>& corners) {
  const Vec3i vertices{corners[0].vertex, corners[1].vertex, corners[2].vertex};
  Index place = static_cast<Index>(fine_.size());
  if (!free_fine_.empty()) {
    place = free_fine_.back();
    free_fine_.pop_back();
    fine_[at(place)] = vertices;
  } else if (place >= capacity_.triangles) {
    is_full_ = true;
    return;
  } else {
    fine_.push_back(vertices);
  }
  parts_[at(triangle)].triangles.push_back(place);
}

void WallMesh::divide(Index triangle) {
  const auto [v0, v1, v2] = coarse_[at(triangle)];
  if (v0 < 0) return;
  const Vec3f origin = rest_m_[at(v0)], to_1 = rest_m_[at(v1)] - origin, to_2 = rest_m_[at(v2)] - origin;
  const auto place = [&](const Corner& corner) { return corner.b * to_1 + corner.c * to_2; };
  std::vector<std::array<Corner, 3>> left{{{{v0, 0, 0}, {v1, 1, 0}, {v2, 0, 1}}}};
  while (!left.empty()) {
    const std::array<Corner, 3> t = left.back();
    left.pop_back();
    std::size_t longest = 0;
    float most_m = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const float edge_m = length(place(t.at((k + 1) % 3)) - place(t.at(k)));
      if (edge_m > most_m) most_m = edge_m, longest = k;
    }
    if (!(most_m > longest_m_)) {
      add_triangle(triangle, t);
      continue;
    }
    const Corner &from = t.at(longest), &to = t.at((longest + 1) % 3), &tip = t.at((longest + 2) % 3);
    const float b = 0.5F * (from.b + to.b), c = 0.5F * (from.c + to.c);
    const Corner middle{add_vertex(triangle, b, c), b, c};
    if (middle.vertex < 0) return;
    left.push_back({{middle, to, tip}});
    left.push_back({{from, middle, tip}});
  }
}

}  // namespace tactus
