/// A body's surface as particles of a liquid see it.
#include "tactus/contact/walls/body_walls.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "support/device_sets.h"
#include "tactus/contact/surface_triangles.h"
#include "tactus/geom/mesh/box_surface.h"

namespace tactus {
namespace {

constexpr float kSpacing_m = 0.01F, kReach_m = 1.5F * kSpacing_m;
constexpr Index kCollider = 7;

struct Surface {
  std::vector<Vec3f> x_m;
  std::vector<Vec3i> triangles;
  /// A square of half edge `half_m` round `middle`, seen from n, in 2 k^2 triangles.
  void add_square(Vec3f middle, Vec3f n, Vec3f u, float half_m, int k) {
    const auto first = static_cast<Index>(x_m.size());
    const Vec3f w = cross(n, u);
    const auto along = [&](int a) {
      return half_m * (2 * static_cast<float>(a) / static_cast<float>(k) - 1);
    };
    for (int b = 0; b <= k; ++b)
      for (int a = 0; a <= k; ++a) x_m.push_back(middle + along(a) * u + along(b) * w);
    for (int b = 0; b < k; ++b) {
      for (int a = 0; a < k; ++a) {
        const Index at = first + b * (k + 1) + a;
        triangles.push_back({at, at + 1, at + k + 2});
        triangles.push_back({at, at + k + 2, at + k + 1});
      }
    }
  }
};

/// What was found, and what nodes of 1 kg, one a vertex, got after each wall had taken an impulse.
struct Seen {
  std::vector<Index> count;
  std::vector<NearWall> walls;
  std::vector<Vec3f> node_v_m_s;
  const NearWall& wall(std::size_t i, std::size_t k) const { return walls[kNearWalls * i + k]; }
};

/// A surface that is a wall, each vertex on a node of 1 kg, and particles beside it.
class Walls {
 public:
  /// @param parts that the walls are for: with several, no active set follows the liquid @param capacity for
  /// particles
  Walls(DeviceSet& devices, const Surface& surface, Index capacity, int parts = 1)
      : ctx_(devices.context(0)),
        x_(on_device(surface.x_m)),
        v_(on_device(std::vector<Vec3f>(surface.x_m.size()))),
        mass_(on_device(std::vector<float>(surface.x_m.size(), 1.F))),
        count_(ctx_.device(), capacity),
        near_(ctx_.device(), std::int64_t{kNearWalls} * capacity),
        search_(ctx_.device(), {.max_particles = capacity, .reach_m = 2 * kSpacing_m}),
        none_(devices.context(parts - 1).device(), {.max_particles = 1, .reach_m = 2 * kSpacing_m}),
        walls_(devices, parts, given(surface), kCollider, kSpacing_m, capacity) {
    Buffer<Vec3f> no_x(devices.context(parts - 1).device(), 1);
    none_.build(devices.context(parts - 1), no_x.const_view(), {}, Count(0));
    devices.synchronize();
  }
  void move_nodes(const std::vector<Vec3f>& x_m) {
    ctx_.upload(x_m, x_.view());
    ctx_.synchronize();
  }
  void cut(const WallChange& change) { walls_.apply(change); }
  /// What particles see, and what nodes got after each wall had taken an impulse, by its side.
  Seen look(const std::vector<Vec3f>& points_m, const Vec3f (&impulse_N_s)[kWallSides]) {
    const auto n = static_cast<Index>(points_m.size());
    const Buffer<Vec3f> points = on_device(points_m);
    search_.build(ctx_, points.const_view(), {}, Count(n));
    ctx_.fill_bytes(count_.view(), 0);
    ctx_.fill_bytes(near_.view(), 0);
    ctx_.fill_bytes(v_.view(), 0);
    walls_.begin([&](int part) -> const NeighbourSearch& { return part == 0 ? search_ : none_; });
    walls_.pose();
    walls_.find_walls(0, search_, near());
    std::vector<Index> order(points_m.size()), counts(points_m.size());
    std::vector<NearWall> found(kNearWalls * points_m.size());
    const View<NearWall> used = near_.view().part(0, static_cast<Index>(found.size()));
    ctx_.download(search_.cells().order.part(0, n), std::span(order));
    ctx_.download(count_.const_view().part(0, n), std::span(counts));
    ctx_.download(View<const NearWall>(used), std::span(found));
    ctx_.synchronize();
    for (NearWall& wall : found) wall.impulse_N_s = impulse_N_s[wall.side];
    ctx_.upload(std::span<const NearWall>(found), used);
    walls_.push(0, search_, near());
    walls_.end_push();
    Seen seen{std::vector<Index>(points_m.size()), std::vector<NearWall>(found.size()),
              std::vector<Vec3f>(static_cast<std::size_t>(v_.size()))};
    ctx_.download(v_.const_view(), std::span(seen.node_v_m_s));
    ctx_.synchronize();
    for (std::size_t slot = 0; slot < order.size(); ++slot) {
      const auto i = static_cast<std::size_t>(order[slot]);
      seen.count[i] = counts[slot];
      for (std::size_t k = 0; k < kNearWalls; ++k)
        seen.walls[kNearWalls * i + k] = found[kNearWalls * slot + k];
    }
    return seen;
  }

