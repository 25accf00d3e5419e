// What a rig saw is recorded, and replayed on every set of devices: one state.
#include <gtest/gtest.h>

#include <filesystem>

#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "support/synthetic_frame.h"
#include "tactus/rig/wire/recording_file.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;

/// A hand with a depth camera; a tick without images, one that a camera missed, a tick that was bad.
std::string recorded() {
  std::string path =
      (fs::temp_directory_path() / ("tactus-replay-" + std::to_string(::getpid()) + ".rec")).string();
  fs::remove(path);
  SyntheticSource source({.figure = "hand", .shape = {.moving = true, .scale = 0.6F}, .truth = false});
  RecordingWriter writer(path, source.rig(), 30);
  FrameSet frame;
  for (int k = 0; k < 12; ++k) {
    EXPECT_EQ(source.next(frame), NextFrame::success);
    if (k == 5) frame.silhouettes[2] = {};
    const NextFrame next = k == 4   ? NextFrame::nothing_new
                           : k == 7 ? NextFrame::bad_frame
                                    : NextFrame::success;
    writer.add(next, frame, "");
  }
  writer.finish();
  return path;
}

std::vector<Vec3f> replay(const std::string& path, const std::string& devices_text) {
  DeviceSet devices(devices_text, 2);
  RecordingReader reader(path);
  Scene scene;
  scene.reconstruction.resolution = 48;
  BodyDescription body;
  body.material.model = TissueModel::flsm;
  body.material.half_width = 2;
  body.name = "cushion";
  body.shape.size_m = {0.4, 0.12, 0.4};
  body.placement.position_m = {0, 0.25, 0};
  body.spacing_m = 0.04;
  SpaceRegion floor;
  floor.kind = RegionKind::half_space;
  floor.point_m = {0, -0.05, 0};
  body.fixed.push_back({floor});
  scene.bodies.push_back(body);
  test::FilmedWorld simulation(devices, scene, reader.rig(), {});
  FrameSet frame;
  std::string status;
  double last_s = 0;
  for (int i = 0; i < reader.count(); ++i) {
    const NextFrame next = reader.read(i, {}, frame, status);
    if (next == NextFrame::bad_frame) continue;
    simulation.step(next == NextFrame::success ? &frame : nullptr, i == 0 ? 0 : frame.time_s - last_s);
    last_s = frame.time_s;
  }
  std::vector<Vec3f> state = simulation.bodies()[0]->positions_m(devices.context(0));
  const std::vector<Vec3f> v = simulation.bodies()[0]->velocities_m_s(devices.context(0));
  state.insert(state.end(), v.begin(), v.end());
  const FrameSnapshot seen = simulation.snapshot();
  state.insert(state.end(), seen.real.positions_m.begin(), seen.real.positions_m.end());
  return state;
}

class ReplayOnDevices : public ::testing::TestWithParam<std::string> {
 protected:
  static void SetUpTestSuite() { path_ = recorded(); }
  static void TearDownTestSuite() { fs::remove(path_); }
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
  static inline std::string path_;
};
TACTUS_INSTANTIATE_DEVICES(ReplayOnDevices);

TEST_P(ReplayOnDevices, GivesTheSameState) {
  static const std::vector<Vec3f> on_cpu = replay(path_, "cpu");
  ASSERT_GT(on_cpu.size(), 1000U);
  EXPECT_EQ(replay(path_, GetParam()), on_cpu);
}

}  // namespace
}  // namespace tactus
