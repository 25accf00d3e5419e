#include "tactus/geom/rigid_fit.h"

#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "tactus/base/error.h"

namespace tactus {
namespace {

using Matrix4 = std::array<std::array<double, 4>, 4>;

/// Eigenvector of the largest eigenvalue of a symmetric matrix, by cyclic Jacobi rotations.
std::array<double, 4> largest_eigenvector(Matrix4 m) {
  Matrix4 v{};
  for (std::size_t i = 0; i < 4; ++i) v[i][i] = 1;
  for (int sweep = 0; sweep < 30; ++sweep) {
    for (std::size_t p = 0; p < 3; ++p) {
      for (std::size_t q = p + 1; q < 4; ++q) {
        if (m[p][q] == 0) continue;
        const double theta = 0.5 * std::atan2(2 * m[p][q], m[q][q] - m[p][p]);
        const double c = std::cos(theta), s = std::sin(theta);
        for (std::size_t k = 0; k < 4; ++k) {
          const double a = m[k][p], b = m[k][q];
          m[k][p] = c * a - s * b;
          m[k][q] = s * a + c * b;
        }
        for (std::size_t k = 0; k < 4; ++k) {
          const double a = m[p][k], b = m[q][k];
          m[p][k] = c * a - s * b;
          m[q][k] = s * a + c * b;
          const double d = v[k][p], e = v[k][q];
          v[k][p] = c * d - s * e;
          v[k][q] = s * d + c * e;
        }
      }
    }
  }
  std::size_t best = 0;
  for (std::size_t i = 1; i < 4; ++i) {
    if (m[i][i] > m[best][best]) best = i;
  }
  return {v[0][best], v[1][best], v[2][best], v[3][best]};
}

}  // namespace

RigidFit fit_rigid(std::span<const Vec3d> a_m, std::span<const Vec3d> b_m, std::span<const double> weights) {
  if (a_m.empty() || a_m.size() != b_m.size() || (!weights.empty() && weights.size() != a_m.size())) {
    throw Error("rigid fit: needs as many points in both sets, at least one; got " +
                std::to_string(a_m.size()) + ", " + std::to_string(b_m.size()) + " and " +
                std::to_string(weights.size()) + " weights");
  }
  const auto weight = [&](std::size_t i) { return weights.empty() ? 1.0 : weights[i]; };
  double total = 0;
  Vec3d ca{}, cb{};
  for (std::size_t i = 0; i < a_m.size(); ++i) {
    total += weight(i);
    ca += weight(i) * a_m[i];
    cb += weight(i) * b_m[i];
  }
  if (!(total > 0)) throw Error("rigid fit: the weights sum to " + std::to_string(total) + ", must be > 0");
  ca = ca / total;
  cb = cb / total;
  Mat3d s{};
  for (std::size_t i = 0; i < a_m.size(); ++i) s = s + weight(i) * outer(a_m[i] - ca, b_m[i] - cb);
  const Matrix4 horn = {
      {{s(0, 0) + s(1, 1) + s(2, 2), s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0)},
       {s(1, 2) - s(2, 1), s(0, 0) - s(1, 1) - s(2, 2), s(0, 1) + s(1, 0), s(2, 0) + s(0, 2)},
       {s(2, 0) - s(0, 2), s(0, 1) + s(1, 0), s(1, 1) - s(0, 0) - s(2, 2), s(1, 2) + s(2, 1)},
       {s(0, 1) - s(1, 0), s(2, 0) + s(0, 2), s(1, 2) + s(2, 1), s(2, 2) - s(0, 0) - s(1, 1)}}};
  const std::array<double, 4> q = largest_eigenvector(horn);
  RigidFit fit;
  fit.T_b_a.R = rotation_matrix(Quat<double>{q[0], q[1], q[2], q[3]});
  fit.T_b_a.t = cb - fit.T_b_a.R * ca;
  double squares = 0;
  for (std::size_t i = 0; i < a_m.size(); ++i) {
    const Vec3d d = fit.T_b_a * a_m[i] - b_m[i];
    squares += weight(i) * dot(d, d);
  }
  fit.rms_m = std::sqrt(squares / total);
  return fit;
}

}  // namespace tactus
