#include "tactus/track/depth_rays.h"

#include <algorithm>
#include <cmath>

namespace tactus {
namespace {

constexpr double kNearestDepth_m = 0.05;
constexpr double kLeastCosine = 0.3;

}  // namespace

std::span<const DepthRays::Hit> DepthRays::find(const OutlineMesh& mesh, const Rigidd& T_world_model,
                                                const Camera& camera) {
  hits_.clear();
  camera_m_.clear();
  px_.clear();
  Vec2d low{1e9, 1e9}, high{-1e9, -1e9};
  const Rigidd T = camera.T_cam_world * T_world_model;
  for (const Vec3d& vertex_m : mesh.vertices_m) {
    const Vec3d p = camera_m_.emplace_back(T * vertex_m);
    if (!(p.z > kNearestDepth_m)) return hits_;
    const Vec2d at = px_.emplace_back(Vec2d{(camera.fx_px * p.x + camera.skew_px * p.y) / p.z + camera.cx_px,
                                            camera.fy_px * p.y / p.z + camera.cy_px});
    low = {std::min(low.x, at.x), std::min(low.y, at.y)};
    high = {std::max(high.x, at.x), std::max(high.y, at.y)};
  }
  const auto first = [](double from, Index size) {
    return static_cast<Index>(std::ceil(std::clamp(from, 0.0, static_cast<double>(size))));
  };
  const auto last = [](double to, Index size) {
    return static_cast<Index>(std::floor(std::clamp(to, -1.0, size - 1.0)));
  };
  const Index x0 = first(low.x, camera.width_px), y0 = first(low.y, camera.height_px),
              width = last(high.x, camera.width_px) - x0 + 1,
              height = last(high.y, camera.height_px) - y0 + 1;
  if (width < 1 || height < 1) return hits_;
  nearest_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                  {0, 0, 1e30, {}, {}, {}});
  const Mat3d to_world = transpose(camera.T_cam_world.R);
  const Vec3d eye_m = camera.center_world();
  for (const auto& t : mesh.triangles) {
    const auto corner = [&](std::size_t k) { return static_cast<std::size_t>(t.at(k)); };
    const Vec3d a = camera_m_[corner(0)], n = cross(camera_m_[corner(1)] - a, camera_m_[corner(2)] - a);
    if (!(dot(n, a) < 0)) continue;  // it looks away
    const Vec2d p = px_[corner(0)], q = px_[corner(1)], r = px_[corner(2)];
    const auto side = [](Vec2d from, Vec2d to, double x, double y) {
      return (to.x - from.x) * (y - from.y) - (to.y - from.y) * (x - from.x);
    };
    const Index end_y = last(std::max({p.y, q.y, r.y}), camera.height_px),
                end_x = last(std::max({p.x, q.x, r.x}), camera.width_px);
    for (Index y = first(std::min({p.y, q.y, r.y}), camera.height_px); y <= end_y; ++y) {
      for (Index x = first(std::min({p.x, q.x, r.x}), camera.width_px); x <= end_x; ++x) {
        const double s = side(p, q, x, y), u = side(q, r, x, y), w = side(r, p, x, y);
        if (std::min({s, u, w}) < 0 && std::max({s, u, w}) > 0) continue;
        const Vec3d along = pixel_ray_world(camera, x, y), in_camera = camera.T_cam_world.R * along;
        const double distance_m = dot(n, a) / dot(n, in_camera);
        Hit& hit = nearest_[static_cast<std::size_t>(y - y0) * static_cast<std::size_t>(width) +
                            static_cast<std::size_t>(x - x0)];
        if (!(distance_m > 0 && distance_m < hit.distance_m)) continue;
        hit = {x, y, distance_m, eye_m + distance_m * along, along, normalized(to_world * n)};
      }
    }
  }
  for (const Hit& hit : nearest_)
    if (hit.distance_m < 1e30 && dot(hit.along, hit.normal) < -kLeastCosine) hits_.push_back(hit);
  return hits_;
}

}  // namespace tactus
