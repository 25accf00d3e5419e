#include "tactus/sim/cut_score.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"
#include "tactus/geom/mesh/closest_point.h"
#include "tactus/sim/body/body_point.h"

namespace tactus {
namespace {

constexpr double kOnSkin = 1e-3;   // spacings
constexpr double kSameSide = 0.5;  // cosine of 60 degrees
constexpr double kWindow = 4;      // spacings

struct OnSkin {
  Vec3d at_m, inward;
  double distance_m = 1e30;
};

OnSkin nearest_on_skin(const TriangleMesh& mesh, Vec3d p_m) {
  OnSkin best;
  const Vec3f p = vec_cast<float>(p_m);
  const auto corner = [&](Index v) { return mesh.positions_m[static_cast<std::size_t>(v)]; };
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3f q = closest_point_on_triangle(p, corner(a), corner(b), corner(c));
    const auto distance_m = static_cast<double>(length(p - q));
    if (!(distance_m < best.distance_m)) continue;
    const Vec3f out = cross(corner(b) - corner(a), corner(c) - corner(a));
    best = {vec_cast<double>(q), -1.0 * normalized(vec_cast<double>(out)), distance_m};
  }
  return best;
}

double distance_to_segment_m(Vec3d p, Vec3d a, Vec3d b) {
  const Vec3d way = b - a;
  const double all = dot(way, way), t = all > 0 ? std::clamp(dot(p - a, way) / all, 0.0, 1.0) : 0.0;
  return length(p - a - t * way);
}

/// Pieces without a way into the body take that of the nearest piece that has one and goes on as they do.
void find_missing_ways(std::vector<SkinSegment>& line) {
  const std::vector<SkinSegment> known = line;
  for (SkinSegment& s : line) {
    if (s.inward != Vec3d{}) continue;
    const Vec3d along = normalized(s.to_m - s.from_m), middle_m = 0.5 * (s.from_m + s.to_m);
    double least_m = 1e30;
    for (const SkinSegment& other : known) {
      if (other.inward == Vec3d{} || std::abs(dot(normalized(other.to_m - other.from_m), along)) < 0.7)
        continue;
      const double d_m = length(0.5 * (other.from_m + other.to_m) - middle_m);
      if (d_m < least_m) least_m = d_m, s.inward = other.inward;
    }
  }
}

}  // namespace

std::vector<SkinSegment> skin_line(std::span<const std::array<Vec3d, 3>> walls, const CubeLattice& lattice,
                                   const PointInMesh& skin) {
  const auto h = static_cast<double>(lattice.spacing_m);
  const Vec3d origin_m = vec_cast<double>(lattice.origin_m);
  const auto world_m = [&](Vec3d p) { return origin_m + h * p; };
  const auto is_on_skin = [&](Vec3d p) {
    return static_cast<double>(skin.distance_m(vec_cast<float>(world_m(p)))) < kOnSkin * h;
  };
  using Key = std::array<double, 3>;
  const auto key = [](Vec3d p) { return Key{p.x, p.y, p.z}; };
  std::map<Key, bool> known;
  const auto corner_is_on_skin = [&](Vec3d p) {
    const auto [place, is_new] = known.try_emplace(key(p), false);
    if (is_new) place->second = is_on_skin(p);
    return place->second;
  };
  std::map<std::pair<Key, Key>, int> uses;
  const auto edge = [&](const std::array<Vec3d, 3>& t, std::size_t k) {
    const Key a = key(t.at(k)), b = key(t.at((k + 1) % 3));
    return a < b ? std::pair(a, b) : std::pair(b, a);
  };
  for (const auto& t : walls)
    for (std::size_t k = 0; k < 3; ++k) ++uses[edge(t, k)];
  std::vector<SkinSegment> line;
  for (const auto& t : walls) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (uses[edge(t, k)] != 1) continue;
      const Vec3d a = t.at(k), b = t.at((k + 1) % 3), inner = t.at((k + 2) % 3);
      if (!corner_is_on_skin(a) || !corner_is_on_skin(b) || !is_on_skin(0.5 * (a + b))) continue;
      const Vec3d along = normalized(b - a), way = inner - a;
      const Vec3d height = way - dot(way, along) * along;
      // Rounding turns needles.
      const Vec3d inward = length(height) > kOnSkin ? normalized(height) : Vec3d{};
      line.push_back({world_m(a), world_m(b), inward});
    }
  }
  find_missing_ways(line);
  return line;
}

