#pragma once
/// Matrices whose size is known at run time, for poses of many cameras, in double, on the host.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace tactus {

/// Row-major. `reset` keeps its memory.
struct DenseMatrix {
  int rows = 0, columns = 0;
  std::vector<double> v;
  void reset(int row_count, int column_count) {
    rows = row_count;
    columns = column_count;
    v.assign(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns), 0);
  }
  double* row(int i) { return v.data() + static_cast<std::ptrdiff_t>(i) * columns; }
  const double* row(int i) const { return v.data() + static_cast<std::ptrdiff_t>(i) * columns; }
  double& operator()(int i, int j) { return row(i)[j]; }
  double operator()(int i, int j) const { return row(i)[j]; }
};

/// Replaces a symmetric, positive semidefinite matrix, of which the lower triangle is read, by L and L^T, a =
/// L L^T. Unknowns that no equation speaks of stay 0 in solutions with it.
///
/// Row by row, and each of its numbers takes from all that follow: these stand side by side in L^T. Sums over
/// k, one number after the other, would wait for each of their terms.
inline void factorize(DenseMatrix& a) {
  for (int i = 0; i < a.rows; ++i) {
    double* own = a.row(i);
    for (int k = 0; k < i; ++k) {
      const double* above = a.row(k);
      const double share = own[k] /= above[k];
      for (int j = k + 1; j < i; ++j) own[j] -= share * above[j];
      own[i] -= share * share;
    }
    own[i] = std::sqrt(std::max(own[i], 1e-30));
    for (int k = 0; k < i; ++k) a(k, i) = own[k];
  }
}

/// x = L^-1 x, of each column of x. @param l of factorize()
inline void solve_lower(const DenseMatrix& l, DenseMatrix& x) {
  for (int i = 0; i < l.rows; ++i) {
    double* own = x.row(i);
    for (int k = 0; k < i; ++k) {
      const double share = l(i, k);
      const double* other = x.row(k);
      for (int c = 0; c < x.columns; ++c) own[c] -= share * other[c];
    }
    const double scale = 1 / l(i, i);
    for (int c = 0; c < x.columns; ++c) own[c] *= scale;
  }
}

/// x = L^-T x, of each column of x.
inline void solve_upper(const DenseMatrix& l, DenseMatrix& x) {
  for (int i = l.rows - 1; i >= 0; --i) {
    double* own = x.row(i);
    for (int k = i + 1; k < l.rows; ++k) {
      const double share = l(k, i);
      const double* other = x.row(k);
      for (int c = 0; c < x.columns; ++c) own[c] -= share * other[c];
    }
    const double scale = 1 / l(i, i);
    for (int c = 0; c < x.columns; ++c) own[c] *= scale;
  }
}

/// Inverse of a symmetric, positive definite matrix.
inline DenseMatrix inverse_of_definite(DenseMatrix a) {
  DenseMatrix inverse;
  inverse.reset(a.rows, a.rows);
  for (int i = 0; i < a.rows; ++i) inverse(i, i) = 1;
  factorize(a);
  solve_lower(a, inverse);
  solve_upper(a, inverse);
  return inverse;
}

}  // namespace tactus
