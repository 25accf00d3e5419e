#pragma once
/// Eigenvectors of small symmetric matrices on the host.
#include <array>
#include <cmath>
#include <utility>

#include "tactus/base/vec.h"

namespace tactus {

struct SymmetricEigen {
  Vec3d values;                       ///< descending
  Mat3d vectors = Mat3d::identity();  ///< rows: unit, right-handed, in the order of the values
};

/// By cyclic Jacobi rotations; only the upper triangle of m is read.
inline SymmetricEigen symmetric_eigen(Mat3d m) {
  Mat3d v = Mat3d::identity();  // rows become eigenvectors
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < i; ++j) m(i, j) = m(j, i);
  }
  for (int sweep = 0; sweep < 16; ++sweep) {
    for (const auto& [p, q] : {std::pair{0, 1}, {0, 2}, {1, 2}}) {
      if (m(p, q) == 0) continue;
      const double angle = 0.5 * std::atan2(2 * m(p, q), m(q, q) - m(p, p));
      Mat3d turn = Mat3d::identity();
      turn(p, p) = turn(q, q) = std::cos(angle);
      turn(p, q) = -std::sin(angle);
      turn(q, p) = std::sin(angle);
      m = turn * m * transpose(turn);
      v = turn * v;
    }
  }
  std::array<int, 3> order{0, 1, 2};
  for (const auto& [a, b] : {std::pair{0, 1}, {1, 2}, {0, 1}}) {
    const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
    if (m(order[i], order[i]) < m(order[j], order[j])) std::swap(order[i], order[j]);
  }
  SymmetricEigen result{};
  for (int i = 0; i < 3; ++i) {
    const int from = order[static_cast<std::size_t>(i)];
    result.values[i] = m(from, from);
    result.vectors.row[i] = normalized(v.row[from]);
  }
  if (determinant(result.vectors) < 0) result.vectors.row[2] = -result.vectors.row[2];
  return result;
}

}  // namespace tactus
