#include "tactus/io/mesh_reading.h"

#include <charconv>
#include <cmath>
#include <cstdio>

#include "tactus/base/error.h"

namespace tactus::mesh_reading {
namespace {

std::string position_text(Vec3f p) {
  char text[96];
  std::snprintf(text, sizeof text, "(%g, %g, %g)", static_cast<double>(p.x), static_cast<double>(p.y),
                static_cast<double>(p.z));
  return text;
}

}  // namespace

void RawMesh::add_vertex(Vec3f position_m) {
  if (positions.size() >= kMaxVertices) throw TooLarge();
  positions.push_back(position_m);
}

void RawMesh::add_face(std::span<const std::int64_t> corners, std::int64_t place) {
  if (corners.size() > 2 && corners.size() - 2 > kMaxTriangles - triangles.size()) throw TooLarge();
  for (std::size_t i = 2; i < corners.size(); ++i) {
    triangles.push_back({corners[0], corners[i - 1], corners[i]});
    faces.push_back(place);
  }
}

TriangleMesh finish(const std::string& path, RawMesh&& raw) {
  const auto count = static_cast<std::int64_t>(raw.positions.size());
  for (std::size_t i = 0; i < raw.positions.size(); ++i) {
    const Vec3f p = raw.positions[i];
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) continue;
    const std::string place = raw.lines.empty() ? "" : ":" + std::to_string(raw.lines[i]);
    throw Error(path + place + ": vertex " + std::to_string(i) + " is " + position_text(p) +
                ", expected finite numbers");
  }
  TriangleMesh mesh;
  mesh.triangles.reserve(raw.triangles.size());
  for (std::size_t t = 0; t < raw.triangles.size(); ++t) {
    for (const std::int64_t v : raw.triangles[t]) {
      if (v >= 0 && v < count) continue;
      const std::string place = std::to_string(raw.faces[t]);
      throw Error(path + (raw.faces_are_lines ? ":" + place + ": a face" : ": face " + place) +
                  " refers to vertex " + std::to_string(v) + ", but there are " + std::to_string(count) +
                  " (counted from 0)");
    }
    const auto& [a, b, c] = raw.triangles[t];
    mesh.triangles.push_back({static_cast<Index>(a), static_cast<Index>(b), static_cast<Index>(c)});
  }
  if (mesh.triangles.empty()) throw Error(path + ": no triangles in it, expected a surface");
  mesh.positions_m = std::move(raw.positions);
  mesh.normals = std::move(raw.normals);
  return mesh;
}

bool LineReader::next() {
  while (!rest_.empty()) {
    const std::size_t end = rest_.find('\n');
    std::string_view line = rest_.substr(0, end);
    rest_ = end == std::string_view::npos ? std::string_view{} : rest_.substr(end + 1);
    ++line_;
    line = line.substr(0, line.find('#'));
    words_.clear();
    constexpr std::string_view kSpace = " \t\r";
    for (std::size_t b = line.find_first_not_of(kSpace); b != std::string_view::npos;) {
      const std::size_t e = line.find_first_of(kSpace, b);
      words_.push_back(line.substr(b, e == std::string_view::npos ? e : e - b));
      b = line.find_first_not_of(kSpace, e == std::string_view::npos ? line.size() : e);
    }
    if (!words_.empty()) return true;
  }
  words_.clear();
  return false;
}

void LineReader::require(const std::string& what) {
  if (!next()) throw Error(path_ + ": truncated after line " + std::to_string(line_) + ", expected " + what);
}

double LineReader::number(std::size_t i) const {
  if (i >= words_.size())
    fail(std::to_string(words_.size()) + " values, expected at least " + std::to_string(i + 1));
  std::string_view s = words_[i];
  if (s.size() > 1 && s.front() == '+') s.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
  // Out of range of a double: so is a float; it is reported as the infinity or zero that it becomes.
  if (error == std::errc::result_out_of_range) return s.find("e-") == s.npos ? HUGE_VAL : 0;
  if (error != std::errc{} || end != s.data() + s.size())
    fail("'" + std::string(words_[i]) + "', expected a number");
  return value;
}

std::int64_t LineReader::integer(std::size_t i) const {
  if (i >= words_.size())
    fail(std::to_string(words_.size()) + " values, expected at least " + std::to_string(i + 1));
  std::int64_t value = 0;
  const std::string_view s = words_[i];
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
  if (error != std::errc{} || end != s.data() + s.size())
    fail("'" + std::string(s) + "', expected a whole number");
  return value;
}

Vec3f LineReader::position(std::size_t first) const {
  return {static_cast<float>(number(first)), static_cast<float>(number(first + 1)),
          static_cast<float>(number(first + 2))};
}

void LineReader::fail(const std::string& message) const {
  throw Error(path_ + ":" + std::to_string(line_) + ": " + message);
}

}  // namespace tactus::mesh_reading
