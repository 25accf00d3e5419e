#pragma once
/// Small systems of linear equations, on every device.
#include "tactus/base/math.h"

namespace tactus {

/// Solves a x = b by a = L L^T (Cholesky). A pivot below 1e-30 counts as 1e-30: an unknown that no equation
/// speaks of stays 0.
/// @param a symmetric and positive semidefinite, row-major; only the lower triangle is read, L replaces it
/// @param x in: b; out: the solution
template <class T, int N>
TACTUS_HD void solve_cholesky(T (&a)[N][N], T (&x)[N]) {
  for (int j = 0; j < N; ++j) {
    for (int k = 0; k < j; ++k) a[j][j] -= a[j][k] * a[j][k];
    a[j][j] = tactus::sqrt(max(a[j][j], static_cast<T>(1e-30)));
    for (int i = j + 1; i < N; ++i) {
      for (int k = 0; k < j; ++k) a[i][j] -= a[i][k] * a[j][k];
      a[i][j] /= a[j][j];
    }
  }
  for (int i = 0; i < N; ++i) {
    for (int k = 0; k < i; ++k) x[i] -= a[i][k] * x[k];
    x[i] /= a[i][i];
  }
  for (int i = N - 1; i >= 0; --i) {
    for (int k = i + 1; k < N; ++k) x[i] -= a[k][i] * x[k];
    x[i] /= a[i][i];
  }
}

}  // namespace tactus
