/// Frames of several worlds at once: each is submitted before any is waited for.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>

#include "support/device_sets.h"
#include "support/message_of.h"
#include "tactus/base/error.h"
#include "tactus/io/scene_file.h"
#include "tactus/world/device_results.h"
#include "tactus/world/world.h"

namespace tactus {
namespace {

constexpr double kFrame_s = 1.0 / 60;

Scene pressed_slab() {
  return parse_scene(R"(
source: {kind: none}
bodies:
  - name: slab
    shape: {kind: box, size_m: [0.08, 0.04, 0.08]}
    spacing_m: 0.01
    material: {young_modulus_pa: 20000}
    fixed: [{kind: half_space, point_m: [0, -0.019, 0], normal: [0, 1, 0]}]
obstacles:
  - {name: ball, kind: sphere, radius_m: 0.02, held: true, placement: {position_m: [0, 0.06, 0]}}
)",
                     "slab.yaml");
}

/// A world with devices of its own, whose ball goes down at a speed of its own.
struct Pressed {
  Pressed(const std::string& text, double by_m)
      : devices(text), scene(pressed_slab()), world(devices, scene, {}), step_m(by_m) {}
  void move(int frame) {
    const double y_m = std::max(0.06 - step_m * (frame + 1), 0.035);
    world.set_pose("ball", {Mat3d::identity(), {0, y_m, 0}});
  }
  DeviceSet devices;
  Scene scene;
  World world;
  double step_m;
};

class OpenStep : public ::testing::TestWithParam<std::string> {};
TACTUS_INSTANTIATE_DEVICES(OpenStep);

/// The fastest ball goes a spacing in a frame, which takes such a frame several parts.
TEST_P(OpenStep, InterleavedWorldsHaveTheBitsOfLoneOnes) {
  TACTUS_SKIP_WITHOUT_DEVICES(GetParam());
  constexpr std::array kStep_m{0.0005, 0.003, 0.012};
  constexpr int kFrames = 10;
  std::vector<std::unique_ptr<Pressed>> together, alone;
  for (const double step_m : kStep_m) {
    together.push_back(std::make_unique<Pressed>(GetParam(), step_m));
    alone.push_back(std::make_unique<Pressed>(GetParam(), step_m));
  }
  int parts = 0;
  for (int f = 0; f < kFrames; ++f) {
    std::array<std::optional<StepReport>, kStep_m.size()> reports;
    for (auto& w : together) {
      w->move(f);
      w->world.begin_step(kFrame_s);
    }
    for (bool is_open = true; is_open;) {
      is_open = false;
      for (std::size_t k = 0; k < together.size(); ++k) {
        if (reports[k]) continue;
        reports[k] = together[k]->world.continue_step();
        ++parts;
        is_open = is_open || !reports[k];
      }
    }
    for (std::size_t k = 0; k < alone.size(); ++k) {
      alone[k]->move(f);
      const StepReport expected = alone[k]->world.step(kFrame_s);
      EXPECT_EQ(reports[k]->substeps, expected.substeps);
      ASSERT_EQ(reports[k]->contacts.size(), expected.contacts.size());
      for (std::size_t c = 0; c < expected.contacts.size(); ++c)
        EXPECT_EQ(reports[k]->contacts[c].reaction.force_N, expected.contacts[c].reaction.force_N);
    }
  }
  EXPECT_GT(parts, kFrames * static_cast<int>(kStep_m.size())) << "some frame has several parts";
  for (std::size_t k = 0; k < alone.size(); ++k)
    EXPECT_EQ(state_hash(together[k]->world), state_hash(alone[k]->world)) << k;
}

TEST(OpenStep, OneFrameIsOpenAtATime) {
  Pressed w("cpu", 0.001);
  EXPECT_EQ(test::message_of([&] { w.world.continue_step(); }),
            "continue_step: no frame is open, expected begin_step() before");
  w.world.begin_step(kFrame_s);
  const std::string open = "begin_step: a frame is open, expected continue_step() until it gives a report";
  EXPECT_EQ(test::message_of([&] { w.world.begin_step(kFrame_s); }), open);
  EXPECT_EQ(test::message_of([&] { w.world.step(kFrame_s); }), open);
  while (!w.world.continue_step()) {
  }
  EXPECT_GT(w.world.step(kFrame_s).substeps, 0);
}

/// A body's nodes and surface where they lie are those that copies on the host have, at one place for good.
TEST_P(OpenStep, ResultsOnTheDeviceAreThoseOfTheHost) {
  TACTUS_SKIP_WITHOUT_DEVICES(GetParam());
  Pressed w(GetParam(), 0.004);
  const DeviceNodes first = device_nodes(w.world, "slab");
  const auto expect_same = [&](View<const Vec3f> on_device, const std::vector<Vec3f>& on_host) {
    EXPECT_EQ(to_host(w.devices.context(0), on_device), on_host);
  };
  for (int f = 0; f < 8; ++f) {
    w.move(f);
    w.world.step(kFrame_s);
    const DeviceNodes nodes = device_nodes(w.world, "slab");
    EXPECT_EQ(nodes.positions_m.data(), first.positions_m.data());
    EXPECT_EQ(nodes.velocities_m_s.data(), first.velocities_m_s.data());
    const BodyNodes copy = w.world.nodes("slab");
    expect_same(nodes.positions_m, copy.positions_m);
    expect_same(nodes.velocities_m_s, copy.velocities_m_s);
    const DeviceMesh mesh = device_surface(w.world, "slab");
    const TriangleMesh mesh_copy = w.world.snapshot().bodies[0];
    expect_same(mesh.positions_m, mesh_copy.positions_m);
    expect_same(mesh.normals, mesh_copy.normals);
    EXPECT_EQ(mesh.corners.size(), 3 * static_cast<Index>(mesh_copy.triangles.size()));
  }
}

TEST(OpenStep, StreamsAreThoseOfGpus) {
  DeviceSet devices("cpu:2");
  EXPECT_EQ(test::message_of([&] { wait_for_stream(devices, 2); }),
            "stream is 2, but 'cpu:2' has no CUDA streams: expected none");
}

}  // namespace
}  // namespace tactus
