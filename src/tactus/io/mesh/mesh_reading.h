#pragma once
/// Types and functions that the readers of mesh files share. Internal to io.
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tactus/geom/mesh/mesh.h"

namespace tactus::mesh_reading {

/// Largest mesh that is read: 67 million vertices, 134 million triangles.
constexpr std::size_t kMaxVertices = std::size_t{1} << 26, kMaxTriangles = std::size_t{1} << 27;
/// Thrown where a file asks for more, before memory is taken. Caught by parse_mesh.
struct TooLarge {};

/// The contents of a file, before they are checked.
struct RawMesh {
  /// A face with more than three corners. Until all positions are known it is a fan, which lists its corners.
  struct Polygon {
    std::size_t first, corners;  ///< its first triangle
  };
  std::vector<Vec3d> positions;  ///< in the file's unit
  std::vector<Vec3f> normals;
  std::vector<std::array<std::int64_t, 3>> triangles;
  std::vector<Polygon> polygons;
  std::vector<std::int64_t> faces;  ///< per triangle: its line, or the number of its face
  std::vector<std::int64_t> lines;  ///< per position: its line; empty: the number of the vertex is named
  bool faces_are_lines = false;

  /// @throws TooLarge beyond kMaxVertices.
  void add_vertex(Vec3d position);
  /// @throws TooLarge beyond kMaxTriangles.
  void add_face(std::span<const std::int64_t> corners, std::int64_t place);
  /// Every corner from the third on makes a triangle with the two before it, turned the other way in every
  /// second; a negative corner ends a strip. Triangles with equal corners lead from one part to the next and
  /// are left out.
  void add_strip(std::span<const std::int64_t> corners, std::int64_t place);
  /// "FILE:7: a face", "FILE: face 7".
  std::string face_text(const std::string& path, std::size_t triangle) const;
};

/// A text as UTF-8: UTF-16 behind its byte order mark becomes ASCII, where '?' stands for all other
/// characters; a byte order mark of UTF-8 goes. Other bytes stay as they are and are not copied.
class PlainText {
 public:
  explicit PlainText(std::string_view bytes);
  PlainText(const PlainText&) = delete;
  PlainText& operator=(const PlainText&) = delete;
  std::string_view view() const { return view_; }

 private:
  std::string own_;
  std::string_view view_;
};

std::string lower_case(std::string_view word);

/// Non-empty lines of a text, split into words; text behind '#' is a comment. Lines end with LF, CR LF or CR.
class LineReader {
 public:
  /// @param joins whether a backslash at the end of a line that is no comment goes on with the next line
  LineReader(std::string path, std::string_view text, bool joins = false)
      : path_(std::move(path)), rest_(text), joins_(joins) {}
  /// Moves on; false at the end of the file.
  bool next();
  /// Moves on. @throws Error "truncated, expected ..." at the end of the file.
  void require(const std::string& what);
  const std::vector<std::string_view>& words() const { return words_; }
  std::int64_t line() const { return line_; }
  std::string_view rest() const { return rest_; }

  /// Word i as a number (NaN and infinity included). @throws Error naming line and word.
  double number(std::size_t i) const;
  std::int64_t integer(std::size_t i) const;
  Vec3d position(std::size_t first) const;
  [[noreturn]] void fail(const std::string& message) const;

 private:
  std::string_view take_line();
  /// Appends the words of a line; whether it goes on.
  bool split(std::string_view line);

  std::string path_;
  std::string_view rest_;
  bool joins_, cr_alone_ = false;
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
