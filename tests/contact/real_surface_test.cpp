#include "tactus/contact/real/real_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
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
  std::vector<Index> component;
  SurfaceComponents components;
  std::array<SurfaceMotion, kComponents> motions;
  SurfaceMotion motion;  ///< of the first component
};

/// The last of these frames on a device.
HostSamples run(ExecContext& ctx, const std::vector<TriangleMesh>& frames, float dt_s) {
  RealSurface surface(ctx.device(), test::small_surface(kSpacing));
  for (const TriangleMesh& mesh : frames) {
    const test::DeviceMesh on_device(ctx, mesh);
    surface.update(ctx, on_device.view(), dt_s);
    ctx.synchronize();
  }
  const RealSurfaceReport report = surface.report(ctx);
  const Index n = report.samples;
  const SamplesView s = surface.samples();
  return {to_host(ctx, s.x_m.part(0, n)),
          to_host(ctx, s.n.part(0, n)),
          to_host(ctx, s.area_m2.part(0, n)),
          to_host(ctx, s.component.part(0, n)),
          report.components,
          report.motions,
          report.motions[0]};
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
  EXPECT_EQ(on_cpu({small, far}, dt).motion.source, MotionSource::too_fast);  // 30 m/s
  EXPECT_EQ(on_cpu({small}, dt).motion.source, MotionSource::still);
  EXPECT_EQ(on_cpu({small, small}, 0).motion.source, MotionSource::still);
  TriangleMesh nothing = small;
  nothing.triangles.resize(1);
  nothing.triangles[0] = {0, 0, 0};
  EXPECT_EQ(on_cpu({small, nothing}, dt).motion.velocity_m_s, Vec3f{});
  EXPECT_EQ(on_cpu({nothing, small}, dt).motion.velocity_m_s, Vec3f{});
}

/// Root mean square of how far the samples' velocities are from `truth`, relative to the truth's.
double velocity_error(const HostSamples& s, float t_s, const std::function<Vec3f(Vec3f)>& truth) {
  double wrong = 0, all = 0;
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    const SurfaceMotion& motion = s.motions[static_cast<std::size_t>(std::max(s.component[i], Index(0)))];
    const Vec3f v = truth(s.x[i]);
    const auto off = vec_cast<double>(motion.velocity_at(s.x[i], t_s) - v), want = vec_cast<double>(v);
    wrong += dot(off, off);
    all += dot(want, want);
  }
  return std::sqrt(wrong / all);
}

TEST_P(RealSurfaceOn, TwoSpheresMoveInOppositeDirections) {
  // 4 and 3 cm, at +-0.6 m/s; tessellated anew, so nothing but their shape tells how they moved.
  const float dt = 1.F / 30;
  const Vec3f v = {0, 0.6F, 0};
  const auto frame = [&](Index n, float t) {
    const Mat3f turn = rotation_matrix(axis_angle(normalized(Vec3f{1, 2, 3}), 20 * t));
    return test::together(
        test::transformed(test::unit_sphere(n), {turn, Vec3f{-0.06F, 0, 0} + t * v}, 0.04F),
        test::transformed(test::unit_sphere(n - 3), {turn, Vec3f{0.04F, 0, 0} - t * v}, 0.03F));
  };
  const std::vector<TriangleMesh> frames = {frame(16, 0), frame(17, dt), frame(15, 2 * dt)};
  const HostSamples s = on_cpu(frames, dt);
  EXPECT_EQ(s.components.count, 2);
  EXPECT_GT(s.components.component[0].area_m2, s.components.component[1].area_m2);
  // Half the bound of 0.03 m/s that the test above derives for boxes, at 0.6 m/s: spheres have no edges.
  EXPECT_LT(velocity_error(s, 0, [&](Vec3f x) { return x.x < 0 ? v : -v; }), 0.05);
  // One motion for both, as the centre of all of it moves: two thirds of the first sphere's velocity.
  HostSamples one = s;
  one.component.assign(one.component.size(), 0);
  one.motions[0] = {};
  one.motions[0].velocity_m_s = (16.F - 9.F) / 25.F * v;
  EXPECT_GT(velocity_error(one, 0, [&](Vec3f x) { return x.x < 0 ? v : -v; }), 0.9);
  DeviceSet devices(GetParam(), 3);
  devices.for_each_part([&](ExecContext& ctx, int) {
    const HostSamples there = run(ctx, frames, dt);
    EXPECT_EQ(there.x, s.x);
    EXPECT_EQ(there.component, s.component);
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_EQ(there.motions[k].velocity_m_s, s.motions[k].velocity_m_s);
      EXPECT_EQ(there.motions[k].spin_rad_s, s.motions[k].spin_rad_s);
      EXPECT_EQ(there.components.component[k].label, s.components.component[k].label);
    }
  });
}

