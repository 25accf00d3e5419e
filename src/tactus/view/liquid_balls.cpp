#include "tactus/view/liquid_balls.h"

#include <cmath>
#include <vector>

#include "tactus/geom/mesh/point_cells.h"

namespace tactus {
namespace {

constexpr float kCrowdRadius = 0.8F;  // in spacings: leaves no hole between four a spacing apart
constexpr float kLoneRadius = 0.62F;  // a ball of the particle's volume
constexpr float kCrowd = 12;  // neighbours, the nearer the more, of a particle in a crowd: 17 lie on a plane
constexpr float kNeighbour = 2;  // reach, in spacings
constexpr float kChain = 6;      // how far particles of a thin jet hang together, in spacings
constexpr float kNoEdge_m = 1;   // of a film that is everywhere

/// The vertices of wet surfaces near the particles.
struct WetSurface {
  std::vector<Vec3f> points_m, normals;
  std::vector<float> edge_m;  ///< how far the film's edge is, < 0 past it
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
      wet.edge_m.push_back(view.film->edge_m.empty() ? kNoEdge_m : view.film->edge_m[v]);
    }
  }
  return wet;
}

float smooth_step(float low, float high, float v) {
  const float t = clamp((v - low) / (high - low), 0.F, 1.F);
  return t * t * (3 - 2 * t);
}

/// What a particle lies on, and among.
struct Ground {
  Vec3f on_m{}, normal{};
  float edge_m = 0;   ///< as WetSurface's
  float above = 0;    ///< so many particles lie on it
  float crowded = 0;  ///< 1: in a crowd
};

/// A cap: with a contact angle of 40 degrees it would be 1.19 spacings wide and 0.43 high. In a film it
/// spreads until it is none, and a few that hang together do so with it; a pool doesn't.
/// @returns whether anything of it is left
bool lie_down(LiquidBall& ball, const Ground& ground, float spacing_m) {
  constexpr float kWide = 1.15F, kHigh = 0.6F, kSunk = 0.1F;
  const float high = dot(ball.center_m - ground.on_m, ground.normal) / spacing_m;
  const float spread = smooth_step(0, spacing_m, ground.edge_m) * (1 - smooth_step(1.5F, 4, ground.above)) *
                       (1 - smooth_step(0.6F, 1.2F, high + ground.crowded - 1));
  if (spread > 0.9F) return false;
  const float lies = max(1 - smooth_step(0.6F, 1.2F, high), spread);
  if (lies <= 0) return true;
  ball.axis = ground.normal;
  ball.stretch = 1;
  ball.center_m = ball.center_m - (lies * (high + kSunk) * spacing_m) * ground.normal;
  const float left_high = kHigh * (1 - spread);
  const float radius_m = spacing_m * std::cbrt(kWide * kWide * left_high);
  ball.radius_m += lies * (radius_m - ball.radius_m);
  ball.stretch += lies * (left_high * spacing_m / radius_m - 1);
  return true;
}

/// Whither a particle's surroundings extend.
struct Spread {
  Vec3f axis{0, 1, 0};
  float straight = 0;  ///< 1: they lie on a line; 0: on a plane or all around
  float gap_m = 0;     ///< along the axis to the nearest, mean of both sides
  Vec3f off_m{};       ///< to the line through them
};