 private:
  template <class T>
  Buffer<T> on_device(const std::vector<T>& values) {
    Buffer<T> buffer(ctx_.device(), static_cast<std::int64_t>(values.size()));
    ctx_.upload(std::span<const T>(values), buffer.view());
    ctx_.synchronize();
    return buffer;
  }
  NearWalls near() { return {count_.view(), near_.view()}; }
  WallSurface given(const Surface& surface) {
    WallSurface given;
    given.lattice_spacing_m = kSpacing_m;
    given.box_m = {{-1, -1, -1}, {1, 1, 1}};
    given.nodes = {x_.view(), v_.view(), mass_.const_view(), {}};
    for (Index i = 0; i < x_.size(); ++i) {
      EmbeddedPoint single{};
      for (Index& node : single.node) node = i;
      single.weight[0] = 1;
      given.all.vertices.push_back({i, single, surface.x_m[static_cast<std::size_t>(i)]});
    }
    for (const Vec3i& t : surface.triangles)
      given.all.triangles.push_back({static_cast<Index>(given.all.triangles.size()), {t.x, t.y, t.z}});
    return given;
  }

  ExecContext& ctx_;
  Buffer<Vec3f> x_, v_;
  Buffer<float> mass_;
  Buffer<Index> count_;
  Buffer<NearWall> near_;
  NeighbourSearch search_, none_;
  BodyWalls walls_;
};

Seen look(const std::string& devices_text, const Surface& surface, const std::vector<Vec3f>& points_m,
          const Vec3f (&impulse_N_s)[kWallSides]) {
  DeviceSet devices(devices_text, 3);
  return Walls(devices, surface, static_cast<Index>(points_m.size())).look(points_m, impulse_N_s);
}

class BodyWallsOn : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
  std::mt19937 random_{1};
  float any(float low, float high) { return std::uniform_real_distribution<float>(low, high)(random_); }
  Vec3f any_direction() {
    for (;;) {
      const Vec3f v{any(-1, 1), any(-1, 1), any(-1, 1)};
      if (length(v) > 0.1F && length(v) < 1) return normalized(v);
    }
  }
};
TACTUS_INSTANTIATE_DEVICES(BodyWallsOn);

/// Gaps between two squares that lean to each other by up to 80 degrees, 0.2 to 1.2 spacings apart, turned
/// anyhow; the particle is up to 0.05 spacings behind one of them, or between. Distances are those of the
/// planes, to rounding of coordinates of 0.1 m and of the turn: 1e-7 m. Each square's nodes together get the
/// impulse of their wall, in units of 2^-48 N s, rounded in at most a few places, and float velocities: 1e-6.
TEST_P(BodyWallsOn, SeeBothSidesOfAGap) {
  constexpr Vec3f kImpulse[kWallSides] = {{1, 2, 3}, {-4, 5, -6}};
  for (int k = 0; k < 40; ++k) {
    const Vec3f n = any_direction(), u = normalized(cross(n, any_direction())),
                x{any(-0.05F, 0.05F), 0.05F, 0.02F};
    const float lean = any(0, 1.4F), near_m = kSpacing_m * any(-0.05F, 0.5F),
                far_m = kSpacing_m * any(0.55F, 0.7F);
    const Vec3f across = -std::cos(lean) * n + std::sin(lean) * cross(n, u), side = cross(across, u);
    Surface gap;
    gap.add_square(x - near_m * n, n, u, 0.004F, 1 + k % 3);
    const auto nodes = gap.x_m.size();
    gap.add_square(x - far_m * across, across, u, 0.004F, 1 + k % 2);
    ASSERT_NEAR(dot(side, u), 0, 1e-6F);
    const Seen seen = look(GetParam(), gap, {x}, kImpulse);
    ASSERT_EQ(seen.count[0], 2) << k;
    EXPECT_NEAR(seen.wall(0, 0).distance_m, near_m, 1e-7F) << k;
    EXPECT_NEAR(seen.wall(0, 1).distance_m, far_m, 1e-7F) << k;
    EXPECT_EQ(seen.wall(0, 0).side, 0);
    EXPECT_EQ(seen.wall(0, 1).side, 1);
    if (near_m > 0.1F * kSpacing_m) {
      EXPECT_LT(length(seen.wall(0, 0).n - n), 1e-4F) << k;
    }
    EXPECT_LT(length(seen.wall(0, 1).n - across), 1e-4F) << k;
    Vec3f sum[kWallSides]{};
    for (std::size_t i = 0; i < gap.x_m.size(); ++i) sum[i < nodes ? 0 : 1] += seen.node_v_m_s[i];
    for (int s = 0; s < kWallSides; ++s) EXPECT_LT(length(sum[s] - kImpulse[s]), 1e-5F) << k << " side " << s;
  }
}

/// Round a box and inside of it, within reach of its faces, edges and corners, there is one wall: the
/// nearest.
void expect_one_side_of_a_box(const Seen& seen, Vec3f half_m, const std::vector<Vec3f>& points, int least) {
  int near = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3f p = points[i], out = Vec3f{std::abs(p.x), std::abs(p.y), std::abs(p.z)} - half_m;
    const float inside = std::max({out.x, out.y, out.z}), d = inside < 0 ? inside : length(max(out, Vec3f{}));
    if (std::abs(d) > 0.999F * kReach_m) continue;
    ++near;
    ASSERT_EQ(seen.count[i], 1) << i;
    EXPECT_NEAR(seen.wall(i, 0).distance_m, d, 0.5F * GapOfTriangles::kTie * kReach_m + 1e-7F) << i;
  }
  EXPECT_GT(near, least);
}
Surface box_of(Vec3f half_m, Vec3i cells) {
  const TriangleMesh box = box_surface(half_m, cells);
  Surface surface{box.positions_m, {}};
  for (const auto& t : box.triangles) surface.triangles.push_back({t[0], t[1], t[2]});
  return surface;
}
constexpr Vec3f kHalf_m{0.03F, 0.02F, 0.025F};