TEST(RealSurface, ComponentsTurnForThemselvesAndKeepTheirLabels) {
  // Three boxes; the second grows until it is the largest, so the components' order changes and labels don't.
  const float dt = 1.F / 30;
  const Vec3f spin[3] = {{3, 0, 0}, {0, -4, 0}, {0, 0, 2}},
              v[3] = {{0.3F, 0, 0}, {0, 0, -0.4F}, {0, 0.5F, 0}};
  const auto frame = [&](float t, float growth) {
    TriangleMesh all;
    for (int k = 0; k < 3; ++k) {
      const Rigidf T{rotation_matrix(axis_angle(normalized(spin[k]), 0.4F + t * length(spin[k]))),
                     Vec3f{0.2F * static_cast<float>(k), 0, 0} + t * v[k]};
      all = test::together(all,
                           test::transformed(test::box({0.06F, 0.03F, 0.04F}, 14), T, k == 1 ? growth : 1.F));
    }
    all.normals.clear();
    return all;
  };
  const HostSamples before = on_cpu({frame(0, 0.95F), frame(dt, 0.97F)}, dt);
  const HostSamples after =
      on_cpu({frame(0, 0.95F), frame(dt, 0.97F), frame(2 * dt, 1.03F), frame(3 * dt, 1.03F)}, dt);
  ASSERT_EQ(before.components.count, 3);
  ASSERT_EQ(after.components.count, 3);
  const auto middle = [](const HostSamples& s) {
    for (int k = 0; k < 3; ++k) {
      if (std::abs(s.components.component[k].center_m.x - 0.2F) < 0.05F) return k;
    }
    return -1;
  };
  EXPECT_EQ(middle(before), 2);
  EXPECT_EQ(middle(after), 0);
  EXPECT_EQ(before.components.component[2].label, after.components.component[0].label);
  EXPECT_LT(velocity_error(after, 0,
                           [&](Vec3f x) {
                             const int k = x.x < 0.1F ? 0 : x.x < 0.3F ? 1 : 2;
                             const Vec3f c = Vec3f{0.2F * static_cast<float>(k), 0, 0} + 3 * dt * v[k];
                             return v[k] + cross(spin[k], x - c);
                           }),
            0.05);
}

/// The label of the component nearest to a point.
Index label_at(const SurfaceComponents& components, Vec3f p_m) {
  const SurfaceComponent* const end = components.component + components.count;
  return std::min_element(components.component, end,
                          [&](const SurfaceComponent& a, const SurfaceComponent& b) {
                            return length(a.center_m - p_m) < length(b.center_m - p_m);
                          })
      ->label;
}

