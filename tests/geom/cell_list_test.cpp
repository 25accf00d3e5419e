#include "tactus/geom/search/cell_list.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "geom/cell_list_test_kernels.h"
#include "support/device_sets.h"
#include "support/message_of.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {
namespace {

using test::message_of;

class CellListOn : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(CellListOn);

constexpr float kRadius = 0.1F;
constexpr Index kCapacity = 512;

std::vector<Vec3f> random_points(Index n, float extent, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> u(-extent, extent);
  std::vector<Vec3f> x(static_cast<std::size_t>(n));
  for (Vec3f& p : x) p = {u(random), u(random), u(random)};
  return x;
}

/// found, then counts
std::vector<Index> query(ExecContext& ctx, const std::vector<Vec3f>& particles, Index used,
                         const std::vector<Vec3f>& points) {
  const Buffer<Vec3f> x = to_device(ctx, particles), p = to_device(ctx, points);
  const Buffer<Index> count = to_device(ctx, std::vector<Index>{used});
  CellList list(ctx.device(), x.size(), kRadius, 3);
  list.build(ctx, x.view(), Count(count.view(), x.size()));
  Buffer<Index> found = to_device(ctx, std::vector<Index>(points.size() * kCapacity, -1));
  Buffer<Index> found_count(ctx.device(), p.size());
  ctx.parallel_for("test/collect", p.size(),
                   test::CollectNear{list.view(), x.view(), p.view(), kRadius, kCapacity, found.view(),
                                     found_count.view()});
  std::vector<Index> all = to_host(ctx, found.view());
  const std::vector<Index> counts = to_host(ctx, found_count.view());
  all.insert(all.end(), counts.begin(), counts.end());
  return all;
}

void expect_brute_force(const std::vector<Index>& result, const std::vector<Vec3f>& particles, Index used,
                        const std::vector<Vec3f>& points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::vector<Index> expected;
    for (Index j = 0; j < used; ++j) {
      const Vec3f d = particles[static_cast<std::size_t>(j)] - points[i];
      if (dot(d, d) <= kRadius * kRadius) expected.push_back(j);
    }
    ASSERT_LT(expected.size(), static_cast<std::size_t>(kCapacity));
    const auto first = result.begin() + static_cast<std::ptrdiff_t>(i * kCapacity);
    std::vector<Index> got(first, first + result[points.size() * kCapacity + i]);
    std::sort(got.begin(), got.end());
    EXPECT_EQ(got, expected) << "point " << i;
  }
}

void check_everywhere(const std::string& devices, const std::vector<Vec3f>& particles, Index used,
                      const std::vector<Vec3f>& points) {
  DeviceSet reference("cpu");
  const std::vector<Index> expected = query(reference.context(0), particles, used, points);
  expect_brute_force(expected, particles, used, points);
  DeviceSet set(devices, 3);
  set.for_each_part([&](ExecContext& ctx, int) {
    EXPECT_EQ(query(ctx, particles, used, points), expected) << "order of the visit";
  });
}

TEST_P(CellListOn, EqualsBruteForce) {
  // 8 cells of 0.1 a side: points up to 2 m away wrap around the table five times.
  check_everywhere(GetParam(), random_points(3000, 0.4F, 1), 3000, random_points(200, 0.5F, 2));
  check_everywhere(GetParam(), random_points(3000, 2.F, 3), 3000, random_points(200, 2.F, 4));
}

TEST_P(CellListOn, Clustered) {
  std::vector<Vec3f> x = random_points(400, 0.02F, 5);
  const std::vector<Vec3f> far = random_points(100, 3.F, 6);
  x.insert(x.end(), far.begin(), far.end());
  check_everywhere(GetParam(), x, static_cast<Index>(x.size()), random_points(50, 0.2F, 7));
}

TEST_P(CellListOn, CountOnDeviceAndBadPositions) {
  std::vector<Vec3f> x = random_points(1000, 0.4F, 8);
  x[10].x = std::numeric_limits<float>::quiet_NaN();
  x[11].y = std::numeric_limits<float>::infinity();
  x[12].z = 1e30F;
  std::vector<Vec3f> points = random_points(50, 0.4F, 9);
  points[0].x = std::numeric_limits<float>::quiet_NaN();
  check_everywhere(GetParam(), x, 600, points);
  check_everywhere(GetParam(), x, 0, points);
}

TEST(CellListErrors, NameTheValue) {
  DeviceSet cpu("cpu");
  const auto message = [&](Index n, float cell, int bits) -> std::string {
    return message_of([&] { CellList list(cpu.device(0), n, cell, bits); });
  };
  EXPECT_NE(message(0, 1, 5).find("max_particles is 0"), std::string::npos);
  EXPECT_NE(message(1, -1, 5).find("cell_m is -1"), std::string::npos);
  EXPECT_NE(message(1, 1, 9).find("bits_per_axis is 9"), std::string::npos);
}

}  // namespace
}  // namespace tactus
