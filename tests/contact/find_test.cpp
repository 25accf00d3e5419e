/// What keeps searches short (lists of triangles, points that sleep) changes nothing of what is found.
#include <gtest/gtest.h>

#include <cstdio>
#include <random>
#include <utility>

#include "contact/contact_scene.h"
#include "tactus/contact/contact.h"
#include "tactus/contact/find_kernels.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {
namespace {

constexpr float kSpacing = 0.01F, kSubstep = 1e-3F;
constexpr int kSubsteps = 24;

/// A block as a GPU works on it, on the host: lanes share a search.
struct LaneBlock : CpuBlock<FindContacts::kThreads> {
  static constexpr bool kIsLoop = false;
  using CpuBlock::CpuBlock;
};

/// Points of a body of single nodes, and how they search.
struct Searcher {
  enum class How { lists, lanes, anew } how;
  BodyPoints points;
  Index searches = 0;  ///< round points without a list that may do
  Searcher(ExecContext& ctx, How does, Index count) : how(does) {
    std::vector<EmbeddedPoint> single(static_cast<std::size_t>(count));
    for (Index i = 0; i < count; ++i) {
      EmbeddedPoint& point = single[static_cast<std::size_t>(i)];
      point = {};
      for (Index& node : point.node) node = i;
      point.weight[0] = 1;
    }
    points = BodyPoints(ctx, single, count, kSpacing);
  }
  void find(ExecContext& ctx, ContactFinder finder) {
    if (how == How::anew) ctx.fill_bytes(points.state().searched, 0xff);
    if (how == How::anew) ctx.fill_bytes(points.blocks().pose, 0xff);
    finder.body.table = points.table();
    finder.body.state = points.state();
    ctx.parallel_for("wake", points.block_count(), WakePoints{finder, points.blocks()});
    const PointState& state = finder.body.state;
    FindContacts kernel{finder};
    const Index awake = std::exchange(state.awake.count[0], 0);
    for (Index b = 0; b < awake; ++b) searches += state.awake.points[b] < 0 ? 1 : 0;
    if (how != How::lanes) return ctx.parallel_for("find", awake, kernel);
    kernel.load();
    FindContacts::Shared shared;
    for (Index b = 0; b < awake; ++b) kernel(LaneBlock(b), shared);
  }
};

/// A box and a blade that turn and move as two components, a mesh that stands still, and a plane.
struct Surroundings {
  RealSurface surface;
  Obstacles obstacles;
  Buffer<SurfacePoses> poses;
  static TriangleMesh shapes(float t) {
    const Mat3f turn = rotation_matrix(axis_angle({0, 0, 1}, 3 * t));
    return test::together(
        test::transformed(test::box({0.04F, 0.03F, 0.05F}, 11), {turn, {-0.06F + t, 0.01F, 0}}),
        test::transformed(test::box({0.0005F, 0.04F, 0.04F}, 11), {transpose(turn), {0.06F - t, 0, 0}}));
  }
  /// Whether a point may be inside at the beginning.
  static bool may_hold(Vec3f p) {
    const bool box = length(Vec3f{p.x + 0.06F, p.y - 0.01F, 0}) < 0.055F && std::abs(p.z) < 0.055F;
    const bool still =
        std::abs(p.x) < 0.025F && std::abs(p.y - 0.05F) < 0.015F && std::abs(p.z - 0.03F) < 0.035F;
    return box || still || p.y < -0.055F;
  }
  explicit Surroundings(ExecContext& ctx)
      : surface(ctx.device(), test::small_surface(kSpacing)), poses(ctx.device(), kSubsteps) {
    std::vector<ObstacleDescription> two(2);
    two[0].T_world_obstacle.t = {0, -0.06F, 0};
    two[1].kind = ObstacleKind::mesh;
    two[1].mesh = test::box({0.02F, 0.01F, 0.03F}, 2);
    two[1].T_world_obstacle.t = {0, 0.05F, 0.03F};
    obstacles = Obstacles(ctx, two, kSpacing);
    for (const float t : {0.F, kSubsteps * kSubstep}) {
      const test::DeviceMesh mesh(ctx, shapes(t));
      surface.update(ctx, mesh.view(), kSubsteps * kSubstep);
    }
    ctx.parallel_for(
        "pose", kSubsteps,
        PoseSurface{surface.motions(),
                    surface.components(),
                    {.dt_s = kSubstep, .substeps = kSubsteps, .dt_frame_s = kSubsteps * kSubstep},
                    poses.view()});
  }
};

/// 2,000 points at up to 3 m/s: their lists hold for one to all substeps. All begin outside: what is deeper
/// than the reach is left to DeepRescue, which is not here. Whatever is kept from one substep to
/// the next, and whoever shares a search, each touches the same, to the last bit. The poses of a frame of so
/// many substeps overwrite those of the frame before the last.
void touch_alike(Index frame) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  Surroundings around(ctx);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> u(-1, 1);
  std::vector<Vec3f> x(2000), v(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    do {
      x[i] = {0.12F * u(random), 0.08F * u(random), 0.08F * u(random)};
    } while (Surroundings::may_hold(x[i]));
    v[i] = (i % 3 == 0 ? 0.05F : 3.F) * Vec3f{u(random), u(random), u(random)};
  }
  const auto count = static_cast<Index>(x.size());
  std::vector<Searcher> all;
  for (const auto how : {Searcher::How::anew, Searcher::How::lists, Searcher::How::lanes})
    all.emplace_back(ctx, how, count);
  Buffer<Vec3f> dx = to_device(ctx, x), dv = to_device(ctx, v);
  const Buffer<float> mass = to_device(ctx, std::vector<float>(x.size(), 1));
  Buffer<SurfacePoses> poses(ctx.device(), 2 * static_cast<std::int64_t>(frame));
  Index touched = 0, lists = 0, crowded = 0;
  for (int k = 0; k < kSubsteps; ++k) {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += kSubstep * v[i];
    ctx.upload(x, dx.view());
    const Index first_pose = k / frame % 2 * frame;
    if (k % frame == 0)
      ctx.copy(around.poses.const_view().part(k, frame), poses.view().part(first_pose, frame));
    ContactFinder finder{};
    finder.boundaries = {around.surface.triangles(), around.surface.coarse_samples(), poses.const_view(),
                         around.obstacles.view()};
    finder.body.nodes = {dx.view(), dv.view(), mass.const_view(), {}};
    finder.body.reach_m = 2 * kSpacing;
    finder.friction = 0.5F;
    finder.margin_m = 0.125F * kSpacing;
    finder.now = {.substep = k % frame, .dt_s = kSubstep, .first_pose = first_pose};
    std::vector<std::vector<Index>> touching;
    std::vector<std::vector<PointContact>> contact;
    for (Searcher& s : all) {
      s.find(ctx, finder);
      touching.push_back(to_host(ctx, s.points.touching()));
      contact.push_back(to_host(ctx, View<const PointContact>(s.points.state().contact)));
    }
    const std::vector<PointNeighbours> near =
        to_host(ctx, View<const PointNeighbours>(all[1].points.state().neighbours));
    for (std::size_t i = 0; i < x.size(); ++i) {
      for (std::size_t how = 1; how < all.size(); ++how) {
        ASSERT_EQ(touching[how][i], touching[0][i]) << "point " << i << " substep " << k << " how " << how;
        if (touching[0][i] == 0) continue;
        ASSERT_EQ(contact[how][i].collider, contact[0][i].collider) << "point " << i << " substep " << k;
        ASSERT_EQ(contact[how][i].position_correction_m, contact[0][i].position_correction_m)
            << "point " << i << " substep " << k;
        ASSERT_EQ(contact[how][i].velocity_correction_m_s, contact[0][i].velocity_correction_m_s)
            << "point " << i << " substep " << k;
        ASSERT_EQ(contact[how][i].anchor_m, contact[0][i].anchor_m) << "point " << i << " substep " << k;
      }
      if (touching[0][i] == 1) x[i] += contact[0][i].position_correction_m;
      touched += touching[0][i] == 1 ? 1 : 0;
      lists += near[i].count > 0 ? 1 : 0;
      crowded += near[i].listed_m == 0.F ? 1 : 0;
    }
  }
  std::printf("touching %d, with a list %d, too many triangles %d; searches %d, of %d\n", touched, lists,
              crowded, all[1].searches, all[0].searches);
  EXPECT_LT(all[1].searches, all[0].searches / 2);
  EXPECT_GT(touched, 1000);
  EXPECT_GT(lists, 1000);
  EXPECT_GT(crowded, 10);
}

TEST(FindContacts, WhatIsKeptChangesNothing) { touch_alike(kSubsteps); }

TEST(FindContacts, WhatIsKeptFromFrameToFrameChangesNothing) {
  for (const Index frame : {1, 2, 8}) touch_alike(frame);
}

}  // namespace
}  // namespace tactus
