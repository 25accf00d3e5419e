// Parts of cubes that hold next to nothing. One that nothing else hangs on joins the part across its wall.
#include <algorithm>
#include <map>

#include "tactus/tissue/cut/cut_surface.h"
#include "tactus/tissue/cut/small_part.h"

namespace tactus::cut {
namespace {

/// A part that holds less than a copy's least fill has few copies; one with more is not looked at further.
constexpr std::size_t kMostCopies = 16;

}  // namespace

/// How much the parts of cubes hold, by samples, whatever fill they get.
void CutSurface::note_slivers(const LatticeCutter& cutter, const Stage& s) {
  const CubeLattice& lattice = cutter.lattice();
  const Index first = lattice.regular_cubes();
  for (std::size_t k = 0; k < s.splits.size(); ++k) {
    const CubeSplit& split = s.splits[k].split;
    const double held = split.parent < first ? double{lattice.cube_fill[index(split.parent)]}
                                             : held_[index(split.parent - first)];
    held_[index(split.part[0] - first)] = (1 - s.found[k]) * held;
    held_[index(split.part[1] - first)] = s.found[k] * held;
    if (s.is_sliver[k] != 0) new_slivers_.push_back(split.part[s.found[k] < 0.5 ? 1 : 0]);
  }
}

/// Copies that hang together with this one, if there is nothing but them, and they hold less than kLeastFill.
std::vector<Index> CutSurface::severed_sliver(const LatticeCutter& cutter, Index copy) const {
  double held = 0;
  return small_part(cutter, copy, kMostCopies, [&](Index part) {
    held += held_[index(part - cutter.lattice().regular_cubes())];
    return held < kLeastFill;
  });
}

void CutSurface::move_triangles(Index from, Index to) {
  for (const Index triangle : near_) {
    Triangle& t = triangles_[index(triangle)];
    for (Corner& corner : t.corner)
      if (corner.cube == from) corner.cube = to;
    if (t.home == from) t.home = to;
  }
}

/// Where a copy got the material across its wall, both sides of the wall are its own now, and go.
void CutSurface::drop_shut_walls(const std::vector<std::array<Index, 2>>& from_to) {
  std::map<Piece, std::vector<Index>> walls;  // by their points, from the lowest on, in order
  const auto points_of = [](const Triangle& t) {
    Piece p{t.corner[0].point, t.corner[1].point, t.corner[2].point};
    std::rotate(p.begin(), std::min_element(p.begin(), p.end()), p.end());
    return p;
  };
  for (const Index triangle : near_) {
    const Triangle& t = triangles_[index(triangle)];
    const bool is_of_joined =
        std::any_of(from_to.begin(), from_to.end(), [&](const auto& join) { return join[1] == t.home; });
    if (t.is_fill || !is_of_joined || !is_used(vertices_of_[index(triangle)])) continue;
    const Piece p = points_of(t);
    const auto twin = walls.find({p[0], p[2], p[1]});
    if (twin == walls.end() || twin->second.empty()) {
      walls[p].push_back(triangle);
      continue;
    }
    drop_triangle(twin->second.back());
    drop_triangle(triangle);
    twin->second.pop_back();
  }
}

}  // namespace tactus::cut
