#include "tactus/geom/figures/figure_builders.h"

#include <array>

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

FigureParts build_liver(const FigureOptions& options) {
  FigureParts parts;
  parts.limbs.resize(1);
  FigureParts::Limb& body = parts.limbs.front();
  // A thick right lobe that thins out into the left one across the body; 25 cm wide.
  body.blend_m = 0.05F;
  body.cones = {cone({-0.065F, 0.015F, 0}, {-0.045F, -0.035F, 0.012F}, 0.055F, 0.042F),
                cone({-0.05F, 0.03F, -0.005F}, {0.03F, 0.035F, 0.012F}, 0.046F, 0.034F),
                cone({0.02F, 0.032F, 0.014F}, {0.105F, 0.042F, 0.022F}, 0.032F, 0.014F),
                cone({-0.07F, -0.03F, 0.005F}, {-0.06F, -0.075F, 0.01F}, 0.036F, 0.018F),
                cone({0.0F, 0.0F, 0.012F}, {-0.03F, -0.025F, 0.015F}, 0.028F, 0.03F)};
  scale_parts(parts, options.scale);
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

FigureParts build_scalpel(const FigureOptions& options) {
  FigureParts parts;
  parts.limbs.resize(2);
  // Handle along x, thicker where it is held; the blade points to -x with its edge down.
  FigureParts::Limb& handle = parts.limbs[0];
  handle.blend_m = 0.02F;
  handle.cones = {cone({-0.02F, 0, 0}, {0.1F, 0, 0}, 0.013F, 0.019F),
                  cone({0.1F, 0, 0}, {0.3F, 0, 0}, 0.019F, 0.012F),
                  cone({-0.06F, 0, 0}, {-0.02F, 0, 0}, 0.009F, 0.013F)};
  FigureParts::Limb& blade = parts.limbs[1];
  const auto side = [&](Vec3f n, Vec3f through) {
    const Vec3f unit = normalized(n);
    blade.planes.push_back({0, {unit, dot(unit, through)}});
  };
  const Vec3f edge{-0.15F, -0.028F, 0};  // a point of the cutting edge
  side({0, -0.06F, 1}, {-0.15F, 0.02F, 0.0035F});
  side({0, -0.06F, -1}, {-0.15F, 0.02F, -0.0035F});
  side({0, -1, 0}, edge);                     // the edge
  side({0.05F, 1, 0}, {-0.06F, 0.016F, 0});   // the back
  side({-0.45F, 1, 0}, {-0.2F, 0.018F, 0});   // the back falls to the tip
  side({-0.7F, -1, 0}, {-0.2F, -0.028F, 0});  // the belly rises to the tip
  side({1, 0, 0}, {-0.05F, 0, 0});            // inside the handle
  blade.planes_center_m = {-0.15F, -0.003F, 0};
  blade.planes_radius_m = 0.13F;
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
