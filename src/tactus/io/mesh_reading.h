#pragma once
/// What the readers of mesh files share. Internal to io.
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tactus/geom/mesh.h"

namespace tactus::mesh_reading {

/// Largest mesh that is read: 67 million vertices, 134 million triangles.
constexpr std::size_t kMaxVertices = std::size_t{1} << 26, kMaxTriangles = std::size_t{1} << 27;
/// Thrown where a file asks for more, before memory is taken. Caught by parse_mesh.
struct TooLarge {};

/// What a file holds, before it is checked.
struct RawMesh {
  std::vector<Vec3f> positions, normals;
  std::vector<std::array<std::int64_t, 3>> triangles;
  std::vector<std::int64_t> faces;  ///< per triangle: its line, or the number of its face
  std::vector<std::int64_t> lines;  ///< per position: its line; empty: the number of the vertex is named
  bool faces_are_lines = false;

  /// @throws TooLarge beyond kMaxVertices.
  void add_vertex(Vec3f position_m);
  /// Adds a polygon as a fan of triangles. @throws TooLarge beyond kMaxTriangles.
  void add_face(std::span<const std::int64_t> corners, std::int64_t place);
};

/// Checks everything that makes a mesh usable. @throws Error naming the line or element and its value.
TriangleMesh finish(const std::string& path, RawMesh&& raw);

/// Non-empty lines of a text, split into words; what follows '#' is a comment.
class LineReader {
 public:
  LineReader(std::string path, std::string_view text) : path_(std::move(path)), rest_(text) {}
  /// Moves on; false at the end of the file.
  bool next();
  /// Moves on. @throws Error "truncated, expected `what`".
  void require(const std::string& what);
  const std::vector<std::string_view>& words() const { return words_; }
  std::int64_t line() const { return line_; }
  std::string_view rest() const { return rest_; }

  /// Word i as a number (NaN and infinity included). @throws Error naming line and word.
  double number(std::size_t i) const;
  std::int64_t integer(std::size_t i) const;
  Vec3f position(std::size_t first) const;
  [[noreturn]] void fail(const std::string& message) const;

 private:
  std::string path_;
  std::string_view rest_;
  std::int64_t line_ = 0;
  std::vector<std::string_view> words_;
};

RawMesh read_ply(const std::string& path, const std::string& bytes);
RawMesh read_obj(const std::string& path, const std::string& bytes);
RawMesh read_stl(const std::string& path, const std::string& bytes);
RawMesh read_off(const std::string& path, const std::string& bytes);
/// Buffers are looked for in the folder of `path` and below, nowhere else.
RawMesh read_gltf(const std::string& path, const std::string& bytes, bool binary);

}  // namespace tactus::mesh_reading
