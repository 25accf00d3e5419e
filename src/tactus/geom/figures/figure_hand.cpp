/// The hand: proportions of an adult right hand (0.19 m from wrist to middle tip at life size), each phalanx
/// a bone, joints bent by forward kinematics.
#include <algorithm>
#include <array>

#include "tactus/geom/figures/figure_builders.h"

namespace tactus {
namespace {

/// Benchmark size over life size.
constexpr float kEnlarged = 3.5F;

/// A finger: where its first joint sits in the palm's frame (x to the thumb, y to the fingers, z out of the
/// palm), the fan angle, and for its three bones length and radii [mm].
struct FingerPlan {
  Vec3f knuckle_mm;
  float fan_rad;
  std::array<float, 3> length_mm;
  std::array<float, 4> radius_mm;
  float curl;  ///< how much it takes part in bending
};
constexpr std::array kFingers = {
    FingerPlan{{29, 94, 0}, -0.16F, {44, 26, 21}, {11.2F, 10, 9, 7.6F}, 0.85F},
    FingerPlan{{8, 98, -2}, -0.03F, {48, 30, 22}, {11.6F, 10.4F, 9.3F, 7.8F}, 1.F},
    FingerPlan{{-13, 93, -2}, 0.10F, {45, 28, 22}, {11, 9.8F, 8.8F, 7.4F}, 1.08F},
    FingerPlan{{-32, 82, 0}, 0.26F, {35, 20, 19}, {9.8F, 8.6F, 7.6F, 6.4F}, 1.15F},
};
constexpr int kThumbBone = 1 + 3 * 4;
constexpr int kBones = kThumbBone + 3;

/// How far joints are bent [rad] and how the hand stands.
struct HandPosture {
  float knuckle_rad, middle_rad, end_rad, thumb_rad;
  Rigidf T_world_palm;
};

/// Poses of the three bones of a chain; y runs along a bone, bending turns y towards z.
void pose_chain(const Rigidf& T_world_first, const std::array<float, 3>& length_m,
                const std::array<float, 3>& bend_rad, Rigidf* T_world_bone) {
  Rigidf joint = T_world_first;
  for (std::size_t i = 0; i < 3; ++i) {
    joint = joint * Rigidf{rotation_matrix(axis_angle(Vec3f{1, 0, 0}, bend_rad[i])), {}};
    T_world_bone[i] = joint;
    joint = joint * Rigidf{Mat3f::identity(), {0, length_m[i], 0}};
  }
}

constexpr std::array<float, 3> kThumbLength_mm = {43, 33, 25};
constexpr std::array<float, 4> kThumbRadius_mm = {14.5F, 12, 11, 8.6F};
constexpr Vec3f kThumbBase_mm{21, 20, 6};

/// The thumb's first bone: away from the fingers and out of the palm, bending across it.
Rigidf thumb_frame(float unit_m) {
  const Vec3f y = normalized(Vec3f{0.74F, 0.62F, 0.28F});
  const Vec3f across{-0.62F, 0.25F, 0.75F};
  const Vec3f z = normalized(across - dot(across, y) * y);
  const Mat3f columns{{cross(y, z), y, z}};
  return {transpose(columns), unit_m * kThumbBase_mm};
}

void pose_hand(const HandPosture& posture, float unit_m, std::vector<Rigidf>& T_world_bone) {
  T_world_bone[0] = posture.T_world_palm;
  for (std::size_t i = 0; i < kFingers.size(); ++i) {
    const FingerPlan& f = kFingers[i];
    const Rigidf first{rotation_matrix(axis_angle(Vec3f{0, 0, 1}, f.fan_rad)), unit_m * f.knuckle_mm};
    pose_chain(posture.T_world_palm * first,
               {unit_m * f.length_mm[0], unit_m * f.length_mm[1], unit_m * f.length_mm[2]},
               {f.curl * posture.knuckle_rad, f.curl * posture.middle_rad, f.curl * posture.end_rad},
               &T_world_bone[1 + 3 * i]);
  }
  pose_chain(posture.T_world_palm * thumb_frame(unit_m),
             {unit_m * kThumbLength_mm[0], unit_m * kThumbLength_mm[1], unit_m * kThumbLength_mm[2]},
             {0.3F * posture.thumb_rad, 0.6F * posture.thumb_rad, posture.thumb_rad},
             &T_world_bone[kThumbBone]);
}

FigureParts::Limb chain_limb(int first_bone, const std::array<float, 3>& length_m,
                             const std::array<float, 4>& radius_m, float blend_m) {
  FigureParts::Limb limb;
  limb.blend_m = blend_m;
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    limb.cones.push_back({first_bone + i, {}, {0, length_m[k], 0}, radius_m[k], radius_m[k + 1]});
  }
  return limb;
}

FigureParts::Limb palm_limb() {
  FigureParts::Limb palm;
  palm.blend_m = 12;
  const auto add = [&](Vec3f a, Vec3f b, float ra, float rb) { palm.cones.push_back({0, a, b, ra, rb}); };
  for (const FingerPlan& f : kFingers) {  // metacarpals fan out from the wrist
    const Vec3f wrist{0.42F * f.knuckle_mm.x, 10, -1};
    add(wrist, f.knuckle_mm + Vec3f{0, -3, 0}, 13, f.radius_mm[0] + 1);
  }
  add({17, 16, 5}, {35, 46, 9}, 15, 13);       // ball of the thumb
  add({-19, 14, 4}, {-29, 56, 4}, 13, 10.5F);  // the other edge of the palm
  add({11, 2, -1}, {13, -34, -2}, 16, 19);     // forearm, wider than thick
  add({-11, 2, -1}, {-13, -34, -2}, 16, 19);
  return palm;
}

/// Upright, the palm towards +z, or coming down palm first, to bend its fingers as it presses.
HandPosture posture_at(double time_s, double period_s, const FigureOptions& options, float unit_m) {
  if (!options.moving) {
    // 76 mm from the wrist is the middle between the end of the forearm and the middle finger's tip.
    return {
        0.1F, 0.14F, 0.1F, 0.12F, {Mat3f::identity(), options.offset_m + Vec3f{0, 0.5F - 76 * unit_m, 0}}};
  }
  const SinCos a = sin_cos(2 * kPi * static_cast<float>(time_s / period_s));
  const float up = 0.5F * (1 + a.cos);  // 1 above, 0 pressing
  const float press = (1 - up) * (1 - up);
  const float lift_m = 0.25F * up, sway_m = 0.015F * a.sin;
  // Fingers towards -x and a little down, palm down, thumb towards +z.
  const float dip = 0.3F - 0.12F * press;
  const SinCos d = sin_cos(dip);
  const Vec3f y{-d.cos, -d.sin, 0}, z{d.sin, -d.cos, 0};
  const Mat3f columns{{cross(y, z), y, z}};
  const Vec3f center = -unit_m * (70.F * y);  // the middle of palm and fingers stays over the origin
  return {0.1F + 0.45F * press,
          0.2F + 0.6F * press,
          0.12F + 0.3F * press,
          0.15F + 0.35F * press,
          {transpose(columns), options.offset_m + center + Vec3f{sway_m, lift_m, 0}}};
}

}  // namespace

