#include "tactus/reconstruct/doctor/rig_hypotheses.h"

#include <cmath>

namespace tactus {
namespace {

/// OpenCV's camera axes from OpenGL's, and back: y and z point the other way.
Rigidd flip_yz() { return {{{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}}, {0, 0, 0}}; }

Camera with_pose(const Camera& c, const Rigidd& T_cam_world) {
  Camera result = c;
  result.T_cam_world = T_cam_world;
  return result;
}
Camera inverted(const Camera& c) { return with_pose(c, inverse(c.T_cam_world)); }
Camera from_opengl(const Camera& c) { return with_pose(c, flip_yz() * c.T_cam_world); }
Camera inverted_from_opengl(const Camera& c) { return with_pose(c, flip_yz() * inverse(c.T_cam_world)); }
Camera transposed(const Camera& c) { return with_pose(c, {transpose(c.T_cam_world.R), c.T_cam_world.t}); }
Camera center_given(const Camera& c) {
  return with_pose(c, {c.T_cam_world.R, -1.0 * (c.T_cam_world.R * c.T_cam_world.t)});
}
/// K of an image `scale` times as large. Pixel centres are whole numbers, so the corner lies at -0.5.
Camera scaled(const Camera& c, double scale) {
  Camera result = c;
  result.fx_px *= scale;
  result.fy_px *= scale;
  result.skew_px *= scale;
  result.cx_px = (c.cx_px + 0.5) * scale - 0.5;
  result.cy_px = (c.cy_px + 0.5) * scale - 0.5;
  return result;
}
Camera doubled(const Camera& c) { return scaled(c, 2); }
Camera halved(const Camera& c) { return scaled(c, 0.5); }

}  // namespace

Camera RigHypothesis::apply(const Camera& given) const {
  Camera result = given;
  result.T_cam_world.t = unit * given.T_cam_world.t;
  return camera == nullptr ? result : camera(result);
}

std::span<const RigHypothesis> rig_hypotheses() {
  static const std::vector<RigHypothesis> all = [] {
    std::vector<RigHypothesis> h{
        {"pose inverted", "invert the pose: the file maps camera to world, not world to camera", &inverted},
        {"OpenGL axes", "turn the axes: the file's camera looks along -z with y up (OpenGL)", &from_opengl},
        {"pose inverted, OpenGL axes",
         "invert the pose and turn the axes: the file maps OpenGL's camera to world (transforms.json)",
         &inverted_from_opengl},
        {"R transposed", "transpose the rotation matrix, keep t", &transposed},
        {"t is the camera's position", "t = -R c: the file gives the camera's position c, not t",
         &center_given},
        {"mirrored left to right", "flip the mask left to right", nullptr, MaskFlip::u},
        {"mirrored top to bottom", "flip the mask top to bottom", nullptr, MaskFlip::v},
        {"K of half the size", "K belongs to an image of half the size: double fx, fy, cx, cy", &doubled},
        {"K of double the size", "K belongs to an image of double the size: halve fx, fy, cx, cy", &halved}};
    for (const auto& [unit, text] : {std::pair{1e-3, "0.001"},
                                     {1e-2, "0.01"},
                                     {0.1, "0.1"},
                                     {10.0, "10"},
                                     {100.0, "100"},
                                     {1000.0, "1000"}})
      h.push_back(
          {"unit of t", std::string("multiply the translation by ") + text, nullptr, MaskFlip::none, unit});
    return h;
  }();
  return all;
}

std::vector<RigHypothesis> combined_hypotheses() {
  std::vector<RigHypothesis> result;
  for (const RigHypothesis& pose : rig_hypotheses()) {
    if (pose.camera == nullptr || pose.camera == &doubled || pose.camera == &halved) continue;
    for (const RigHypothesis& image : rig_hypotheses()) {
      if (image.flip == MaskFlip::none) continue;
      result.push_back(
          {pose.fault + "; " + image.fault, pose.cure + "; " + image.cure, pose.camera, image.flip});
    }
  }
  return result;
}

BitMask flipped(const BitMask& mask, MaskFlip flip) {
  if (flip == MaskFlip::none) return mask;
  BitMask result(mask.width_px, mask.height_px);
  for (Index y = 0; y < mask.height_px; ++y) {
    for (Index x = 0; x < mask.width_px; ++x) {
      if ((x & 31) == 0 && mask.words[static_cast<std::size_t>(y * mask.words_per_row() + (x >> 5))] == 0) {
        x += 31;  // none of the word
        continue;
      }
      if (!mask(x, y)) continue;
      if (flip == MaskFlip::u)
        result.set(mask.width_px - 1 - x, y);
      else
        result.set(x, mask.height_px - 1 - y);
    }
  }
  return result;
}

Camera moved(const Camera& camera, const CameraMotion& motion) {
  const double angle = length(motion.turn_rad);
  Mat3d R = Mat3d::identity();
  if (angle > 0) {  // Rodrigues
    const Vec3d k = 1 / angle * motion.turn_rad;
    const double c = std::cos(angle), s = std::sin(angle), v = 1 - c;
    R = {{{c + k.x * k.x * v, k.x * k.y * v - k.z * s, k.x * k.z * v + k.y * s},
          {k.y * k.x * v + k.z * s, c + k.y * k.y * v, k.y * k.z * v - k.x * s},
          {k.z * k.x * v - k.y * s, k.z * k.y * v + k.x * s, c + k.z * k.z * v}}};
  }
  return with_pose(camera, Rigidd{R, motion.shift_m} * camera.T_cam_world);
}

}  // namespace tactus