TEST(RealSurface, WhatIsLostForAMomentKeepsItsLabel) {
  // Two boxes pass each other; their sizes, and so their order, swap on the way. A third one is away for ten
  // frames, then for twenty: longer than labels are kept.
  DeviceSet cpu("cpu");
  RealSurface surface(cpu.device(0), test::small_surface(kSpacing));
  std::vector<Index> labels;
  for (int frame = 0; frame < 50; ++frame) {
    const bool is_away = (frame >= 4 && frame < 14) || (frame >= 20 && frame < 40);
    const float t = 0.02F * static_cast<float>(frame), grow = 0.0004F * static_cast<float>(frame - 25);
    const Vec3f at[] = {{-0.5F + t, 0, 0}, {0.5F - t, 0.2F, 0}, {0, 0, 0.5F}};
    TriangleMesh mesh = test::together(
        test::transformed(test::box({0.04F + grow, 0.04F, 0.04F}, 8), {Mat3f::identity(), at[0]}),
        test::transformed(test::box({0.04F - grow, 0.04F, 0.04F}, 8), {Mat3f::identity(), at[1]}));
    if (!is_away)
      mesh = test::together(
          mesh, test::transformed(test::box({0.03F, 0.03F, 0.03F}, 8), {Mat3f::identity(), at[2]}));
    const test::DeviceMesh on_device(cpu.context(0), mesh);
    surface.update(cpu.context(0), on_device.view(), 1.F / 30);
    const SurfaceComponents components = surface.report(cpu.context(0)).components;
    if (frame == 0)
      for (const Vec3f p : at) labels.push_back(label_at(components, p));
    EXPECT_EQ(label_at(components, at[0]), labels[0]) << frame;
    EXPECT_EQ(label_at(components, at[1]), labels[1]) << frame;
    // After the long absence: the next that was never given.
    if (!is_away) {
      EXPECT_EQ(label_at(components, at[2]), frame < 20 ? labels[2] : 3) << frame;
    }
  }
  EXPECT_NE(labels[0], labels[1]);
  EXPECT_NE(labels[1], labels[2]);
}

TEST(RealSurface, LabelsComeBackAfterATouch) {
  // A gap of 12 cm closes by 2 cm a frame; from frame 6 to 12 the boxes are one component, then it opens
  // again.
  DeviceSet cpu("cpu");
  RealSurface surface(cpu.device(0), test::small_surface(kSpacing));
  Index left = -1, right = -1;
  for (int frame = 0; frame < 18; ++frame) {
    const float half_gap = 0.01F * static_cast<float>(std::max({9 - frame, frame - 9, 3}) - 3);
    const Vec3f at[] = {{-0.04F - half_gap, 0, 0}, {0.04F + half_gap, 0, 0}};
    TriangleMesh mesh =
        test::together(test::transformed(test::box({0.04F, 0.04F, 0.06F}, 8), {Mat3f::identity(), at[0]}),
                       test::transformed(test::box({0.04F, 0.05F, 0.04F}, 8), {Mat3f::identity(), at[1]}));
    // What has no area joins them and is no sample.
    if (half_gap == 0) mesh.triangles.push_back({0, 0, static_cast<Index>(mesh.positions_m.size()) - 1});
    const test::DeviceMesh on_device(cpu.context(0), mesh);
    surface.update(cpu.context(0), on_device.view(), 1.F / 30);
    const SurfaceComponents components = surface.report(cpu.context(0)).components;
    ASSERT_EQ(components.count, half_gap == 0 ? 1 : 2) << frame;
    if (half_gap == 0) continue;
    if (frame == 0) {
      left = label_at(components, at[0]);
      right = label_at(components, at[1]);
    }
    EXPECT_EQ(label_at(components, at[0]), left) << frame;
    EXPECT_EQ(label_at(components, at[1]), right) << frame;
  }
}

