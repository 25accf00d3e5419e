#include "tactus/reconstruct/visual_hull.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <sstream>

#include "sphere_scene.h"
#include "support/device_sets.h"
#include "support/masks.h"
#include "support/message_of.h"
#include "tactus/geom/image/mask_growth.h"
#include "tactus/geom/mesh/mesh_view.h"

namespace tactus {
namespace {

using test::make_mask;
using test::message_of;

using test::kCube, test::ring, test::sphere_silhouette, test::sphere_silhouettes;

/// Blobs of random size and place: silhouettes that no real object casts.
std::vector<BitMask> random_silhouettes(const std::vector<Camera>& cameras, unsigned seed) {
  std::mt19937 random(seed);
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  std::vector<BitMask> masks;
  for (const Camera& c : cameras) {
    struct Disc {
      double x, y, r;
    };
    std::vector<Disc> discs;
    for (int i = 0; i < 12; ++i)
      discs.push_back({uniform(0, c.width_px), uniform(0, c.height_px), uniform(8, 60)});
    masks.push_back(make_mask(c.width_px, c.height_px, [&](Index x, Index y) {
      bool inside = false;
      for (const Disc& d : discs) inside ^= (x - d.x) * (x - d.x) + (y - d.y) * (y - d.y) < d.r * d.r;
      return inside;
    }));
  }
  return masks;
}

TriangleMesh hull_of(const std::string& devices, const std::vector<Camera>& cameras,
                     const std::vector<BitMask>& masks, Index resolution, std::uint64_t seed = 1,
                     PeerAccess access = PeerAccess::automatic) {
  DeviceSet set(devices, seed, access);
  VisualHull hull(set, cameras, {kCube, resolution});
  for (int frame = 0; frame < 3;
       ++frame) {  // later frames must not depend on earlier ones (nor on how they are replayed)
    hull.upload(frame == 1 ? std::vector<BitMask>(masks.size()) : masks);
    hull.reconstruct();
  }
  EXPECT_FALSE(hull.report().overflow.has_value());
  return hull.download();
}

class Hull : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(Hull);

TEST_P(Hull, SameBitsAsOneCpu) {
  const std::vector<Camera> cameras = ring(5);
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const std::vector<BitMask> masks = random_silhouettes(cameras, seed);
    for (const Index resolution : {20, 67}) {
      const TriangleMesh expected = hull_of("cpu", cameras, masks, resolution);
      const TriangleMesh got = hull_of(GetParam(), cameras, masks, resolution, seed);
      ASSERT_GT(expected.triangles.size(), 100U);
      EXPECT_EQ(got.triangles, expected.triangles);
      EXPECT_EQ(got.positions_m, expected.positions_m);
      const TriangleMesh staged = hull_of(GetParam(), cameras, masks, resolution, seed, PeerAccess::staged);
      EXPECT_EQ(staged.triangles, expected.triangles);
      EXPECT_EQ(staged.positions_m, expected.positions_m);
    }
  }
}

TEST(Hull, RandomSilhouettesGiveClosedOrientedManifolds) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const std::vector<Camera> cameras = ring(2 + static_cast<int>(seed % 4));
    const TriangleMesh mesh = hull_of("cpu", cameras, random_silhouettes(cameras, seed), 40);
    const MeshTopology t = topology(mesh);
    EXPECT_GT(t.edges, 100) << seed;
    EXPECT_EQ(t.boundary_edges, 0) << seed;
    EXPECT_EQ(t.nonmanifold_edges, 0) << seed;
    EXPECT_GT(volume_m3(mesh), 0) << seed;
  }
}

