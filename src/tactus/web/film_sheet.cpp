#include "tactus/web/film_sheet.h"

#include <algorithm>

namespace tactus {

std::string FilmSheet::add(const TriangleMesh& mesh, std::string_view film) {
  std::vector<Index> number(mesh.positions_m.size());
  for (std::size_t v = 0; v < number.size(); ++v) {
    const Vec3f p = mesh.positions_m[v], n = mesh.normals[v];
    const auto [found, is_new] =
        number_.try_emplace({p.x, p.y, p.z, n.x, n.y, n.z}, static_cast<Index>(positions_m_.size()));
    number[v] = found->second;
    if (!is_new) continue;
    positions_m_.push_back(p);
    normals_.push_back(n);
  }
  for (std::array<Index, 3> t : mesh.triangles) {
    for (Index& corner : t) corner = number[static_cast<std::size_t>(corner)];
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    if (known_.insert(t).second) triangles_ = nullptr;
  }
  std::string bytes(positions_m_.size(), '\0');
  for (std::size_t v = 0; v < number.size(); ++v) bytes[static_cast<std::size_t>(number[v])] = film[v];
  return bytes;
}

std::shared_ptr<const FilmSheet::Triangles> FilmSheet::triangles() {
  if (triangles_ == nullptr) triangles_ = std::make_shared<const Triangles>(known_.begin(), known_.end());
  return triangles_;
}

}  // namespace tactus
