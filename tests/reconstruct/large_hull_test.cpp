#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "sphere_scene.h"
#include "support/device_sets.h"
#include "tactus/base/error.h"
#include "tactus/reconstruct/hull_part.h"
#include "tactus/reconstruct/mesh_part_kernels.h"
#include "tactus/reconstruct/visual_hull.h"

namespace tactus {
namespace {

using test::kCube, test::ring, test::sphere_silhouettes;

const Vec3d kCenter{0.05, 0.5, -0.02};
constexpr double kRadius_m = 0.1;  // 1/8 of the surface of what fills the box, so that 1024^3 takes a second

struct Result {
  TriangleMesh mesh;
  HullReport report;
};

Result sphere_hull(const std::string& devices, Index resolution, Index depth_px = 0, std::uint64_t order = 5,
                   PeerAccess access = PeerAccess::automatic, Index tolerated = 0) {
  DeviceSet set(devices, order, access);
  const std::vector<Camera> cameras = ring(6);
  std::vector<Camera> tof;
  std::vector<DepthImage> depths_m;
  if (depth_px > 0) {
    tof = {look_at({0, 0.75, 1.6}, {0, 0.5, 0}, {0, 1, 0}, depth_px, depth_px, depth_px)};
    DepthImage& image = depths_m.emplace_back(depth_px, depth_px);
    const Vec3d to = kCenter - tof[0].center_world();
    for (Index y = 0; y < depth_px; ++y) {
      for (Index x = 0; x < depth_px; ++x) {
        const double along = dot(to, pixel_ray_world(tof[0], x, y));
        const double half2 = kRadius_m * kRadius_m - (dot(to, to) - along * along);
        image(x, y) = half2 >= 0 ? static_cast<float>(along - std::sqrt(half2)) : 0.F;
      }
    }
  }
  HullOptions options{kCube, resolution};
  options.tolerated_views = tolerated;
  VisualHull hull(set, cameras, options, tof);
  // The last frame counts; the one before must neither change it nor be read too late.
  for (const double radius_m : {2 * kRadius_m, kRadius_m}) {
    hull.upload(sphere_silhouettes(cameras, kCenter, radius_m), depths_m);
    hull.reconstruct();
  }
  Result result{hull.download(), hull.report()};
  EXPECT_FALSE(result.report.overflow.has_value());
  EXPECT_EQ(result.report.depth, "");
  return result;
}

TEST(LargeHull, SphereIsAClosedManifoldUpTo1024) {
  double volume_at_512 = 0;
  for (const Index n : {512, 1024}) {
    const Result r = sphere_hull("cpu", n);
    const MeshTopology t = topology(r.mesh);
    EXPECT_TRUE(t.closed_manifold()) << n;
    EXPECT_EQ(t.euler, 2) << n;
    const double volume = volume_m3(r.mesh);
    // Chords lose (h/r)^2/4 of the volume: 1e-4 at 512. Vertices lie on the outline of the pixels to the
    // bisection's 1/8 of a step, at steps of about a pixel: far below 1e-3 of the volume at both.
    if (n == 512) volume_at_512 = volume;
    EXPECT_NEAR(volume / volume_at_512, 1, 2e-3);
    // Cost follows the surface: active are the bricks within a shell around it, as thick as a brick's
    // diagonal and the four pixels that its outline and bilinear samples take part in (1.7 m / 288 px).
    const double pixel = 1.7 / 288 * n, shell = 8 * std::numbers::sqrt3 + 4 * pixel;
    const double area = 4 * std::numbers::pi * (kRadius_m * n) * (kRadius_m * n);
    EXPECT_LT(r.report.active_bricks, area * shell / 512) << n;
  }
}

TEST(LargeHull, DepthCorrectedSphereIsAClosedManifoldAt1024) {
  const Result plain = sphere_hull("cpu", 1024), deep = sphere_hull("cpu", 1024, 200);
  EXPECT_TRUE(topology(deep.mesh).closed_manifold());
  EXPECT_LT(volume_m3(deep.mesh), volume_m3(plain.mesh));
  const double sphere = 4.0 / 3 * std::numbers::pi * kRadius_m * kRadius_m * kRadius_m;
  // Half a pixel (1.5 m / 288 px / 2 = 2.6 mm) in the radius of 100 mm: 8 %.
  EXPECT_GT(volume_m3(deep.mesh), 0.92 * sphere);
}

class LargeHullOn : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(LargeHullOn);

TEST_P(LargeHullOn, SameBitsAsOneCpu) {
  for (const Index depth_px : {0, 100}) {
    const Result expected = sphere_hull("cpu", 512, depth_px), got = sphere_hull(GetParam(), 512, depth_px);
    ASSERT_GT(expected.mesh.triangles.size(), 50'000U);
    // Not EXPECT_EQ: a difference would be printed, all of it.
    EXPECT_TRUE(got.mesh.triangles == expected.mesh.triangles);
    EXPECT_TRUE(got.mesh.positions_m == expected.mesh.positions_m);
    EXPECT_EQ(got.report.active_bricks, expected.report.active_bricks);
  }
}

/// Virtual devices run their queues in an order that the seed chooses.
TEST(LargeHull, SameBitsOnAnyNumberOfDevicesInAnyOrder) {
  for (const Index depth_px : {0, 100}) {
    for (const Index tolerated : {0, 1}) {
      const Result expected = sphere_hull("cpu", 150, depth_px, 0, PeerAccess::automatic, tolerated);
      ASSERT_GT(expected.mesh.triangles.size(), 4000U);
      for (const char* devices : {"cpu:2", "cpu:4", "cpu:7"}) {
        for (const PeerAccess access : {PeerAccess::direct, PeerAccess::staged}) {
          for (const std::uint64_t order : {0U, 1U, 2U}) {
            const Result got = sphere_hull(devices, 150, depth_px, order, access, tolerated);
            EXPECT_TRUE(got.mesh.triangles == expected.mesh.triangles) << devices << ' ' << order;
            EXPECT_TRUE(got.mesh.positions_m == expected.mesh.positions_m) << devices << ' ' << order;
            EXPECT_EQ(got.report.active_bricks, expected.report.active_bricks) << devices;
          }
        }
      }
    }
  }
}

/// 4 times as much from one resolution to the next is surface, 8 times would be volume.
TEST(LargeHull, MemoryFollowsTheSurface) {
  DeviceSet set("cpu");
  const std::vector<Camera> cameras = ring(6);
  for (const bool depth : {false, true}) {
    const std::vector<Camera> tof(depth ? 1 : 0, cameras.front());
    const auto bytes_at = [&](Index n) {
      return static_cast<double>(VisualHull(set, cameras, {kCube, n}, tof).memory_bytes());
    };
    // What does not grow, masks and images, lowers the factors of the first.
    const double at_256 = bytes_at(256), at_512 = bytes_at(512), at_1024 = bytes_at(1024);
    for (const double factor : {at_512 / at_256, at_1024 / at_512}) {
      EXPECT_GT(factor, 3.5) << depth;
      // The share of what is kept of empty space, 8 bytes a tile of 8192 nodes and 4 to 8 a block of 32768,
      // is 1.3e-3 bytes a node: 1.4 MB of the 500 MB at 1024. It grows by 8: 4 (1 + 1.4/500) = 4.02.
      EXPECT_LT(factor, 4.05) << depth;
    }
    EXPECT_LT(at_1024, 700e6) << depth;
  }
}

TEST(LargeHull, WhatDoesNotFitIsRefusedWithWhatItWouldNeed) {
  DeviceSet set("cpu");
  const std::vector<Camera> cameras = ring(2);
  try {
    const VisualHull hull(set, cameras, {kCube, 100'000});
    FAIL() << "was not refused";
  } catch (const Error& e) {
    const std::string text = e.what();
    EXPECT_TRUE(text.starts_with("resolution 100000 would need ")) << text;
    EXPECT_NE(text.find("TB on cpu, which has "), std::string::npos) << text;
    EXPECT_NE(text.find("choose a lower resolution"), std::string::npos) << text;
  }
}

class Shares : public LargeHullOn {};
TACTUS_INSTANTIATE_DEVICES(Shares);

/// Blocks of 4^3 bricks, and some of them cut off by the grid.
const HullGrid kGrid{{11, 9, 10}, {3, 3, 3}, {88, 72, 80}};

TEST_P(Shares, AreEqualAndHoldTheNeighboursOfTheirBricks) {
  DeviceSet set(GetParam(), 3);
  ExecContext& ctx = set.context(0);
  std::mt19937 random(7);
  std::vector<std::uint32_t> words(static_cast<std::size_t>(kGrid.tile_count()));
  std::vector<Index> tile_first{0}, numbers;
  for (Index tile = 0; tile < kGrid.tile_count(); ++tile) {
    std::uint32_t& word = words[static_cast<std::size_t>(tile)];
    for (int bit = 0; bit < kTileBricks; ++bit) {
      const Index number = tile * kTileBricks + bit;
      if (!kGrid.holds(kGrid.brick_at(number)) || random() % 5 != 0) continue;
      word |= kActiveBit << bit;
      numbers.push_back(number);
    }
    tile_first.push_back(static_cast<Index>(numbers.size()));
  }
  const auto all = static_cast<Index>(numbers.size());
  ASSERT_GT(all, 100);
  const Buffer<std::uint32_t> tiles = to_device(ctx, words);
  const Buffer<Index> first_of_tile = to_device(ctx, tile_first);
  const auto rank_of = [&](Vec3i brick) {
    const Index number = kGrid.tile_of(brick) * kTileBricks + HullGrid::bit_in_tile(brick);
    const auto at = std::lower_bound(numbers.begin(), numbers.end(), number);
    return at != numbers.end() && *at == number ? static_cast<Index>(at - numbers.begin()) : -1;
  };
  for (const Index parts : {1, 2, 3, 7, 64, all + 3}) {
    Index next = 0;
    for (Index part = 0; part < parts; ++part) {
      const Index capacity = part == 1 ? 10 : all;
      Buffer<Index> bricks(ctx.device(), capacity);
      Buffer<PartRange> range(ctx.device(), 1);
      ctx.parallel_for(
          "assign", kGrid.tile_count(),
          AssignSlots{kGrid, part, parts, tiles.view(), first_of_tile.view(), bricks.view(), range.view()});
      const PartRange r = to_host(ctx, range.const_view())[0];
      ASSERT_EQ(r.first, next);
      next += r.own;
      EXPECT_LE(std::abs(r.own * parts - all), parts) << "a share is a brick off at most";
      EXPECT_LE(r.own, r.counted);
      EXPECT_LE(r.counted, r.held);
      ASSERT_LE(r.first + r.held, all);
      EXPECT_EQ(r.ghost_words, 16 * std::max(std::min(r.held, capacity) - r.own, 0));
      const std::vector<Index> slots = to_host(ctx, bricks.const_view());
      for (Index i = 0; i < std::min(r.held, capacity); ++i)
        ASSERT_EQ(slots[static_cast<std::size_t>(i)], numbers[static_cast<std::size_t>(r.first + i)]);
      for (Index i = r.first; i < r.first + r.own; ++i) {
        const Vec3i brick = kGrid.brick_at(numbers[static_cast<std::size_t>(i)]);
        for (const Vec3i step : {Vec3i{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}}) {
          EXPECT_LT(rank_of(brick + step), r.first + r.counted);
          EXPECT_LT(rank_of(brick + 2 * step), r.first + r.held);
        }
      }
    }
    EXPECT_EQ(next, all) << parts;
  }
}

TEST_P(Shares, GhostsComeFromWhoeverOwnsThem) {
  DeviceSet set(GetParam(), 4);
  ExecContext& ctx = set.context(0);
  constexpr Index kParts = 4, kAll = 10, kHeld = 8, kCapacity = 8;
  // Word w of brick i is 100 i + w; shares begin at 0, 3, 6, 8.
  const std::vector<Index> tile_first{0, 4, kAll};
  const Buffer<Index> first_of_tile = to_device(ctx, tile_first);
  std::vector<Buffer<std::uint32_t>> rows;
  for (Index part = 0; part < kParts; ++part) {
    std::vector<std::uint32_t> words(kCapacity * kSignWords, 7777);
    const Index first = share_begin(kAll, part, kParts);
    // Part 2 has capacity for one of its two.
    for (Index i = first; i < share_begin(kAll, part + 1, kParts); ++i) {
      for (Index w = 0; w < kSignWords; ++w)
        words[static_cast<std::size_t>((i - first) * kSignWords + w)] =
            static_cast<std::uint32_t>(100 * i + w);
    }
    if (part == 2) words.resize(kSignWords);
    rows.push_back(to_device(ctx, words));
  }
  const PartRange of_first{0, 3, 5, kHeld, (kCapacity - 3) * kSignWords};
  const Buffer<PartRange> range = to_device(ctx, std::vector<PartRange>{of_first});
  FetchGhosts kernel{{}, 0, kParts, first_of_tile.view(), range.view(), rows[0].view()};
  for (std::size_t p = 0; p < kParts; ++p) kernel.rows[p] = rows[p].const_view();
  ctx.parallel_for("fetch", of_first.ghost_words, kernel);
  const std::vector<std::uint32_t> got = to_host(ctx, rows[0].const_view());
  for (Index i = 0; i < kCapacity; ++i) {
    for (Index w = 0; w < kSignWords; ++w) {
      const bool is_missing = i == 7;
      EXPECT_EQ(got[static_cast<std::size_t>(i * kSignWords + w)],
                is_missing ? 0U : static_cast<std::uint32_t>(100 * i + w))
          << i;
    }
  }
}

class Regions : public LargeHullOn {};
TACTUS_INSTANTIATE_DEVICES(Regions);

/// Which bricks are active and which inside, with regions sorted before blocks or without.
std::vector<std::uint32_t> sorted_bricks(DeviceSet& set, HullPlan plan, bool with_regions,
                                         std::span<const BitMask> masks) {
  const Vec3i n = plan.grid.regions();
  plan.regions = with_regions ? n.x * n.y * n.z : 0;
  ExecContext& ctx = set.context(0);
  HullPart part;
  part.allocate(ctx, plan, {});
  std::vector<std::uint32_t> raw(static_cast<std::size_t>(part.masks.raw.size()));
  for (std::size_t c = 0; c < masks.size(); ++c)
    std::copy(masks[c].words.begin(), masks[c].words.end(),
              raw.begin() + plan.silhouettes.cameras[c].raw_begin);
  ctx.upload(std::span<const std::uint32_t>(raw), part.masks.raw.view());
  for (int frame = 0; frame < 2; ++frame) {
    ctx.fill_bytes(part.tiles.view(), 0xAA);  // all words are written anew
    part.carve(ctx, plan);
  }
  return to_host(ctx, part.tiles.const_view());
}

TEST_P(Regions, SortedBeforeTheirBlocksLeaveTheSameBricks) {
  DeviceSet set(GetParam(), 6);
  const std::vector<Camera> cameras = ring(6);
  HullOptions options{kCube, 200};
  for (const Index tolerated : {0, 2}) {
    options.tolerated_views = tolerated;
    const HullPlan plan = plan_hull(cameras, options, {});
    EXPECT_EQ(plan.regions, 0) << "a small grid has none";
    // A ball in one region, one across several, nothing, and all of the box.
    for (const double radius_m : {0.03, 0.3, 0.0, 10.0}) {
      const std::vector<BitMask> masks = sphere_silhouettes(cameras, kCenter, radius_m);
      const std::vector<std::uint32_t> plain = sorted_bricks(set, plan, false, masks),
                                       sorted = sorted_bricks(set, plan, true, masks);
      EXPECT_TRUE(sorted == plain) << radius_m << ' ' << tolerated;
      const bool any = std::any_of(plain.begin(), plain.end(), [](std::uint32_t word) { return word != 0; });
      EXPECT_EQ(any, radius_m > 0);
    }
  }
  EXPECT_GT(plan_hull(cameras, {kCube, 1024}, {}).regions, 0);
}

class Numbering : public LargeHullOn {};
TACTUS_INSTANTIATE_DEVICES(Numbering);

TEST_P(Numbering, IsTheSumOfAllBefore) {
  DeviceSet set(GetParam(), 5);
  ExecContext& ctx = set.context(0);
  std::mt19937 random(3);
  // Nothing, one, a piece of the kernel, several and a rest; and more than there is capacity for.
  for (const Index counted : {0, 1, 700, NumberBricks::kPiece, 3 * NumberBricks::kPiece + 77}) {
    for (const Index missing : {0, 5}) {
      const Index capacity = std::max(counted - missing, 1), own = counted / 2;
      std::vector<std::uint64_t> counts(static_cast<std::size_t>(capacity + 1)), expected(counts.size());
      for (std::uint64_t& count : counts)
        count = MeshCount::of(static_cast<Index>(random() % 300), static_cast<Index>(random() % 600)).packed;
      Buffer<std::uint64_t> mesh_start = to_device(ctx, counts);
      const Buffer<PartRange> range =
          to_device(ctx, std::vector<PartRange>{{3, own, counted, counted + 9, 0}});
      Buffer<PartCounts> found(ctx.device(), 1);
      ctx.parallel_for("number", 1, NumberBricks{range.view(), mesh_start.view(), found.view()});
      const std::vector<std::uint64_t> starts = to_host(ctx, mesh_start.const_view());
      std::uint64_t sum = 0;
      for (Index i = 0; i <= std::min(counted, capacity); ++i) {
        ASSERT_EQ(starts[static_cast<std::size_t>(i)], sum) << i << " of " << counted;
        sum += counts[static_cast<std::size_t>(i)];
      }
      const PartCounts c = to_host(ctx, found.const_view())[0];
      const MeshCount at_own{starts[static_cast<std::size_t>(std::min(own, capacity))]};
      EXPECT_EQ(c.vertices, at_own.vertices());
      EXPECT_EQ(c.triangles, at_own.triangles());
      EXPECT_EQ(c.active_bricks, own);
      EXPECT_EQ(c.held_bricks, counted + 9);
    }
  }
}

}  // namespace
}  // namespace tactus
