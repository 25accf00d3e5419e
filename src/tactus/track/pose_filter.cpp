#include "tactus/track/pose_filter.h"

#include <algorithm>

namespace tactus {
namespace {

constexpr double kSurpriseMemory = 0.6;  // of surprises, from frame to frame

}  // namespace

Matrix6 PoseFilter::covariance() const {
  Matrix6 m;
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b) m(a, b) = covariance_(a, b);
  return m;
}

void PoseFilter::start(const PoseFit& fit, double calibration_px) {
  pose_ = fit.T_world_model;
  shifts_px_ = fit.shifts_px;
  velocity_ = surprise_ = {};
  manoeuvre_gain_ = 1;
  const int unknowns = fit.information.rows;
  DenseMatrix known = fit.information;
  const double sigma_px = std::max(calibration_px, 1e-3);
  for (int i = 0; i < unknowns; ++i) known(i, i) += i < 6 ? 1 : 2 / (sigma_px * sigma_px);
  const DenseMatrix start = inverse_of_definite(std::move(known));
  covariance_.reset(unknowns + 6, unknowns + 6);
  for (int i = 0; i < unknowns; ++i)
    for (int k = 0; k < unknowns; ++k) covariance_(place(i), place(k)) = start(i, k);
  for (int i = 0; i < 6; ++i) {
    const double v = i < 3 ? settings_.start_rad_s : settings_.start_m_s;
    covariance_(6 + i, 6 + i) = v * v;
  }
}

void PoseFilter::predict(double dt_s) {
  Twist by;
  for (std::size_t i = 0; i < 6; ++i) by[i] = dt_s * velocity_[i];
  pose_ = moved(pose_, center_m_, by);
  const int n = covariance_.rows;
  for (int i = 0; i < 6; ++i)
    for (int k = 0; k < n; ++k) covariance_(i, k) += dt_s * covariance_(6 + i, k);
  for (int k = 0; k < n; ++k)
    for (int i = 0; i < 6; ++i) covariance_(k, i) += dt_s * covariance_(k, 6 + i);
  add_process_noise(dt_s);
}

void PoseFilter::add_process_noise(double dt_s) {
  for (int i = 0; i < 6; ++i) {
    const double a = i < 3 ? settings_.acceleration_rad_s2 : settings_.acceleration_m_s2,
                 a2 = manoeuvre_gain_ * a * a;
    covariance_(i, i) += a2 * dt_s * dt_s * dt_s * dt_s / 4;
    covariance_(i, 6 + i) += a2 * dt_s * dt_s * dt_s / 2;
    covariance_(6 + i, i) += a2 * dt_s * dt_s * dt_s / 2;
    covariance_(6 + i, 6 + i) += a2 * dt_s * dt_s;
  }
}

const PosePrior& PoseFilter::prior() {
  prior_.T_world_model = pose_;
  prior_.shifts_px = shifts_px_;
  const int unknowns = covariance_.rows - 6;
  DenseMatrix own;
  own.reset(unknowns, unknowns);
  for (int i = 0; i < unknowns; ++i)
    for (int k = 0; k < unknowns; ++k) own(i, k) = covariance_(place(i), place(k));
  prior_.information = inverse_of_definite(std::move(own));
  return prior_;
}

/// With the information H of masks and that of the prior, P⁻¹, of the unknowns of a fit: the inverse of the
/// innovations' covariance is S = H - H (P⁻¹ + H)⁻¹ H, also where H has no inverse.
void PoseFilter::update(const PoseFit& fit) {
  const int unknowns = fit.information.rows, n = covariance_.rows;
  const DenseMatrix& H = fit.information;
  DenseMatrix both = prior_.information;
  for (std::size_t i = 0; i < both.v.size(); ++i) both.v[i] += H.v[i];
  factorize(both);
  DenseMatrix half = H;
  solve_lower(both, half);
  DenseMatrix S = H;
  for (int k = 0; k < unknowns; ++k)
    for (int i = 0; i < unknowns; ++i)
      for (int j = 0; j < unknowns; ++j) S(i, j) -= half(k, i) * half(k, j);
  // The fit's changes of the unknowns, and the changes of velocities that follow.
  const Twist by = twist_between(pose_, fit.T_world_model, center_m_);
  std::vector<double> found(static_cast<std::size_t>(unknowns)), known(found.size());
  for (std::size_t i = 0; i < found.size(); ++i)
    found[i] = i < 6 ? by[i] : fit.shifts_px[i - 6] - shifts_px_[i - 6];
  for (int i = 0; i < unknowns; ++i)
    for (int k = 0; k < unknowns; ++k)
      known[static_cast<std::size_t>(i)] += prior_.information(i, k) * found[static_cast<std::size_t>(k)];
  pose_ = fit.T_world_model;
  shifts_px_ = fit.shifts_px;
  SmallMatrix<6, 1> change;
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < unknowns; ++k)
      change(i, 0) += covariance_(6 + i, place(k)) * known[static_cast<std::size_t>(k)];
    velocity_[static_cast<std::size_t>(i)] += change(i, 0);
  }
  DenseMatrix gain;  // covariance with the unknowns, times S
  gain.reset(n, unknowns);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < unknowns; ++k)
      for (int j = 0; j < unknowns; ++j) gain(i, j) += covariance_(i, place(k)) * S(k, j);
  DenseMatrix less;
  less.reset(n, n);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k <= i; ++k) {
      double sum = 0;
      for (int j = 0; j < unknowns; ++j) sum += gain(i, j) * covariance_(k, place(j));
      less(i, k) = less(k, i) = sum;
    }
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k) covariance_(i, k) -= less(i, k);
  detect_manoeuvre(change, less);
}

/// Changes of the velocity that keep their direction say that accelerations are larger than assumed.
void PoseFilter::detect_manoeuvre(const SmallMatrix<6, 1>& change, const DenseMatrix& less) {
  Matrix6 expected;  // covariance of the changes
  SmallMatrix<6, 1> mean;
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < 6; ++k) expected(i, k) = less(6 + i, 6 + k);
    expected(i, i) *= 1 + 1e-9;
    double& s = surprise_[static_cast<std::size_t>(i)];
    s = kSurpriseMemory * s + (1 - kSurpriseMemory) * change(i, 0);
    mean(i, 0) = s;
  }
  const double share =
      (1 - kSurpriseMemory) / (1 + kSurpriseMemory);  // of the variance of a mean of white ones
  const double size = (transpose(mean) * (inverse_of_definite(expected) * mean))(0, 0) / (6 * share);
  manoeuvre_gain_ = std::clamp(size * size / 4, 1.0, 1000.0);
}

}  // namespace tactus
