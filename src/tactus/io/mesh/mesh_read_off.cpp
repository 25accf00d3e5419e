/// OFF of Geomview, with and without its first word: vertices may have normals, colours and texture
/// coordinates.
#include <algorithm>
#include <cstring>

#include "tactus/base/byte_io.h"
#include "tactus/base/error.h"
#include "tactus/io/mesh/mesh_reading.h"

namespace tactus::mesh_reading {
namespace {

/// Meaning of the first word: [ST][C][N][4][n]OFF.
struct Kind {
  bool is_off = false, texture = false, color = false, normal = false;
  std::string refused;  ///< the letter for other than three coordinates
};

Kind kind_of(std::string_view word) {
  Kind kind;
  const std::string lower = lower_case(word);
  if (!lower.ends_with("off")) return kind;
  std::string_view letters = word.substr(0, word.size() - 3);
  const auto take = [&](std::string_view small, std::string_view large) {
    if (!letters.starts_with(small) && !letters.starts_with(large)) return false;
    letters.remove_prefix(large.size());
    return true;
  };
  kind.texture = take("st", "ST");
  kind.color = take("c", "C");
  const bool whole_lower = letters == "n" && word.ends_with("off");
  kind.normal = whole_lower ? take("n", "N") : take("N", "N");
  if (take("4", "4")) kind.refused = "4";
  if (take("n", "n")) kind.refused = "n";
  kind.is_off = letters.empty();
  return kind;
}

/// Numbers of Geomview's binary files: 32 bits, the high byte first.
class BigEndian {
 public:
  BigEndian(const std::string& path, std::string_view bytes) : path_(path), bytes_(bytes) {}
  std::int32_t integer(const char* what, std::int64_t i, std::int64_t of) {
    std::uint32_t raw = bytes_.take<std::uint32_t>();
    raw = (raw << 24) | (raw << 8 & 0xff0000U) | (raw >> 8 & 0xff00U) | (raw >> 24);
    if (bytes_.failed())
      throw Error(path_ + ": truncated in " + what + " " + std::to_string(i) + " of " + std::to_string(of));
    return std::bit_cast<std::int32_t>(raw);
  }
  float number(const char* what, std::int64_t i, std::int64_t of) {
    return std::bit_cast<float>(integer(what, i, of));
  }

 private:
  const std::string& path_;
  ByteReader bytes_;
};

void check_corners(const std::string& place, std::int64_t n) {
  if (n < 3 || n > 100000)
    throw Error(place + ": a face with " + std::to_string(n) + " corners, expected 3 or more");
}

RawMesh read_binary(const std::string& path, std::string_view bytes, const Kind& kind) {
  RawMesh raw;
  BigEndian in(path, bytes);
  const std::int64_t vertices = in.integer("count", 0, 3), faces = in.integer("count", 1, 3);
  in.integer("count", 2, 3);  // edges
  if (vertices < 0 || faces < 0)
    throw Error(path + ": " + std::to_string(vertices) + " vertices and " + std::to_string(faces) +
                " faces, expected numbers from 0 on");
  const int more = (kind.normal ? 3 : 0) + (kind.color ? 4 : 0) + (kind.texture ? 2 : 0);
  for (std::int64_t i = 0; i < vertices; ++i) {
    float p[3];
    for (float& x : p) x = in.number("vertex", i, vertices);
    for (int k = 0; k < more; ++k) in.number("vertex", i, vertices);
    raw.add_vertex(vec_cast<double>(Vec3f{p[0], p[1], p[2]}));
  }
  std::vector<std::int64_t> corners;
  for (std::int64_t i = 0; i < faces; ++i) {
    const std::int64_t n = in.integer("face", i, faces);
    check_corners(path + ": face " + std::to_string(i), n);
    corners.clear();
    for (std::int64_t c = 0; c < n; ++c) corners.push_back(in.integer("face", i, faces));
    raw.add_face(corners, i);
    const std::int64_t colors = in.integer("face", i, faces);
    for (std::int64_t c = 0; c < colors; ++c) in.integer("face", i, faces);
  }
  return raw;
}

RawMesh read_text(const std::string& path, LineReader& in, std::size_t first) {
  RawMesh raw;
  raw.faces_are_lines = true;
  const std::int64_t vertices = in.integer(first), faces = in.integer(first + 1);
  if (vertices < 0 || faces < 0) in.fail("a negative number of vertices or faces");
  for (std::int64_t i = 0; i < vertices; ++i) {
    in.require("vertex " + std::to_string(i) + " of " + std::to_string(vertices));
    raw.add_vertex(in.position(0));
    raw.lines.push_back(in.line());
  }
  std::vector<std::int64_t> corners;
  for (std::int64_t i = 0; i < faces; ++i) {
    in.require("face " + std::to_string(i) + " of " + std::to_string(faces));
    const std::int64_t n = in.integer(0);
    check_corners(path + ":" + std::to_string(in.line()), n);
    corners.clear();
    for (std::int64_t c = 1; c <= n; ++c) corners.push_back(in.integer(static_cast<std::size_t>(c)));
    raw.add_face(corners, in.line());
  }
  return raw;
}

bool is_number(std::string_view word) { return word.find_first_not_of("0123456789") == word.npos; }

}  // namespace

RawMesh read_off(const std::string& path, const std::string& bytes) {
  const PlainText text(bytes);
  LineReader in(path, text.view());
  in.require("'OFF'");
  const std::string word(in.words()[0]);
  // Some programs leave the word out.
  if (in.words().size() >= 2 && in.words().size() <= 3 && is_number(word)) return read_text(path, in, 0);
  const Kind kind = kind_of(word);
  if (!kind.is_off) in.fail("'" + word + "', expected 'OFF', or COFF, NOFF, STOFF and the like");
  if (!kind.refused.empty())
    in.fail("'" + word + "' has not three coordinates a vertex, expected OFF, COFF, NOFF or STOFF");
  std::size_t first = 1;  // the counts may follow on the same line
  if (in.words().size() > 1 && lower_case(in.words()[1]) == "binary")
    return read_binary(path, in.rest(), kind);
  if (in.words().size() == 1) {
    in.require("the numbers of vertices and faces");
    first = 0;
  }
  return read_text(path, in, first);
}

}  // namespace tactus::mesh_reading
