#include "tactus/track/pose_filter.h"

#include <algorithm>

namespace tactus {
namespace {

constexpr double kMemory = 0.6;  // of surprises, from frame to frame

}  // namespace

Matrix6 PoseFilter::block(int i, int j) const {
  Matrix6 m;
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b) m(a, b) = covariance_(6 * i + a, 6 * j + b);
  return m;
}

void PoseFilter::start(const Rigidd& T_world_model, const Matrix6& covariance) {
  pose_ = T_world_model;
  velocity_ = surprise_ = {};
  hurry_ = 1;
  covariance_ = {};
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) covariance_(i, j) = covariance(i, j);
    const double v = i < 3 ? settings_.start_rad_s : settings_.start_m_s;
    covariance_(6 + i, 6 + i) = v * v;
  }
}

void PoseFilter::predict(double dt_s) {
  Twist by;
  for (std::size_t i = 0; i < 6; ++i) by[i] = dt_s * velocity_[i];
  pose_ = moved(pose_, center_m_, by);
  Matrix12 F = Matrix12::diagonal(1);
  for (int i = 0; i < 6; ++i) F(i, 6 + i) = dt_s;
  covariance_ = F * covariance_ * transpose(F);
  for (int i = 0; i < 6; ++i) {
    const double a = i < 3 ? settings_.acceleration_rad_s2 : settings_.acceleration_m_s2, a2 = hurry_ * a * a;
    covariance_(i, i) += a2 * dt_s * dt_s * dt_s * dt_s / 4;
    covariance_(i, 6 + i) += a2 * dt_s * dt_s * dt_s / 2;
    covariance_(6 + i, i) += a2 * dt_s * dt_s * dt_s / 2;
    covariance_(6 + i, 6 + i) += a2 * dt_s * dt_s;
  }
}

PosePrior PoseFilter::prior() const { return {pose_, inverse_of_definite(covariance())}; }

void PoseFilter::update(const Rigidd& T_world_model, const Matrix6& noise) {
  const Twist by = twist_between(pose_, T_world_model, center_m_);
  SmallMatrix<12, 6> gain;  // of innovations: covariance with the pose, over that of innovations
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 6; ++j) gain(i, j) = covariance_(i, j);
  const Matrix6 expected = covariance() + noise, known = inverse_of_definite(covariance());
  SmallMatrix<6, 1> found;
  for (int i = 0; i < 6; ++i) found(i, 0) = by[static_cast<std::size_t>(i)];
  const SmallMatrix<6, 1> inner = known * found, innovation = expected * inner;
  const SmallMatrix<12, 1> step = gain * inner;
  pose_ = T_world_model;
  for (int i = 0; i < 6; ++i) velocity_[static_cast<std::size_t>(i)] += step(6 + i, 0);
  const Matrix6 expected_inverse = inverse_of_definite(expected);
  covariance_ = covariance_ - gain * expected_inverse * transpose(gain);
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < i; ++j)
      covariance_(i, j) = covariance_(j, i) = 0.5 * (covariance_(i, j) + covariance_(j, i));
  // Innovations that keep their direction say that accelerations are larger than assumed.
  SmallMatrix<6, 1> mean;
  for (int i = 0; i < 6; ++i) {
    double& s = surprise_[static_cast<std::size_t>(i)];
    s = kMemory * s + (1 - kMemory) * innovation(i, 0);
    mean(i, 0) = s;
  }
  const double share = (1 - kMemory) / (1 + kMemory);  // of the variance of a mean of white ones
  const double size = (transpose(mean) * (expected_inverse * mean))(0, 0) / (6 * share);
  hurry_ = std::clamp(size * size / 4, 1.0, 1000.0);
}

}  // namespace tactus
