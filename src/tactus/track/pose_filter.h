#pragma once
/// A pose over time: constant velocity with white acceleration, a Kalman filter on rigid motions.
#include <optional>

#include "tactus/track/pose_fit.h"

namespace tactus {

struct PoseFilterSettings {
  double acceleration_m_s2 = 0.2;  ///< of a calm hand, 1 sigma over a frame
  double acceleration_rad_s2 = 1;
  double start_m_s = 0.5, start_rad_s = 3;  ///< 1 sigma of velocities that nothing is known of
};

class PoseFilter {
 public:
  explicit PoseFilter(Vec3d center_m, const PoseFilterSettings& settings = {})
      : settings_(settings), center_m_(center_m) {}

  void start(const Rigidd& T_world_model, const Matrix6& covariance);
  void predict(double dt_s);
  /// What a measurement with `prior()` as its prior found.
  void update(const Rigidd& T_world_model, const Matrix6& noise);

  PosePrior prior() const;
  const Rigidd& pose() const { return pose_; }
  Matrix6 covariance() const { return block(0, 0); }
  const Twist& velocity() const { return velocity_; }

 private:
  using Matrix12 = SmallMatrix<12>;
  Matrix6 block(int i, int j) const;

  PoseFilterSettings settings_;
  Vec3d center_m_;
  Rigidd pose_;
  Twist velocity_{};
  Matrix12 covariance_;  ///< of twist and velocity
  Twist surprise_{};     ///< mean of what measurements had over predictions
  double hurry_ = 1;     ///< by how much variances of acceleration are raised
};

}  // namespace tactus
