#include "tactus/reconstruct/doctor/workspace_from_cones.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tactus/geom/image/mask_bounds.h"

namespace tactus {
namespace {

/// Inside: dot(normal, p) + offset >= 0.
struct Plane {
  Vec3d normal;
  double offset = 0;
  double at(Vec3d p) const { return dot(normal, p) + offset; }
};

/// A convex body as its faces, each a polygon.
class ConvexBody {
 public:
  explicit ConvexBody(Vec3d center, double half) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double side : {-1.0, 1.0}) {
        std::vector<Vec3d> face;
        for (const auto& [a, b] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
          Vec3d corner;
          corner[axis] = side;
          corner[(axis + 1) % 3] = a;
          corner[(axis + 2) % 3] = b;
          face.push_back(center + half * corner);
        }
        faces_.push_back(std::move(face));
      }
    }
  }
  bool empty() const { return faces_.empty(); }

  /// Keeps the part inside the plane (Sutherland and Hodgman 1974, and the new face).
  void cut(const Plane& plane) {
    std::vector<std::vector<Vec3d>> kept;
    std::vector<Vec3d> rim;
    for (const std::vector<Vec3d>& face : faces_) {
      std::vector<Vec3d> part;
      for (std::size_t i = 0; i < face.size(); ++i) {
        const Vec3d a = face[i], b = face[(i + 1) % face.size()];
        const double fa = plane.at(a), fb = plane.at(b);
        if (fa >= 0) part.push_back(a);
        if ((fa >= 0) == (fb >= 0)) continue;
        const Vec3d cut = a + fa / (fa - fb) * (b - a);
        part.push_back(cut);
        rim.push_back(cut);
      }
      if (part.size() >= 3) kept.push_back(std::move(part));
    }
    if (rim.size() >= 3 && !kept.empty()) kept.push_back(around(rim, plane.normal));
    faces_ = std::move(kept);
  }

  Box3f bounds() const {
    Vec3d low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
    for (const auto& face : faces_) {
      for (const Vec3d p : face) {
        for (int i = 0; i < 3; ++i) {
          low[i] = std::min(low[i], p[i]);
          high[i] = std::max(high[i], p[i]);
        }
      }
    }
    return {vec_cast<float>(low), vec_cast<float>(high)};
  }

 private:
  /// Points of a plane as the polygon around their middle.
  static std::vector<Vec3d> around(const std::vector<Vec3d>& points, Vec3d normal) {
    Vec3d middle;
    for (const Vec3d p : points) middle = middle + 1.0 / static_cast<double>(points.size()) * p;
    const Vec3d other = std::abs(normal.x) < 0.7 * length(normal) ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
    const Vec3d u = normalized(cross(normal, other)), v = cross(normalized(normal), u);
    std::vector<std::pair<double, Vec3d>> sorted;
    sorted.reserve(points.size());
    for (const Vec3d p : points) sorted.emplace_back(std::atan2(dot(p - middle, v), dot(p - middle, u)), p);
    std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<Vec3d> polygon;
    for (const auto& [angle, p] : sorted) polygon.push_back(p);
    return polygon;
  }

  std::vector<std::vector<Vec3d>> faces_;
};

/// The plane through the optical centre and the line of pixels a u + b v + c = 0; inside where that is >= 0.
Plane plane_of_line(const Camera& camera, double a, double b, double c) {
  const Mat3d KR = camera.intrinsics() * camera.T_cam_world.R;
  const Vec3d Kt = camera.intrinsics() * camera.T_cam_world.t;
  return {a * KR.row[0] + b * KR.row[1] + c * KR.row[2], a * Kt.x + b * Kt.y + c * Kt.z};
}

/// Planes of the pyramid over a rectangle of pixels, and the one through the camera: space behind it is not
/// seen.
std::vector<Plane> pyramid(const Camera& camera, const PixelRect& rect) {
  std::vector<Plane> planes{plane_of_line(camera, 0, 0, 1)};
  if (rect.min_x > 0) planes.push_back(plane_of_line(camera, 1, 0, -(rect.min_x - 0.5)));
  if (rect.min_y > 0) planes.push_back(plane_of_line(camera, 0, 1, -(rect.min_y - 0.5)));
  if (rect.max_x + 1 < camera.width_px) planes.push_back(plane_of_line(camera, -1, 0, rect.max_x + 0.5));
  if (rect.max_y + 1 < camera.height_px) planes.push_back(plane_of_line(camera, 0, -1, rect.max_y + 0.5));
  return planes;
}

