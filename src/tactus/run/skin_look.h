#pragma once
/// The skin of a body as it is drawn.
#include <cstdint>
#include <vector>

#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// A sharp margin that a lattice samples gets teeth of a sample's size. They go; what is larger, and the
/// volume, stay (Taubin 1995). Normals are made anew.
/// @param may_move per vertex
void smooth_skin(TriangleMesh& surface, const std::vector<std::uint8_t>& may_move);

}  // namespace tactus
