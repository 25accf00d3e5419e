#include "tactus/reconstruct/depth/depth_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace tactus {
namespace {

constexpr int kSamples = 300;
constexpr std::size_t kMostSamples = 2 * kSamples;  // whole steps give less than twice as many
/// A wrong reading must lose this share of the better one's points, and at least kFewest of them: contours,
/// noise and calibration errors move some points across a silhouette's border, too.
constexpr double kLost = 0.15;
constexpr int kFewest = 12;
/// Points that are read too far leave the object at its back, and only where it is thin or seen at a slant:
/// fewer do, but then none comes in for them.
constexpr double kLostBehind = 0.03;
/// How far a point may project beside a silhouette [px]: its border is given to whole pixels, so 1. With
/// more, masks that are too small lose nothing; no mask is off by more than the last.
constexpr int kBorder = 1, kMasksOff[] = {kBorder, 3, 5}, kMasksFarOff = 7;
/// A reading that is named must explain all points but this share.
constexpr double kUnexplained = 0.03;

struct Ray {
  Vec3d direction;  ///< unit, world
  double distance_m, cosine;
};

struct Reading {
  const char* name;
  double factor;
  int cosines;  ///< -1: z is given; 1: radial distance was taken for z; 0: neither
  double scale(const Ray& ray) const {
    return factor * (cosines == 0 ? 1.0 : cosines < 0 ? 1 / ray.cosine : ray.cosine);
  }
};

constexpr Reading kAsGiven{"", 1, 0};

class Judge {
 public:
  Judge(std::span<const Camera> cameras, std::span<const BitMask> silhouettes, const Camera& depth_camera,
        const DepthImage& depth_m, Box3f workspace_m)
      : cameras_(cameras), silhouettes_(silhouettes), box_(workspace_m), eye_(depth_camera.center_world()) {
    std::int64_t measured = 0;
    for (const float e : depth_m.pixels) measured += is_distance(e) ? 1 : 0;
    const std::int64_t step = std::max<std::int64_t>(1, measured / kSamples);
    const Vec3d axis = depth_camera.axis_world();
    std::int64_t number = step / 2;
    const auto width = static_cast<std::size_t>(depth_m.width_px);
    std::array<float, kMostSamples> bends;
    std::size_t bend_count = 0;
    for (std::size_t i = 0; i < depth_m.pixels.size(); ++i) {
      const float e = depth_m.pixels[i];
      if (!is_distance(e) || ++number % step != 0) continue;
      const std::size_t x = i % width;
      const Vec3d direction =
          pixel_ray_world(depth_camera, static_cast<double>(x), static_cast<double>(i / width));
      if (count_ == rays_.size()) break;
      rays_[count_++] = {direction, static_cast<double>(e), dot(direction, axis)};
      if (x == 0 || x + 1 == width) continue;
      const float left = depth_m.pixels[i - 1], right = depth_m.pixels[i + 1];
      if (is_distance(left) && is_distance(right)) bends[bend_count++] = std::abs(left - 2 * e + right);
    }
    sigma_m_ = noise_m(std::span(bends).first(bend_count));
  }

  int samples() const { return static_cast<int>(count_); }
  int inside(const Reading& reading, int border_px = kBorder) const {
    return static_cast<int>(std::count_if(rays_.begin(), rays_.begin() + count_, [&](const Ray& ray) {
      return is_inside(ray, reading, border_px);
    }));
  }
  /// Points that `reading` puts inside and kAsGiven doesn't.
  int gained(const Reading& reading) const {
    return static_cast<int>(std::count_if(rays_.begin(), rays_.begin() + count_, [&](const Ray& ray) {
      return is_inside(ray, reading, kBorder) && !is_inside(ray, kAsGiven, kBorder);
    }));
  }
  /// By how much that reading is longer, on average over the points that it puts inside.
  double mean_stretch(const Reading& reading) const {
    double sum = 0;
    int n = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      if (!is_inside(rays_[i], reading, kBorder)) continue;
      sum += reading.scale(rays_[i]);
      ++n;
    }
    return n > 0 ? sum / n : 1;
  }

 private:
  bool is_inside(const Ray& ray, const Reading& reading, int border_px) const {
    const double scale = reading.scale(ray);
    // Noise puts half of the points before the surface, where no silhouette need hold them.
    for (const double sigmas : {0.0, 1.0, 2.0}) {
      if (is_inside(eye_ + scale * (ray.distance_m + sigmas * sigma_m_) * ray.direction, border_px))
        return true;
    }
    return false;
  }
  /// Standard deviation of the noise from second differences along rows: their median over that of Gaussian
  /// noise of unit variance (second differences have six times a pixel's variance). Slopes don't count,
  /// curvature little.
  static double noise_m(std::span<float> bends) {
    if (bends.size() < 16) return 0;
    const auto middle = bends.begin() + static_cast<std::ptrdiff_t>(bends.size() / 2);
    std::nth_element(bends.begin(), middle, bends.end());
    return static_cast<double>(*middle) / (0.6745 * std::sqrt(6.0));
  }
  static bool is_distance(float e) { return (e > 0) & (e <= std::numeric_limits<float>::max()); }
  bool is_inside(Vec3d p, int border_px) const {
    const auto between = [](double x, float low, float high) {
      return x >= static_cast<double>(low) && x <= static_cast<double>(high);
    };
    if (!between(p.x, box_.min.x, box_.max.x) || !between(p.y, box_.min.y, box_.max.y) ||
        !between(p.z, box_.min.z, box_.max.z))
      return false;
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      if (silhouettes_[c].words.empty()) continue;
      const Pixel at = project(cameras_[c], p);
      if (at.z_m <= 0) continue;
      const double u = std::floor(at.u_px + 0.5), v = std::floor(at.v_px + 0.5);
      if (u < 0 || v < 0 || u >= cameras_[c].width_px || v >= cameras_[c].height_px) continue;
      if (!near_silhouette(silhouettes_[c], static_cast<Index>(u), static_cast<Index>(v), border_px))
        return false;
    }
    return true;
  }
  static bool near_silhouette(const BitMask& mask, Index u, Index v, int border_px) {
    if (mask(u, v)) return true;
    for (Index y = std::max(v - border_px, 0); y <= std::min(v + border_px, mask.height_px - 1); ++y) {
      for (Index x = std::max(u - border_px, 0); x <= std::min(u + border_px, mask.width_px - 1); ++x) {
        if (mask(x, y)) return true;
      }
    }
    return false;
  }

  std::span<const Camera> cameras_;
  std::span<const BitMask> silhouettes_;
  Box3f box_;
  Vec3d eye_;
  double sigma_m_ = 0;
  std::array<Ray, kMostSamples> rays_;
  std::size_t count_ = 0;
};

