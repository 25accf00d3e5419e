#include "tactus/tissue/node_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/device_sets.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {
namespace {

class NodeCheckOnDevices : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(NodeCheckOnDevices);

/// 1000 nodes in four blocks of 256.
TEST_P(NodeCheckOnDevices, TheFirstBadNodeAndTheFastestAreNamed) {
  DeviceSet set(GetParam());
  ExecContext& ctx = set.context(0);
  NodeCheck check(ctx, 1000);
  const auto look = [&](Index substep, auto&& change) {
    std::vector<Vec3f> x(1000, Vec3f{1, 2, 3}), v(1000, Vec3f{0.1F, 0, 0});
    change(x, v);
    const Buffer<Vec3f> x_m = to_device(ctx, x), v_m_s = to_device(ctx, v);
    check.check(ctx, x_m.size(), x_m.const_view(), v_m_s.const_view(), {}, substep);
    ctx.synchronize();
  };
  const auto report = [&ctx](NodeCheck& of) {
    of.summarise(ctx);
    return to_host(ctx, of.summary())[0];
  };
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  look(0, [](auto&, auto& v) { v[300] = {3, 4, 0}; });
  NodeCheckRecord r = report(check);
  EXPECT_EQ(r.bad_substep, -1);
  EXPECT_EQ(r.fastest_node, 300);
  EXPECT_EQ(r.fastest2_m2_s2, 25);
  look(1, [&](auto& x, auto&) { x[700].y = nan; });
  look(2, [&](auto&, auto& v) { v[3].z = -inf; });
  look(3, [&](auto&, auto& v) { v[600] = {0, 2e5F, 0}; });
  r = report(check);
  EXPECT_EQ(r.bad_substep, 1);
  EXPECT_EQ(r.bad_node, 700);
  EXPECT_EQ(r.fastest_node, 300);
  check.begin_frame(ctx);
  look(0, [&](auto& x, auto& v) { x[999].x = inf, v[800] = {nan, 0, 0}; });
  r = report(check);
  EXPECT_EQ(r.bad_substep, 0);
  EXPECT_EQ(r.bad_node, 800);
  EXPECT_EQ(r.fastest_node, 0);  // all others are as fast
}

}  // namespace
}  // namespace tactus
