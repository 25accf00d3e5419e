#include "tactus/geom/figures/figure_builders.h"

#include <span>
#include <utility>
#include <vector>

namespace tactus {
namespace {

constexpr float kTurn = 2 * kPi;

/// Angle of the motion at a time of its period.
float phase_rad(double time_s, double period_s) { return kTurn * static_cast<float>(time_s / period_s); }

Mat3f turn(Vec3f axis, float angle_rad) { return rotation_matrix(axis_angle(axis, angle_rad)); }

/// Radii and points of `part` times `s`.
void scale_parts(FigureParts& parts, float s) {
  parts.seam_m *= s;
  for (FigureParts::Limb& limb : parts.limbs) {
    limb.blend_m *= s;
    limb.planes_radius_m *= s;
    limb.planes_center_m *= s;
    for (FigureParts::Cone& c : limb.cones) {
      c.a_m *= s;
      c.b_m *= s;
      c.radius_a_m *= s;
      c.radius_b_m *= s;
    }
    for (FigureParts::Plane& p : limb.planes) p.side.offset_m *= s;
    for (SphereShell& shell : limb.shells) {
      shell.center_m *= s;
      shell.radius_m *= s;
      shell.half_thickness_m *= s;
    }
  }
}

/// The middle of the workspace.
constexpr Vec3f kCenter{0, 0.5F, 0};

FigureParts::Cone cone(Vec3f a, Vec3f b, float ra, float rb) { return {0, a, b, ra, rb}; }
FigureParts::Cone ball(Vec3f a, float r) { return {0, a, a, r, r}; }

/// The side of a plane through a point to which `n` does not point.
FigureParts::Plane side(Vec3f n, Vec3f through) {
  const Vec3f unit = normalized(n);
  return {0, {unit, dot(unit, through)}};
}

/// How far a plate reaches to -y and +y at a place along x.
struct PlateWidth {
  float x_m, below_m, above_m;
};

/// A convex plate in the plane of x and y whose outline goes through three places; its edges are bevelled.
FigureParts::Limb plate(PlateWidth begin, PlateWidth middle, PlateWidth end, float half_thickness_m) {
  FigureParts::Limb limb;
  for (const float z : {1.F, -1.F}) limb.planes.push_back(side({0, 0, z}, {0, 0, z * half_thickness_m}));
  for (const float y : {1.F, -1.F}) {
    const auto corner = [&](PlateWidth w) { return Vec3f{w.x_m, y > 0 ? w.above_m : -w.below_m, 0}; };
    for (const auto& [from, to] : {std::pair{begin, middle}, {middle, end}}) {
      const Vec3f along = corner(to) - corner(from), out = y * normalized(Vec3f{-along.y, along.x, 0});
      limb.planes.push_back(side(out, corner(middle)));
      for (const float z : {1.F, -1.F}) {
        const Vec3f bevel{0, 0, 0.4F * z * half_thickness_m};
        limb.planes.push_back(side(out + Vec3f{0, 0, z}, corner(middle) + bevel));
      }
    }
  }
  limb.planes.push_back(side({-1, 0, 0}, {begin.x_m, 0, 0}));
  limb.planes.push_back(side({1, 0, 0}, {end.x_m, 0, 0}));
  limb.planes_center_m = {0.5F * (begin.x_m + end.x_m), 0, 0};
  limb.planes_radius_m = 1.01F * length(Vec3f{end.x_m - limb.planes_center_m.x,
                                              max(middle.below_m, middle.above_m), half_thickness_m});
  return limb;
}

/// A rigid figure around the middle of the workspace: R(phase) and t(phase) move it.
template <class Rotation, class Shift>
void move_rigidly(FigureParts& parts, const FigureOptions& options, double period_s, Rotation R, Shift t) {
  parts.period_s = period_s;
  const Vec3f offset = options.offset_m + kCenter;
  const bool moving = options.moving;
  parts.pose = [=](double time_s, std::vector<Rigidf>& T) {
    const float a = phase_rad(time_s, period_s);
    T.front() = moving ? Rigidf{R(a), offset + t(a)} : Rigidf{R(0.F), offset};
  };
}

}  // namespace

FigureParts build_sphere(const FigureOptions& options) {
  FigureParts parts;
  parts.limbs.resize(1);
  parts.limbs.front().cones = {ball({}, 0.25F)};
  scale_parts(parts, options.scale);
  move_rigidly(
      parts, options, 4, [](float) { return Mat3f::identity(); },
      [](float a) {
        return Vec3f{0.15F * sin_cos(a).sin, 0.1F * sin_cos(2 * a).sin, 0.15F * sin_cos(a).cos};
      });
  return parts;
}

FigureParts build_bowl(const FigureOptions& options) {
  FigureParts parts;
  // Opens along +z, towards the time-of-flight camera; the rim lies 2 cm in front of the centre.
  FigureParts::Limb wall;
  wall.planes = {{0, {{0, 0, 1}, 0.02F}}};
  wall.shells = {{{}, 0.29F, 0.02F}};
  wall.planes_radius_m = 0.3101F;
  parts.limbs = {wall};
  scale_parts(parts, options.scale);
  move_rigidly(
      parts, options, 4,
      [](float a) {
        return turn({0, 1, 0}, 0.5F * sin_cos(a).sin);
      },
      [](float a) {
        return Vec3f{0, 0.05F * sin_cos(a).sin, 0};
      });
  return parts;
}

/// As a surgeon sees it who stands before it at +z: the right lobe at -x, thick and domed; the left one thin.
FigureParts build_liver(const FigureOptions& options) {
  FigureParts parts;
  parts.seam_m = 0.004F;  // lobes meet in a crease, along the falciform ligament, that ends in a notch
  const auto inside_ball = [](Vec3f center, float r) { return SphereShell{center, 0, r}; };
  // Each lobe lies between a dome below the diaphragm and the plane of the viscera: their edge is the sharp
  // margin.
  FigureParts::Limb right, left, gallbladder;
  right.blend_m = 0.026F;
  right.planes = {side({0.36F, -0.62F, -0.70F}, {-0.03F, -0.075F, 0.03F}),
                  side({1, 0.45F, 0}, {0.034F, 0.04F, 0}), side({1, -0.25F, 0}, {0.021F, -0.045F, 0})};
  right.shells = {inside_ball({-0.02F, -0.022F, -0.04F}, 0.106F),
                  inside_ball({-0.012F, -0.01F, 0.052F}, 0.127F)};
  right.planes_center_m = {-0.035F, -0.005F, 0};
  right.planes_radius_m = 0.104F;
  left.blend_m = 0.024F;
  left.planes = {side({0.33F, -0.68F, -0.66F}, {0.045F, -0.032F, 0.035F}),
                 side({-1, -0.6F, 0}, {0.027F, -0.03F, 0})};
  left.shells = {inside_ball({0.038F, -0.04F, -0.073F}, 0.134F), inside_ball({0.03F, -0.16F, 0}, 0.226F)};
  left.planes_center_m = {0.055F, 0.01F, 0.01F};
  left.planes_radius_m = 0.088F;
  // It lies in its bed under the right lobe; the fundus looks out below the margin.
  gallbladder.cones = {cone({-0.012F, -0.02F, 0.002F}, {-0.026F, -0.077F, 0.026F}, 0.009F, 0.0135F)};
  parts.limbs = {right, left, gallbladder};
  scale_parts(parts, 1.07F * options.scale);  // 23 cm wide, 1.9 litres

  move_rigidly(
      parts, options, 4,
      [](float a) {
        return turn({0, 1, 0}, 0.6F * sin_cos(a).sin);
      },
      [](float a) {
        return Vec3f{0.1F * sin_cos(a).sin, 0.03F * sin_cos(2 * a).sin, 0};
      });
  return parts;
}

std::span<const Vec3f> scalpel_edge_m() {
  // From the tip along the belly, a quarter of an ellipse that ends where the straight part begins.
  static const std::vector<Vec3f> edge_m = [] {
    constexpr int kBelly = 4;
    constexpr Vec3f kMiddle{-0.175F, 0.004F, 0};
    std::vector<Vec3f> points_m;
    for (int i = 0; i <= kBelly; ++i) {
      const SinCos t = sin_cos(0.25F * kTurn * static_cast<float>(i) / kBelly);
      points_m.push_back(kMiddle + Vec3f{-0.065F * t.cos, -0.032F * t.sin, 0});
    }
    points_m.push_back({-0.085F, -0.028F, 0});
    return points_m;
  }();
  return edge_m;
}

/// A No. 10 blade on a flat handle along x; the blade points to -x, its edge down.
FigureParts build_scalpel(const FigureOptions& options) {
  FigureParts parts;
  // Flat, with bevelled edges. Its belly, where fingers hold it, shows cameras which way the edge is.
  FigureParts::Limb blade,
      grip = plate({-0.075F, 0.0125F, 0.0125F}, {0.03F, 0.038F, 0.016F}, {0.312F, 0.018F, 0.015F}, 0.012F),
      neck = plate({-0.086F, 0.0105F, 0.0095F}, {-0.078F, 0.0125F, 0.0115F}, {-0.03F, 0.0135F, 0.0125F},
                   0.0065F);
  constexpr float kHalfThickness = 0.0014F, kBevel = 0.35F;  // the sine of its angle
  for (const float z : {1.F, -1.F}) blade.planes.push_back(side({0, 0, z}, {0, 0, kHalfThickness * z}));
  const std::span<const Vec3f> edge_m = scalpel_edge_m();
  for (std::size_t i = 1; i < edge_m.size(); ++i) {
    const Vec3f along = normalized(edge_m[i] - edge_m[i - 1]);
    for (const float z : {1.F, -1.F}) {
      const Vec3f across = kBevel * Vec3f{along.y, -along.x, 0};
      blade.planes.push_back(side(across + Vec3f{0, 0, z * sqrt(1 - kBevel * kBevel)}, edge_m[i]));
    }
  }
  blade.planes.push_back(side({-0.05F, 1, 0}, edge_m.front()));  // the back
  blade.planes.push_back(side({1, -0.6F, 0}, edge_m.back()));    // the heel
  blade.planes_center_m = {-0.16F, -0.01F, 0};
  blade.planes_radius_m = 0.09F;
  parts.limbs = {grip, neck, blade};
  scale_parts(parts, options.scale);
  // Held like a pen, the tip down and to the left; a sweep draws the edge through a cut along x.
  move_rigidly(
      parts, options, 3,
      [](float a) {
        return turn({0, 0, 1}, 0.5F + 0.15F * sin_cos(a).sin);
      },
      [](float a) {
        return Vec3f{0.18F * sin_cos(a).sin, -0.05F + 0.05F * sin_cos(a).cos, 0};
      });
  return parts;
}

FigureParts build_rabbit(const FigureOptions& options) {
  FigureParts parts;
  parts.seam_m = 0.06F;
  FigureParts::Limb body;  // sits, looks to -x
  body.blend_m = 0.1F;
  body.cones = {cone({0.09F, -0.21F, 0}, {-0.04F, -0.08F, 0}, 0.19F, 0.145F),
                cone({-0.04F, -0.08F, 0}, {-0.12F, 0.03F, 0}, 0.135F, 0.095F)};
  FigureParts::Limb head;
  head.blend_m = 0.035F;
  head.cones = {cone({-0.14F, 0.11F, 0}, {-0.2F, 0.085F, 0}, 0.105F, 0.075F),
                cone({-0.225F, 0.07F, 0.018F}, {-0.25F, 0.065F, 0.012F}, 0.045F, 0.03F),
                cone({-0.225F, 0.07F, -0.018F}, {-0.25F, 0.065F, -0.012F}, 0.045F, 0.03F)};
  parts.limbs = {body, head};
  for (const float s : {1.F, -1.F}) {  // left and right
    FigureParts::Limb ear;
    ear.blend_m = 0.02F;
    ear.cones = {cone({-0.125F, 0.15F, 0.04F * s}, {-0.095F, 0.24F, 0.062F * s}, 0.03F, 0.042F),
                 cone({-0.095F, 0.24F, 0.062F * s}, {-0.055F, 0.33F, 0.085F * s}, 0.042F, 0.044F),
                 cone({-0.055F, 0.33F, 0.085F * s}, {-0.005F, 0.435F, 0.11F * s}, 0.044F, 0.02F)};
    FigureParts::Limb hind;  // thigh and long foot
    hind.blend_m = 0.04F;
    hind.cones = {cone({0.1F, -0.23F, 0.13F * s}, {0.02F, -0.3F, 0.15F * s}, 0.11F, 0.075F),
                  cone({0.03F, -0.375F, 0.15F * s}, {-0.15F, -0.385F, 0.15F * s}, 0.042F, 0.035F)};
    FigureParts::Limb fore;
    fore.blend_m = 0.03F;
    fore.cones = {cone({-0.11F, -0.1F, 0.075F * s}, {-0.17F, -0.35F, 0.07F * s}, 0.055F, 0.034F),
                  cone({-0.17F, -0.382F, 0.07F * s}, {-0.22F, -0.39F, 0.07F * s}, 0.036F, 0.03F)};
    parts.limbs.insert(parts.limbs.end(), {ear, hind, fore});
  }
  FigureParts::Limb tail;
  tail.cones = {ball({0.285F, -0.26F, 0}, 0.07F)};
  parts.limbs.push_back(tail);
  scale_parts(parts, 0.9F * options.scale);  // fills 4.5 % of the cube
  move_rigidly(
      parts, options, 4,
      [](float a) {
        return turn({0, 1, 0}, 0.35F + 0.8F * sin_cos(a).sin);
      },
      [](float a) {
        return Vec3f{0, 0.03F - 0.03F * sin_cos(2 * a).cos, 0};
      });
  return parts;
}

}  // namespace tactus
