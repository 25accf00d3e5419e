#pragma once
/// A pose over time: constant velocity with white acceleration, a Kalman filter on rigid motions. With it, it
/// finds by how much each camera's picture is shifted, which stays.
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

  /// @param calibration_px 1 sigma of the shift of a point
  void start(const PoseFit& fit, double calibration_px);
  void predict(double dt_s);
  /// In place of a prediction and an update: pictures are those of the last frame, to the bit. The tool
  /// stands still, and their errors are the same ones again: nothing is learned.
  void stay() { velocity_ = {}; }
  /// Takes the pose and shifts of a fit with `prior()`, and corrects velocities and covariance.
  void update(const PoseFit& fit);

  /// Valid until the next change.
  const PosePrior& prior();
  const Rigidd& pose() const { return pose_; }
  Matrix6 covariance() const;

 private:
  /// Number of the k-th unknown of a fit among the filter's: twist, velocity, shifts.
  static int place(int k) { return k < 6 ? k : k + 6; }
  void add_process_noise(double dt_s);
  void detect_manoeuvre(const SmallMatrix<6, 1>& change, const DenseMatrix& less);

  PoseFilterSettings settings_;
  Vec3d center_m_;
  Rigidd pose_;
  Twist velocity_{};
  std::vector<double> shifts_px_;
  DenseMatrix covariance_;  ///< of twist, velocity and shifts
  PosePrior prior_;
  Twist surprise_{};           ///< mean of the fits' changes of velocities
  double manoeuvre_gain_ = 1;  ///< by how much variances of acceleration are raised
};

}  // namespace tactus
