#include "tactus/tissue/cut/cut_wounds.h"

#include <set>

#include "tactus/tissue/cut/wall_parts.h"

namespace tactus::cut {

void CutWounds::update(const LatticeCutter& cutter, const CutSurface& surface, const TopologyChange& change,
                       Index stroke) {
  for (const auto& [cubes_of_sides, wall] : wall_cells(surface, pieces_per_spacing_)) {
    if (!(wall.area > 0)) continue;
    WallPiece piece;
    piece.p = wall.middle;
    piece.area_m2 = static_cast<float>(wall.area * sqr(double{cutter.lattice().spacing_m}));
    piece.stroke = stroke;
    piece.depth = surface.depth(wall.middle);
    if (is_near_skin(piece)) piece.skin = surface.outward(wall.middle);
    for (const std::size_t side : {0U, 1U}) {
      piece.cube = cubes_of_sides.at(side);
      piece.normal = (side == 0 ? 1.0 : -1.0) * wall.normal;
      add(cutter, surface, piece);
    }
  }
  std::set<Index> cubes;
  for (const TopologyChange::Copy& copy : change.copies) cubes.insert(copy.copy.of);
  for (const Index cube : cubes) {
    const auto known = of_cube_.find(cube);
    if (known == of_cube_.end()) continue;
    for (const std::size_t k : known->second) pieces_[k].cube = surface.leaf(pieces_[k].cube, pieces_[k].p);
  }
}

void CutWounds::add(const LatticeCutter& cutter, const CutSurface& surface, WallPiece piece) {
  if (static_cast<Index>(pieces_.size()) >= capacity_) {
    is_full_ = true;
    return;
  }
  piece.cube = surface.leaf(piece.cube, piece.p);
  of_cube_[cutter.regular_of(piece.cube)].push_back(pieces_.size());
  pieces_.push_back(piece);
}

}  // namespace tactus::cut
