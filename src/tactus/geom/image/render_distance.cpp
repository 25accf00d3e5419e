#include "tactus/geom/image/render_distance.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "tactus/base/error.h"

namespace tactus {
namespace {

constexpr double kNear_m = 1e-6;

/// Sets 1/z of the pixels that the triangle covers where it is nearer.
void draw(const Pixel& a, const Pixel& b, const Pixel& c, Image<double>& inverse_z) {
  const double area = (b.u_px - a.u_px) * (c.v_px - a.v_px) - (b.v_px - a.v_px) * (c.u_px - a.u_px);
  if (area == 0) return;
  const auto first = [](double x) { return static_cast<Index>(std::max(0.0, std::ceil(x))); };
  const auto last = [](double x, Index size) {
    return static_cast<Index>(std::min<double>(size - 1, std::floor(x)));
  };
  const Index y0 = first(std::min({a.v_px, b.v_px, c.v_px})),
              y1 = last(std::max({a.v_px, b.v_px, c.v_px}), inverse_z.height_px);
  const Index x0 = first(std::min({a.u_px, b.u_px, c.u_px})),
              x1 = last(std::max({a.u_px, b.u_px, c.u_px}), inverse_z.width_px);
  for (Index y = y0; y <= y1; ++y) {
    for (Index x = x0; x <= x1; ++x) {
      const auto side = [&](const Pixel& p, const Pixel& q) {
        return ((q.u_px - p.u_px) * (y - p.v_px) - (q.v_px - p.v_px) * (x - p.u_px)) / area;
      };
      const double wa = side(b, c), wb = side(c, a), wc = side(a, b);
      if (wa < -1e-9 || wb < -1e-9 || wc < -1e-9) continue;
      double& nearest = inverse_z(x, y);
      nearest = std::max(nearest, wa / a.z_m + wb / b.z_m + wc / c.z_m);
    }
  }
}

}  // namespace

DepthImage render_distance(const TriangleMesh& mesh, const Camera& camera) {
  check_camera(camera);
  std::vector<Pixel> pixels;
  pixels.reserve(mesh.positions_m.size());
  for (const Vec3f p : mesh.positions_m) pixels.push_back(project(camera, vec_cast<double>(p)));
  Image<double> inverse_z(camera.width_px, camera.height_px);
  for (const auto& t : mesh.triangles) {
    for (const Index v : t) {
      if (v < 0 || static_cast<std::size_t>(v) >= pixels.size())
        throw Error("mesh: a triangle has vertex " + std::to_string(v) + ", expected 0 to " +
                    std::to_string(static_cast<std::int64_t>(pixels.size()) - 1));
    }
    const Pixel &a = pixels[static_cast<std::size_t>(t[0])], &b = pixels[static_cast<std::size_t>(t[1])],
                &c = pixels[static_cast<std::size_t>(t[2])];
    if (std::min({a.z_m, b.z_m, c.z_m}) > kNear_m) draw(a, b, c, inverse_z);
  }
  DepthImage distance(camera.width_px, camera.height_px);
  for (Index y = 0; y < camera.height_px; ++y) {
    for (Index x = 0; x < camera.width_px; ++x) {
      if (inverse_z(x, y) <= 0) continue;
      const double cosine = dot(pixel_ray_world(camera, x, y), camera.axis_world());
      distance(x, y) = static_cast<float>(1 / (inverse_z(x, y) * cosine));
    }
  }
  return distance;
}

}  // namespace tactus
