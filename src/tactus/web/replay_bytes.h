#pragma once
/// Vertices of a report: small where things hardly move.
#include <array>
#include <span>
#include <string>
#include <string_view>

#include "tactus/base/vec.h"

namespace tactus {

/// Packs vertices of the stream (8 bytes each). Each 16-bit word becomes its difference from the word of the
/// frame before, or from that of the vertex before it. A difference d becomes (2 d) xor (d < 0 ? -1 : 0):
/// small numbers for small moves. Then all first bytes follow one another, then all second ones, to the
/// eighth. That deflates well.
/// @param before of as many vertices; or empty: differences are from the vertex before
std::string pack_vertices(std::string_view vertices, std::string_view before);
/// Likewise, corners of triangles as differences from the corner before, in 32 bits.
std::string pack_corners(std::span<const std::array<Index, 3>> triangles);

/// Film on vertices: each byte less that of the frame before, where that has as many.
std::string pack_film(std::string_view film, std::string_view before);

/// zlib's deflate at its best, as DecompressionStream('deflate') reads it. @throws Error out of memory.
std::string deflated(std::string_view bytes);

}  // namespace tactus