FigureParts build_hand(const FigureOptions& options) {
  const float unit_m = 1e-3F * kEnlarged * options.scale;  // of one millimetre of a life-size hand
  FigureParts parts;
  parts.bone_count = kBones;
  parts.seam_m = 9 * unit_m;
  FigureParts::Limb palm = palm_limb();
  palm.blend_m *= unit_m;
  for (FigureParts::Cone& c : palm.cones) {
    c.a_m *= unit_m;
    c.b_m *= unit_m;
    c.radius_a_m *= unit_m;
    c.radius_b_m *= unit_m;
  }
  parts.limbs.push_back(palm);
  const auto add_chain = [&](int first_bone, std::array<float, 3> length, std::array<float, 4> radius) {
    for (float& l : length) l *= unit_m;
    for (float& r : radius) r *= unit_m;
    parts.limbs.push_back(chain_limb(first_bone, length, radius, 3 * unit_m));
  };
  for (std::size_t i = 0; i < kFingers.size(); ++i)
    add_chain(1 + 3 * static_cast<int>(i), kFingers[i].length_mm, kFingers[i].radius_mm);
  add_chain(kThumbBone, kThumbLength_mm, kThumbRadius_mm);

  const double period_s = parts.period_s;
  float lift_m = 0;
  if (options.moving) {  // the lowest point over time comes to rest at y = 0.2 m
    std::vector<Rigidf> T(kBones);
    float lowest_m = 1e9F;
    for (int i = 0; i < 128; ++i) {
      pose_hand(posture_at(period_s * i / 128, period_s, options, unit_m), unit_m, T);
      for (const FigureParts::Limb& limb : parts.limbs) {
        for (const FigureParts::Cone& c : limb.cones) {
          const Rigidf& M = T[static_cast<std::size_t>(c.bone)];
          lowest_m = std::min({lowest_m, (M * c.a_m).y - c.radius_a_m, (M * c.b_m).y - c.radius_b_m});
        }
      }
    }
    lift_m = 0.2F + options.offset_m.y - lowest_m;
  }
  FigureOptions placed = options;
  placed.offset_m.y += lift_m;
  parts.pose = [=](double time_s, std::vector<Rigidf>& T) {
    pose_hand(posture_at(time_s, period_s, placed, unit_m), unit_m, T);
  };
  return parts;
}

}  // namespace tactus
