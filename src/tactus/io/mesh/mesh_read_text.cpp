/// OBJ and STL.
#include <algorithm>
#include <bit>
#include <cstring>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/io/mesh/mesh_reading.h"

namespace tactus::mesh_reading {
namespace {

/// "7", "7/1", "7//2", "7/1/2" or negative (from the end): 0-based vertex and normal (-1: none).
struct ObjCorner {
  std::int64_t vertex, normal;
};
ObjCorner obj_corner(const LineReader& in, std::string_view word, std::size_t vertices, std::size_t normals) {
  const auto index = [&](std::string_view s, std::size_t count) {
    LineReader one("", s);
    std::int64_t value = 0;
    const bool plain = one.next() && one.words().size() == 1;
    try {
      value = plain ? one.integer(0) : 0;
    } catch (const Error&) {
      value = 0;
    }
    if (value == 0)
      in.fail("corner '" + std::string(word) + "', expected vertex numbers from 1 such as 3 or 3/1/2");
    return value > 0 ? value - 1 : static_cast<std::int64_t>(count) + value;
  };
  const std::size_t slash = word.find('/');
  const std::int64_t vertex = index(word.substr(0, slash), vertices);
  const std::size_t last = word.rfind('/');
  const bool has_normal = slash != word.npos && last != slash && last + 1 < word.size();
  return {vertex, has_normal ? index(word.substr(last + 1), normals) : -1};
}

RawMesh read_binary_stl(const std::string& bytes, std::uint32_t count) {
  RawMesh raw;
  raw.positions.reserve(std::min(3 * static_cast<std::size_t>(count), kMaxVertices));
  for (std::uint32_t t = 0; t < count; ++t) {
    float corner[9];
    std::memcpy(corner, bytes.data() + 84 + 50 * static_cast<std::size_t>(t) + 12, sizeof corner);
    const std::int64_t first = 3 * static_cast<std::int64_t>(t);
    for (int i = 0; i < 3; ++i)
      raw.add_vertex(vec_cast<double>(Vec3f{corner[3 * i], corner[3 * i + 1], corner[3 * i + 2]}));
    raw.add_face(std::array<std::int64_t, 3>{first, first + 1, first + 2}, t);
  }
  return raw;
}

/// One mesh of all solids of the file.
RawMesh read_ascii_stl(const std::string& path, std::string_view text) {
  RawMesh raw;
  raw.faces_are_lines = true;
  LineReader in(path, text);
  std::vector<std::int64_t> corners;
  bool open = true;
  while (in.next()) {
    const std::string key = lower_case(in.words()[0]);
    if (key == "vertex") {
      corners.push_back(static_cast<std::int64_t>(raw.positions.size()));
      raw.add_vertex(in.position(1));
      raw.lines.push_back(in.line());
    } else if (key == "endfacet") {
      if (corners.size() != 3)
        in.fail("a facet with " + std::to_string(corners.size()) + " vertices, expected 3");
      raw.add_face(corners, in.line());
      corners.clear();
    } else if (key == "endsolid" || key == "solid") {
      open = key == "solid";
    } else if (key != "facet" && key != "outer" && key != "endloop") {
      in.fail("'" + std::string(in.words()[0]) +
              "', expected facet, outer, vertex, endloop, endfacet, endsolid or solid");
    }
  }
  if (open)
    throw Error(path + ": truncated after line " + std::to_string(in.line()) + ", expected 'endsolid'");
  return raw;
}

/// A binary header may begin with "solid", too: only text goes on with facets.
bool is_ascii_stl(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  if (lower_case(text.substr(0, 5)) != "solid") return false;
  for (const std::string_view word : {"facet", "FACET", "Facet", "endsolid", "ENDSOLID", "EndSolid"}) {
    if (text.find(word) != text.npos) return true;
  }
  return false;
}

}  // namespace

RawMesh read_obj(const std::string& path, const std::string& bytes) {
  RawMesh raw;
  raw.faces_are_lines = true;
  const PlainText text(bytes);
  std::vector<Vec3f> normals;
  bool normals_match = true;  // normal i belongs to vertex i, as in files that this program wrote
  std::vector<std::int64_t> corners;
  for (LineReader in(path, text.view(), true); in.next();) {
    const auto& words = in.words();
    if (words[0] == "v") {
      raw.add_vertex(in.position(1));
      raw.lines.push_back(in.line());
    } else if (words[0] == "vn") {
      normals.push_back(vec_cast<float>(in.position(1)));
    } else if (words[0] == "f") {
      if (words.size() < 4)
        in.fail("a face with " + std::to_string(words.size() - 1) + " corners, expected 3 or more");
      corners.clear();
      for (std::size_t i = 1; i < words.size(); ++i) {
        const ObjCorner corner = obj_corner(in, words[i], raw.positions.size(), normals.size());
        corners.push_back(corner.vertex);
        normals_match = normals_match && corner.normal == corner.vertex;
      }
      raw.add_face(corners, in.line());
    }
  }
  if (normals_match && normals.size() == raw.positions.size()) raw.normals = std::move(normals);
  return raw;
}

RawMesh read_stl(const std::string& path, const std::string& bytes) {
  static_assert(std::endian::native == std::endian::little, "binary STL is read as it lies in memory");
  std::uint32_t count = 0;
  if (bytes.size() >= 84) std::memcpy(&count, bytes.data() + 80, sizeof count);
  const std::uint64_t expected = 84 + 50 * std::uint64_t{count};
  const bool fits = bytes.size() >= 84 && bytes.size() >= expected;
  if (fits && bytes.size() == expected) return read_binary_stl(bytes, count);
  if (const PlainText text(bytes); is_ascii_stl(text.view())) return read_ascii_stl(path, text.view());
  if (bytes.size() < 84)
    throw Error(path + ": truncated, " + std::to_string(bytes.size()) + " bytes are no STL file");
  if (!fits || count == 0)
    throw Error(path + ": " + std::to_string(count) + " triangles take " + std::to_string(expected) +
                " bytes, but the file has " + std::to_string(bytes.size()));
  log_warning(path + ": " + std::to_string(bytes.size() - expected) + " bytes behind its " +
              std::to_string(count) + " triangles are not read");
  return read_binary_stl(bytes, count);
}

}  // namespace tactus::mesh_reading
