/// Thumbnails of cameras and the doctor's findings, without a window.
#include <gtest/gtest.h>

#include <filesystem>

#include "tactus/base/timing.h"
#include "tactus/rig/live.h"
#include "tactus/run/scene_source.h"
#include "tactus/window/camera_model.h"
#include "tactus/window/live_run.h"

namespace tactus {
namespace {

BitMask rectangle(Index left, Index right, Index top, Index bottom) {
  BitMask mask(320, 240);
  for (Index y = top; y < bottom; ++y)
    for (Index x = left; x < right; ++x) mask.set(x, y);
  return mask;
}

std::array<int, 256> reds(const ColorImage& image) {
  std::array<int, 256> counts{};
  for (const Rgb8 p : image.pixels) ++counts[p.r];
  return counts;
}

/// 160 x 120 px in a picture of half the size: 80 x 60, of which 2 (80 + 60) - 4 are its outline.
TEST(Thumbnail, HasTheSilhouetteAndItsOutline) {
  const ColorImage thumb = thumbnail(rectangle(80, 240, 60, 180), {}, {320, 240}, 160);
  EXPECT_EQ(thumb.width_px, 160);
  EXPECT_EQ(thumb.height_px, 120);
  const auto counts = reds(thumb);
  EXPECT_EQ(counts[230], 276);
  EXPECT_EQ(counts[190], 80 * 60 - 276);
  EXPECT_EQ(counts[38], 160 * 120 - 80 * 60);
  EXPECT_EQ(thumb(40, 30).r, 230);
  EXPECT_EQ(thumb(39, 30).r, 38);
  EXPECT_EQ(reds(thumbnail({}, {}, {320, 240}, 160))[38], 160 * 120) << "it missed the tick";
  // A pixel holds 4 x 4 of the image's, and samples lie 2 apart.
  EXPECT_EQ(reds(thumbnail(rectangle(100, 102, 0, 240), {}, {320, 240}, 80))[230], 60)
      << "thin things are seen";
}

TEST(Thumbnail, ShowsAPhotographDarkerOutside) {
  const ColorImage photo(320, 240, {99, 99, 99});
  const auto counts = reds(thumbnail(rectangle(80, 240, 60, 180), photo, {320, 240}, 160));
  EXPECT_EQ(counts[99], 80 * 60 - 276);
  EXPECT_EQ(counts[33], 160 * 120 - 80 * 60);
}

CameraLook look_of(std::vector<double> late_s, std::string links = "") {
  auto rig = std::make_shared<Rig>();
  for (std::size_t c = 0; c < late_s.size(); ++c) {
    rig->cameras.emplace_back().name = "cam" + std::to_string(c);
    rig->cameras.back().width_px = 320;
    rig->cameras.back().height_px = 240;
  }
  return {7, rig, {}, std::move(late_s), std::move(links)};
}

TEST(CameraText, TellsStateAndLateness) {
  const CameraModel model = camera_model(look_of({0, 0.4, -1, 0, 0, 12.3}), {0.0912, -1, -1, 0, 1, -1},
                                         RigCheckup::State::off, nullptr);
  EXPECT_EQ(model.title, "cameras, frame 7");
  ASSERT_EQ(model.cameras.size(), 6U);
  const char* const states[] = {"covers 9 %", "missed 0.4 s", "no image yet",
                                "all black",  "all white",    "missed 12 s"};
  for (std::size_t c = 0; c < 6; ++c) {
    EXPECT_EQ(model.cameras[c].state, states[c]) << c;
    EXPECT_EQ(model.cameras[c].is_missing, c != 0) << c;
  }
  EXPECT_TRUE(model.findings.empty());
}

TEST(CameraText, TellsHowLateLiveCamerasAre) {
  LiveStatus status;
  for (const char* name : {"cam0", "cam1", "cam2", "cam3"}) status.cameras.emplace_back().name = name;
  status.cameras[0].skew_ms = 12.04;
  status.cameras[3].skew_ms = -0.2;
  status.cameras[3].is_present = status.cameras[0].is_present = status.cameras[1].is_present = true;
  const CameraModel model = camera_model(look_of({0, 0.2, 3, 0}, live_status_json(status)),
                                         {0.1, -1, -1, 0.1}, RigCheckup::State::off, nullptr);
  EXPECT_EQ(model.cameras.at(0).state, "12 ms late");
  EXPECT_EQ(model.cameras.at(1).state, "missed 0.2 s");
  EXPECT_EQ(model.cameras.at(2).state, "no link");
  EXPECT_EQ(model.cameras.at(3).state, "in time");
}

TEST(CameraText, TellsTheDoctorsFindings) {
  const auto findings = [](RigCheckup::State state, const RigCheckup::Result* result) {
    return camera_model(look_of({0, 0, 0}), {0.1, 0.1, 0.1}, state, result);
  };
  EXPECT_EQ(findings(RigCheckup::State::waiting, nullptr).findings.at(0).text,
            "the doctor waits for 11 sets of images");
  EXPECT_EQ(findings(RigCheckup::State::looking, nullptr).findings.at(0).text,
            "the doctor looks at the rig ...");
  RigCheckup::Result result;
  result.diagnosis.verdict = Verdict::well;
  result.diagnosis.why = "the silhouettes agree";
  const CameraModel well = findings(RigCheckup::State::done, &result);
  EXPECT_EQ(well.findings.at(0).text, "the doctor finds nothing wrong");
  EXPECT_EQ(well.findings.at(0).remedy, "the silhouettes agree");
  EXPECT_FALSE(well.findings.at(0).is_fault);
  result.diagnosis.verdict = Verdict::faulty;
  result.diagnosis.findings = {{1, -1, "the focal length is off", "calibrate it", 0.9, 1},
                               {0, 2, "names are swapped", "rename", 0.9, 1},
                               {-1, -1, "the workspace is large", "", 1, 1, false}};
  const CameraModel faulty = findings(RigCheckup::State::done, &result);
  EXPECT_EQ(faulty.findings.at(0).text, "cam1: the focal length is off");
  EXPECT_EQ(faulty.findings.at(0).remedy, "calibrate it");
  EXPECT_TRUE(faulty.findings.at(0).is_fault);
  EXPECT_EQ(faulty.findings.at(1).text, "cam0, cam2: names are swapped");
  EXPECT_EQ(faulty.findings.at(2).text, "all cameras: the workspace is large");
  EXPECT_EQ(faulty.cameras.at(1).fault, "the focal length is off");
  EXPECT_EQ(faulty.cameras.at(2).fault, "names are swapped");
  result.error = "no masks";
  EXPECT_EQ(findings(RigCheckup::State::done, &result).findings.at(0).text,
            "the doctor can't look: no masks");
}

/// A recorded hand: camera 2's masks are all white, and camera 3 gives no images after the first four.
Scene faulty_recording(const std::string& path) {
  Scene scene;
  scene.source.kind = SourceKind::synthetic;
  scene.source.figure = "hand";
  scene.source.fps = 30;
  scene.source.frames.last = 11;
  class Faulty final : public SourceFilter {
   public:
    using SourceFilter::SourceFilter;
    NextFrame next(FrameSet& frame) override {
      const NextFrame next = SourceFilter::next(frame);
      if (next != NextFrame::success) return next;
      BitMask& white = frame.silhouettes.at(2);
      for (Index y = 0; y < white.height_px; ++y)
        for (Index x = 0; x < white.width_px; ++x) white.set(x, y);
      if (frames_++ >= 4) frame.silhouettes.at(3) = {};
      return next;
    }
    int frames_ = 0;
  };
  RecordingFilter recorded(std::make_unique<Faulty>(open_scene_source(scene)), path);
  FrameSet frame;
  while (recorded.next(frame) != NextFrame::no_more_data) {
  }
  recorded.finish();
  scene.source = {};
  scene.source.kind = SourceKind::recording;
  scene.source.path = path;
  scene.reconstruction.resolution = 16;
  return scene;
}

class RecordedCameras : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::remove(path_); }
  void TearDown() override { std::filesystem::remove(path_); }
  template <class Is>
  static void wait_for(LiveRun& run, Is is) {
    for (const double until_s = now_s() + 60; now_s() < until_s;) {
      run.rethrow_failure();
      if (is()) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    FAIL() << "not in a minute";
  }
  const std::string path_ = ::testing::TempDir() + "window_cameras.rec";
};

TEST_F(RecordedCameras, AreSeenWithTheirLatenessAndTheirFaults) {
  LiveRun run(faulty_recording(path_), {.devices = "cpu", .tools = {}});
  run.show_cameras(true);
  run.control().set_paused(true);
  run.start({});
  std::shared_ptr<const CameraLook> look;
  for (int number = 1; number <= 12; ++number) {
    wait_for(run, [&] { return run.take_frame() != nullptr; });
    look = run.take_cameras();
    ASSERT_NE(look, nullptr) << number;
    EXPECT_EQ(look->number, number);
    if (number == 1) {
      EXPECT_EQ(run.checkup().state(), RigCheckup::State::waiting);
    }
    run.control().step();
  }
  ASSERT_EQ(look->silhouettes.size(), look->rig->cameras.size());
  EXPECT_EQ(look->late_s.at(0), 0);
  EXPECT_NEAR(look->late_s.at(3), 8 / 30.0, 1e-6) << "its last image was in the fourth frame";
  EXPECT_TRUE(look->silhouettes.at(3).words.empty());
  EXPECT_EQ(covered_share(look->silhouettes.at(2)), 1);
  wait_for(run, [&] { return run.checkup().state() == RigCheckup::State::done; });
  const auto result = run.checkup().result();
  ASSERT_NE(result, nullptr);
  EXPECT_EQ(result->error, "");
  const CameraModel model = camera_model(*look, {}, run.checkup().state(), result.get());
  EXPECT_EQ(model.cameras.at(2).fault, "the mask is all white");
  EXPECT_EQ(model.cameras.at(0).fault, "");
  EXPECT_NE(model.findings.at(0).text.find("the mask is all white"), std::string::npos);
  EXPECT_NE(model.findings.at(0).remedy, "");
}

TEST_F(RecordedCameras, CostNothingWhileTheyAreHidden) {
  LiveRun run(faulty_recording(path_), {.devices = "cpu", .tools = {}});
  run.start({});
  wait_for(run, [&] { return run.state() == LiveRun::State::ended; });
  EXPECT_EQ(run.take_cameras(), nullptr);
  // The source had 12 sets: the doctor has begun.
  EXPECT_NE(run.checkup().state(), RigCheckup::State::waiting);
}

/// Nobody built them.
TEST(RigCheckup, DoesNotExamineSyntheticRigs) {
  SourceDescription source;
  source.kind = SourceKind::synthetic;
  RigCheckup checkup(source, {});
  checkup.add(Rig(), {});
  checkup.begin();
  EXPECT_EQ(checkup.state(), RigCheckup::State::off);
}

/// A failure of the doctor is text, and ends nothing.
TEST(RigCheckup, SaysWhyItCannotLook) {
  SourceDescription source;
  source.kind = SourceKind::recording;
  int calls = 0;
  {
    RigCheckup checkup(source, [&] { ++calls; });
    checkup.add(Rig(), {});
    checkup.begin();
    for (const double until_s = now_s() + 20; checkup.result() == nullptr && now_s() < until_s;)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ASSERT_NE(checkup.result(), nullptr);
    EXPECT_EQ(checkup.result()->error, "doctor: no cameras or no masks");
  }
  EXPECT_EQ(calls, 1);
}

}  // namespace
}  // namespace tactus
