#include "tactus/view/liquid_balls.h"

#include <cmath>
#include <cstdint>

#include "tactus/base/at.h"

namespace tactus {
namespace {

constexpr float kCrowdRadius = 0.8F;  // in spacings: leaves no hole between four a spacing apart
constexpr float kLoneRadius = 0.62F;  // a ball of the particle's volume
constexpr float kCrowd = 12;  // neighbours, the nearer the more, of a particle in a crowd: 17 lie on a plane
constexpr float kNeighbour = 2;  // reach, in spacings

/// Points by hashed cells, in compact lists.
class Cells {
 public:
  Cells(const std::vector<Vec3f>& points_m, float cell_m) : points_m_(points_m), per_m_(1 / cell_m) {
    std::size_t size = 64;
    while (size < 2 * points_m.size()) size *= 2;
    first_.assign(size + 1, 0);
    for (const Vec3f p : points_m)
      if (is_somewhere(p)) ++first_[hash(cell_of(p)) + 1];
    for (std::size_t k = 1; k <= size; ++k) first_[k] += first_[k - 1];
    ids_.resize(first_.back());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t i = 0; i < points_m.size(); ++i)
      if (is_somewhere(points_m[i])) ids_[next[hash(cell_of(points_m[i]))]++] = static_cast<std::uint32_t>(i);
  }
  static bool is_somewhere(Vec3f p) { return std::abs(p.x) + std::abs(p.y) + std::abs(p.z) < 1e6F; }
  /// Calls f(point) for all in the 27 cells round p_m.
  template <class F>
  void around(Vec3f p_m, F&& f) const {
    const Vec3i c = cell_of(p_m);
    for (int k = 0; k < 27; ++k) {
      const Vec3i cell = c + Vec3i{k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
      const std::size_t h = hash(cell);
      for (std::size_t i = first_[h]; i < first_[h + 1]; ++i)
        if (cell_of(points_m_[ids_[i]]) == cell) f(static_cast<std::size_t>(ids_[i]));
    }
  }

 private:
  Vec3i cell_of(Vec3f p) const {
    const auto along = [&](float v) {
      return static_cast<Index>(std::floor(clamp(v * per_m_, -1e9F, 1e9F)));
    };
    return {along(p.x), along(p.y), along(p.z)};
  }
  std::size_t hash(Vec3i c) const {
    const std::uint32_t h = static_cast<std::uint32_t>(c.x) * 73856093U ^
                            static_cast<std::uint32_t>(c.y) * 19349663U ^
                            static_cast<std::uint32_t>(c.z) * 83492791U;
    return at(h) & (first_.size() - 2);
  }
  const std::vector<Vec3f>& points_m_;
  float per_m_;
  std::vector<std::uint32_t> first_, ids_;
};

/// The vertices of wet surfaces near the particles.
struct WetSurface {
  std::vector<Vec3f> points_m, normals;
};

WetSurface wet_surface(const ViewScene& scene, const Box3f& box) {
  WetSurface wet;
  for (const ViewMesh& view : scene.meshes) {
    if (!view.film || view.device || view.mesh.normals.empty()) continue;
    for (std::size_t v = 0; v < view.mesh.positions_m.size(); ++v) {
      const Vec3f p = view.R_world_mesh * view.mesh.positions_m[v];
      const Vec3f out = max(box.min - p, p - box.max);
      if (max(out.x, max(out.y, out.z)) > 0) continue;
      wet.points_m.push_back(p);
      wet.normals.push_back(view.R_world_mesh * view.mesh.normals[v]);
    }
  }
  return wet;
}

float smooth_step(float low, float high, float v) {
  const float t = clamp((v - low) / (high - low), 0.F, 1.F);
  return t * t * (3 - 2 * t);
}

/// A cap: with a contact angle of 40 degrees it would be 1.19 spacings wide and 0.43 high.
void lie_down(LiquidBall& ball, Vec3f on_m, Vec3f normal, float spacing_m) {
  constexpr float kWide = 1.15F, kHigh = 0.6F, kSunk = 0.1F;
  const float high_m = dot(ball.center_m - on_m, normal);
  const float lies = 1 - smooth_step(0.6F * spacing_m, 1.2F * spacing_m, high_m);
  if (lies <= 0) return;
  ball.axis = normal;
  ball.center_m = ball.center_m - (lies * (high_m + kSunk * spacing_m)) * normal;
  const float radius_m = spacing_m * std::cbrt(kWide * kWide * kHigh);
  ball.radius_m += lies * (radius_m - ball.radius_m);
  ball.stretch += lies * (kHigh * spacing_m / radius_m - 1);
}

}  // namespace

std::vector<LiquidBall> liquid_balls(const ViewLiquid& liquid, const ViewScene& scene) {
  const std::vector<Vec3f>& x_m = liquid.positions_m;
  const float spacing_m = liquid.spacing_m, reach_m = kNeighbour * spacing_m;
  Box3f box{{1e30F, 1e30F, 1e30F}, {-1e30F, -1e30F, -1e30F}};
  for (const Vec3f p : x_m)
    if (Cells::is_somewhere(p)) box = {min(box.min, p), max(box.max, p)};
  const Vec3f margin_m{reach_m, reach_m, reach_m};
  const WetSurface wet = wet_surface(scene, {box.min - margin_m, box.max + margin_m});
  const Cells particles(x_m, reach_m), surface(wet.points_m, reach_m);
  std::vector<LiquidBall> balls(x_m.size());
  for (std::size_t i = 0; i < x_m.size(); ++i) {
    LiquidBall& ball = balls[i];
    ball.center_m = x_m[i];
    if (!Cells::is_somewhere(x_m[i])) continue;
    float count = 0;
    Vec3f sum{};
    particles.around(x_m[i], [&](std::size_t j) {
      const Vec3f to = x_m[j] - x_m[i];
      const float near = 1 - dot(to, to) / (reach_m * reach_m);
      if (near <= 0 || j == i) return;
      const float weight = near * near * (3 - 2 * near);
      count += weight;
      sum += weight * to;
    });
    const float crowded = smooth_step(0, 1, 2.5F * count / kCrowd);
    ball.radius_m = spacing_m * (kLoneRadius + crowded * (kCrowdRadius - kLoneRadius));
    ball.center_m += (0.5F * (1 - crowded) / (count + 1)) * sum;
    if (wet.points_m.empty()) continue;
    float nearest = reach_m * reach_m;
    std::size_t found = wet.points_m.size();
    surface.around(ball.center_m, [&](std::size_t v) {
      const Vec3f off = ball.center_m - wet.points_m[v];
      if (dot(off, off) < nearest) nearest = dot(off, off), found = v;
    });
    if (found < wet.points_m.size()) lie_down(ball, wet.points_m[found], wet.normals[found], spacing_m);
  }
  return balls;
}

}  // namespace tactus
