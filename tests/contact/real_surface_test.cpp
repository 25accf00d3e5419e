#include "tactus/contact/real_surface.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "contact/contact_scene.h"
#include "support/device_sets.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {
namespace {

constexpr float kSpacing = 0.005F;

class RealSurfaceOn : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(RealSurfaceOn);

struct HostSamples {
  std::vector<Vec3f> x, n;
  std::vector<float> area;
  SurfaceMotion motion;
};

/// The last of these frames on a device.
HostSamples run(ExecContext& ctx, const std::vector<TriangleMesh>& frames, float dt_s) {
  RealSurface surface(ctx.device(), test::small_surface(kSpacing));
  for (const TriangleMesh& mesh : frames) {
    const test::DeviceMesh on_device(ctx, mesh);
    surface.update(ctx, on_device.view(), dt_s);
    ctx.synchronize();
  }
  const Index n = surface.report(ctx).samples;
  const SamplesView s = surface.samples();
  return {to_host(ctx, s.x_m.part(0, n)), to_host(ctx, s.n.part(0, n)), to_host(ctx, s.area_m2.part(0, n)),
          to_host(ctx, surface.motion())[0]};
}

HostSamples on_cpu(const std::vector<TriangleMesh>& frames, float dt_s = 0) {
  DeviceSet cpu("cpu");
  return run(cpu.context(0), frames, dt_s);
}

/// Distance from p to the nearest sample.
float hole(const HostSamples& samples, Vec3f p) {
  float best = 1e9F;
  for (const Vec3f& x : samples.x) best = std::min(best, length(x - p));
  return best;
}

TEST(RealSurface, SamplesCoverSmallAndLargeTriangles) {
  const float radius = 0.04F;
  for (const Index n : {3, 12, 48}) {  // edges of 5, 1.3 and 0.33 spacings
    const TriangleMesh mesh = test::transformed(test::unit_sphere(n), {}, radius);
    const HostSamples s = on_cpu({mesh});
    double area = 0;
    for (const float a : s.area) area += static_cast<double>(a);
    EXPECT_NEAR(area, area_m2(mesh), 1e-5 * area);  // sums of at most 2^14 float32 areas: 1e-6 relative each
    // One sample a cell of 2/3 s: a plane cuts at most 3 of these cells for each (2/3 s)² (all three axes),
    // and a cell may hold two directions at 45°; twice that bounds it.
    EXPECT_LT(static_cast<double>(s.x.size()), 6 * area / (kSpacing * kSpacing * 4 / 9.0));
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 1 + mesh.triangles.size() / 300) {
      const auto& t = mesh.triangles[i];
      const auto vertex = [&](int k) {
        return mesh.positions_m[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])];
      };
      EXPECT_LT(hole(s, vertex(0)), kSpacing);
      EXPECT_LT(hole(s, 0.5F * (vertex(0) + vertex(1))), kSpacing);
      EXPECT_LT(hole(s, (1.F / 3) * (vertex(0) + vertex(1) + vertex(2))), kSpacing);
    }
    for (std::size_t i = 0; i < s.x.size(); ++i) EXPECT_GT(dot(s.n[i], normalized(s.x[i])), 0.95F);
  }
}

TEST(RealSurface, ThinObjectsKeepBothSides) {
  const HostSamples s = on_cpu({test::box({0.03F, 0.0005F, 0.03F}, 12)});  // 1 mm thick, spacing 5 mm
  double up = 0, down = 0;
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    EXPECT_NEAR(length(s.n[i]), 1, 1e-5);
    if (s.n[i].y > 0.9F) up += static_cast<double>(s.area[i]);
    if (s.n[i].y < -0.9F) down += static_cast<double>(s.area[i]);
  }
  EXPECT_NEAR(up, 0.0036, 1e-6);
  EXPECT_NEAR(down, 0.0036, 1e-6);
}

TEST_P(RealSurfaceOn, SameBitsAndTheMotionThatWas) {
  // A box of 12 x 6 x 8 cm moves by 1 m/s and turns by 3 rad/s.
  const float dt = 1.F / 30;
  const Vec3f v = {0.6F, -0.8F, 0}, w = {1, 2, -2};
  const auto frame = [&](float t) {
    const Rigidf T{rotation_matrix(axis_angle(normalized(w), 3 * t)), t * v};
    return test::transformed(test::box({0.06F, 0.03F, 0.04F}, 20), T);
  };
  const std::vector<TriangleMesh> frames = {frame(0.3F), frame(0.3F + dt)};
  const HostSamples reference = on_cpu(frames, dt);
  EXPECT_EQ(reference.motion.source, MotionSource::rigid);
  // Samples are averages within cells of 3.3 mm that lie differently in both frames: at edges they are off by
  // up to 1 mm, a tenth of them; averaged over 512 points that is 1e-3 * sqrt(.1/512) = 14 um, /dt = 0.5
  // mm/s; the bias of rounding off the 45° edges is smaller than 1 mm in 33 ms = 0.03 m/s.
  EXPECT_LT(length(reference.motion.velocity_m_s - v), 0.03F);
  EXPECT_LT(length(reference.motion.spin_rad_s - w), 0.03F * 3 / 0.1F);  // the same at 3.3 cm arms
  DeviceSet devices(GetParam(), 3);
  devices.for_each_part([&](ExecContext& ctx, int) {
    const HostSamples s = run(ctx, frames, dt);
    EXPECT_EQ(s.x, reference.x);
    EXPECT_EQ(s.n, reference.n);
    EXPECT_EQ(s.area, reference.area);
    EXPECT_EQ(s.motion.velocity_m_s, reference.motion.velocity_m_s);
    EXPECT_EQ(s.motion.spin_rad_s, reference.motion.spin_rad_s);
  });
}

