#include "tactus/tissue/cut/wall.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "tactus/base/at.h"
#include "tactus/tissue/cut/lattice_cutter.h"

namespace tactus::cut {
namespace {

Vec3d corner(Vec3i cube, int q) { return vec_cast<double>(cube + Vec3i{q & 1, q >> 1 & 1, q >> 2}); }

int pair_of(int a, int b) {
  static const auto table = [] {
    std::array<std::array<int, 8>, 8> pair{};
    for (int k = 0; k < kPairs; ++k) {
      const auto [low, high] = kCornerPairs[at(k)];
      pair[at(low)][at(high)] = pair[at(high)][at(low)] = k;
    }
    return pair;
  }();
  return table[at(a)][at(b)];
}

/// Corners of a tetrahedron on one side of a wall.
struct Corners {
  std::array<int, 4> corner{};
  std::size_t count = 0;
  void push_back(int q) { corner[count++] = q; }
  bool empty() const { return count == 0; }
  std::size_t size() const { return count; }
  int operator[](std::size_t k) const { return corner[k]; }
  int front() const { return corner[0]; }
};

}  // namespace

const std::array<std::array<int, 4>, 6> Wall::kTets = {
    {{0, 1, 3, 7}, {0, 1, 5, 7}, {0, 2, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 4, 6, 7}}};

Wall::Wall(Vec3i cube, std::uint8_t sides, std::uint8_t own, const std::array<Vec3d, 19>& crossing,
           const std::array<std::uint32_t, 2>& wedges)
    : cube_(cube) {
  for (int t = 0; t < 6; ++t) {
    Parting& parting = tets_[at(t)];
    Corners on[2];
    bool has_own[2] = {false, false};
    for (const int q : kTets[at(t)]) {
      on[sides >> q & 1].push_back(q);
      has_own[sides >> q & 1] |= (own >> q & 1) != 0;
    }
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < i; ++j)
        for (const std::size_t side : {0U, 1U})
          has_own[side] |= (wedges[side] >> pair_of(kTets[at(t)][i], kTets[at(t)][j]) & 1U) != 0;
    parting.is_parted = has_own[0] && has_own[1];
    parting.side = has_own[1] || (!has_own[0] && on[0].empty()) ? 1 : 0;
    if (!parting.is_parted) continue;
    const Vec3d on_side_1 = corner(cube, on[1].front());
    if (on[0].size() == 2) {
      // Corners a, b | c, d. The wall has an edge from ac to bd; the plane through a, c and bd holds it.
      const int a = on[0][0], b = on[0][1], c = on[1][0], d = on[1][1];
      const int ac = pair_of(a, c), ad = pair_of(a, d), bc = pair_of(b, c), bd = pair_of(b, d);
      parting.is_double = true;
      const Vec3d p = corner(cube, a);
      parting.middle = {p, cross(corner(cube, c) - p, crossing[at(bd)] - p)};
      if (parting.middle.above(corner(cube, d)) < 0) parting.middle.normal = -parting.middle.normal;
      add(t, ac, bd, bc, crossing, corner(cube, c), parting.below);
      add(t, ac, bd, ad, crossing, corner(cube, d), parting.above);
      continue;
    }
    const bool lone_is_1 = on[1].size() == 1;
    const int lone = on[lone_is_1 ? 1 : 0][0];
    const Corners& others = on[lone_is_1 ? 0 : 1];
    add(t, pair_of(lone, others[0]), pair_of(lone, others[1]), pair_of(lone, others[2]), crossing, on_side_1,
        parting.below);
  }
}

Wall::Wall(Vec3i cube, const WallPlane& plane, const std::array<int, 6>& side) : cube_(cube) {
  for (std::size_t t = 0; t < tets_.size(); ++t) {
    tets_[t].is_parted = side[t] < 0;
    tets_[t].side = std::max(side[t], 0);
    tets_[t].below = plane;
  }
}