TEST_P(BodyWallsOn, SeeOneSideOfABox) {
  std::vector<Vec3f> points;
  for (int k = 0; k < 3000; ++k)
    points.push_back({any(-0.042F, 0.042F), any(-0.032F, 0.032F), any(-0.037F, 0.037F)});
  expect_one_side_of_a_box(look(GetParam(), box_of(kHalf_m, {3, 2, 2}), points, {}), kHalf_m, points, 2000);
}

/// Of triangles of 0.22 mm², 3,000 are within reach of a particle at a face: no list has capacity for so
/// many.
TEST_P(BodyWallsOn, SeeOneSideOfABoxOfMoreTrianglesThanAreListed) {
  std::vector<Vec3f> points;
  for (int k = 0; k < 200; ++k)
    points.push_back({any(-0.02F, 0.02F), any(0.015F, 0.03F), any(-0.02F, 0.02F)});
  expect_one_side_of_a_box(look(GetParam(), box_of(kHalf_m, {90, 60, 75}), points, {}), kHalf_m, points, 180);
}

/// On a ball of 24 x 12 faces, whose normals turn by 15 degrees from one to the next, there is one wall, too.
TEST_P(BodyWallsOn, SeeOneSideOfABall) {
  Surface ball;
  constexpr int kRound = 24, kUp = 12;
  constexpr float kRadius_m = 0.02F, kPi_ = 3.14159265F;
  for (int b = 0; b <= kUp; ++b) {
    for (int a = 0; a < kRound; ++a) {
      const float up = kPi_ * static_cast<float>(b) / kUp, round = 2 * kPi_ * static_cast<float>(a) / kRound;
      ball.x_m.push_back(kRadius_m *
                         Vec3f{std::sin(up) * std::cos(round), std::cos(up), std::sin(up) * std::sin(round)});
    }
  }
  for (int b = 0; b < kUp; ++b) {
    for (int a = 0; a < kRound; ++a) {
      const Index p = b * kRound + a, q = b * kRound + (a + 1) % kRound;
      if (b > 0) ball.triangles.push_back({p, q, q + kRound});
      if (b + 1 < kUp) ball.triangles.push_back({p, q + kRound, p + kRound});
    }
  }
  std::vector<Vec3f> points;
  for (int k = 0; k < 2000; ++k)
    points.push_back(any(kRadius_m - 0.009F, kRadius_m + 0.014F) * any_direction());
  const Seen seen = look(GetParam(), ball, points, {});
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(seen.count[i], 1) << i;
    // Half of a face's diagonal is 10.6 degrees at most: its middle is R (1 - cos 10.6) = 0.017 R below.
    EXPECT_NEAR(seen.wall(i, 0).distance_m, length(points[i]) - kRadius_m, 0.02F * kRadius_m) << i;
  }
}