TEST(GrowMask, IsTheSetOfPixelsWithinSoManySteps) {
  const Index width = 70, height = 9;
  const BitMask mask =
      make_mask(width, height, [](Index x, Index y) { return (x * 7 + y * 13) % 41 == 0 || x == 69; });
  for (const int steps : {0, 1, 3}) {
    BitMask grown;
    grow_mask(mask, steps, grown);
    const BitMask expected = make_mask(width, height, [&](Index x, Index y) {
      for (Index v = 0; v < height; ++v) {
        for (Index u = 0; u < width; ++u) {
          if (mask(u, v) && std::abs(u - x) + std::abs(v - y) <= steps) return true;
        }
      }
      return false;
    });
    EXPECT_EQ(grown, expected) << steps;
  }
}

/// Independent program: the sign of every node by a plain double-precision loop, volume by counting voxel
/// centres.
TEST(Hull, SphereHullHasTheVolumeOfThePlainLoop) {
  const std::vector<Camera> cameras = ring(8);
  const std::vector<BitMask> masks = sphere_silhouettes(cameras, {0.05, 0.5, -0.02}, 0.25);
  const TriangleMesh mesh = hull_of("cpu", cameras, masks, 64);
  const MeshTopology t = topology(mesh);
  EXPECT_TRUE(t.closed_manifold());
  EXPECT_EQ(t.euler, 2);
  constexpr int n = 128;
  std::int64_t inside = 0;
  for (int k = 0; k < n * n * n; ++k) {
    const Vec3d p{(k % n + 0.5) / n - 0.5, (k / n % n + 0.5) / n, (k / n / n + 0.5) / n - 0.5};
    bool in = true;
    for (std::size_t c = 0; c < cameras.size() && in; ++c) {
      const Pixel px = project(cameras[c], p);
      const auto u = static_cast<Index>(std::lround(px.u_px)), v = static_cast<Index>(std::lround(px.v_px));
      const bool seen = u >= 0 && u < cameras[c].width_px && v >= 0 && v < cameras[c].height_px;
      in = !seen || masks[c](u, v);
    }
    inside += in ? 1 : 0;
  }
  const double voxel_count_volume = static_cast<double>(inside) / (n * n * n);
  // Chords instead of arcs lose about (h/r)^2/4 = 0.1 % at h = 1/64; the two pixel rules (nearest, bilinear)
  // differ by at most half a pixel = 3 mm of r = 250 mm in a few places: 1 %.
  EXPECT_NEAR(volume_m3(mesh) / voxel_count_volume, 1.0, 0.01);
  // The hull of 8 cones contains the sphere (but for the pixel rule) and is not much larger.
  const double sphere = 4.0 / 3 * std::numbers::pi * std::pow(0.25, 3);
  EXPECT_GT(volume_m3(mesh), 0.99 * sphere);
  EXPECT_LT(volume_m3(mesh), 1.15 * sphere);
}

/// Every vertex of a hull lies on the boundary of the hull: within a pixel of a silhouette's border for some
/// camera.
TEST(Hull, VerticesLieOnSilhouettes) {
  const std::vector<Camera> cameras = ring(6);
  const Vec3d center{0, 0.45, 0.03};
  const double radius = 0.3;
  const TriangleMesh mesh = hull_of("cpu", cameras, sphere_silhouettes(cameras, center, radius), 48);
  for (const Vec3f p : mesh.positions_m) {
    double nearest = 1e9;
    for (const Camera& c : cameras) {
      const Vec3d eye = c.center_world();
      const double miss = length(cross(normalized(vec_cast<double>(p) - eye), center - eye)) - radius;
      nearest = std::min(nearest, std::abs(miss));
    }
    // The mask knows the contour to half a pixel diagonal: 0.71 px * 1.9 m / 288 px = 4.7 mm.
    EXPECT_LT(nearest, 5e-3);
  }
}

