#include "tactus/reconstruct/surface_smoothing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

#include "support/device_sets.h"
#include "tactus/base/error.h"

namespace tactus {
namespace {

/// -1 to 1, the same everywhere.
float noise(std::size_t i, std::uint32_t channel) {
  std::uint32_t h = static_cast<std::uint32_t>(i) * 2654435761U + channel * 40503U;
  h = (h ^ (h >> 15)) * 2246822519U;
  h = (h ^ (h >> 13)) * 3266489917U;
  return static_cast<float>((h ^ (h >> 16)) & 0xFFFFU) / 32767.5F - 1;
}

TriangleMesh noisy(TriangleMesh mesh, float amplitude_m) {
  for (std::size_t i = 0; i < mesh.positions_m.size(); ++i)
    mesh.positions_m[i] += amplitude_m * Vec3f{noise(i, 0), noise(i, 1), noise(i, 2)};
  return mesh;
}

/// The cube [-1, 1]^3, n x n squares a face, closed.
TriangleMesh cube(Index n) {
  TriangleMesh mesh;
  std::map<std::array<Index, 3>, Index> known;
  const auto vertex = [&](std::array<Index, 3> at) {
    const auto [found, added] = known.try_emplace(at, static_cast<Index>(mesh.positions_m.size()));
    if (added) {
      const float step = 2.F / static_cast<float>(n);
      mesh.positions_m.push_back({step * static_cast<float>(at[0]) - 1, step * static_cast<float>(at[1]) - 1,
                                  step * static_cast<float>(at[2]) - 1});
    }
    return found->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const bool high : {false, true}) {
      for (Index i = 0; i < n; ++i) {
        for (Index j = 0; j < n; ++j) {
          const auto at = [&](Index di, Index dj) {
            std::array<Index, 3> p{};
            p[axis] = high ? n : 0;
            p[(axis + 1) % 3] = i + di;
            p[(axis + 2) % 3] = j + dj;
            return vertex(p);
          };
          const std::array<Index, 4> q{at(0, 0), at(1, 0), at(1, 1), at(0, 1)};
          if (high) {
            mesh.triangles.push_back({q[0], q[1], q[2]});
            mesh.triangles.push_back({q[0], q[2], q[3]});
          } else {
            mesh.triangles.push_back({q[0], q[2], q[1]});
            mesh.triangles.push_back({q[0], q[3], q[2]});
          }
        }
      }
    }
  }
  return mesh;
}

std::vector<Vec3f> smoothed(const TriangleMesh& mesh, float edge_m, int steps,
                            const std::string& devices = "cpu", std::uint64_t seed = 1) {
  DeviceSet set(devices, seed);
  ExecContext& ctx = set.context(0);
  // Capacity for more than there is, as in a hull.
  const auto vertices = static_cast<Index>(mesh.positions_m.size()),
             triangles = static_cast<Index>(mesh.triangles.size());
  Buffer<Vec3f> positions(set.device(0), vertices + 100);
  Buffer<Vec3i> indices(set.device(0), triangles + 77);
  std::vector<Vec3i> corners;
  for (const auto& [a, b, c] : mesh.triangles) corners.push_back({a, b, c});
  ctx.upload(std::span<const Vec3f>(mesh.positions_m), positions.view().part(0, vertices));
  ctx.upload(std::span<const Vec3i>(corners), indices.view().part(0, triangles));
  const Buffer<Index> counts = to_device(ctx, std::vector<Index>{vertices, triangles});
  const View<const Index> count = counts.const_view();
  SurfaceSmoothing smoothing(set.device(0), positions.size(), indices.size());
  MeshView out{};
  for (int frame = 0; frame < 2; ++frame)  // the second must not depend on the first
    out = smoothing.smooth(ctx,
                           {positions.view(),
                            indices.view(),
                            {count.part(0, 1), positions.size()},
                            {count.part(1, 1), indices.size()},
                            {}},
                           edge_m, steps);
  return to_host(ctx, out.positions_m.part(0, vertices));
}

double rms(const std::vector<Vec3f>& points, const std::function<double(Vec3d)>& distance) {
  double sum = 0;
  for (const Vec3f p : points) sum += sqr(distance(vec_cast<double>(p)));
  return std::sqrt(sum / static_cast<double>(points.size()));
}
double relative_volume(const TriangleMesh& mesh, const std::vector<Vec3f>& points) {
  return volume_m3({points, {}, mesh.triangles}) / volume_m3(mesh);
}

class Smoothing : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(Smoothing);

TEST_P(Smoothing, SameBitsAsOneCpu) {
  const TriangleMesh mesh = noisy(cube(20), 0.01F);
  EXPECT_EQ(smoothed(mesh, 0.1F, 3, GetParam(), 5), smoothed(mesh, 0.1F, 3));
}

TEST(Smoothing, ASphereLosesItsNoiseAndKeepsItsVolume) {
  // Edges of about 0.05 m, noise of 0.01 m in each axis: 0.0058 RMS along the normal. A move to the mean of
  // the planes through the centroids leaves 0.43 of it (the vertex itself counts 1/3, six neighbours 1/9
  // each) when the planes do not lean; they do, so half is asked of one step, and 0.38, a mean over seven, of
  // five.
  TriangleMesh clean = cube(32);
  for (Vec3f& p : clean.positions_m) p = Vec3f{0.3F, -2, 5} + normalized(p);
  const TriangleMesh mesh = noisy(clean, 0.01F);
  const auto off = [](Vec3d p) { return length(p - Vec3d{0.3, -2, 5}) - 1; };
  const double before = rms(mesh.positions_m, off);
  const std::vector<Vec3f> once = smoothed(mesh, 0.05F, 1), often = smoothed(mesh, 0.05F, 5);
  EXPECT_LT(rms(often, off), 0.38 * before);
  EXPECT_LT(rms(once, off), 0.75 * before);
  EXPECT_LT(rms(often, off), 0.75 * rms(once, off));
  // What the header states; 1e-7 of rounding a term, 12288 of them in one tree, twice to first order.
  EXPECT_NEAR(relative_volume(mesh, once), 1, 1e-4);
  EXPECT_NEAR(relative_volume(mesh, often), 1, 1e-4);
}

TEST(Smoothing, ABoxKeepsItsEdges) {
  constexpr Index kSquares = 30;
  constexpr double kEdge = 2.0 / kSquares;
  const TriangleMesh clean = cube(kSquares), mesh = noisy(clean, 0.1F * static_cast<float>(kEdge));
  const std::vector<Vec3f> points = smoothed(mesh, static_cast<float>(kEdge), 5);
  const auto from_box = [](Vec3d p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) - 1; };
  EXPECT_LT(rms(points, from_box), 0.5 * rms(mesh.positions_m, from_box));
  EXPECT_NEAR(relative_volume(mesh, points), 1, 1e-4);
  // Vertices of the edges, not their ends: a mean over the ring would pull them in by a quarter of the
  // squares beside them on both faces, 0.35 kEdge, at the first of its steps.
  double off = 0;
  int count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    int on = 0;
    for (int axis = 0; axis < 3; ++axis) on += abs(clean.positions_m[i][axis]) > 0.999F ? 1 : 0;
    if (on != 2) continue;
    for (int axis = 0; axis < 3; ++axis) {
      if (abs(clean.positions_m[i][axis]) > 0.999F) off += sqr(static_cast<double>(abs(points[i][axis])) - 1);
    }
    ++count;
  }
  EXPECT_EQ(count, 12 * (kSquares - 1));
  EXPECT_LT(std::sqrt(off / count), 0.1 * kEdge);
}

TEST(Smoothing, RefusesWhatItCannotUse) {
  const TriangleMesh mesh = cube(2);
  EXPECT_THROW(smoothed(mesh, 0.1F, 0), Error);
  EXPECT_THROW(smoothed(mesh, 0, 1), Error);
}

}  // namespace
}  // namespace tactus