/// The same in all bits. Walls are listed in one order: by side, then as they were found.
void expect_same(const Seen& seen, const Seen& expected, int step) {
  ASSERT_EQ(seen.count, expected.count) << step;
  for (std::size_t i = 0; i < seen.count.size(); ++i) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(seen.count[i]); ++k) {
      const NearWall &a = seen.wall(i, k), &b = expected.wall(i, k);
      EXPECT_TRUE(a.n == b.n && a.distance_m == b.distance_m && a.side == b.side) << step << ' ' << i;
    }
  }
  EXPECT_TRUE(seen.node_v_m_s == expected.node_v_m_s) << step;
}
int walls_in(const Seen& seen) { return std::accumulate(seen.count.begin(), seen.count.end(), 0); }

/// An active set that follows the liquid misses nothing: all that particles see and do is what it is beside
/// walls that were made just now, whose set is chosen for this step. A drop flies over a sheet of 0.6 m,
/// which is 20 cells of walls, by a third of a cell to several cells a step; then the sheet flies and turns
/// under it; then half of it goes, and comes back.
TEST_P(BodyWallsOn, FollowWhatMovesAndWhatIsCut) {
  Surface sheet;
  sheet.add_square({}, {0, 1, 0}, {1, 0, 0}, 0.3F, 30);
  constexpr Vec3f kImpulse[kWallSides] = {{0.1F, 0.2F, 0.3F}, {}};
  constexpr int kDrop = 60;
  DeviceSet devices(GetParam(), 3);
  Walls walls(devices, sheet, kDrop);
  const auto drop_at = [&](Vec3f x) {
    std::vector<Vec3f> drop;
    for (int k = 0; k < kDrop; ++k) drop.push_back(x + 0.02F * any(0, 1) * any_direction());
    return drop;
  };
  int step = 0, seen_walls = 0;
  const auto expect_as_new = [&](const Surface& now, Vec3f drop_m, const std::vector<WallChange>& cuts = {}) {
    const std::vector<Vec3f> drop = drop_at(drop_m);
    Walls others(devices, now, kDrop);
    for (const WallChange& cut : cuts) others.cut(cut);
    const Seen seen = walls.look(drop, kImpulse);
    expect_same(seen, others.look(drop, kImpulse), step++);
    seen_walls += walls_in(seen);
  };
  for (const float pace_m : {0.01F, 0.05F, 0.17F})
    for (float x = -0.35F; x < 0.35F; x += pace_m) expect_as_new(sheet, {x, 0.01F, 0.3F * x});
  EXPECT_GT(seen_walls, 1000);

  seen_walls = 0;
  Surface moved = sheet;
  for (int k = 0; k < 40; ++k) {
    const float turn = k < 20 ? 0.03F * static_cast<float>(k) : 0,
                fly_m = (k < 20 ? 0.002F : 0.025F) * static_cast<float>(k % 20);
    for (std::size_t i = 0; i < moved.x_m.size(); ++i) {
      const Vec3f x = sheet.x_m[i];
      moved.x_m[i] = {x.x * std::cos(turn) - x.y * std::sin(turn) + fly_m,
                      x.x * std::sin(turn) + x.y * std::cos(turn), x.z};
    }
    walls.move_nodes(moved.x_m);
    expect_as_new(moved, {0.25F, std::tan(turn) * (0.25F - fly_m) + 0.01F, 0});
  }
  EXPECT_GT(seen_walls, 1000);
  walls.move_nodes(sheet.x_m);

  // The triangles on one side of x = 0 go, then come back, while the drop rests on them.
  WallChange gone, back;
  for (std::size_t t = 0; t < sheet.triangles.size(); ++t) {
    const Vec3i v = sheet.triangles[t];
    if (sheet.x_m[static_cast<std::size_t>(v.x)].x < -0.001F) continue;
    gone.triangles.push_back({static_cast<Index>(t), {0, 0, 0}});
    back.triangles.push_back({static_cast<Index>(t), {v.x, v.y, v.z}});
  }
  const Vec3f above{0.05F, 0.01F, 0};
  expect_as_new(sheet, above);
  walls.cut(gone);
  seen_walls = 0;
  expect_as_new(sheet, above, {gone});
  EXPECT_EQ(seen_walls, 0);
  walls.cut(back);
  expect_as_new(sheet, above, {gone, back});
  EXPECT_GT(seen_walls, 20);
}