TEST(Hull, OutsideTheImageIsNoInformation) {
  // Two cameras; one sees only the left half of the sphere. The other half must stay.
  std::vector<Camera> cameras = ring(4);
  const std::vector<BitMask> whole = sphere_silhouettes(cameras, {0, 0.5, 0}, 0.3);
  const double all = volume_m3(hull_of("cpu", cameras, whole, 48));
  cameras[0].width_px = 160;
  std::vector<BitMask> cut = whole;
  cut[0] = sphere_silhouette(cameras[0], {0, 0.5, 0}, 0.3);
  const TriangleMesh mesh = hull_of("cpu", cameras, cut, 48);
  EXPECT_GE(volume_m3(mesh), all - 1e-4);
  EXPECT_TRUE(topology(mesh).closed_manifold());
  // A camera that misses the tick carves nothing: as if it were not there.
  cut[0] = BitMask();
  const double without = volume_m3(hull_of("cpu", cameras, cut, 48));
  const double three =
      volume_m3(hull_of("cpu", {cameras.begin() + 1, cameras.end()}, {whole.begin() + 1, whole.end()}, 48));
  EXPECT_DOUBLE_EQ(without, three);
}

TEST(Hull, BehindTheCameraIsNoInformation) {
  std::vector<Camera> cameras = ring(3);
  const std::vector<BitMask> masks = sphere_silhouettes(cameras, {0, 0.5, 0}, 0.25);
  const double before = volume_m3(hull_of("cpu", cameras, masks, 32));
  std::vector<Camera> more = cameras;
  more.push_back(look_at({3, 0.5, 0}, {5, 0.5, 0}, {0, 1, 0}, 320, 240, 300));
  std::vector<BitMask> more_masks = masks;
  more_masks.emplace_back(320, 240);
  EXPECT_DOUBLE_EQ(volume_m3(hull_of("cpu", more, more_masks, 32)), before);
}

TEST(Hull, BlackMasksGiveNothingAndWhiteOnesTheBox) {
  const std::vector<Camera> cameras = ring(3);
  const std::vector<BitMask> black(3, BitMask(320, 240));
  EXPECT_TRUE(hull_of("cpu", cameras, black, 32).triangles.empty());
  const std::vector<BitMask> white(3);
  const TriangleMesh box = hull_of("cpu", cameras, white, 32);
  EXPECT_TRUE(topology(box).closed_manifold());
  // The cap stands 1e-3 voxel off the last node: (1 + 2e-3/32)^3, less the rounded rim.
  EXPECT_NEAR(volume_m3(box), 1.0, 3e-3);
}

void apply_remedy(const HullOverflow& overflow, HullOptions& options) {
  Index& option = overflow.option == "max_active_bricks"
                      ? options.max_active_bricks
                      : (overflow.option == "max_vertices" ? options.max_vertices : options.max_triangles);
  ASSERT_EQ(overflow.capacity, option);
  ASSERT_GT(overflow.wanted, option);
  option = overflow.wanted;
}

TEST_P(Hull, HalvesMakeTheSame) {
  const std::vector<Camera> cameras = ring(5);
  const std::vector<BitMask> masks = random_silhouettes(cameras, 2);
  DeviceSet set(GetParam(), 3);
  VisualHull hull(set, cameras, {kCube, 67});
  for (int frame = 0; frame < 3; ++frame) {  // the third is replayed
    hull.upload(masks);
    hull.carve();
    hull.extract();
  }
  const TriangleMesh got = hull.download(), expected = hull_of("cpu", cameras, masks, 67);
  EXPECT_EQ(got.positions_m, expected.positions_m);
  EXPECT_EQ(got.triangles, expected.triangles);
}

