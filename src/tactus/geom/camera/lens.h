#pragma once
/// Lenses: they bend rays between the scene and the sensor. The formulas of distortion are in lens_maths.h.
#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tactus/geom/camera/camera.h"

namespace tactus {

enum class LensModel : std::uint8_t { none, brown, fisheye, omni, eucm, double_sphere };

/// Maps ideal image coordinates (x/z, y/z) to distorted ones. OpenCV defines the first two models:
///  brown: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tau_x tau_y, r^2 = x^2 + y^2 (Brown-Conrady; rational, thin
///  prism
///         and tilted sensor where given)
///    x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)
///         + 2 p1 x y + p2 (r^2 + 2 x^2) + s1 r^2 + s2 r^4
///    y' likewise with p1 and p2 exchanged, s3 and s4; then turned by the sensor's tilt.
///  fisheye: k1 k2 k3 k4 (Kannala-Brandt), theta = atan r
///    (x', y') = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8) / r (x, y)
/// Three project onto spheres or an ellipsoid. They are scaled to slope 1 on the axis, so the focal length of
/// the camera is that of the picture's middle; with d = sqrt(1 + r^2):
///  omni: k1 k2 p1 p2 xi (Mei, Rives 2007)
///    (x', y') = (1 + xi) brown((x, y) / (1 + xi d))
///  eucm: alpha beta (Khomutenko, Garcia, Martinet 2016)
///    (x', y') = (x, y) / (alpha sqrt(beta r^2 + 1) + 1 - alpha)
///  double_sphere: xi alpha (Usenko, Demmel, Cremers 2018), with w = xi d + 1
///    (x', y') = (1 + xi) (x, y) / (alpha sqrt(r^2 + w^2) + (1 - alpha) w)
struct Lens {
  LensModel model = LensModel::none;
  std::array<double, 14> k{};  ///< coefficients in the order above; unused ones are 0

  Vec2d distort(Vec2d ideal) const;
  /// The ideal coordinates of distorted ones, to 1e-12; none where the lens has no inverse (beyond `limit`).
  std::optional<Vec2d> undistort(Vec2d distorted) const;
  /// Ideal radius up to which the image grows with the angle: beyond, the polynomial folds back into the
  /// picture and means nothing. Infinite where it never folds.
  double limit() const;
  friend bool operator==(const Lens&, const Lens&) = default;
};

/// @throws Error naming model, count and possible counts: brown 0 (then none), 2, 4, 5, 8, 12 or 14; fisheye
/// 4; omni 5; eucm and double_sphere 2; or a coefficient that is not finite or out of its range.
Lens make_lens(LensModel model, std::span<const double> coefficients);
/// As many coefficients as say it all: brown 4, 5, 8, 12 or 14, the others as make_lens.
std::vector<double> coefficients(const Lens& lens);
/// "none", "brown", "fisheye", "omni", "eucm", "double sphere"
std::string lens_name(LensModel model);

/// A camera as it was calibrated: `camera` without its lens, and the lens. `camera.width_px` and `height_px`
/// are the photo's.
struct CalibratedCamera {
  Camera camera;
  Lens lens;
};

/// Where the photo shows a point: through the lens. z_m <= 0 is behind the camera.
Pixel project(const CalibratedCamera& calibrated, Vec3d p_world);
/// Pixel of the photo that shows the same ray as pixel `pinhole_px` of a pinhole of the same pose; none
/// beyond the lens's `limit` (handed in, as it costs a search).
std::optional<Vec2d> photo_pixel(const CalibratedCamera& calibrated, const Camera& pinhole, Vec2d pinhole_px,
                                 double lens_limit);
/// The pinhole whose picture the photo fills: K of the calibration, cut to the largest rectangle of whole
/// pixels that found the photo behind every one (a pincushion lens leaves the corners empty, and unseen
/// pixels must not carve).
/// @throws Error naming the camera when no such rectangle is left.
Camera undistorted_camera(const CalibratedCamera& calibrated);

}  // namespace tactus
