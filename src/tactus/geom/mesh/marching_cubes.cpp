#include "tactus/geom/mesh/marching_cubes.h"

#include <array>
#include <limits>
#include <utility>

#include "tactus/base/error.h"
#include "tactus/base/vec.h"

namespace tactus {
namespace {

constexpr int kNone = -1;

/// Edge between two corners that differ in one bit.
int edge_between(int a, int b) {
  const int axis = (a ^ b) == 1 ? 0 : ((a ^ b) == 2 ? 1 : 2);
  for (int e = 4 * axis; e < 4 * axis + 4; ++e) {
    if (edge_corner(e) == (a & b)) return e;
  }
  return kNone;
}

/// Corners of the face `axis` = `side`, counter-clockwise seen from outside the cell.
std::array<int, 4> face_corners(int axis, int side) {
  const int u = 1 << ((axis + 1) % 3), v = 1 << ((axis + 2) % 3), base = side << axis;
  if (side == 1) return {base, base | u, base | u | v, base | v};
  return {base, base | v, base | u | v, base | u};
}

/// Bit f is set when the edge lies on face f.
int faces_of_edge(int edge) {
  const int axis = edge / 4, corner = edge_corner(edge);
  int faces = 0;
  for (int other = 0; other < 3; ++other) {
    if (other != axis) faces |= 1 << (2 * other + (corner >> other & 1));
  }
  return faces;
}

Vec3f edge_middle(int edge) {
  const int corner = edge_corner(edge);
  Vec3f p{static_cast<float>(corner & 1), static_cast<float>(corner >> 1 & 1),
          static_cast<float>(corner >> 2 & 1)};
  p[edge / 4] = 0.5F;
  return p;
}

/// For each crossed edge the next one around its loop. Walking a face counter-clockwise, each run of inside
/// corners is entered over one edge and left over another; the surface cuts the run off with a segment from
/// the former to the latter. (So on a face with two opposite inside corners, they are separated.)
std::array<int, kCellEdges> next_crossings(int signs) {
  std::array<int, kCellEdges> next;
  next.fill(kNone);
  for (int face = 0; face < 6; ++face) {
    const std::array<int, 4> corner = face_corners(face / 2, face % 2);
    const auto inside = [&](int k) { return (signs >> corner[static_cast<std::size_t>(k % 4)] & 1) != 0; };
    for (int k = 0; k < 4; ++k) {
      if (inside(k) || !inside(k + 1)) continue;
      int last = k + 1;
      while (inside(last + 1)) ++last;
      const auto at = [&](int i) { return corner[static_cast<std::size_t>(i % 4)]; };
      next[static_cast<std::size_t>(edge_between(at(k), at(k + 1)))] = edge_between(at(last), at(last + 1));
    }
  }
  return next;
}

/// Triangulates loop[first..last] (a polygon closed by last-first) at the least total length of diagonals.
/// Returns infinity when every triangulation needs a diagonal within a cell face.
float triangulate(const std::vector<int>& loop, std::size_t first, std::size_t last, std::vector<int>& out) {
  constexpr float kImpossible = std::numeric_limits<float>::infinity();
  if (last - first < 2) return 0;
  const auto diagonal_length = [&](std::size_t a, std::size_t b) {
    const bool side = b - a == 1 || (a == 0 && b + 1 == loop.size());
    if (side) return 0.F;
    if ((faces_of_edge(loop[a]) & faces_of_edge(loop[b])) != 0) return kImpossible;
    return length(edge_middle(loop[a]) - edge_middle(loop[b]));
  };
  float best = kImpossible;
  std::vector<int> best_out;
  for (std::size_t middle = first + 1; middle < last; ++middle) {
    std::vector<int> candidate{loop[first], loop[middle], loop[last]};
    const float cost = diagonal_length(first, middle) + diagonal_length(middle, last) +
                       triangulate(loop, first, middle, candidate) +
                       triangulate(loop, middle, last, candidate);
    if (cost < best) {
      best = cost;
      best_out = candidate;
    }
  }
  out.insert(out.end(), best_out.begin(), best_out.end());
  return best;
}

CellCase make_case(int signs) {
  std::array<int, kCellEdges> next = next_crossings(signs);
  std::vector<int> triangles;
  for (int start = 0; start < kCellEdges; ++start) {
    std::vector<int> loop;
    for (int e = start; next[static_cast<std::size_t>(e)] != kNone;) {
      loop.push_back(e);
      e = std::exchange(next[static_cast<std::size_t>(e)], kNone);
    }
    if (loop.empty()) continue;
    if (triangulate(loop, 0, loop.size() - 1, triangles) == std::numeric_limits<float>::infinity()) {
      throw Error("marching cubes: case " + std::to_string(signs) + " has no admissible triangulation");
    }
  }
  CellCase result;
  if (triangles.size() > std::size(result.edge))
    throw Error("marching cubes: case " + std::to_string(signs) + " is too large");
  result.triangle_count = static_cast<std::uint8_t>(triangles.size() / 3);
  for (std::size_t i = 0; i < triangles.size(); ++i) result.edge[i] = static_cast<std::uint8_t>(triangles[i]);
  return result;
}

}  // namespace

std::vector<CellCase> make_marching_cubes_table() {
  std::vector<CellCase> table;
  for (int signs = 0; signs < 256; ++signs) table.push_back(make_case(signs));
  return table;
}

}  // namespace tactus