TEST_P(Hull, OverflowIsAStatusWithItsRemedy) {
  const std::vector<Camera> cameras = ring(4);
  const std::vector<BitMask> masks = sphere_silhouettes(cameras, {0, 0.5, 0}, 0.3);
  DeviceSet set(GetParam(), 2);
  HullOptions options{kCube, 64};
  options.max_active_bricks = 20;
  options.max_vertices = 500;
  options.max_triangles = 3000;
  std::vector<std::string> remedies;
  for (int attempt = 0; attempt < 4; ++attempt) {
    VisualHull hull(set, cameras, options);
    hull.upload(masks);
    hull.reconstruct();
    const std::optional<HullOverflow> overflow = hull.report().overflow;
    const TriangleMesh mesh = hull.download();
    EXPECT_NO_THROW(topology(mesh));  // no triangle names a vertex that is not there
    // Nor does any on the device, where normals and surfaces read them.
    const MeshView there = hull.mesh();
    for (const Vec3i t : to_host(set.context(0), there.triangles.part(0, hull.report().triangles)))
      ASSERT_TRUE(min(t.x, min(t.y, t.z)) >= 0 && max(t.x, max(t.y, t.z)) < there.positions_m.size());
    if (!overflow) {
      EXPECT_TRUE(topology(mesh).closed_manifold());
      EXPECT_EQ(mesh.positions_m, hull_of("cpu", cameras, masks, 64).positions_m);
      break;
    }
    remedies.push_back(overflow->text());
    apply_remedy(*overflow, options);
  }
  // Each is named once, bricks first: without them the mesh can't be counted.
  ASSERT_EQ(remedies.size(), 3U);
  EXPECT_NE(remedies[0].find("surface bricks, capacity for 20: raise max_active_bricks"), std::string::npos);
  EXPECT_NE(remedies[1].find("vertices, capacity for 500: raise max_vertices"), std::string::npos);
  EXPECT_NE(remedies[2].find("triangles, capacity for 3000: raise max_triangles"), std::string::npos);
}

TEST(Hull, OfNoImagesIsEmptyAndMasksHoldTheirPixels) {
  DeviceSet set("cpu");
  const std::vector<Camera> cameras = ring(2);
  VisualHull hull(set, cameras, {kCube, 32});
  EXPECT_EQ(hull.report().vertices, 0);
  EXPECT_TRUE(hull.download().triangles.empty());
  for (const std::size_t by : {std::size_t{1}, std::size_t{0}}) {
    std::vector<BitMask> masks(2, BitMask(cameras[0].width_px, cameras[0].height_px));
    const std::size_t right = masks[1].words.size();
    masks[1].words.resize(by == 0 ? 3 * right : right - by);
    EXPECT_EQ(message_of([&] { hull.upload(masks); }),
              "camera 'cam1': the silhouette holds " + std::to_string(masks[1].words.size()) +
                  " values, expected " + std::to_string(right) + " for its " +
                  std::to_string(masks[1].width_px) + "x" + std::to_string(masks[1].height_px) + " pixels");
  }
}

TEST(Hull, BadInputIsNamed) {
  DeviceSet set("cpu");
  const std::vector<Camera> cameras = ring(2);
  EXPECT_NE(message_of([&] { VisualHull(set, {}, {kCube, 64}); }).find("no cameras"), std::string::npos);
  EXPECT_NE(message_of([&] {
              VisualHull(set, cameras, {kCube, 0});
            }).find("resolution 0"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              VisualHull(set, cameras, {kCube, -4});
            }).find("resolution -4"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              VisualHull(set, cameras, {kCube, 100'000});
            }).find("would need"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              VisualHull(set, cameras, {kCube, 2'000'000});
            }).find("at most 1048576"),
            std::string::npos);
  HullOptions capacity{kCube, 64};
  capacity.max_vertices = -1;
  EXPECT_NE(message_of([&] { VisualHull(set, cameras, capacity); }).find("max_vertices -1: expected 0 (from"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              VisualHull(set, cameras, {{}, 64});
            }).find("workspace is empty"),
            std::string::npos);
  std::vector<Camera> bad = cameras;
  bad[1].fx_px = std::nan("");
  EXPECT_NE(message_of([&] {
              VisualHull(set, bad, {kCube, 64});
            }).find("camera 'cam1': focal length"),
            std::string::npos);
  VisualHull hull(set, cameras, {kCube, 32});
  EXPECT_NE(message_of([&] {
              hull.upload(std::vector<BitMask>{BitMask(320, 240), BitMask(100, 100)});
            }).find("camera 'cam1': the silhouette has 100x100"),
            std::string::npos);
}

}  // namespace
}  // namespace tactus
