#include "tactus/geom/maths/cholesky.h"

#include <gtest/gtest.h>

namespace tactus {
namespace {

template <class T>
class Cholesky : public ::testing::Test {};
using Scalars = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Cholesky, Scalars);

/// L of small integers and a solution of small integers: every product, root and quotient on the way is an
/// integer below 2^24, so that float and double alike make no error at all.
TYPED_TEST(Cholesky, IsExactOnIntegers) {
  constexpr int n = 6;
  const TypeParam L[n][n] = {{2}, {1, 3}, {-1, 2, 1}, {4, 0, -2, 5}, {0, 1, 3, -1, 2}, {3, -2, 0, 1, 1, 4}};
  const TypeParam solution[n] = {7, -3, 0, 2, -5, 11};
  TypeParam a[n][n] = {}, x[n] = {};
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      for (int k = 0; k < n; ++k) a[i][j] += L[i][k] * L[j][k];
      x[i] += a[i][j] * solution[j];
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = i + 1; j < n; ++j) a[i][j] = -999;  // only the lower triangle is read
  }
  solve_cholesky(a, x);
  for (int i = 0; i < n; ++i) {
    EXPECT_EQ(x[i], solution[i]) << i;
    for (int j = 0; j <= i; ++j) EXPECT_EQ(a[i][j], L[i][j]) << i << " " << j;
  }
}

/// What no equation speaks of stays 0 and harms nobody: 0 / sqrt(1e-30) = 0; the others are exact as above.
TYPED_TEST(Cholesky, AnUnknownWithoutEquationsStaysZero) {
  TypeParam a[3][3] = {{4, 0, 6}, {0, 0, 0}, {6, 0, 10}}, x[3] = {2, 0, 4};
  solve_cholesky(a, x);
  EXPECT_EQ(x[0], -1);
  EXPECT_EQ(x[1], 0);
  EXPECT_EQ(x[2], 1);
}

}  // namespace
}  // namespace tactus
