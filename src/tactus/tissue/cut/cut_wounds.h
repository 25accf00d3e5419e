#pragma once
/// The walls of cuts in small pieces, as a body is cut.
#include <unordered_map>
#include <vector>

#include "tactus/tissue/cut/cut_surface.h"

namespace tactus::cut {

/// A piece of a wall, on one side of it. Places are at rest, in lattice coordinates.
struct WallPiece {
  Vec3d p{};         ///< on the wall
  Vec3d normal{};    ///< unit, out of the body
  Vec3d skin{};      ///< near_skin: outward normal of the original surface there
  double depth = 0;  ///< below the original surface [spacings]
  Index cube = 0;    ///< that moves it, or copy
  float area_m2 = 0;
  Index stroke = 0;  ///< as it was given
};

/// Owns them. They add up to the area of the walls, twice. Pieces in cubes that are cut go with the copy that
/// has their place.
class CutWounds {
 public:
  CutWounds() = default;
  /// @param edge_of_piece in spacings @param near_skin to which depth the skin's normal is looked up
  CutWounds(double edge_of_piece, double near_skin, Index capacity)
      : pieces_per_spacing_(std::max(1, static_cast<int>(std::lround(1 / edge_of_piece)))),
        near_skin_(near_skin),
        capacity_(capacity) {}

  /// After CutSurface::update. @param stroke of the new pieces
  void update(const LatticeCutter& cutter, const CutSurface& surface, const TopologyChange& change,
              Index stroke);
  const std::vector<WallPiece>& pieces() const { return pieces_; }
  bool is_near_skin(const WallPiece& piece) const { return piece.depth < near_skin_; }
  /// More than there was capacity for was left out.
  bool is_full() const { return is_full_; }

 private:
  void add(const LatticeCutter& cutter, const CutSurface& surface, WallPiece piece);

  int pieces_per_spacing_ = 1;
  double near_skin_ = 0;
  Index capacity_ = 0;
  std::vector<WallPiece> pieces_;
  std::unordered_map<Index, std::vector<std::size_t>> of_cube_;  ///< in each regular cube
  bool is_full_ = false;
};

}  // namespace tactus::cut