TEST(RealSurface, WhatJoinsOrComesApartMovesOnForAFrame) {
  // Two spheres that touch (they share a vertex) move on together, then apart: for one frame there is nothing
  // to compare with, and the difference of centres would say 1.5 m/s.
  const float dt = 1.F / 30;
  const Vec3f v = {0, 0.3F, 0};
  const auto frame = [&](float t, bool joined) {
    TriangleMesh two = test::together(
        test::transformed(test::unit_sphere(16), {Mat3f::identity(), {-0.05F, t * v.y, 0}}, 0.05F),
        test::transformed(test::unit_sphere(16), {Mat3f::identity(), {0.05F, t * v.y, 0}}, 0.049F));
    if (joined) two.triangles.push_back({0, 0, static_cast<Index>(two.positions_m.size()) - 1});
    return two;
  };
  const HostSamples apart = on_cpu({frame(0, true), frame(dt, true), frame(2 * dt, false)}, dt);
  const HostSamples joined = on_cpu({frame(0, false), frame(dt, false), frame(2 * dt, true)}, dt);
  EXPECT_EQ(apart.components.count, 2);
  EXPECT_EQ(joined.components.count, 1);
  const auto truth = [&](Vec3f) { return v; };
  EXPECT_LT(velocity_error(apart, 0, truth), 0.1);  // 0.03 m/s, as above
  EXPECT_LT(velocity_error(joined, 0, truth), 0.1);
  // The frame after, both are registered again.
  const HostSamples later =
      on_cpu({frame(0, true), frame(dt, true), frame(2 * dt, false), frame(3 * dt, false)}, dt);
  EXPECT_LT(velocity_error(later, 0, truth), 0.1);
  for (std::size_t k = 0; k < 2; ++k) EXPECT_NE(later.motions[k].source, MotionSource::carried);
}

TEST(RealSurface, CrumbsBorrowAndDoNotDisturb) {
  // Crumbs below 48 samples (16 s²) anywhere change neither the body's motion nor their own: they borrow it.
  const float dt = 1.F / 30;
  std::vector<TriangleMesh> clean, dusty;
  for (int f = 0; f < 2; ++f) {
    const auto t = static_cast<float>(f) * dt;
    clean.push_back(test::transformed(test::unit_sphere(16), {Mat3f::identity(), {0, 0.5F * t, 0}}, 0.05F));
    dusty.push_back(clean.back());
    for (int k = 0; k < 30; ++k) {
      const auto a = static_cast<float>(k + 7 * f);
      dusty.back() = test::together(
          dusty.back(),
          test::transformed(test::unit_sphere(2), {Mat3f::identity(), {0.1F + 0.01F * a, 0, 0}}, 0.002F));
    }
  }
  const HostSamples alone = on_cpu(clean, dt), s = on_cpu(dusty, dt);
  EXPECT_EQ(s.components.count, 1);
  EXPECT_EQ(std::count(s.component.begin(), s.component.end(), 0),
            static_cast<std::ptrdiff_t>(alone.x.size()));
  EXPECT_GT(s.x.size(), alone.x.size());
  EXPECT_LT(length(s.motion.velocity_m_s - Vec3f{0, 0.5F, 0}), 0.03F);
  EXPECT_EQ(s.motion.source, alone.motion.source);
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
  settings.max_raw_samples = 500;
  settings.max_samples = 100;
  RealSurface surface(ctx.device(), settings);
  const test::DeviceMesh on_device(ctx, test::transformed(test::unit_sphere(12), {}, 0.04F));
  surface.update(ctx, on_device.view(), 0);
  const RealSurfaceReport report = surface.report(ctx);
  EXPECT_EQ(report.samples, 100);
  EXPECT_GT(report.dropped_raw_samples, 0);
  EXPECT_GT(report.dropped_samples, 0);

  // Capacity for as many triangles as a hull of 512 voxels has changes nothing.
  settings.max_triangles = 1 << 22;
  RealSurface roomy(ctx.device(), settings);
  roomy.update(ctx, on_device.view(), 0);
  EXPECT_EQ(roomy.report(ctx).dropped_raw_samples, report.dropped_raw_samples);

  settings.max_triangles = 10;
  RealSurface tiny(ctx.device(), settings);
  EXPECT_THROW(tiny.update(ctx, on_device.view(), 0), Error);
  settings.sample_spacing_m = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(RealSurface(ctx.device(), settings), Error);
}

}  // namespace
}  // namespace tactus