void Wall::add(int tet, int a, int b, int c, const std::array<Vec3d, 19>& crossing, Vec3d on_side_1,
               WallPlane& plane) {
  const Vec3d p = crossing[at(a)];
  plane = {p, cross(crossing[at(b)] - p, crossing[at(c)] - p)};
  if (plane.above(on_side_1) < 0) {
    plane.normal = -plane.normal;
    std::swap(b, c);
  }
  triangles_[triangle_count_++] = {
      {static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b), static_cast<std::uint8_t>(c)},
      static_cast<std::uint8_t>(tet)};
}

int Wall::tet_of(Vec3d p) const {
  const Vec3d f = p - vec_cast<double>(cube_);
  if (f.x >= f.y) return f.y >= f.z ? 0 : f.x >= f.z ? 1 : 4;
  return f.x >= f.z ? 2 : f.y >= f.z ? 3 : 5;
}

int Wall::side(Vec3d p) const {
  const Parting& parting = tets_[at(tet_of(p))];
  if (!parting.is_parted) return parting.side;
  const WallPlane& plane = parting.is_double && parting.middle.above(p) >= 0 ? parting.above : parting.below;
  return plane.above(p) >= 0 ? 1 : 0;
}

double volume(const Tet& tet) {
  return std::abs(dot(tet[1] - tet[0], cross(tet[2] - tet[0], tet[3] - tet[0]))) / 6;
}

std::array<Tet, 6> whole_cube(Vec3i cube) {
  std::array<Tet, 6> tets;
  for (std::size_t t = 0; t < tets.size(); ++t)
    for (std::size_t k = 0; k < 4; ++k) tets[t][k] = corner(cube, Wall::kTets[t][k]);
  return tets;
}

TetParts clip(const Tet& tet, const WallPlane& plane) {
  TetParts parts;
  auto& [below, above] = parts;
  below.count = above.count = 0;
  std::array<double, 4> d{};
  std::array<std::size_t, 4> order{0, 1, 2, 3};
  for (std::size_t k = 0; k < 4; ++k) d[k] = plane.above(tet[k]);
  for (std::size_t k = 1; k < 4; ++k)
    for (std::size_t i = k; i > 0 && d[order[i]] < d[order[i - 1]]; --i) std::swap(order[i], order[i - 1]);
  int lower = 0;
  for (const double v : d) lower += v < 0 ? 1 : 0;
  if (lower == 0 || lower == 4) {
    (lower == 0 ? above : below).push_back(tet);
    return parts;
  }
  const Vec3d a = tet[order[0]], b = tet[order[1]], c = tet[order[2]], e = tet[order[3]];
  const auto between = [&](std::size_t i, std::size_t j) {
    return tet[order[i]] + d[order[i]] / (d[order[i]] - d[order[j]]) * (tet[order[j]] - tet[order[i]]);
  };
  /// Triangles pqr and stu with edges p-s, q-t, r-u.
  const auto prism = [](TetPart& to, Vec3d p, Vec3d q, Vec3d r, Vec3d s, Vec3d t, Vec3d u) {
    to.push_back({p, q, r, s});
    to.push_back({q, r, s, t});
    to.push_back({r, s, t, u});
  };
  if (lower == 2) {
    const Vec3d ac = between(0, 2), ae = between(0, 3), bc = between(1, 2), be = between(1, 3);
    prism(below, a, ac, ae, b, bc, be);
    prism(above, c, ac, bc, e, ae, be);
    return parts;
  }
  const bool lone_below = lower == 1;
  const std::size_t lone = lone_below ? 0 : 3, x = lone_below ? 1 : 0, y = lone_below ? 2 : 1,
                    z = lone_below ? 3 : 2;
  const Vec3d p = between(lone, x), q = between(lone, y), r = between(lone, z);
  (lone_below ? below : above).push_back({tet[order[lone]], p, q, r});
  prism(lone_below ? above : below, p, q, r, tet[order[x]], tet[order[y]], tet[order[z]]);
  return parts;
}

}  // namespace tactus::cut