/// A body that blows up, until the end of its frame: particles see the rest of it as before.
TEST_P(BodyWallsOn, SeeWhatIsLeftOfOneThatBlowsUp) {
  Surface sheet;
  sheet.add_square({}, {0, 1, 0}, {1, 0, 0}, 0.3F, 30);
  constexpr Vec3f kImpulse[kWallSides] = {{0.1F, 0.2F, 0.3F}, {}};
  std::vector<Vec3f> drop;
  for (int k = 0; k < 60; ++k) drop.push_back(Vec3f{0.2F, 0.01F, 0.2F} + 0.02F * any(0, 1) * any_direction());
  const Seen whole = look(GetParam(), sheet, drop, kImpulse);
  ASSERT_GT(walls_in(whole), 20);
  constexpr float kInfinite = std::numeric_limits<float>::infinity();
  for (const float far : {1e6F, 1e12F, 3e38F, kInfinite, -kInfinite, std::nanf("")}) {
    DeviceSet devices(GetParam(), 3);
    Walls walls(devices, sheet, static_cast<Index>(drop.size()));
    std::vector<Vec3f> moved = sheet.x_m;
    moved[0] = {far, 0, -far};  // at (-0.3, 0, -0.3)
    walls.move_nodes(moved);
    const Seen seen = walls.look(drop, kImpulse);
    EXPECT_EQ(seen.count, whole.count) << far;
  }
}

/// Where the liquid is on several devices, all of the surface is active: particles see the same.
TEST(BodyWalls, SeeTheSameWhereAllIsActive) {
  Surface sheet;
  sheet.add_square({}, {0, 1, 0}, {1, 0, 0}, 0.3F, 30);
  constexpr Vec3f kImpulse[kWallSides] = {{0.1F, 0.2F, 0.3F}, {}};
  DeviceSet devices("cpu:2", 3);
  std::vector<Vec3f> points;
  for (int k = 0; k < 50; ++k)
    points.push_back({0.01F * static_cast<float>(k % 7), 0.008F, 0.005F * static_cast<float>(k)});
  Walls near(devices, sheet, 50), whole(devices, sheet, 50, 2);
  const Seen seen = near.look(points, kImpulse);
  expect_same(seen, whole.look(points, kImpulse), 0);
  EXPECT_GT(walls_in(seen), 30);
}

}  // namespace
}  // namespace tactus
