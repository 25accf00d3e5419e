// A body whose surface cuts cubes, in bending: half a torus that hangs by one foot.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "support/filmed_world.h"
#include "support/probe_readings.h"
#include "tactus/rig/synthetic/synthetic_source.h"

namespace tactus {
namespace {

constexpr double kRing = 0.05, kTube = 0.015;

/// Half a torus round z, y >= 0, closed by two flat feet at y = 0.
TriangleMesh half_torus() {
  constexpr Index kAlong = 160, kRound = 80;
  TriangleMesh mesh;
  for (Index i = 0; i <= kAlong; ++i) {
    const double a = M_PI * i / kAlong;
    for (Index j = 0; j < kRound; ++j) {
      const double b = 2 * M_PI * j / kRound, r = kRing + kTube * std::cos(b);
      mesh.positions_m.push_back(
          vec_cast<float>(Vec3d{r * std::cos(a), i == kAlong ? 0 : r * std::sin(a), kTube * std::sin(b)}));
    }
  }
  const auto vertex = [](Index i, Index j) { return i * kRound + j % kRound; };
  for (Index i = 0; i < kAlong; ++i) {
    for (Index j = 0; j < kRound; ++j) {
      mesh.triangles.push_back({vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1)});
      mesh.triangles.push_back({vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1)});
    }
  }
  for (const Index end : {Index{0}, kAlong}) {
    const auto middle = static_cast<Index>(mesh.positions_m.size());
    mesh.positions_m.push_back({static_cast<float>(end == 0 ? kRing : -kRing), 0, 0});
    for (Index j = 0; j < kRound; ++j) {
      const Index a = vertex(end, j), b = vertex(end, j + 1);
      mesh.triangles.push_back(end == 0 ? std::array<Index, 3>{middle, a, b}
                                        : std::array<Index, 3>{middle, b, a});
    }
  }
  return mesh;
}

/// By how much the free foot moves under the weight.
Vec3d sag_m(double spacing_m, Vec3d gravity_m_s2) {
  Scene scene;
  scene.reconstruction.resolution = 16;
  scene.gravity_m_s2 = gravity_m_s2;
  scene.frame.start = FrameStart::settled;
  BodyDescription hook;
  hook.name = "hook";
  hook.shape.kind = ShapeKind::mesh;
  hook.spacing_m = spacing_m;
  hook.contact = false;
  hook.material.model = TissueModel::tled;
  hook.material.law = MaterialLaw::isochoric_neo_hookean;
  hook.material.young_modulus_pa = 3e6;
  hook.material.poisson_ratio = 0.4;
  FixedRegion foot;
  foot.where.kind = RegionKind::box;
  foot.where.box = {{0, -1, -1}, {1, 1e-6, 1}};
  hook.fixed.push_back(foot);
  scene.bodies = {hook};
  scene.probes.push_back({"foot", "hook", CoordinateFrame::world, {-kRing, 1e-6, 0}});
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {.meshes = {{"hook", half_torus()}}});
  const StepReport report = simulation.step(nullptr, 0);
  EXPECT_EQ(text_of(report.notices), "");
  return vec_cast<double>(probe_positions_m(simulation)[0]) - Vec3d{-kRing, 1e-6, 0};
}

/// CalculiX 2.20, 8,707 quadratic tetrahedra (gmsh, edges of 4 mm): the mean of the free foot moves by
/// (0.8345, -2.2772, 0) mm in plane and by -3.1840 mm across (with 2,761 tetrahedra 0.8342 and -2.2783).
/// Spacings divide the body's height, so that its feet lie on planes of nodes: where they don't, the held
/// foot is longer or shorter by up to a spacing, which is as large an error.
///
/// A cut cube has one strain, that of its centre. Some of what it holds is handed to the cubes below
/// (cube_parts.h), not all: lever is left, h^2 / 12 of second moment per area twice over, times what is not
/// handed on. Found: a third of (h / R)^2.
TEST(OutsiderHook, HangsAsInCalculiX) {
  const bool all = std::getenv("TACTUS_LONG_TESTS") != nullptr;
  for (const double h_mm : {65 / 6.0, 65 / 8.0, 6.5, 5.0, 3.25, 2.5}) {
    if (!all && h_mm < 5) continue;
    const double in_plane = sag_m(1e-3 * h_mm, {0, -9.81, 0}).y / -2.2772e-3 - 1,
                 across = sag_m(1e-3 * h_mm, {0, 0, -9.81}).z / -3.1840e-3 - 1;
    std::printf("spacing %.2f mm: sinks by %+.1f %% in plane, %+.1f %% across\n", h_mm, 100 * in_plane,
                100 * across);
    const double most = 0.36 * sqr(1e-3 * h_mm / kTube) + 0.01;  // of the mesh, and of what settles
    for (const double error : {in_plane, across}) {
      EXPECT_GT(error, -most) << h_mm;
      EXPECT_LT(error, 0.01) << h_mm;
    }
  }
}

}  // namespace
}  // namespace tactus
