// Whether a point is inside of a surface, next to its edges and corners.
#include <gtest/gtest.h>

#include <cstdio>
#include <random>

#include "contact/contact_scene.h"
#include "tactus/geom/mesh/point_in_mesh.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {
namespace {

/// A closed ball of spikes and dents: every corner of a sphere goes in or out by up to 0.8 of the radius, so
/// edges are sharp, and corners convex, concave and saddles.
TriangleMesh spiky_ball(Index n, float radius_m, unsigned seed) {
  TriangleMesh mesh = test::unit_sphere(n);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> scale(0.2F, 1.8F);
  for (Vec3f& p : mesh.positions_m) p *= radius_m * scale(random);
  return mesh;
}

/// Points near corners, edges and faces. Found: with the side of the plane that is farthest, 1 in 4000 was
/// wrong.
TEST(SideOfPoint, AgreesWithTheWindingNumberNearEdgesAndCorners) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  int wrong = 0, count = 0, inside = 0;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    // Triangles of about a spacing, and of many.
    const float spacing_m = seed % 2 == 0 ? 0.02F : 0.008F;
    const TriangleMesh mesh = spiky_ball(4, 0.05F, seed);
    const PointInMesh truth(mesh);
    RealSurface surface(ctx.device(), test::small_surface(spacing_m));
    const test::DeviceMesh on_device(ctx, mesh);
    surface.update(ctx, on_device.view(), 0.F);
    ctx.synchronize();
    std::mt19937 random(seed);
    std::normal_distribution<float> normal;
    std::uniform_real_distribution<float> uniform;
    const auto direction = [&] { return normalized(Vec3f{normal(random), normal(random), normal(random)}); };
    for (const auto& t : mesh.triangles) {
      const auto corner = [&](std::size_t k) { return mesh.positions_m[static_cast<std::size_t>(t.at(k))]; };
      for (int k = 0; k < 100; ++k) {
        const float u = uniform(random), far_m = 0.5F * spacing_m * uniform(random) * uniform(random);
        const Vec3f on = k % 3 == 0   ? corner(0)
                         : k % 3 == 1 ? corner(0) + u * (corner(1) - corner(0))
                                      : (1.F / 3) * (corner(0) + corner(1) + corner(2));
        const Vec3f p = on + far_m * direction();
        // Distances from one corner to triangles of up to 5 cm differ by rounding, by 5e-9 m. They count as
        // the same when they differ by less than 5e-5 of them: from 1e-4 m on.
        if (truth.distance_m(p) < 1e-4F) continue;
        const bool is_inside = truth.inside(p);
        const SurfaceGap gap = surface.triangles().gap(kAnyComponent, p, p, 2 * spacing_m, {});
        wrong += gap.inside != is_inside ? 1 : 0;
        inside += is_inside ? 1 : 0;
        ++count;
      }
    }
  }
  std::printf("%d of %d points on the wrong side; %d are inside\n", wrong, count, inside);
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace tactus