bool is_better(int n, int other, double lost = kLost) {
  return n - other >= std::max(kFewest + 0.0, lost * n);
}

/// Whether z was taken for radial distance: points lie before the surface by 1/cos of their ray's angle from
/// the optical axis. So do those of right depth where masks are too small (a poor segmentation), and the
/// farther out the more, as contours are there. But with masks that much wider they lie inside as they are,
/// and longer rays never bring in all: those next to a contour pass beside the mask. So there must be a width
/// at which `bent` explains nearly all points and `straight` far fewer; where the same stretch everywhere
/// explains nearly as many, twice as far.
bool is_bent(const Judge& judge, const Reading& straight, const Reading& bent) {
  if (!is_better(judge.inside(bent), judge.inside(straight))) return false;
  const int all = std::max(judge.inside(straight, kMasksFarOff), judge.inside(bent, kMasksFarOff));
  const Reading stretched{"", judge.mean_stretch(bent), 0};
  for (const int border_px : kMasksOff) {
    const int n = judge.inside(bent, border_px);
    if (n < (1 - kUnexplained) * all) continue;
    const int alike = judge.inside(stretched, border_px);
    const double lost = alike <= (1 - kUnexplained) * n ? kLost : 2 * kLost;
    return alike <= n && is_better(n, judge.inside(straight, border_px), lost);
  }
  return false;
}

/// The reading under which far more points lie inside; nullptr: none.
const Reading* much_better(const Judge& judge, int as_given) {
  static constexpr Reading kUnits[] = {{"millimetres given as metres", 1e-3, 0},
                                       {"kilometres given as metres", 1e3, 0}};
  static constexpr Reading kBent[] = {{"z (distance along the optical axis) given as radial distance", 1, -1},
                                      {"z in millimetres given as radial distance in metres", 1e-3, -1}};
  if (!is_better(judge.samples(), as_given)) return nullptr;  // no reading can be much better
  const Reading* unit = nullptr;
  int most = as_given;
  for (const Reading& reading : kUnits) {
    const int n = judge.inside(reading);
    if (n <= most || !is_better(n, as_given)) continue;
    most = n;
    unit = &reading;
  }
  const Reading& straight = unit != nullptr ? *unit : kAsGiven;
  for (const Reading& bent : kBent) {
    if (bent.factor == straight.factor && is_bent(judge, straight, bent)) return &bent;
  }
  return unit;
}

/// Radial distance taken for z was made too long by 1/cos: points leave the object at its back, and none lies
/// before it. If the points really lie there, the shorter reading loses points at the front, which rules it
/// out.
const Reading* radial_as_z(const Judge& judge, int as_given) {
  static constexpr Reading kReading{"radial distance given as z (distance along the optical axis)", 1, 1};
  const double fewest = std::max(kFewest + 0.0, kLostBehind * judge.samples());
  if (judge.samples() - as_given < fewest) return nullptr;
  const int inside = judge.inside(kReading), gained = judge.gained(kReading);
  const int lost = as_given + gained - inside;
  if (gained < fewest || 4 * lost > gained) return nullptr;
  // Noise, or a camera that is a little off, is helped as much by the same shortening everywhere.
  return judge.inside({"", judge.mean_stretch(kReading), 0}) >= inside ? nullptr : &kReading;
}

}  // namespace

std::string depth_inconsistency(std::span<const Camera> cameras, std::span<const BitMask> silhouettes,
                                const Camera& depth_camera, const DepthImage& depth_m, Box3f workspace_m) {
  const auto is_seen = [](const BitMask& mask) { return !mask.words.empty(); };
  if (depth_m.empty() || std::none_of(silhouettes.begin(), silhouettes.end(), is_seen)) return "";
  const Judge judge(cameras, silhouettes, depth_camera, depth_m, workspace_m);
  const int as_given = judge.inside(kAsGiven), samples = judge.samples();
  if (samples - as_given < kFewest) return "";
  const Reading* reading = much_better(judge, as_given);
  if (reading == nullptr) reading = radial_as_z(judge, as_given);
  if (reading == nullptr) return "";
  return "the depth of camera '" + depth_camera.name + "' looks like " + reading->name + ": of " +
         std::to_string(samples) + " measured points " + std::to_string(as_given) +
         " lie inside the silhouettes, read so " + std::to_string(judge.inside(*reading));
}

}  // namespace tactus
