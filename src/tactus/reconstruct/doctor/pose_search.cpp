#include "tactus/reconstruct/doctor/pose_search.h"

#include <array>
#include <cmath>

#include "tactus/geom/image/mask_metrics.h"

namespace tactus {
namespace {

/// No view misses more than its rim.
constexpr double kGoodCost = 2e-3;

/// Sum of the shares of their masks that all views miss. A hull that the view carves away altogether misses
/// everything, so the search starts where its mask lies on the hull's image.
double cost_of(const SilhouetteConsistency& trusted, const SeenView& view) {
  double cost = 0;
  const std::vector<double> recalls = trusted.recalls({&view, 1});
  for (const double r : recalls) cost += 1 - r;
  return cost;
}

CameraMotion motion_of(const std::array<double, 6>& p) { return {{p[0], p[1], p[2]}, {p[3], p[4], p[5]}}; }

/// Mean of the trusted hull's points, in the camera's frame [m].
Vec3d middle_m(const SilhouetteConsistency& trusted, const SeenView& view) {
  Vec3d sum;
  for (const Vec3f p : trusted.points_m()) sum = sum + vec_cast<double>(p);
  return view.camera.T_cam_world *
         (1.0 / static_cast<double>(std::max<std::size_t>(trusted.sample_count(), 1)) * sum);
}

/// The turn that takes the middle of the hull's image to the middle of the mask.
std::array<double, 6> centered(const SilhouetteConsistency& trusted, const SeenView& view) {
  const Vec3d is = normalized(middle_m(trusted, view));
  const Vec2d at = center_px(*view.mask);
  const double y = (at.y - view.camera.cy_px) / view.camera.fy_px,
               x = (at.x - view.camera.cx_px - view.camera.skew_px * y) / view.camera.fx_px;
  const Vec3d wanted = normalized(Vec3d{x, y, 1});
  const Vec3d axis = cross(is, wanted);
  const double sine = length(axis), angle = std::atan2(sine, dot(is, wanted));
  const Vec3d turn = sine > 1e-12 ? angle / sine * axis : Vec3d{};
  return {turn.x, turn.y, turn.z, 0, 0, 0};
}

}  // namespace

FoundPose search_pose(const SilhouetteConsistency& trusted, const SeenView& view) {
  const Vec3d center = middle_m(trusted, view);
  const double distance_m = std::max(length(center), 1e-6);
  const auto cost_at = [&](const std::array<double, 6>& p) {
    return cost_of(trusted, {moved(view.camera, motion_of(p)), view.mask});
  };
  std::array<double, 6> best{};
  double best_cost = cost_at(best);
  if (const std::array<double, 6> start = centered(trusted, view); cost_at(start) < best_cost) {
    best = start;
    best_cost = cost_at(start);
  }
  const double least_step = 0.3 / view.camera.fx_px;  // a third of a pixel
  // Cameras are turned more often than moved, and small turns and shifts look alike: turns first.
  for (const std::size_t parameters : {std::size_t{3}, std::size_t{6}}) {
    for (double step = 0.03; step > least_step && best_cost > kGoodCost; step *= 0.5) {
      for (bool better = true; better;) {
        better = false;
        for (std::size_t i = 0; i < parameters; ++i) {
          for (const double sign : {1.0, -1.0}) {
            std::array<double, 6> trial = best;
            trial[i] += sign * step * (i < 3 ? 1 : distance_m);
            // A shift is made good for by a turn, so that the hull stays where it is in the image.
            if (i == 3) trial[1] -= sign * step;
            if (i == 4) trial[0] += sign * step;
            const double cost = cost_at(trial);
            if (cost >= best_cost - 1e-6) continue;
            best = trial;
            best_cost = cost;
            better = true;
          }
        }
      }
    }
  }
  return {moved(view.camera, motion_of(best)), best_cost};
}

}  // namespace tactus
