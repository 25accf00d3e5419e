#include "tactus/geom/image/rasterize.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>

#include "tactus/base/error.h"

namespace tactus {
namespace {

constexpr double kSubpixels = 16384;  // 2^14
constexpr double kGuardPx = 8192;     // beyond the image, where coordinates still fit the integers below
constexpr Index kMaxSidePx = 16384;
constexpr double kNearM = 1e-6;

/// A vertex as (u z, v z, z): linear in the world's point, so planes of the view cut it exactly.
using Homogeneous = Vec3d;

struct Fixed {
  std::int64_t x, y;  // [2^-14 px]; |x| <= 2^14 * (2^13 + 2^14) < 2^29
};

/// Distances to the planes of the view volume; inside is >= 0. Order matters: `z` first.
struct Planes {
  double width_px, height_px;
  static constexpr int kCount = 5;
  double distance(int plane, Homogeneous p) const {
    switch (plane) {
      case 0:
        return p.z - kNearM;
      case 1:
        return p.x + kGuardPx * p.z;
      case 2:
        return (width_px + kGuardPx) * p.z - p.x;
      case 3:
        return p.y + kGuardPx * p.z;
      default:
        return (height_px + kGuardPx) * p.z - p.y;
    }
  }
};

struct Polygon {
  std::array<Homogeneous, 3 + Planes::kCount> corner;
  int count = 0;
};

/// Sutherland-Hodgman. A cut edge is always walked from its inner to its outer end, so that the two triangles
/// that share it get the same bits for the new corner.
Polygon clip(const Polygon& in, const Planes& planes, int plane) {
  Polygon out;
  for (int i = 0; i < in.count; ++i) {
    const Homogeneous a = in.corner[static_cast<std::size_t>(i)];
    const Homogeneous b = in.corner[static_cast<std::size_t>((i + 1) % in.count)];
    const double da = planes.distance(plane, a), db = planes.distance(plane, b);
    if (da >= 0) out.corner[static_cast<std::size_t>(out.count++)] = a;
    if (da >= 0 && db < 0) out.corner[static_cast<std::size_t>(out.count++)] = a + (da / (da - db)) * (b - a);
    if (da < 0 && db >= 0) out.corner[static_cast<std::size_t>(out.count++)] = b + (db / (db - da)) * (a - b);
  }
  return out;
}

Fixed to_fixed(Homogeneous p) {
  return {std::llround(p.x / p.z * kSubpixels), std::llround(p.y / p.z * kSubpixels)};
}

std::int64_t ceil_px(std::int64_t v) { return (v + 16383) >> 14; }
std::int64_t floor_px(std::int64_t v) { return v >> 14; }

/// Twice the signed area of (a, b, p): the products stay below 2^61.
struct Edge {
  std::int64_t step_x, step_y, value;  // per pixel; at the first pixel of the first row
  Edge(Fixed a, Fixed b, std::int64_t x_px, std::int64_t y_px)
      : step_x(-(b.y - a.y) * 16384),
        step_y((b.x - a.x) * 16384),
        value((b.x - a.x) * (y_px * 16384 - a.y) - (b.y - a.y) * (x_px * 16384 - a.x)) {}
};

class Canvas {
 public:
  explicit Canvas(BitMask& mask) : mask_(mask) {}

  void fill(Fixed a, Fixed b, Fixed c) const {
    const std::int64_t x0 = std::max<std::int64_t>(0, ceil_px(std::min({a.x, b.x, c.x})));
    const std::int64_t x1 = std::min<std::int64_t>(mask_.width_px - 1, floor_px(std::max({a.x, b.x, c.x})));
    const std::int64_t y0 = std::max<std::int64_t>(0, ceil_px(std::min({a.y, b.y, c.y})));
    const std::int64_t y1 = std::min<std::int64_t>(mask_.height_px - 1, floor_px(std::max({a.y, b.y, c.y})));
    if (x0 > x1 || y0 > y1) return;
    const std::int64_t twice_area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if (twice_area == 0) return;
    if (twice_area < 0) std::swap(b, c);
    std::array<Edge, 3> edges{Edge(a, b, x0, y0), Edge(b, c, x0, y0), Edge(c, a, x0, y0)};
    for (std::int64_t y = y0; y <= y1; ++y) {
      fill_row(edges, x0, x1, y);
      for (Edge& e : edges) e.value += e.step_y;
    }
  }