TEST(RealSurface, ASphereMovesAndDoesNotSpin) {
  const float dt = 1.F / 30;
  std::vector<TriangleMesh> frames;
  for (int f = 0; f < 2; ++f) {
    const Mat3f turn = rotation_matrix(axis_angle(normalized(Vec3f{1, 2, 3}), 0.7F * static_cast<float>(f)));
    frames.push_back(
        test::transformed(test::unit_sphere(16), {turn, {0, 0.02F * static_cast<float>(f), 0}}, 0.04F));
  }
  const SurfaceMotion m = on_cpu(frames, dt).motion;
  EXPECT_LT(length(m.velocity_m_s - Vec3f{0, 0.6F, 0}), 0.03F);
  EXPECT_LT(length(m.spin_rad_s), 0.5F);  // at the surface 0.02 m/s
}

TEST(RealSurface, WhatCannotBeRegisteredFallsBack) {
  const float dt = 1.F / 30;
  const TriangleMesh small = test::transformed(test::unit_sphere(12), {}, 0.03F);
  const TriangleMesh large =
      test::transformed(test::unit_sphere(24), {Mat3f::identity(), {0.01F, 0, 0}}, 0.05F);
  const SurfaceMotion grown = on_cpu({small, large}, dt).motion;
  EXPECT_EQ(grown.source, MotionSource::centroid);
  EXPECT_NEAR(grown.velocity_m_s.x, 0.3, 0.01);  // [P 19]: 1 cm in 1/30 s; the centre is good to 0.3 mm
  EXPECT_EQ(grown.spin_rad_s, Vec3f{});
  const TriangleMesh far = test::transformed(test::unit_sphere(12), {Mat3f::identity(), {1, 0, 0}}, 0.03F);
  EXPECT_EQ(on_cpu({small, far}, dt).motion.source, MotionSource::still);  // 30 m/s
  EXPECT_EQ(on_cpu({small}, dt).motion.source, MotionSource::still);
  EXPECT_EQ(on_cpu({small, small}, 0).motion.source, MotionSource::still);
  TriangleMesh nothing = small;
  nothing.triangles.resize(1);
  nothing.triangles[0] = {0, 0, 0};
  EXPECT_EQ(on_cpu({small, nothing}, dt).motion.velocity_m_s, Vec3f{});
  EXPECT_EQ(on_cpu({nothing, small}, dt).motion.velocity_m_s, Vec3f{});
}

TEST(RealSurface, BadMeshesAndOverflowAreSurvivedAndCounted) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  TriangleMesh mesh = test::transformed(test::unit_sphere(12), {}, 0.04F);
  const std::size_t whole = on_cpu({mesh}).x.size();
  mesh.positions_m[5].x = std::numeric_limits<float>::quiet_NaN();
  mesh.triangles.push_back({0, 1, 1'000'000});
  mesh.triangles.push_back({-1, 1, 2});
  const HostSamples s = on_cpu({mesh});
  EXPECT_GT(s.x.size(), whole * 9 / 10);
  for (const Vec3f& x : s.x) EXPECT_NEAR(length(x), 0.04, 0.002);

  RealSurfaceSettings settings = test::small_surface(kSpacing);
  settings.max_pieces = 500;
  settings.max_samples = 100;
  RealSurface surface(ctx.device(), settings);
  const test::DeviceMesh on_device(ctx, test::transformed(test::unit_sphere(12), {}, 0.04F));
  surface.update(ctx, on_device.view(), 0);
  const RealSurfaceReport report = surface.report(ctx);
  EXPECT_EQ(report.samples, 100);
  EXPECT_GT(report.dropped_pieces, 0);
  EXPECT_GT(report.dropped_samples, 0);

  settings.max_triangles = 10;
  RealSurface tiny(ctx.device(), settings);
  EXPECT_THROW(tiny.update(ctx, on_device.view(), 0), Error);
  settings.sample_spacing_m = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(RealSurface(ctx.device(), settings), Error);
}

}  // namespace
}  // namespace tactus
