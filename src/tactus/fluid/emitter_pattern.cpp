#include "tactus/fluid/emitter_pattern.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tactus {
namespace {

/// Points of a cubic lattice of spacing 1 in a period of a cylinder along `axis`.
class Cylinder {
 public:
  Cylinder(Vec3i axis, double radius) : axis_(axis), radius_(radius) {
    const Vec3d a = vec_cast<double>(axis);
    length2_ = dot(a, a);
    u_ = normalized(cross(a, Vec3d{0, 0, 1}));
    w_ = (1 / std::sqrt(length2_)) * cross(a, u_);
  }
  double length() const { return std::sqrt(length2_); }
  /// Calls use(x, y, phase) for each; the cylinder's axis goes through (x, y) = -at.
  template <class Use>
  void for_each(double at_x, double at_y, const Use& use) const {
    const auto most = static_cast<int>(std::ceil(radius_ + length() + 2)),
               squared = static_cast<int>(length2_);
    for (int i = -most; i <= most; ++i) {
      for (int j = -most; j <= most; ++j) {
        const int before = axis_.x * i + axis_.y * j;  // the phase is (before + axis.z k) / length^2
        const auto first = static_cast<int>(std::ceil(-static_cast<double>(before) / axis_.z));
        for (int k = first; before + axis_.z * k < squared; ++k) {
          const Vec3d p{static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)};
          const double x = dot(p, u_) + at_x, y = dot(p, w_) + at_y;
          if (x * x + y * y < radius_ * radius_) use(x, y, (before + axis_.z * k) / length2_);
        }
      }
    }
  }

 private:
  Vec3i axis_;
  double radius_, length2_ = 1;
  Vec3d u_, w_;
};

double volume_of(double radius, double length) { return std::numbers::pi * radius * radius * length; }

}  // namespace

EmitterPattern emitter_pattern(const LiquidEmitter& e, float spacing_m) {
  constexpr double kLarge = 16;         // from that radius on, a shorter period has points enough
  constexpr double kTriedPoints = 2e6;  // in all tries
  const double d = static_cast<double>(spacing_m), radius = static_cast<double>(e.radius_m) / d;
  const Cylinder cylinder(radius < kLarge ? Vec3i{2, 5, 8} : Vec3i{1, 2, 3}, radius);
  const double wanted = volume_of(radius, cylinder.length());
  const int tries =
      static_cast<int>(std::clamp(kTriedPoints / (4 * sqr(radius + cylinder.length()) * 10), 8.0, 512.0));
  double best_x = 0, best_y = 0, best = -1;
  for (int t = 0; t < tries; ++t) {
    // Kronecker's sequence of the plastic number fills the square evenly.
    const double x = std::fmod(0.5 + 0.7548776662466927 * t, 1.0),
                 y = std::fmod(0.5 + 0.5698402909980532 * t, 1.0);
    double count = 0;
    cylinder.for_each(x, y, [&](double, double, double) { ++count; });
    const bool is_better = best < wanted ? count > best : count >= wanted && count < best;
    if (is_better) best = count, best_x = x, best_y = y;
  }
  struct Point {
    double x, y, phase;
  };
  std::vector<Point> points;
  cylinder.for_each(best_x, best_y, [&](double x, double y, double phase) {
    points.push_back({x, y, phase});
  });
  if (points.empty()) points.push_back({0, 0, 0});
  std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) {
    return a.phase != b.phase ? a.phase < b.phase : (a.x != b.x ? a.x < b.x : a.y < b.y);
  });
  const Vec3f along = normalized(e.direction),
              aside = std::abs(along.x) < 0.7F ? Vec3f{1, 0, 0} : Vec3f{0, 1, 0},
              u = normalized(cross(along, aside)), w = cross(along, u);
  EmitterPattern pattern;
  for (const Point& p : points) {
    pattern.points_m.push_back(e.position_m + static_cast<float>(p.x * d) * u +
                               static_cast<float>(p.y * d) * w);
    pattern.phases.push_back(static_cast<float>(p.phase - points.front().phase));
  }
  pattern.period_m = static_cast<double>(points.size()) / volume_of(radius, 1) * d;
  return pattern;
}

Index most_in_a_step(const LiquidEmitter& e, float spacing_m) {
  constexpr double kFluctuation = 0.5, kLeast = 8;
  const double two = volume_of(static_cast<double>(e.radius_m / spacing_m), 2);
  return static_cast<Index>(std::min((1 + kFluctuation) * two + kLeast, 1e8));
}

}  // namespace tactus
