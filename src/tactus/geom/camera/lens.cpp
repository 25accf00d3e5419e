#include "tactus/geom/camera/lens.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tactus/base/error.h"
#include "tactus/geom/camera/lens_maths.h"

namespace tactus {
namespace {

constexpr std::size_t kBrownCounts[] = {2, 4, 5, 8, 12, 14};

/// Ideal radius to distorted radius, and its derivative.
struct Radial {
  double value, slope;
};

Radial brown_radial(const std::array<double, 14>& k, double r) {
  const double q = r * r;
  const double above = 1 + q * (k[0] + q * (k[1] + q * k[4])), below = 1 + q * (k[5] + q * (k[6] + q * k[7]));
  // Derivatives by r of both polynomials.
  const double above_r = 2 * r * (k[0] + q * (2 * k[1] + q * 3 * k[4]));
  const double below_r = 2 * r * (k[5] + q * (2 * k[6] + q * 3 * k[7]));
  return {r * above / below, above / below + r * (above_r * below - above * below_r) / (below * below)};
}

Radial fisheye_radial(const std::array<double, 14>& k, double r) {
  const double theta = std::atan(r), q = theta * theta;
  const double value = lens_maths::fisheye_theta(k.data(), theta);
  const double by_theta = 1 + q * (3 * k[0] + q * (5 * k[1] + q * (7 * k[2] + q * 9 * k[3])));
  return {value, by_theta / (1 + r * r)};
}

/// Brown of m = r / (1 + xi d): dm/dr = (1 + xi / d) / (1 + xi d)^2, as d^2 - r^2 = 1.
Radial omni_radial(const std::array<double, 14>& k, double r) {
  const double xi = k[4], d = std::sqrt(1 + r * r), below = 1 + xi * d;
  const Radial at = brown_radial({k[0], k[1]}, r / below);
  return {(1 + xi) * at.value, (1 + xi) * at.slope * (1 + xi / d) / (below * below)};
}

Radial eucm_radial(const std::array<double, 14>& k, double r) {
  const double alpha = k[0], beta = k[1], d = std::sqrt(beta * r * r + 1), below = alpha * d + 1 - alpha;
  return {r / below, (below - alpha * beta * r * r / d) / (below * below)};
}

Radial double_sphere_radial(const std::array<double, 14>& k, double r) {
  const double xi = k[0], alpha = k[1], d = std::sqrt(1 + r * r), w = xi * d + 1,
               e = std::sqrt(r * r + w * w);
  const double below = alpha * e + (1 - alpha) * w;
  const double w_r = xi * r / d, below_r = alpha * (r + w * w_r) / e + (1 - alpha) * w_r;
  return {(1 + xi) * r / below, (1 + xi) * (below - r * below_r) / (below * below)};
}

Radial radial(const Lens& lens, double r) {
  switch (lens.model) {
    case LensModel::brown:
      return brown_radial(lens.k, r);
    case LensModel::fisheye:
      return fisheye_radial(lens.k, r);
    case LensModel::omni:
      return omni_radial(lens.k, r);
    case LensModel::eucm:
      return eucm_radial(lens.k, r);
    case LensModel::double_sphere:
      return double_sphere_radial(lens.k, r);
    case LensModel::none:
      break;
  }
  return {r, 1};
}

/// How many coefficients a model has, and their names; brown has several counts.
struct ModelText {
  const char* name;
  std::size_t count;
  const char* expected;
};
const ModelText& text_of(LensModel model) {
  static constexpr ModelText kTexts[] = {{"none", 0, "none"},
                                         {"brown", 0, "2, 4, 5, 8, 12 or 14 (k1 k2 p1 p2 k3 ...)"},
                                         {"fisheye", 4, "4 (k1 k2 k3 k4)"},
                                         {"omni", 5, "5 (k1 k2 p1 p2 xi)"},
                                         {"eucm", 2, "2 (alpha beta)"},
                                         {"double sphere", 2, "2 (xi alpha)"}};
  return kTexts[static_cast<std::size_t>(model)];
}

/// Within these ranges points before the camera have pictures.
void check_ranges(const Lens& lens) {
  const auto expect = [](bool right, const char* name, double value, const char* range) {
    if (!right)
      throw Error(std::string(name) + " of the lens is " + number_text(value) + ", expected " + range);
  };
  if (lens.model == LensModel::omni) expect(lens.k[4] >= 0, "xi", lens.k[4], "0 or more");
  if (lens.model == LensModel::eucm) {
    expect(lens.k[0] >= 0 && lens.k[0] <= 1, "alpha", lens.k[0], "0 to 1");
    expect(lens.k[1] > 0, "beta", lens.k[1], "above 0");
  }
  if (lens.model == LensModel::double_sphere) {
    expect(lens.k[0] > -1, "xi", lens.k[0], "above -1");
    expect(lens.k[1] >= 0 && lens.k[1] <= 1, "alpha", lens.k[1], "0 to 1");
  }
}

}  // namespace

Vec2d Lens::distort(Vec2d ideal) const {
  if (model == LensModel::brown) lens_maths::distort_brown(k.data(), ideal.x, ideal.y);
  if (model == LensModel::fisheye) lens_maths::distort_fisheye(k.data(), ideal.x, ideal.y);
  if (model == LensModel::omni) lens_maths::distort_omni(k.data(), ideal.x, ideal.y);
  if (model == LensModel::eucm) lens_maths::distort_eucm(k.data(), ideal.x, ideal.y);
  if (model == LensModel::double_sphere) lens_maths::distort_double_sphere(k.data(), ideal.x, ideal.y);
  return ideal;
}

namespace {

/// Lens::limit where that is below an ideal radius; anything at least as large elsewhere.
double limit_below(const Lens& lens, double radius) {
  if (lens.model == LensModel::none) return std::numeric_limits<double>::infinity();
  // 84 degrees off the axis: no pinhole picture reaches farther. The step is finer than any fold of 14
  // coefficients.
  constexpr double kMostRadius = 10, kStep = 1.0 / 512;
  for (double r = kStep; r < kMostRadius && r - kStep < radius; r += kStep) {
    const Radial at = radial(lens, r);
    if (!(at.slope > 0) || !(at.value > 0)) return r - kStep;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

double Lens::limit() const { return limit_below(*this, std::numeric_limits<double>::infinity()); }

std::optional<Vec2d> Lens::undistort(Vec2d distorted) const {
  if (model == LensModel::none) return distorted;
  // Newton's method with central differences, from the radius whose image has the right length.
  const double wanted = std::hypot(distorted.x, distorted.y);
  double r = wanted;
  for (int i = 0; i < 50; ++i) {
    const Radial at = radial(*this, r);
    if (!(at.slope > 1e-6)) break;
    const double step = (at.value - wanted) / at.slope;
    r = std::max(0.0, r - std::clamp(step, -0.2, 0.2));
    if (std::abs(step) < 1e-14) break;
  }
  Vec2d p = wanted > 0 ? r / wanted * distorted : distorted;
  for (int i = 0; i < 100; ++i) {
    const Vec2d off = distort(p) - distorted;
    const double d = 1e-6;
    const Vec2d by_x = 0.5 / d * (distort({p.x + d, p.y}) - distort({p.x - d, p.y}));
    const Vec2d by_y = 0.5 / d * (distort({p.x, p.y + d}) - distort({p.x, p.y - d}));
    const double det = by_x.x * by_y.y - by_y.x * by_x.y;
    if (!(std::abs(det) > 1e-9)) return {};
    const Vec2d step{(off.x * by_y.y - off.y * by_y.x) / det, (off.y * by_x.x - off.x * by_x.y) / det};
    p = p - step;
    if (!std::isfinite(p.x + p.y)) return {};
    if (std::hypot(step.x, step.y) < 1e-13) break;
  }
  const Vec2d off = distort(p) - distorted;
  const double radius = std::hypot(p.x, p.y);
  if (std::hypot(off.x, off.y) > 1e-12 || radius > limit_below(*this, radius)) return {};
  return p;
}

Lens make_lens(LensModel model, std::span<const double> coefficients) {
  const std::size_t n = coefficients.size();
  const bool right = model == LensModel::brown ? n == 0 || std::ranges::count(kBrownCounts, n) > 0
                                               : n == text_of(model).count;
  if (!right) {
    throw Error("a lens '" + lens_name(model) + "' with " + std::to_string(n) + " coefficients, expected " +
                text_of(model).expected);
  }
  Lens lens;
  if (n == 0) return lens;
  lens.model = model;
  for (std::size_t i = 0; i < n; ++i) {
    if (!std::isfinite(coefficients[i]))
      throw Error("coefficient " + std::to_string(i + 1) + " of the lens is not a finite number");
    lens.k[i] = coefficients[i];
  }
  check_ranges(lens);
  return lens;
}

std::vector<double> coefficients(const Lens& lens) {
  if (lens.model != LensModel::brown)
    return {lens.k.begin(), lens.k.begin() + static_cast<std::ptrdiff_t>(text_of(lens.model).count)};
  std::size_t used = lens.k.size();
  while (used > 0 && lens.k[used - 1] == 0) --used;
  for (const std::size_t n : kBrownCounts) {
    if (n >= std::max<std::size_t>(used, 4))
      return {lens.k.begin(), lens.k.begin() + static_cast<std::ptrdiff_t>(n)};
  }
  return {lens.k.begin(), lens.k.end()};
}

std::string lens_name(LensModel model) { return text_of(model).name; }

namespace {

/// Pixels of ideal or distorted coordinates, and back.
Vec2d to_px(const Camera& c, Vec2d p) {
  return {c.fx_px * p.x + c.skew_px * p.y + c.cx_px, c.fy_px * p.y + c.cy_px};
}
Vec2d from_px(const Camera& c, Vec2d px) {
  const double y = (px.y - c.cy_px) / c.fy_px;
  return {(px.x - c.cx_px - c.skew_px * y) / c.fx_px, y};
}

}  // namespace

Pixel project(const CalibratedCamera& calibrated, Vec3d p_world) {
  const Vec3d p = calibrated.camera.T_cam_world * p_world;
  const Vec2d px = to_px(calibrated.camera, calibrated.lens.distort({p.x / p.z, p.y / p.z}));
  return {px.x, px.y, p.z};
}

std::optional<Vec2d> photo_pixel(const CalibratedCamera& calibrated, const Camera& pinhole, Vec2d pinhole_px,
                                 double lens_limit) {
  const Vec2d ideal = from_px(pinhole, pinhole_px);
  if (std::isfinite(lens_limit) && std::hypot(ideal.x, ideal.y) > lens_limit) return {};
  return to_px(calibrated.camera, calibrated.lens.distort(ideal));
}

Camera undistorted_camera(const CalibratedCamera& calibrated) {
  const Camera& photo = calibrated.camera;
  if (calibrated.lens.model == LensModel::none) return photo;
  const double limit = calibrated.lens.limit();
  const auto empty = [&](Index x, Index y) {
    const auto at = photo_pixel(calibrated, photo, {static_cast<double>(x), static_cast<double>(y)}, limit);
    // Half a pixel beyond the last centre is still the last pixel.
    return !at || at->x < -0.5 || at->y < -0.5 || at->x > photo.width_px - 0.5 ||
           at->y > photo.height_px - 0.5;
  };
  Index left = 0, top = 0, right = photo.width_px, bottom = photo.height_px;
  while (left < right && top < bottom) {
    // Share of each border that lies beyond the photo: the worst one gives way.
    double share[4] = {};
    for (Index y = top; y < bottom; ++y) {
      share[0] += empty(left, y) ? 1.0 / (bottom - top) : 0;
      share[1] += empty(right - 1, y) ? 1.0 / (bottom - top) : 0;
    }
    for (Index x = left; x < right; ++x) {
      share[2] += empty(x, top) ? 1.0 / (right - left) : 0;
      share[3] += empty(x, bottom - 1) ? 1.0 / (right - left) : 0;
    }
    const auto worst = std::max_element(std::begin(share), std::end(share)) - std::begin(share);
    if (share[worst] == 0) break;
    Index* const borders[] = {&left, &right, &top, &bottom};
    *borders[worst] += worst % 2 == 0 ? 1 : -1;
  }
  if (left >= right || top >= bottom) {
    throw Error("camera '" + photo.name + "': its lens (" + lens_name(calibrated.lens.model) +
                ") leaves nothing of the image of " + std::to_string(photo.width_px) + "x" +
                std::to_string(photo.height_px) + " pixels");
  }
  Camera result = photo;
  result.cx_px -= left;
  result.cy_px -= top;
  result.width_px = right - left;
  result.height_px = bottom - top;
  return result;
}

}  // namespace tactus