constexpr int kConeSamples = 48;
constexpr float kMarginSamples = 2;

/// Bounds of the samples of the box that no mask carves; none when all are carved.
std::optional<Box3f> carve(const Box3f& box, std::span<const Camera> cameras,
                           std::span<const BitMask* const> masks) {
  const Vec3f step = 1.F / kConeSamples * box.extent();
  Box3f kept{box.max, box.min};
  bool any = false;
  for (int k = 0; k < kConeSamples * kConeSamples * kConeSamples; ++k) {
    const Vec3i at{k % kConeSamples, k / kConeSamples % kConeSamples, k / (kConeSamples * kConeSamples)};
    const Vec3f p = box.min + Vec3f{(static_cast<float>(at.x) + 0.5F) * step.x,
                                    (static_cast<float>(at.y) + 0.5F) * step.y,
                                    (static_cast<float>(at.z) + 0.5F) * step.z};
    bool inside = true;
    for (std::size_t c = 0; c < cameras.size() && inside; ++c) {
      if (masks[c] == nullptr || masks[c]->words.empty()) continue;
      const Pixel px = project(cameras[c], vec_cast<double>(p));
      const double u = px.u_px + 0.5, v = px.v_px + 0.5;
      const bool seen = px.z_m > 0 && u >= 0 && v >= 0 && u < cameras[c].width_px && v < cameras[c].height_px;
      inside = !seen || (*masks[c])(static_cast<Index>(u), static_cast<Index>(v));
    }
    if (!inside) continue;
    any = true;
    for (int i = 0; i < 3; ++i) {
      kept.min[i] = std::min(kept.min[i], p[i] - kMarginSamples * step[i]);
      kept.max[i] = std::max(kept.max[i], p[i] + kMarginSamples * step[i]);
    }
  }
  if (!any) return {};
  for (int i = 0; i < 3; ++i) {
    kept.min[i] = std::max(kept.min[i], box.min[i] - step[i]);
    kept.max[i] = std::min(kept.max[i], box.max[i] + step[i]);
  }
  return kept;
}

/// The cube that the cones are cut from, about the middle of all cameras. Half its side is four times the
/// distance of the farthest camera; no two cameras can bound space farther out. It is 10 where all cameras
/// stand at one point.
struct Reach {
  Vec3d center;
  double half = 0;
};
Reach reach_of(std::span<const Camera> cameras) {
  Reach reach;
  for (const Camera& c : cameras)
    reach.center = reach.center + 1.0 / static_cast<double>(cameras.size()) * c.center_world();
  for (const Camera& c : cameras) reach.half = std::max(reach.half, length(c.center_world() - reach.center));
  reach.half = reach.half > 0 ? 4 * reach.half : 10;
  return reach;
}

}  // namespace

std::optional<ConeBox> workspace_from_cones(std::span<const Camera> cameras,
                                            std::span<const BitMask> silhouettes) {
  std::vector<const BitMask*> masks;
  for (const BitMask& mask : silhouettes) masks.push_back(&mask);
  return workspace_from_cones(cameras, masks);
}

std::optional<ConeBox> workspace_from_cones(std::span<const Camera> cameras,
                                            std::span<const BitMask* const> silhouettes, int turns) {
  const Reach reach = reach_of(cameras);
  ConvexBody body(reach.center, reach.half);
  std::size_t counted = 0;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (silhouettes[c] == nullptr || silhouettes[c]->words.empty()) continue;
    const PixelRect rect = bounds_of(*silhouettes[c]);
    if (rect.empty()) continue;
    ++counted;
    for (const Plane& plane : pyramid(cameras[c], rect)) body.cut(plane);
    if (body.empty()) return {};
  }
  if (counted == 0) return {};
  ConeBox result{body.bounds()};
  for (int turn = 0; turn < turns; ++turn) {
    const std::optional<Box3f> tighter = carve(result.box_m, cameras, silhouettes);
    if (!tighter) break;  // thinner than the samples
    result.box_m = *tighter;
  }
  for (int i = 0; i < 3; ++i) {
    const double low = static_cast<double>(result.box_m.min[i]) - reach.center[i],
                 high = static_cast<double>(result.box_m.max[i]) - reach.center[i];
    if (low < -0.98 * reach.half || high > 0.98 * reach.half) result.is_bounded = false;
  }
  return result;
}

}  // namespace tactus
