/// Bodies that many strokes cut, each through the cuts of the others.
#include <gtest/gtest.h>

#include <cstdio>
#include <random>
#include <string>

#include "support/filmed_world.h"
#include "tactus/io/scene_file.h"
#include "tactus/sim/body/body_cuts.h"
#include "tactus/sim/body/slab_points.h"

namespace tactus {
namespace {

constexpr int kStrokes = 15, kFrames = 14;

/// Straight strokes of 0.1 s through a cube of 0.16 m, near its middle, that overlap in time.
std::string strokes() {
  std::mt19937 random(7);
  const auto uniform = [&] { return 2 * static_cast<double>(random()) / 4294967296.0 - 1; };
  const auto direction = [&] { return normalized(Vec3d{uniform(), uniform(), uniform()}, Vec3d{1, 0, 0}); };
  std::string text = "blades:\n";
  for (int k = 0; k < kStrokes; ++k) {
    const Vec3d along = direction(), way = normalized(cross(along, direction()), Vec3d{0, 1, 0});
    const Vec3d begin = 0.05 * direction() - 0.15 * way, from = begin - 0.15 * along,
                to = begin + 0.15 * along, moved = 0.3 * way;
    const double at_s = (2 + k % 8) / 30.0;
    char line[400];
    std::snprintf(
        line, sizeof line,
        "  - {name: b%d, from_m: [%.4f, %.4f, %.4f], to_m: [%.4f, %.4f, %.4f], path: [{time_s: %.4f}, "
        "{time_s: %.4f, displacement_m: [%.4f, %.4f, %.4f]}]}\n",
        k, from.x, from.y, from.z, to.x, to.y, to.z, at_s, at_s + 0.1, moved.x, moved.y, moved.z);
    text += line;
  }
  return text;
}

std::string cube(const char* gravity) {
  return std::string("source: {kind: none}\ngravity_m_s2: ") + gravity + R"(
bodies:
  - name: cube
    cuttable: true
    shape: {kind: box, size_m: [0.16, 0.16, 0.16]}
    spacing_m: 0.02
    material: {model: tled, young_modulus_pa: 20000}
)" + strokes();
}

/// Points of a body that touch and move with a node that has no mass.
int points_without_mass(test::FilmedWorld& simulation) {
  SoftBody& body = *simulation.bodies()[0];
  const CubeLattice& lattice = body.cuts()->cutter().lattice().lattice();
  int found = 0;
  for (const EmbeddedPoint& point : to_host(simulation.context(), body.points().points(0).table().points))
    for (int k = 0; k < 8; ++k)
      found += point.weight[k] != 0 && !(lattice.node_mass_kg[static_cast<std::size_t>(point.node[k])] > 0);
  return found;
}

/// A cube that floats at rest, and that strokes cut into more than a hundred parts, stays at rest: nothing
/// presses the parts apart. Where strokes bend a wall within a cube, samples of the distance to it are off by
/// up to 0.06 spacings. One point that contact moves by 0.05 spacings strains its cube by about
/// E h (0.05 h)^2 / 2 = 2e-4 J, and some thousand points did: 1e-3 J, and the body blew up. Rounding gives
/// 1e-8 J; the bound is a hundredth of one point's.
TEST(CrossingCuts, ACubeAtRestStaysAtRest) {
  const Scene scene = parse_scene(cube("[0, 0, 0]"), "scenes/x.yaml");
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, {}, {});
  for (int k = 0; k < kFrames; ++k) {
    for (const Notice& n : simulation.step(nullptr, k == 0 ? 0 : 1.0 / 30).notices)
      EXPECT_NE(n.code, "body.blew_up") << "frame " << k << ": " << n.message();
    EXPECT_LT(simulation.bodies()[0]->status().motion.kinetic_J, 2e-6) << "frame " << k;
  }
  EXPECT_GT(simulation.bodies()[0]
                ->cuts()
                ->cutter()
                .closed_volumes_m3(simulation.bodies()[0]->positions_m(simulation.context()))
                .size(),
            100U);
  EXPECT_EQ(points_without_mass(simulation), 0);
}

}  // namespace
}  // namespace tactus
