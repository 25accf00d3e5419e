#include "tactus/io/mesh/mesh_reading.h"

#include <charconv>
#include <cmath>

#include "tactus/base/error.h"

namespace tactus::mesh_reading {

void RawMesh::add_vertex(Vec3d position) {
  if (positions.size() >= kMaxVertices) throw TooLarge();
  positions.push_back(position);
}

void RawMesh::add_face(std::span<const std::int64_t> corners, std::int64_t place) {
  if (corners.size() > 2 && corners.size() - 2 > kMaxTriangles - triangles.size()) throw TooLarge();
  if (corners.size() > 3) polygons.push_back({triangles.size(), corners.size()});
  for (std::size_t i = 2; i < corners.size(); ++i) {
    triangles.push_back({corners[0], corners[i - 1], corners[i]});
    faces.push_back(place);
  }
}

void RawMesh::add_strip(std::span<const std::int64_t> corners, std::int64_t place) {
  std::size_t begin = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (corners[i] < 0) begin = i + 1;
    if (i < begin + 2) continue;
    std::array<std::int64_t, 3> t = {corners[i - 2], corners[i - 1], corners[i]};
    if ((i - begin) % 2 == 1) std::swap(t[0], t[1]);
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) add_face(t, place);
  }
}

std::string RawMesh::face_text(const std::string& path, std::size_t triangle) const {
  const std::string place = std::to_string(faces[triangle]);
  return path + (faces_are_lines ? ":" + place + ": a face" : ": face " + place);
}

PlainText::PlainText(std::string_view bytes) : view_(bytes) {
  if (bytes.starts_with("\xef\xbb\xbf")) view_.remove_prefix(3);
  // Without its mark, UTF-16 is told by the zeros of its first two letters.
  const auto is_zero = [&](std::size_t i) { return bytes[i] == 0; };
  const bool has_four = bytes.size() >= 4, marks_little = bytes.starts_with("\xff\xfe"),
             marks_big = bytes.starts_with("\xfe\xff"),
             little = marks_little || (has_four && !is_zero(0) && is_zero(1) && !is_zero(2) && is_zero(3)),
             big = marks_big || (has_four && is_zero(0) && !is_zero(1) && is_zero(2) && !is_zero(3));
  if (!little && !big) return;
  own_.reserve(bytes.size() / 2);
  for (std::size_t i = marks_little || marks_big ? 2 : 0; i + 1 < bytes.size(); i += 2) {
    const char low = bytes[little ? i : i + 1], high = bytes[little ? i + 1 : i];
    own_ += high == 0 && static_cast<unsigned char>(low) < 128 ? low : '?';
  }
  view_ = own_;
}

std::string lower_case(std::string_view word) {
  std::string lower(word);
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return lower;
}

std::string_view LineReader::take_line() {
  const std::size_t end = rest_.find_first_of("\r\n");
  const std::string_view line = rest_.substr(0, end);
  ++line_;
  if (end == std::string_view::npos) {
    rest_ = {};
    return line;
  }
  const bool cr = rest_[end] == '\r', pair = cr && end + 1 < rest_.size() && rest_[end + 1] == '\n';
  if (line_ == 1) cr_alone_ = cr && !pair;  // then LF may be the first of the bytes behind a header
  rest_ = rest_.substr(end + (pair && !cr_alone_ ? 2 : 1));
  return line;
}

bool LineReader::split(std::string_view line) {
  const std::size_t comment = line.find('#');
  line = line.substr(0, comment);
  constexpr std::string_view kSpace = " \t";
  for (std::size_t b = line.find_first_not_of(kSpace); b != std::string_view::npos;) {
    const std::size_t e = line.find_first_of(kSpace, b);
    words_.push_back(line.substr(b, e == std::string_view::npos ? e : e - b));
    b = line.find_first_not_of(kSpace, e == std::string_view::npos ? line.size() : e);
  }
  if (!joins_ || comment != std::string_view::npos || words_.empty() || !words_.back().ends_with('\\'))
    return false;
  words_.back().remove_suffix(1);
  if (words_.back().empty()) words_.pop_back();
  return true;
}

bool LineReader::next() {
  words_.clear();
  while (!rest_.empty()) {
    if (!split(take_line()) && !words_.empty()) return true;
  }
  return !words_.empty();
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
  // Out of range of a double: it becomes infinity or zero.
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

Vec3d LineReader::position(std::size_t first) const {
  return {number(first), number(first + 1), number(first + 2)};
}

void LineReader::fail(const std::string& message) const {
  throw Error(path_ + ":" + std::to_string(line_) + ": " + message);
}

}  // namespace tactus::mesh_reading
