#pragma once
/// Matrices of a few rows for poses and filters, in double, on the host.
#include <array>

#include "tactus/base/vec.h"
#include "tactus/geom/maths/cholesky.h"

namespace tactus {

template <int kRows, int kColumns = kRows>
struct SmallMatrix {
  double v[kRows][kColumns]{};
  double& operator()(int i, int j) { return v[i][j]; }
  const double& operator()(int i, int j) const { return v[i][j]; }
  static SmallMatrix diagonal(double d) {
    SmallMatrix m;
    for (int i = 0; i < kRows; ++i) m(i, i) = d;
    return m;
  }
  friend SmallMatrix operator+(SmallMatrix a, const SmallMatrix& b) {
    for (int i = 0; i < kRows; ++i)
      for (int j = 0; j < kColumns; ++j) a(i, j) += b(i, j);
    return a;
  }
  friend SmallMatrix operator-(SmallMatrix a, const SmallMatrix& b) {
    for (int i = 0; i < kRows; ++i)
      for (int j = 0; j < kColumns; ++j) a(i, j) -= b(i, j);
    return a;
  }
  friend SmallMatrix operator*(double s, SmallMatrix a) {
    for (auto& row : a.v)
      for (double& x : row) x *= s;
    return a;
  }
  template <int kOther>
  friend SmallMatrix<kRows, kOther> operator*(const SmallMatrix& a, const SmallMatrix<kColumns, kOther>& b) {
    SmallMatrix<kRows, kOther> c;
    for (int i = 0; i < kRows; ++i)
      for (int k = 0; k < kColumns; ++k)
        for (int j = 0; j < kOther; ++j) c(i, j) += a(i, k) * b(k, j);
    return c;
  }
};

template <int kRows, int kColumns>
SmallMatrix<kColumns, kRows> transpose(const SmallMatrix<kRows, kColumns>& a) {
  SmallMatrix<kColumns, kRows> t;
  for (int i = 0; i < kRows; ++i)
    for (int j = 0; j < kColumns; ++j) t(j, i) = a(i, j);
  return t;
}

/// Inverse of a symmetric, positive definite matrix.
template <int kRows>
SmallMatrix<kRows> inverse_of_definite(const SmallMatrix<kRows>& a) {
  SmallMatrix<kRows> result;
  for (int j = 0; j < kRows; ++j) {
    double lower[kRows][kRows], x[kRows]{};
    for (int i = 0; i < kRows; ++i)
      for (int k = 0; k < kRows; ++k) lower[i][k] = a(i, k);
    x[j] = 1;
    solve_cholesky(lower, x);
    for (int i = 0; i < kRows; ++i) result(i, j) = x[i];
  }
  return result;
}

/// Six numbers of a small motion: turn [rad], then shift [m], world axes.
using Twist = std::array<double, 6>;
using Matrix6 = SmallMatrix<6>;

}  // namespace tactus