Spread spread_of(const std::vector<Vec3f>& x_m, std::size_t i, const PointCells& chain, float reach_m) {
  Vec3f columns[3]{}, sum{};
  float weights = 0;
  const auto each = [&](auto&& f) {
    chain.around(x_m[i], [&](std::size_t j) {
      const Vec3f to = x_m[j] - x_m[i];
      const float near = 1 - dot(to, to) / (reach_m * reach_m);
      if (j != i && near > 0) f(to, near);
    });
  };
  each([&](Vec3f to, float near) {
    for (int k = 0; k < 3; ++k) columns[k] += near * to[k] * to;
    sum += near * to;
    weights += near;
  });
  Spread spread;
  if (weights <= 0) return spread;
  const float trace = columns[0].x + columns[1].y + columns[2].z;
  Vec3f axis = columns[0];
  for (const Vec3f c : columns)
    if (dot(c, c) > dot(axis, axis)) axis = c;
  float most = 0;
  for (int k = 0; k < 8 && (most = length(axis)) > 0; ++k) {
    axis = axis / most;
    axis = axis.x * columns[0] + axis.y * columns[1] + axis.z * columns[2];
  }
  most = length(axis);
  if (!(most > 0)) return spread;
  spread.axis = axis / most;
  // Two drops are no jet.
  spread.straight = smooth_step(0.7F, 0.92F, most / trace) * smooth_step(0.75F, 1.1F, weights);
  const Vec3f mean = (1 / (weights + 1)) * sum;
  spread.off_m = mean - dot(mean, spread.axis) * spread.axis;
  float ahead_m = reach_m, behind_m = reach_m;
  each([&](Vec3f to, float) {
    const float along_m = dot(to, spread.axis);
    if (4 * along_m * along_m < dot(to, to)) return;  // beside it
    float& nearest_m = along_m > 0 ? ahead_m : behind_m;
    nearest_m = min(nearest_m, std::abs(along_m));
  });
  // At an end of a jet one side counts.
  if (ahead_m >= reach_m) ahead_m = behind_m;
  if (behind_m >= reach_m) behind_m = ahead_m;
  spread.gap_m = 0.5F * (ahead_m + behind_m);
  return spread;
}

/// Drops that fall in a line are a jet and not a string of balls: each is as long as it is to the next one,
/// and as much thinner.
void join_jet(LiquidBall& ball, const Spread& jet, float lone) {
  constexpr float kOverlap = 0.6F, kMostStretch = 6;
  const float straight = jet.straight * lone;
  if (straight <= 0) return;
  ball.axis = jet.axis;
  ball.center_m += (0.8F * straight) * jet.off_m;
  const float stretch = clamp(kOverlap * jet.gap_m / ball.radius_m, 1.F, kMostStretch);
  ball.stretch = 1 + straight * (stretch - 1);
}

}  // namespace

std::vector<LiquidBall> liquid_balls(const ViewLiquid& liquid, const ViewScene& scene) {
  const std::vector<Vec3f>& x_m = liquid.positions_m;
  const float spacing_m = liquid.spacing_m, reach_m = kNeighbour * spacing_m;
  Box3f box{{1e30F, 1e30F, 1e30F}, {-1e30F, -1e30F, -1e30F}};
  for (const Vec3f p : x_m)
    if (PointCells::is_somewhere(p)) box = {min(box.min, p), max(box.max, p)};
  const Vec3f margin_m{reach_m, reach_m, reach_m};
  const WetSurface wet = wet_surface(scene, {box.min - margin_m, box.max + margin_m});
  const PointCells particles(x_m, reach_m), surface(wet.points_m, reach_m), chain(x_m, kChain * spacing_m);
  std::vector<LiquidBall> balls(x_m.size());
  for (std::size_t i = 0; i < x_m.size(); ++i) {
    LiquidBall& ball = balls[i];
    ball.center_m = x_m[i];
    if (!PointCells::is_somewhere(x_m[i])) continue;
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
    if (crowded < 1) join_jet(ball, spread_of(x_m, i, chain, kChain * spacing_m), 1 - crowded);
    if (wet.points_m.empty()) continue;
    float nearest = reach_m * reach_m;
    std::size_t found = wet.points_m.size();
    surface.around(ball.center_m, [&](std::size_t v) {
      const Vec3f off = ball.center_m - wet.points_m[v];
      if (dot(off, off) < nearest) nearest = dot(off, off), found = v;
    });
    if (found == wet.points_m.size()) continue;
    Ground ground{wet.points_m[found], wet.normals[found], wet.edge_m[found], 0, crowded};
    particles.around(x_m[i], [&](std::size_t j) {
      const Vec3f to = x_m[j] - x_m[i];
      if (dot(to, to) < reach_m * reach_m)
        ground.above += smooth_step(0.5F * spacing_m, 0.8F * spacing_m, dot(to, ground.normal));
    });
    if (!lie_down(ball, ground, spacing_m)) ball.radius_m = 0;
  }
  std::erase_if(balls, [](const LiquidBall& ball) { return !(ball.radius_m > 0); });
  return balls;
}

}  // namespace tactus