 private:
  /// Triangles are convex: the covered pixels of a row are one run.
  void fill_row(const std::array<Edge, 3>& edges, std::int64_t x0, std::int64_t x1, std::int64_t y) const {
    std::int64_t first = 0, last = x1 - x0;
    for (const Edge& e : edges) {
      // value + k step_x >= 0
      if (e.step_x == 0) {
        if (e.value < 0) return;
      } else if (e.step_x > 0) {
        if (e.value < 0) first = std::max(first, (-e.value + e.step_x - 1) / e.step_x);
      } else {
        if (e.value < 0) return;
        last = std::min(last, e.value / -e.step_x);
      }
    }
    if (first <= last) set_run(x0 + first, x0 + last, y);
  }

  void set_run(std::int64_t first, std::int64_t last, std::int64_t y) const {
    std::uint32_t* row = mask_.words.data() + y * mask_.words_per_row();
    for (std::int64_t w = first >> 5; w <= last >> 5; ++w) {
      std::uint32_t bits = ~0U;
      if (w == first >> 5) bits &= ~0U << (first & 31);
      if (w == last >> 5) bits &= ~0U >> (31 - (last & 31));
      // Threads share words; "or" commutes, so the order does not show. Most pixels are set many times.
      const std::atomic_ref<std::uint32_t> word(row[w]);
      if ((word.load(std::memory_order_relaxed) & bits) != bits)
        word.fetch_or(bits, std::memory_order_relaxed);
    }
  }

  BitMask& mask_;
};

struct Projected {
  Homogeneous view;
  Fixed fixed;
  bool inside;  ///< of all planes: `fixed` is valid
};

std::vector<Projected> project_all(const TriangleMesh& mesh, const Camera& camera, const Planes& planes) {
  const Projection K = projection(camera);
  std::vector<Projected> result(mesh.positions_m.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, result.size(), 4096), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      Projected& p = result[i];
      p.view = K.M * vec_cast<double>(mesh.positions_m[i]) + K.t;
      p.inside = true;
      for (int k = 0; k < Planes::kCount; ++k) p.inside = p.inside && planes.distance(k, p.view) >= 0;
      p.fixed = p.inside ? to_fixed(p.view) : Fixed{0, 0};
    }
  });
  return result;
}

void fill_clipped(const Canvas& canvas, const Planes& planes, Homogeneous a, Homogeneous b, Homogeneous c) {
  Polygon polygon{{a, b, c}, 3};
  for (int k = 0; k < Planes::kCount && polygon.count > 0; ++k) polygon = clip(polygon, planes, k);
  if (polygon.count < 3) return;
  const Fixed first = to_fixed(polygon.corner[0]);
  for (std::size_t i = 1; i + 1 < static_cast<std::size_t>(polygon.count); ++i)
    canvas.fill(first, to_fixed(polygon.corner[i]), to_fixed(polygon.corner[i + 1]));
}

void check_mesh(const TriangleMesh& mesh) {
  const std::size_t count = mesh.positions_m.size();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const Index v : mesh.triangles[t]) {
      if (v < 0 || static_cast<std::size_t>(v) >= count) {
        throw Error("mesh: triangle " + std::to_string(t) + " has vertex " + std::to_string(v) +
                    ", expected 0 to " + std::to_string(static_cast<std::int64_t>(count) - 1));
      }
      const Vec3f p = mesh.positions_m[static_cast<std::size_t>(v)];
      if (!std::isfinite(p.x + p.y + p.z))
        throw Error("mesh: the position of vertex " + std::to_string(v) + " is not finite");
    }
  }
}

}  // namespace

BitMask render_silhouette(const TriangleMesh& mesh, const Camera& camera) {
  check_camera(camera);
  if (std::max(camera.width_px, camera.height_px) > kMaxSidePx) {
    throw Error("camera '" + camera.name + "': image size " + std::to_string(camera.width_px) + "x" +
                std::to_string(camera.height_px) + ", expected at most " + std::to_string(kMaxSidePx) +
                " a side");
  }
  check_mesh(mesh);
  const Planes planes{static_cast<double>(camera.width_px), static_cast<double>(camera.height_px)};
  const std::vector<Projected> vertices = project_all(mesh, camera, planes);
  BitMask mask(camera.width_px, camera.height_px);
  const Canvas canvas(mask);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.triangles.size(), 4096), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const auto& t = mesh.triangles[i];
      const Projected& a = vertices[static_cast<std::size_t>(t[0])];
      const Projected& b = vertices[static_cast<std::size_t>(t[1])];
      const Projected& c = vertices[static_cast<std::size_t>(t[2])];
      if (a.inside && b.inside && c.inside)
        canvas.fill(a.fixed, b.fixed, c.fixed);
      else
        fill_clipped(canvas, planes, a.view, b.view, c.view);
    }
  });
  return mask;
}

}  // namespace tactus
