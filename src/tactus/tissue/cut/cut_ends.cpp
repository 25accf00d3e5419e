// Where the material of parts of cubes ends on the ways between corners, and the part of it that has no
// corner there.
#include "tactus/tissue/cut/cut_surface.h"

namespace tactus::cut {
namespace {

/// Whether corners hang together beside the diagonal from a to b: some of them have, with it, a face of a
/// tetrahedron, and these hang together by ways between the corners alone.
bool hang_together_beside(unsigned corners, int a, int b) {
  unsigned beside = 0;
  for (int q = 0; q < 8; ++q)
    if (q != a && q != b && ((q ^ a) & ~(a ^ b) & 7) == 0) beside |= corners & 1U << q;
  if (beside == 0) return false;
  unsigned found = beside & (0U - beside);
  for (unsigned before = 0; before != found;) {
    before = found;
    for (const auto& [p, q] : kCornerPairs)
      if (((found >> p | found >> q) & 1U) != 0) found |= corners & (1U << p | 1U << q);
  }
  return (beside & ~found) == 0;
}

/// A wall that is nearer to the end of the material than kMargin goes to kBeyond: shares of the way from the
/// end to the corner beyond it.
constexpr double kMargin = 0.005, kBeyond = 0.05;

}  // namespace

/// Share of the way between the corners of a pair at which a point on it lies.
double CutSurface::share_of(const LatticeCutter& cutter, Index cube, std::size_t pair, Index point) const {
  const auto [a, b] = kCornerPairs[pair];
  const auto corner = [](int q) { return vec_cast<double>(Vec3i{q & 1, q >> 1 & 1, q >> 2}); };
  const Vec3d way = corner(b) - corner(a);
  return dot(at(point) - vec_cast<double>(cutter.lattice().cubes[index(cube)]) - corner(a), way) /
         dot(way, way);
}

/// Whether a new wall at a place on a diagonal leaves material between itself and an older wall.
bool CutSurface::has_wedge(const LatticeCutter& cutter, Index cube, std::size_t pair, double place) const {
  const Index regular_cubes = cutter.lattice().regular_cubes();
  if (cube < regular_cubes || pair < 12 || place < 0) return false;
  const auto [a, b] = kCornerPairs[pair];
  const std::uint8_t own = cutter.corners(cube);
  if ((own >> a & 1) == (own >> b & 1)) return false;
  const Index at_end = ends_[index(cube - regular_cubes)][pair][0];
  // Where an older wall was led round another one's end, its place tells nothing.
  if (points_[index(at_end)].is_beyond) return false;
  const double end = share_of(cutter, cube, pair, at_end);
  return (own >> a & 1) != 0 ? place < (1 - kMargin) * end : 1 - place < (1 - kMargin) * (1 - end);
}

/// Beyond the end of its material a wall parts nothing. Material between an older wall and a new one on the
/// same way has no corner there. On a diagonal it goes to the part that has a corner beside the diagonal on
/// the same side of the new wall: as all cubes round the diagonal have that corner, they decide the same. On
/// an edge it stays with the corner of the edge, and the wall goes on beyond the older one.
void CutSurface::keep_in_reach(const LatticeCutter& cutter, Split& split,
                               std::array<double, kPairs>& places) const {
  const Index regular_cubes = cutter.lattice().regular_cubes(), parent = split.split.parent;
  if (parent < regular_cubes) return;
  const std::uint8_t own = cutter.corners(parent), sides = split.split.sides;
  const auto& ends = ends_[index(parent - regular_cubes)];
  for (std::size_t pair = 0; pair < kPairs; ++pair) {
    const auto [a, b] = kCornerPairs[pair];
    const bool has_a = (own >> a & 1) != 0, has_b = (own >> b & 1) != 0;
    if (has_a && has_b) continue;
    if (has_a == has_b) {
      if (ends[pair][1] < 0) continue;
      const double low = share_of(cutter, parent, pair, ends[pair][0]),
                   high = share_of(cutter, parent, pair, ends[pair][1]);
      double& place = places[pair];
      if (place > low * (1 - kMargin) && place < high + kMargin * (1 - high))
        place = place - low < high - place ? low * (1 - kBeyond) : high + kBeyond * (1 - high);
      split.wedges[sides >> (place < 0 || place < low ? b : a) & 1] |= 1U << pair;
      continue;
    }
    if (places[pair] < 0) continue;
    const int foreign = has_a ? b : a, side = sides >> foreign & 1;
    const unsigned on_side = own & (side == 1 ? sides : ~unsigned{sides});
    if (has_wedge(cutter, parent, pair, places[pair]) && hang_together_beside(on_side, a, b)) {
      split.wedges[side] |= 1U << pair;
      continue;
    }
    const double end = share_of(cutter, parent, pair, ends[pair][0]);
    if (has_a ? places[pair] >= end + kMargin * (1 - end) : places[pair] <= (1 - kMargin) * end) continue;
    places[pair] = has_a ? end + kBeyond * (1 - end) : (1 - kBeyond) * end;
    split.beyond |= 1U << pair;
  }
}

/// Where the material of the parts ends on the ways from their corners, and where wedges begin and end.
void CutSurface::note_ends(const LatticeCutter& cutter, Split& split) {
  const Index regular_cubes = cutter.lattice().regular_cubes(), parent = split.split.parent;
  const std::uint8_t of_parent = cutter.corners(parent);
  constexpr Ends kNone{-1, -1};
  const std::uint32_t wedges = split.wedges[0] | split.wedges[1];
  for (std::size_t pair = 0; pair < kPairs; ++pair) {
    const auto [a, b] = kCornerPairs[pair];
    const bool has_a = (of_parent >> a & 1) != 0, has_b = (of_parent >> b & 1) != 0, has_one = has_a != has_b,
               is_wedge = (wedges >> pair & 1) != 0;
    const Ends before = parent < regular_cubes ? kNone : ends_[index(parent - regular_cubes)][pair];
    const bool is_at_end = has_one && split.point[pair] == before[0];
    split.in_reach |= ((has_a && has_b) || is_at_end || (has_one && is_wedge) ? 1U : 0U) << pair;
    split.at_end |= (is_at_end ? 1U : 0U) << pair;
    for (const int side : {0, 1}) {
      const Index part = split.split.part[side];
      const std::uint8_t own = cutter.corners(part);
      Ends& ends = ends_[index(part - regular_cubes)][pair];
      ends = kNone;
      if ((own >> a & 1) != (own >> b & 1)) {
        ends = {(has_a && has_b) || is_wedge ? split.point[pair] : before[0], -1};
      } else if (((own >> a | own >> b) & 1) == 0 && (split.wedges[side] >> pair & 1) != 0) {
        ends = has_a   ? Ends{split.point[pair], before[0]}
               : has_b ? Ends{before[0], split.point[pair]}
                       : before;
      }
    }
  }
}

}  // namespace tactus::cut
