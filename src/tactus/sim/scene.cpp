#include "tactus/sim/scene.h"

#include <charconv>
#include <cmath>

namespace tactus {
namespace {

constexpr double kRadPerDeg = 3.14159265358979323846 / 180;

std::optional<int> parse_index(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < 0) return {};
  return value;
}

Mat3d axis_rotation(int axis, double angle_deg) {
  const double c = std::cos(angle_deg * kRadPerDeg), s = std::sin(angle_deg * kRadPerDeg);
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  Mat3d m = Mat3d::identity();
  m(a, a) = c;
  m(a, b) = -s;
  m(b, a) = s;
  m(b, b) = c;
  return m;
}

}  // namespace

std::optional<FrameRange> parse_frame_range(std::string_view text) {
  const std::size_t dash = text.find('-');
  const std::optional<int> first = parse_index(text.substr(0, dash));
  if (!first) return {};
  if (dash == std::string_view::npos) return FrameRange{*first, *first};
  if (dash + 1 == text.size()) return FrameRange{*first, {}};
  const std::optional<int> last = parse_index(text.substr(dash + 1));
  if (!last || *last < *first) return {};
  return FrameRange{*first, last};
}

std::string frame_range_text(const FrameRange& range) {
  return std::to_string(range.first) + "-" + (range.last ? std::to_string(*range.last) : "");
}

Mat3d PlacementDescription::rotation() const {
  return axis_rotation(2, rotation_deg.z) * axis_rotation(1, rotation_deg.y) *
         axis_rotation(0, rotation_deg.x);
}

bool SpaceRegion::contains(Vec3d p_m) const {
  if (kind == RegionKind::label) return false;
  if (kind == RegionKind::sphere) return dot(p_m - center_m, p_m - center_m) <= radius_m * radius_m;
  if (kind == RegionKind::half_space) return dot(p_m - point_m, normal) <= 0;
  return p_m.x >= box.min_m.x && p_m.x <= box.max_m.x && p_m.y >= box.min_m.y && p_m.y <= box.max_m.y &&
         p_m.z >= box.min_m.z && p_m.z <= box.max_m.z;
}

bool BodyDescription::in(const SpaceRegion& region, Vec3d p_world_m) const {
  return region.contains(region.frame == CoordinateFrame::world ? p_world_m : placement.to_body(p_world_m));
}

}  // namespace tactus
