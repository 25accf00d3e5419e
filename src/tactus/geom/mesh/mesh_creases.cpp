#include "tactus/geom/mesh/mesh_creases.h"

#include <algorithm>

#include "tactus/base/at.h"

namespace tactus {
namespace {

constexpr float kSameSide = 0.7F;  // cosine
constexpr float kNeedle = 1e-3F;   // area over the largest at the vertex

/// A corner of a triangle at a vertex.
struct Corner {
  std::size_t triangle = 0, corner = 0;
  Vec3f normal{};  ///< as long as twice the area
};

struct Side {
  Vec3f way, sum;
};

/// The largest triangles found sides; others go with the side that is nearest.
std::vector<Side> sides_of(std::vector<Corner>& corners, std::vector<std::size_t>& side_of) {
  std::sort(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) {
    return dot(a.normal, a.normal) > dot(b.normal, b.normal);
  });
  std::vector<Side> sides;
  side_of.clear();
  const float largest = length(corners.front().normal);
  for (const Corner& c : corners) {
    const Vec3f way = normalized(c.normal, Vec3f{0, 0, 0});
    std::size_t best = 0;
    for (std::size_t k = 1; k < sides.size(); ++k)
      if (dot(way, sides[k].way) > dot(way, sides[best].way)) best = k;
    const bool is_needle = length(c.normal) <= kNeedle * largest;
    if (sides.empty() || (!is_needle && dot(way, sides[best].way) < kSameSide)) {
      best = sides.size();
      sides.push_back({way, {}});
    }
    sides[best].sum += c.normal;
    side_of.push_back(best);
  }
  return sides;
}

}  // namespace

std::vector<Index> split_creases(TriangleMesh& mesh, Index first) {
  std::vector<Index> origin;
  if (mesh.normals.size() != mesh.positions_m.size()) compute_normals(mesh);
  std::vector<std::vector<Corner>> corners(mesh.positions_m.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Vec3f normal = cross(mesh.positions_m[at(b)] - mesh.positions_m[at(a)],
                               mesh.positions_m[at(c)] - mesh.positions_m[at(a)]);
    for (std::size_t k = 0; k < 3; ++k) corners[at(mesh.triangles[t].at(k))].push_back({t, k, normal});
  }
  std::vector<std::size_t> side_of;
  for (std::size_t v = at(first); v < corners.size(); ++v) {
    if (corners[v].empty()) continue;
    const std::vector<Side> sides = sides_of(corners[v], side_of);
    if (sides.size() < 2) continue;
    std::vector<Index> vertex{static_cast<Index>(v)};
    mesh.normals[v] = normalized(sides[0].sum, Vec3f{0, 1, 0});
    for (std::size_t k = 1; k < sides.size(); ++k) {
      vertex.push_back(static_cast<Index>(mesh.positions_m.size()));
      origin.push_back(static_cast<Index>(v));
      mesh.positions_m.push_back(mesh.positions_m[v]);
      mesh.normals.push_back(normalized(sides[k].sum, Vec3f{0, 1, 0}));
    }
    for (std::size_t k = 0; k < corners[v].size(); ++k)
      mesh.triangles[corners[v][k].triangle].at(corners[v][k].corner) = vertex[side_of[k]];
  }
  return origin;
}

void smooth_normals(TriangleMesh& mesh, int passes) {
  constexpr float kOtherSide = 0.82F;  // cosine
  if (mesh.normals.size() != mesh.positions_m.size()) compute_normals(mesh);
  std::vector<Vec3f> sums(mesh.normals.size());
  for (int pass = 0; pass < passes; ++pass) {
    sums = mesh.normals;
    for (const auto& t : mesh.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t a = at(t.at(k)), b = at(t.at((k + 1) % 3));
        // Either end of an inner edge meets it twice.
        const float weight = max(dot(mesh.normals[a], mesh.normals[b]) - kOtherSide, 0.F) / (1 - kOtherSide);
        sums[a] += 0.5F * weight * mesh.normals[b];
        sums[b] += 0.5F * weight * mesh.normals[a];
      }
    }
    for (std::size_t v = 0; v < sums.size(); ++v) mesh.normals[v] = normalized(sums[v], mesh.normals[v]);
  }
}

}  // namespace tactus
