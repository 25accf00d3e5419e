#pragma once
/// Cameras that see a scalpel, its way, and errors of what is found.
#include <cmath>
#include <random>
#include <vector>

#include "tactus/geom/image/rasterize.h"
#include "tactus/geom/maths/rotation.h"
#include "tactus/rig/synthetic/synthetic_noise.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/track/blade_tracker.h"

namespace tactus::test {

inline constexpr double kFrame_s = 1.0 / 30;

inline TriangleMesh at_pose(TriangleMesh mesh, const Rigidd& T) {
  for (Vec3f& p : mesh.positions_m) p = vec_cast<float>(T * vec_cast<double>(p));
  return mesh;
}

/// Eight cameras, what they see and what they are believed to be.
struct Room {
  Rig rig;
  NoiseOptions noise;
  std::vector<Camera> believed;

  explicit Room(const NoiseOptions& n = {}, bool full_hd = false) : noise(n) {
    SyntheticRigOptions options;
    options.depth_cameras = 0;
    if (full_hd) {
      options.width_px = 1920;
      options.height_px = 1080;
      options.focal_px = 1350;
    }
    rig = make_synthetic_rig(options);
    for (std::size_t c = 0; c < rig.cameras.size(); ++c)
      believed.push_back(miscalibrate(rig.cameras[c], noise, static_cast<int>(c)));
  }
  std::vector<BitMask> see(const std::vector<TriangleMesh>& meshes, int tick = 0) const {
    std::vector<BitMask> masks;
    for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
      BitMask& mask = masks.emplace_back(rig.cameras[c].width_px, rig.cameras[c].height_px);
      for (const TriangleMesh& mesh : meshes) {
        const BitMask one = render_silhouette(mesh, rig.cameras[c]);
        for (std::size_t i = 0; i < mask.words.size(); ++i) mask.words[i] |= one.words[i];
      }
      disturb_mask(mask, noise, static_cast<int>(c), tick);
    }
    return masks;
  }
};

/// Errors of the edge, and of the roll about the model's x axis.
struct Errors {
  double tip2 = 0, roll2 = 0;
  int count = 0, coordinates = 0, within = 0;
  void add(const Rigidd& found, const Rigidd& truth, const BladeModel& model) {
    const Vec3d off = found * vec_cast<double>(model.edge_m[0]) - truth * vec_cast<double>(model.edge_m[0]);
    tip2 += dot(off, off);
    const double roll = dot(vector_of_rotation(found.R * transpose(truth.R)), truth.R.column(0));
    roll2 += roll * roll;
    ++count;
  }
  void add_stated(const Twist& error, const Matrix6& covariance) {
    for (int i = 0; i < 6; ++i) {
      ++coordinates;
      within += std::abs(error[static_cast<std::size_t>(i)]) <= 2 * std::sqrt(covariance(i, i)) ? 1 : 0;
    }
  }
  double tip_mm() const { return 1e3 * std::sqrt(tip2 / count); }
  double roll_deg() const { return 180 / M_PI * std::sqrt(roll2 / count); }
  double share_within() const { return static_cast<double>(within) / coordinates; }
};

inline Rigidd some_pose(std::mt19937& random) {
  std::normal_distribution<double> g;
  std::uniform_real_distribution<double> u(-0.1, 0.1);
  const double w = g(random), x = g(random), y = g(random), z = g(random);
  return {rotation_from_quaternion(w, x, y, z), {u(random), 0.5 + u(random), u(random)}};
}

/// A stroke of 5 cm to and fro in 3 s, with a turn.
inline Rigidd stroke(const Rigidd& T, double time_s) {
  const double a = 0.05 * std::sin(2 * M_PI * time_s / 6);
  return {rotation_from_vector({0, 4 * a, 0}) * T.R, T.t + Vec3d{a, 0, 0.5 * a}};
}

}  // namespace tactus::test
