// The frame as a schedule: jittering clocks, frames without images, numbers of substeps that change.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>

#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "support/message_of.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/sim/frame_clock.h"

namespace tactus {
namespace {

/// A ball comes down on a slab of elements and shape matching; beside it, one that nothing touches.
Scene slab_scene() {
  Scene scene;
  scene.reconstruction.resolution = 32;
  BodyDescription slab;
  slab.material.half_width = 2;
  slab.name = "slab";
  slab.shape.size_m = {0.4, 0.1, 0.4};
  slab.placement.position_m = {0, 0.25, 0};
  slab.spacing_m = 0.05;
  slab.material.model = TissueModel::hybrid;
  slab.ratio = RatioDescription{};
  slab.material.young_modulus_pa = 20000;
  slab.material.density_kg_m3 = 300;
  SpaceRegion bottom;
  bottom.kind = RegionKind::half_space;
  bottom.point_m = {0, -0.04, 0};
  bottom.normal = {0, 1, 0};
  slab.fixed.push_back({bottom});
  BodyDescription alone = slab;
  alone.name = "alone";
  alone.placement.position_m = {0.3, 0.7, 0};
  alone.material.model = TissueModel::tled;
  alone.ratio.reset();
  alone.contact = false;
  scene.bodies = {slab, alone};
  scene.gravity_m_s2 = {0, -2, 0};
  return scene;
}

struct Played {
  std::vector<Vec3f> x_m;
  std::vector<int> substeps;
  int recordings = 0;
};

/// Frames of 33.3 +- 10 ms; every fourth comes without images.
Played play(const std::string& devices_text, int frames, std::uint64_t seed = 0) {
  DeviceSet devices(devices_text, seed);
  SyntheticOptions options;
  options.figure = "sphere";
  options.shape.scale = 0.6F;
  options.depth = options.truth = false;
  const Scene scene = slab_scene();
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  std::mt19937 random(1);
  Played played;
  FrameSet frame;
  for (int k = 0; k < frames; ++k) {
    // Slowly down to 4 cm into the slab.
    options.shape.offset_m = {0, 0.33F - 0.5F + 0.15F - 0.002F * static_cast<float>(std::min(k, 35)), 0};
    EXPECT_EQ(SyntheticSource(options).next(frame), NextFrame::success);
    const double dt_s = 1e-4 * (233 + static_cast<double>(random() % 201));
    const StepReport report = simulation.step(k % 4 == 3 ? nullptr : &frame, k == 0 ? 0 : dt_s);
    EXPECT_EQ(text_of(report.notices), "") << "frame " << k;
    EXPECT_EQ(report.dt_s, k == 0 ? 0 : dt_s);
    played.substeps.push_back(report.substeps);
  }
  for (const auto& body : simulation.bodies()) {
    const std::vector<Vec3f> x = body->positions_m(devices.context(0));
    played.x_m.insert(played.x_m.end(), x.begin(), x.end());
  }
  played.recordings = simulation.schedule().recordings();
  return played;
}

class FrameOnDevices : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(FrameOnDevices);

/// `cpu` runs every stage as it is declared; GPUs replay one recording. (500 frames: tactus bench frame.)
TEST_P(FrameOnDevices, JitterNeedsNoNewRecordingAndChangesNoBit) {
  const Played expected = play("cpu", 60), played = play(GetParam(), 60);
  EXPECT_EQ(played.substeps, expected.substeps);
  EXPECT_EQ(played.x_m, expected.x_m);
  EXPECT_EQ(played.recordings, 1);
  // The jitter is seen: 23 and 43 ms need different numbers of substeps.
  const auto [least, most] = std::minmax_element(played.substeps.begin() + 1, played.substeps.end());
  EXPECT_LT(*least, *most);
}

TEST(Frame, AnyLegalOrderOfTheDevicesGivesTheSameBits) {
  const Played expected = play("cpu", 6);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) EXPECT_EQ(play("cpu:3", 6, seed).x_m, expected.x_m) << seed;
}

double resident_MB() {
  std::ifstream statm("/proc/self/statm");
  double pages = 0, resident = 0;
  statm >> pages >> resident;
  return resident * 4096e-6;
}

/// That all processes use of all GPUs; 0 where nothing tells. Whole MB, as the driver counts them.
double used_on_gpus_MB() {
  double sum = 0;
  std::FILE* reported =
      popen("nvidia-smi --query-gpu=memory.used --format=csv,noheader,nounits 2>/dev/null", "r");
  if (reported == nullptr) return 0;
  for (double used = 0; std::fscanf(reported, "%lf", &used) == 1;) sum += used;
  pclose(reported);
  return sum;
}

/// Everything is allocated by the first frames. 0.5 MB: what the heap may fragment into; a record of 100
/// bytes kept per frame and stage would take 0.7 MB in 500 frames. With TACTUS_LONG_TESTS=1 ten
/// thousand frames, after as many as timings are kept of; then nothing grows on GPUs, either.
TEST_P(FrameOnDevices, FiveHundredFramesTakeNoMoreMemory) {
  DeviceSet devices(GetParam());
  SyntheticOptions options;
  options.figure = "sphere";
  options.depth = options.truth = false;
  FrameSet frame;
  EXPECT_EQ(SyntheticSource(options).next(frame), NextFrame::success);
  test::FilmedWorld simulation(devices, slab_scene(), make_synthetic_rig(), {});
  const auto play_frames = [&](int frames) {
    for (int k = 0; k < frames; ++k) simulation.step(frame, 0.005);
  };
  const bool is_long = std::getenv("TACTUS_LONG_TESTS") != nullptr;
  play_frames(is_long ? 9000 : 50);
  const bool on_gpus = is_long && GetParam().starts_with("cuda");
  const double before_MB = resident_MB(), on_gpus_before_MB = on_gpus ? used_on_gpus_MB() : 0;
  play_frames(is_long ? 10000 : GetParam() == "cpu" ? 500 : 100);
  EXPECT_LT(resident_MB() - before_MB, 0.5);
  if (!on_gpus) return;
  EXPECT_GT(on_gpus_before_MB, 0) << "nvidia-smi tells nothing";
  EXPECT_EQ(used_on_gpus_MB(), on_gpus_before_MB);
}

TEST(Frame, TextNamesEveryStageAndWhatItReads) {
  DeviceSet devices("cpu");
  const test::FilmedWorld simulation(devices, slab_scene(), make_synthetic_rig(), {});
  const std::string text = simulation.schedule().text();
  for (const char* part : {"hull/upload", "hull/carve", "surface/update", "body 'slab': step",
                           "body 'slab': contact sums", "reads hull/mesh", "every substep"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " is not in\n" << text;
}

TEST(FrameClock, FramesWithoutImagesAgeTheSurface) {
  FrameClock clock(0.25, std::nullopt);
  FrameTimes t = clock.next(0, true);
  EXPECT_EQ(t.dt_s, 0);
  EXPECT_EQ(t.dt_capture_s, 0);
  t = clock.next(0.03, true);  // ends at its capture
  EXPECT_EQ(t.surface_age_s, -0.03);
  EXPECT_EQ(t.dt_capture_s, 0.03);
  t = clock.next(0.01, false);
  EXPECT_EQ(t.surface_age_s, 0);
  t = clock.next(0.02, false);
  EXPECT_EQ(t.surface_age_s, 0.01);
  t = clock.next(0.04, true);
  EXPECT_DOUBLE_EQ(t.dt_capture_s, 0.07);
  EXPECT_EQ(t.surface_age_s, -0.04);
  EXPECT_DOUBLE_EQ(clock.simulated_s(), 0.1);
}

/// Sums of time stamps differ by rounding.
TEST(FrameClock, AnInstantIsNoTime) {
  FrameClock clock(0.25, std::nullopt);
  clock.next(0, true);
  EXPECT_EQ(clock.next(4e-9, true).dt_s, 0);
  EXPECT_EQ(clock.next(0.01, true).dt_s, 0.01);
}

TEST(FrameClock, LateFramesAreCutAndJumpsAreABreak) {
  FrameClock clock(0.25, std::nullopt);
  clock.next(0, true);
  FrameTimes t = clock.next(0.5, true);
  EXPECT_EQ(t.dt_s, 0.25);
  EXPECT_EQ(t.dt_capture_s, 0.5);  // it did move that slowly
  ASSERT_EQ(t.notices.size(), 1U);
  EXPECT_EQ(t.notices[0].code, "clock.clamped");
  EXPECT_EQ(t.notices[0].message(),
            "a frame of 0.5 s simulates only 0.25 s: give more frames per second, or raise frame.max_dt_s");
  for (const double jump : {-0.03, 7.0, std::nan("")}) {
    t = clock.next(jump, true);
    EXPECT_EQ(t.dt_s, 0);
    EXPECT_EQ(t.dt_capture_s, 0);
    ASSERT_EQ(t.notices.size(), 1U);
    EXPECT_EQ(t.notices[0].code, "clock.jump");
  }
  EXPECT_EQ(clock.next(0.03, true).dt_s, 0.03);
}

}  // namespace
}  // namespace tactus
