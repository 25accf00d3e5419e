#include "tactus/web/replay_bytes.h"

#include <zlib.h>

#include <cstdint>
#include <cstring>

#include "tactus/base/error.h"

namespace tactus {

std::string pack_vertices(std::string_view vertices, std::string_view before) {
  const std::size_t count = vertices.size() / 8;
  std::string packed(vertices.size(), '\0');
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t w = 0; w < 4; ++w) {
      const std::size_t at = 8 * i + 2 * w;
      std::uint16_t now = 0, then = 0;
      std::memcpy(&now, vertices.data() + at, 2);
      if (!before.empty())
        std::memcpy(&then, before.data() + at, 2);
      else if (i > 0)
        std::memcpy(&then, vertices.data() + at - 8, 2);
      const auto d = static_cast<std::uint16_t>(now - then);
      const auto folded = static_cast<std::uint16_t>((d << 1) ^ ((d & 0x8000) != 0 ? 0xFFFF : 0));
      packed[2 * w * count + i] = static_cast<char>(folded & 255);
      packed[(2 * w + 1) * count + i] = static_cast<char>(folded >> 8);
    }
  }
  return packed;
}

std::string pack_corners(std::span<const std::array<Index, 3>> triangles) {
  const std::size_t count = 3 * triangles.size();
  std::string packed(4 * count, '\0');
  std::uint32_t last = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto corner = static_cast<std::uint32_t>(triangles[i / 3][i % 3]);
    const std::uint32_t d = corner - last;
    const std::uint32_t folded = (d << 1) ^ ((d & 0x80000000U) != 0 ? 0xFFFFFFFFU : 0U);
    for (std::size_t k = 0; k < 4; ++k) packed[k * count + i] = static_cast<char>(folded >> (8 * k) & 255);
    last = corner;
  }
  return packed;
}

std::string pack_film(std::string_view film, std::string_view before) {
  std::string packed(film);
  if (before.size() == film.size())
    for (std::size_t i = 0; i < packed.size(); ++i)
      packed[i] =
          static_cast<char>(static_cast<unsigned char>(film[i]) - static_cast<unsigned char>(before[i]));
  return packed;
}

std::string deflated(std::string_view bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::string out(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                static_cast<uLong>(bytes.size()), Z_BEST_COMPRESSION) != Z_OK)
    throw Error("a report of " + bytes_text(static_cast<double>(bytes.size())) +
                " can't be compressed: out of memory");
  out.resize(size);
  return out;
}

}  // namespace tactus