PlannedLine::PlannedLine(const PlanDescription& plan, const BodyDescription& body, const BodyShape& shape)
    : name_(plan.name), body_(plan.body), tolerance_m_(plan.tolerance_m.value_or(body.spacing_m)) {
  const bool in_body = plan.frame == CoordinateFrame::body;
  const auto to_world = [&](Vec3d p) { return in_body ? body.placement.to_world(p) : p; };
  const auto lay = [&](Vec3d p_m, const std::string& what) {
    const OnSkin on = nearest_on_skin(shape.surface_m, p_m);
    if (on.distance_m > body.spacing_m) {
      const auto text = [&](Vec3d p) { return point_text(in_body ? body.placement.to_body(p) : p); };
      throw usage_error("plan '" + plan.name + "': " + what + " " + text(p_m) + " misses body '" + body.name +
                        "': it is " + number_text(on.distance_m, body.spacing_m) +
                        " m from its surface at rest, expected at most its spacing_m, " +
                        number_text(body.spacing_m) + "; the nearest point of the surface is " +
                        text(on.at_m) + " (frame: " + (in_body ? "body" : "world") + ")");
    }
    points_m_.push_back(on.at_m);
    inward_.push_back(on.inward);
  };
  lay(to_world(plan.line[0]), "'line[0].at'");
  for (std::size_t k = 1; k < plan.line.size(); ++k) {
    const Vec3d from_m = to_world(plan.line[k - 1]), to_m = to_world(plan.line[k]);
    const int parts = std::max(1, static_cast<int>(std::ceil(4 * length(to_m - from_m) / body.spacing_m)));
    const std::string point = "'line[" + std::to_string(k) + "].at'",
                      between = "the way from 'line[" + std::to_string(k - 1) + "].at' to " + point + ", at";
    lay(to_m, point);  // is told of first
    points_m_.pop_back();
    inward_.pop_back();
    for (int i = 1; i <= parts; ++i)
      lay(from_m + static_cast<double>(i) / parts * (to_m - from_m), i < parts ? between : point);
  }
}

double PlannedLine::length_m() const {
  double sum_m = 0;
  for (std::size_t k = 1; k < points_m_.size(); ++k) sum_m += length(points_m_[k] - points_m_[k - 1]);
  return sum_m;
}

PlannedLine::Nearest PlannedLine::nearest(Vec3d p_m) const {
  Nearest best;
  for (std::size_t k = 1; k < points_m_.size(); ++k) {
    const Vec3d from_m = points_m_[k - 1], way = points_m_[k] - from_m;
    const double all = dot(way, way), t = all > 0 ? dot(p_m - from_m, way) / all : 0.0;
    const double off_m = length(p_m - from_m - std::clamp(t, 0.0, 1.0) * way);
    if (!(off_m < best.off_m)) continue;
    const bool is_beyond = (k == 1 && t < 0) || (k + 1 == points_m_.size() && t > 1);
    best = {off_m, k, is_beyond};
  }
  return best;
}

std::optional<LineDeviation> PlannedLine::measure(std::vector<SkinSegment>& cut) const {
  using Place = SkinSegment::Place;
  LineDeviation found;
  double beside_m = 0;
  for (SkinSegment& s : cut) {
    const Nearest nearest = this->nearest(0.5 * (s.from_m + s.to_m));
    s.off_m = nearest.off_m;
    s.place = dot(s.inward, inward_[nearest.piece]) <= kSameSide ? Place::elsewhere
              : nearest.is_beyond                                ? Place::beyond
                                                                 : Place::beside;
    const double length_m = length(s.to_m - s.from_m);
    if (s.place == Place::beyond) found.beyond_m += length_m;
    if (s.place != Place::beside) continue;
    beside_m += length_m;
    found.mean_m += length_m * s.off_m;
    found.max_m = std::max(found.max_m, s.off_m);
  }
  if (!(beside_m > 0)) return {};
  found.mean_m /= beside_m;
  for (std::size_t k = 1; k < points_m_.size(); ++k) {
    const Vec3d middle_m = 0.5 * (points_m_[k - 1] + points_m_[k]);
    const bool is_followed = std::any_of(cut.begin(), cut.end(), [&](const SkinSegment& s) {
      return s.place != Place::elsewhere && distance_to_segment_m(middle_m, s.from_m, s.to_m) <= tolerance_m_;
    });
    if (is_followed) found.followed_m += length(points_m_[k] - points_m_[k - 1]);
  }
  return found;
}

double peak_cut_force_N(std::span<const CutStep> steps, double energy_J_m2, double spacing_m) {
  double peak_N = 0;
  for (std::size_t begin = 0; begin < steps.size(); ++begin) {
    double displacement_m = 0, area_m2 = 0;
    for (std::size_t k = begin + 1; k < steps.size() && displacement_m < kWindow * spacing_m; ++k) {
      displacement_m += steps[k].displacement_m;
      area_m2 += steps[k].area_m2;
    }
    // The rest at the end is too short to say anything, unless it is all there is.
    if (displacement_m > 0 && (begin == 0 || displacement_m >= kWindow * spacing_m))
      peak_N = std::max(peak_N, energy_J_m2 * area_m2 / displacement_m);
  }
  if (steps.size() == 1 && steps[0].displacement_m > 0)
    return energy_J_m2 * steps[0].area_m2 / steps[0].displacement_m;
  return peak_N;
}

}  // namespace tactus
