#include "tactus/reconstruct/doctor/frontier_points.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tactus/base/bits.h"
#include "tactus/base/math.h"

namespace tactus {
namespace {

constexpr double kLeastFactor = 0.8, kMostFactor = 1.25, kStep = 0.01;
/// Right rigs of photographs err, too: Middlebury's dino fits best with focal lengths of all cameras that are
/// 4 % longer.
constexpr double kLeastChange = 0.042, kMostLeft = 0.8;
/// Planes follow when all focal lengths change; those of one camera don't.
constexpr double kLeastRmsOfAll_px = 0.25, kLeastRmsOfOne_px = 0.5;
/// Right rigs are calibrated to that. Where it passes for a change that is to be named, the silhouettes say
/// nothing of the focal lengths of all: a ball's planes move by 1.2 px where these double, a hand's by 6
/// to 9.
constexpr double kCalibration_px = 0.3, kNamedChange = 0.05;
/// Part of the planes that counts: a speck in one mask spoils those of its pairs.
constexpr double kKeptPart = 0.75;
/// A tip that is thinner ends where a pixel happens to lie: of the 9 x 9 pixels around a point that a plane
/// touches, so many are set. At a straight edge it is half of them, at the end of a rod of 4 px 20.
constexpr Index kAround_px = 4;
constexpr int kLeastAround = 16;

bool is_thick_at(const BitMask& mask, Index x, Index y) {
  int set = 0;
  for (Index v = std::max(y - kAround_px, 0); v <= std::min(y + kAround_px, mask.height_px - 1); ++v)
    for (Index u = std::max(x - kAround_px, 0); u <= std::min(x + kAround_px, mask.width_px - 1); ++u)
      set += mask(u, v) ? 1 : 0;
  return set >= kLeastAround;
}

/// Corners of the convex hull of a mask's pixels.
std::vector<Vec2d> convex_hull(const BitMask& mask) {
  std::vector<Vec2d> ends;  // the first and last pixel of each row, upwards in y
  for (Index y = 0; y < mask.height_px; ++y) {
    Index first = -1, last = -1;
    for (Index x = 0; x < mask.width_px; ++x) {
      if (!mask(x, y)) continue;
      if (first < 0) first = x;
      last = x;
    }
    if (first < 0) continue;
    ends.push_back({static_cast<double>(first), static_cast<double>(y)});
    if (last != first) ends.push_back({static_cast<double>(last), static_cast<double>(y)});
  }
  const auto turn = [](Vec2d a, Vec2d b, Vec2d c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  };
  std::vector<Vec2d> hull;
  for (int side = 0; side < 2; ++side) {  // Andrew's chains, along y
    const std::size_t begin = hull.size();
    for (const Vec2d p : ends) {
      while (hull.size() >= begin + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(ends.begin(), ends.end());
  }
  return hull;
}

struct Corner {
  Vec2d px;
  bool is_known = false;  ///< not at the border of the picture, nor at a thin tip
};
struct FrontierView {
  Camera camera;
  std::vector<Corner> hull;
};

FrontierView view_of(const SeenView& seen) {
  FrontierView view{seen.camera, {}};
  const BitMask& mask = *seen.mask;
  for (const Vec2d p : convex_hull(mask)) {
    const auto x = static_cast<Index>(p.x), y = static_cast<Index>(p.y);
    const bool is_inside = x > 0 && y > 0 && x < mask.width_px - 1 && y < mask.height_px - 1;
    view.hull.push_back({p, is_inside && is_thick_at(mask, x, y)});
  }
  return view;
}

/// A plane that touches a silhouette, about the line between two cameras.
struct Touch {
  double angle = 0, px_per_rad = 0;
  bool is_known = false;  ///< as its corner
};

/// Grows with the angle of a direction, -pi to pi, at a fraction of its price.
double order_of_angle(Vec2d d) {
  const double share = d.y / (std::abs(d.x) + std::abs(d.y));
  if (d.x >= 0) return share;
  return (d.y >= 0 ? 2 : -2) - share;
}

/// The two touching planes of a view; none when the other camera lies within the silhouette's cone.
bool touching_planes(const FrontierView& view, Vec3d along, Vec3d u, Vec3d v, Touch (&touch)[2]) {
  const Camera& c = view.camera;
  const Corner* at[2] = {};
  Vec2d first;
  double most[2] = {};
  Vec3d rays[2];
  for (const Corner& p : view.hull) {
    const Vec3d ray = pixel_ray_world(c, p.px.x, p.px.y);
    const Vec2d about{dot(ray, u), dot(ray, v)};
    if (at[0] == nullptr) first = about;
    const double order =
        order_of_angle({first.x * about.x + first.y * about.y, first.x * about.y - first.y * about.x});
    for (int side = 0; side < 2; ++side) {
      if (at[side] != nullptr && (side == 0 ? order >= most[0] : order <= most[1])) continue;
      most[side] = order;
      at[side] = &p;
      rays[side] = ray;
    }
  }
  if (at[0] == nullptr) return false;
  const double reference = std::atan2(first.y, first.x);
  double sines[2] = {};
  for (int side = 0; side < 2; ++side) {
    const Vec3d ray = rays[side];
    touch[side].angle = std::remainder(std::atan2(dot(ray, v), dot(ray, u)) - reference, 2 * M_PI);
    sines[side] = std::sqrt(std::max(0.0, 1 - sqr(dot(ray, along))));
  }
  if (touch[1].angle - touch[0].angle > 0.8 * M_PI) return false;
  for (int side = 0; side < 2; ++side) {
    touch[side].angle += reference;
    touch[side].px_per_rad = 0.5 * (c.fx_px + c.fy_px) * sines[side];
    touch[side].is_known = at[side]->is_known;
  }
  return true;
}

/// Distances between the touching planes of all pairs of views [px], squared; of one view's pairs, if asked.
std::vector<double> squares_of(std::span<const FrontierView> views, int only = -1) {
  std::vector<double> squares;
  for (std::size_t a = 0; a < views.size(); ++a) {
    for (std::size_t b = a + 1; b < views.size(); ++b) {
      if (only >= 0 && static_cast<int>(a) != only && static_cast<int>(b) != only) continue;
      const Vec3d line = views[b].camera.center_world() - views[a].camera.center_world();
      if (!(length(line) > 0)) continue;
      const Vec3d along = normalized(line);
      const Vec3d u = normalized(cross(along, std::abs(along.y) < 0.7 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0}));
      const Vec3d v = cross(along, u);
      Touch of_a[2], of_b[2];
      if (!touching_planes(views[a], along, u, v, of_a) || !touching_planes(views[b], along, u, v, of_b))
        continue;
      for (int side = 0; side < 2; ++side) {
        if (!of_a[side].is_known || !of_b[side].is_known) continue;
        const double off = std::remainder(of_a[side].angle - of_b[side].angle, 2 * M_PI);
        squares.push_back(sqr(off) * of_a[side].px_per_rad * of_b[side].px_per_rad);
      }
    }
  }
  return squares;
}

/// Mean square of the better part.
double mean_square(std::vector<double> squares) {
  const auto kept = static_cast<std::ptrdiff_t>(kKeptPart * static_cast<double>(squares.size()));
  if (kept < 1) return 0;
  std::nth_element(squares.begin(), squares.begin() + kept, squares.end());
  double sum = 0;
  for (auto s = squares.begin(); s != squares.begin() + kept; ++s) sum += *s;
  return sum / static_cast<double>(kept);
}

void scale(Camera& camera, double factor) {
  camera.fx_px *= factor;
  camera.fy_px *= factor;
  camera.skew_px *= factor;
}

std::vector<FrontierView> scaled(std::span<const FrontierView> given, int view, double factor) {
  std::vector<FrontierView> views(given.begin(), given.end());
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (view < 0 || static_cast<int>(v) == view) scale(views[v].camera, factor);
  }
  return views;
}

/// Mean squares of distances with focal lengths that are so many times as long: of one view's pairs, if one
/// is meant; and of all pairs.
double cost(std::span<const FrontierView> given, int view, double factor) {
  return mean_square(squares_of(scaled(given, view, factor), view));
}
double cost_of_all(std::span<const FrontierView> given, int view, double factor) {
  return mean_square(squares_of(scaled(given, view, factor)));
}

/// As many planes tell a spread well.
constexpr double kKnownSpread = 1000;

/// The factor of the least cost, and how well it is known: by the curvature of a sum of squares.
std::optional<FocalFit> fit(std::span<const FrontierView> views, int view) {
  const std::size_t count = squares_of(views, view).size();
  if (count < 6) return {};
  std::vector<double> costs;
  const int steps = static_cast<int>(std::lround((kMostFactor - kLeastFactor) / kStep));
  for (int i = 0; i <= steps; ++i) costs.push_back(cost(views, view, kLeastFactor + i * kStep));
  const auto best = static_cast<int>(std::min_element(costs.begin(), costs.end()) - costs.begin());
  if (best == 0 || best == steps) return {};
  // A parabola through the neighbours; over wider steps, as masks have pixels.
  const int reach = std::min({3, best, steps - best});
  const double low = costs[static_cast<std::size_t>(best - reach)],
               middle = costs[static_cast<std::size_t>(best)],
               high = costs[static_cast<std::size_t>(best + reach)], h = reach * kStep;
  const double curvature = (low - 2 * middle + high) / (h * h);
  if (!(curvature > 0)) return {};
  FocalFit result;
  result.view = view;
  result.factor = kLeastFactor + best * kStep + 0.5 * (low - high) / (low - 2 * middle + high) * h;
  const double used = kKeptPart * static_cast<double>(count);
  const double pixels = sqr(0.15), least = std::max(middle, pixels);  // pixels are no points
  result.planes = middle > pixels ? used : kKnownSpread;
  result.deviation = std::sqrt(2 * least / (used * curvature));
  // The error of a camera's calibration, up and aside, is the same in all of its planes.
  const double errors = 2 * static_cast<double>(views.size());
  result.by_calibration = kCalibration_px * std::sqrt(2 / (errors * curvature));
  result.rms_before_px = std::sqrt(cost(views, view, 1));
  result.rms_after_px = std::sqrt(cost(views, view, result.factor));
  return result;
}

constexpr std::size_t kViewsForAll = 6;

/// By so many deviations, estimated from so many planes, a right factor is off once in 10,000 times
/// (Student).
double most_deviations(double planes) { return std::max(5.0, 3.9 + 165 / sqr(std::max(planes - 1, 1.0))); }

bool is_better(const FocalFit& f) {
  const bool is_of_all = f.view < 0;
  const double change = std::abs(f.factor - 1);
  if (is_of_all && 3 * f.by_calibration > kNamedChange) return false;
  return change >= kLeastChange && change >= most_deviations(f.planes) * f.deviation &&
         f.rms_before_px >= (is_of_all ? kLeastRmsOfAll_px : kLeastRmsOfOne_px) &&
         f.rms_after_px <= kMostLeft * f.rms_before_px;
}

}  // namespace

std::string FocalFit::text(std::span<const Camera> cameras) const {
  const bool too_long = factor < 1;
  char text[240];
  std::snprintf(
      text, sizeof text,
      "%.1f %% too %s: planes that touch the object from two cameras differ by %.1f px, with the right "
      "ones by %.1f px",
      100 * std::abs(1 / factor - 1), too_long ? "long" : "short", rms_before_px, rms_after_px);
  return (view < 0
              ? std::string("the focal lengths of all cameras are ")
              : "the focal length of camera '" + cameras[static_cast<std::size_t>(view)].name + "' is ") +
         text;
}

std::optional<FocalFit> better_focal_lengths(std::span<const SeenView> seen) {
  std::vector<FrontierView> views;
  for (const SeenView& s : seen) {
    if (!s.has_mask() || s.mask->area_px() == 0) return {};
    views.push_back(view_of(s));
  }
  if (views.size() < 4) return {};
  // One factor for all cameras, or for one of them: the fit that explains all planes best.
  std::optional<FocalFit> best;
  double least = 0;
  for (int v = -1; v < static_cast<int>(views.size()); ++v) {
    const std::optional<FocalFit> one = fit(views, v);
    if (!one || !is_better(*one)) continue;
    const double left = cost_of_all(views, v, one->factor);
    if (best && left >= least) continue;
    best = one;
    least = left;
  }
  // Poses of few views pass for focal lengths of all.
  if (best && best->view < 0 && views.size() < kViewsForAll) return {};
  return best;
}

}  // namespace tactus
