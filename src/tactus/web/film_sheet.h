#pragma once
/// Film on an obstacle that stands still, as reports keep it.
#include <array>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>

#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// A frame has the triangles where a film lies, so their vertices have other numbers in each. Here a vertex
/// keeps its number, and triangles of all frames are one list, which a report has once.
class FilmSheet {
 public:
  using Triangles = std::vector<std::array<Index, 3>>;
  /// Takes the triangles of a frame. @param film a byte a vertex
  /// @returns a byte for each vertex that is known so far; 0 where no film lies.
  std::string add(const TriangleMesh& mesh, std::string_view film);
  const std::vector<Vec3f>& positions_m() const { return positions_m_; }
  const std::vector<Vec3f>& normals() const { return normals_; }
  /// All of the frames so far, sorted, each from its smallest corner on: they deflate well so. The same
  /// object until there are more.
  std::shared_ptr<const Triangles> triangles();

 private:
  std::map<std::array<float, 6>, Index> number_;  ///< by position and normal: a crease has several
  std::vector<Vec3f> positions_m_, normals_;
  std::set<std::array<Index, 3>> known_;
  std::shared_ptr<const Triangles> triangles_;
};

}  // namespace tactus
