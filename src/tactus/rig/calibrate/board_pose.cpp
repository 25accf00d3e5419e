#include "tactus/rig/calibrate/board_pose.h"

#include <algorithm>
#include <cmath>
#include <map>
#ifdef TACTUS_WITH_CALIB3D
#include <opencv2/calib3d.hpp>
#endif

#include "tactus/base/error.h"
#include "tactus/geom/maths/rotation.h"

namespace tactus {
namespace {

#ifdef TACTUS_WITH_CALIB3D
constexpr std::size_t kFewestCorners = 6;

/// Smallest extent across the corners' main direction, over the largest: 0 on a line.
double flatness(const Board& board, const BoardView& view) {
  double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  const auto n = static_cast<double>(view.corners.size());
  for (const BoardCorner& c : view.corners) {
    const Vec3d p = board.corner_m(c.id);
    x += p.x / n;
    y += p.y / n;
  }
  for (const BoardCorner& c : view.corners) {
    const Vec3d p = board.corner_m(c.id);
    xx += sqr(p.x - x);
    xy += (p.x - x) * (p.y - y);
    yy += sqr(p.y - y);
  }
  const double half = 0.5 * (xx + yy), root = std::sqrt(std::max(0.0, half * half - xx * yy + xy * xy));
  return half > 0 ? std::sqrt(std::max(0.0, half - root) / (half + root)) : 0;
}
#endif

double distance(const Rigidd& a, const Rigidd& b) {
  const Mat3d R = a.R * transpose(b.R);
  const double scale = length(a.t) + length(b.t) + 1e-12;
  return std::acos(std::clamp(0.5 * (trace(R) - 1), -1.0, 1.0)) + length(a.t - b.t) / scale;
}

/// The one that is nearest to all others.
Rigidd middle(const std::vector<Rigidd>& poses) {
  std::size_t best = 0;
  double least = 1e300;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    double sum = 0;
    for (const Rigidd& other : poses) sum += distance(poses[i], other);
    if (sum < least) {
      least = sum;
      best = i;
    }
  }
  return poses[best];
}

}  // namespace

#ifdef TACTUS_WITH_CALIB3D
std::optional<Rigidd> board_pose(const Board& board, const BoardView& view, const CalibratedCamera& camera) {
  if (view.corners.size() < kFewestCorners || flatness(board, view) < 0.1) return {};
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> ideal;
  const Camera& c = camera.camera;
  for (const BoardCorner& corner : view.corners) {
    const double y = (corner.px.y - c.cy_px) / c.fy_px;
    const auto p = camera.lens.undistort({(corner.px.x - c.cx_px - c.skew_px * y) / c.fx_px, y});
    if (!p) continue;
    const Vec3d q = board.corner_m(corner.id);
    points.emplace_back(q.x, q.y, q.z);
    ideal.emplace_back(p->x, p->y);
  }
  if (points.size() < kFewestCorners) return {};
  cv::Vec3d r, t;
  if (!cv::solvePnP(points, ideal, cv::Mat::eye(3, 3, CV_64F), cv::Mat(), r, t)) return {};
  if (!std::isfinite(r[0] + t[0] + t[2]) || t[2] <= 0) return {};
  return Rigidd{rotation_from_vector({r[0], r[1], r[2]}), {t[0], t[1], t[2]}};
}

CalibratedCamera first_intrinsics(const Board& board, std::span<const BoardView> views, Index camera,
                                  const std::string& name, Vec2i size_px) {
  std::vector<std::vector<cv::Point3f>> points;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const BoardView& view : views) {
    if (view.camera != camera || view.corners.size() < kFewestCorners || flatness(board, view) < 0.1)
      continue;
    points.emplace_back();
    pixels.emplace_back();
    for (const BoardCorner& corner : view.corners) {
      const Vec3f p = vec_cast<float>(board.corner_m(corner.id));
      points.back().emplace_back(p.x, p.y, p.z);
      pixels.back().emplace_back(static_cast<float>(corner.px.x), static_cast<float>(corner.px.y));
    }
  }
  if (points.size() < 3) {
    throw Error("camera '" + name + "': the board was found in " + std::to_string(points.size()) +
                " of its pictures, expected at least 3 (10 to 20, tilted, over the whole image)");
  }
  CalibratedCamera result;
  Camera& c = result.camera;
  c.name = name;
  c.width_px = size_px.x;
  c.height_px = size_px.y;
  c.cx_px = 0.5 * (size_px.x - 1);
  c.cy_px = 0.5 * (size_px.y - 1);
  const cv::Mat K = cv::initCameraMatrix2D(points, pixels, {size_px.x, size_px.y}, 1);
  const double f = K.at<double>(0, 0);
  // Boards that all face the camera say nothing of the focal length.
  c.fx_px = c.fy_px = std::isfinite(f) && f > 0.2 * size_px.x && f < 20 * size_px.x ? f : size_px.x;
  return result;
}
#else
std::optional<Rigidd> board_pose(const Board&, const BoardView&, const CalibratedCamera&) {
  throw Error(boards_missing());
}
CalibratedCamera first_intrinsics(const Board&, std::span<const BoardView>, Index, const std::string&,
                                  Vec2i) {
  throw Error(boards_missing());
}
#endif

std::vector<Rigidd> first_poses(std::span<const BoardView> views,
                                std::span<const std::optional<Rigidd>> poses,
                                std::span<const CalibratedCamera> cameras) {
  const std::size_t n = cameras.size();
  std::map<std::pair<std::size_t, std::size_t>, std::vector<Rigidd>> pairs;  // T_b_a
  std::map<Index, std::vector<std::size_t>> by_instant;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (poses[i]) by_instant[views[i].instant].push_back(i);
  }
  for (const auto& [instant, seen] : by_instant) {
    for (const std::size_t a : seen) {
      for (const std::size_t b : seen) {
        if (views[a].camera != views[b].camera)
          pairs[{static_cast<std::size_t>(views[a].camera), static_cast<std::size_t>(views[b].camera)}]
              .push_back(*poses[b] * inverse(*poses[a]));
      }
    }
  }
  std::vector<std::optional<Rigidd>> found(n);
  found[0] = Rigidd{};
  for (std::size_t step = 1; step < n; ++step) {
    const std::vector<Rigidd>* best = nullptr;
    std::pair<std::size_t, std::size_t> link;
    for (const auto& [pair, list] : pairs) {
      if (found[pair.first] && !found[pair.second] && (best == nullptr || list.size() > best->size())) {
        best = &list;
        link = pair;
      }
    }
    if (best == nullptr) break;
    found[link.second] = middle(*best) * *found[link.first];
  }
  std::string lost, rest;
  for (std::size_t i = 0; i < n; ++i)
    (found[i] ? rest : lost) +=
        ((found[i] ? rest : lost).empty() ? "'" : ", '") + cameras[i].camera.name + "'";
  if (!lost.empty()) {
    throw Error("camera " + lost +
                " shares no view of the board with the others; show the board to it and to one of " + rest +
                " at the same time");
  }
  std::vector<Rigidd> result;
  for (const auto& pose : found) result.push_back(*pose);
  return result;
}

}  // namespace tactus
