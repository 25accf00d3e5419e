/// The loop over frames: who sees what, when it ends, and that looking on changes no bit.
#include "tactus/run/frame_loop.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "support/message_of.h"
#include "tactus/base/error.h"
#include "tactus/io/scene_file.h"
#include "tactus/run/scene_source.h"
#include "tactus/run/sinks.h"
#include "tactus/run/sinks/mesh_sink.h"
#include "tactus/run/sinks/report_sink.h"
#include "tactus/world/world.h"

namespace tactus {
namespace {

constexpr const char* kFalling = R"(
source: {kind: none, frames: 0-7, fps: 50}
bodies:
  - name: block
    shape: {kind: box, size_m: [0.04, 0.04, 0.04]}
    spacing_m: 0.02
    material: {young_modulus_pa: 20000}
)";

/// It meets the block in the half before the checkpoint and pushes it in the other.
constexpr const char* kRisingBall = R"(
obstacles:
  - name: ball
    kind: sphere
    radius_m: 0.03
    placement: {position_m: [0, -0.055, 0]}
    motion: [{time_s: 0}, {time_s: 0.14, displacement_m: [0, 0.05, 0]}]
)";

constexpr const char* kFilmed = R"(
source: {kind: synthetic, figure: sphere, frames: 0-3}
reconstruction: {resolution: 32}
)";

/// A scene with what it needs.
struct Loaded {
  explicit Loaded(const char* text) : scene(parse_scene(text, "scene.yaml")) {}
  Scene scene;
  DeviceSet devices{"cpu"};
  std::unique_ptr<FrameSource> source = open_scene_source(scene);
  BodyAssets assets = load_body_assets(scene);
  std::unique_ptr<Perception> perception = make_perception(devices, scene, source->rig(), assets);
  World world{devices, scene, assets, perception.get()};
};

struct Watcher final : FrameSink {
  explicit Watcher(std::string& order, char letter) : order_(order), letter_(letter) {}
  void begin(const World& /*world*/, std::optional<int> frame_count) override { count = frame_count; }
  void frame(RunFrame& frame) override {
    order_ += letter_;
    numbers.push_back(frame.number);
    new_ones += frame.is_new ? 1 : 0;
    snapshot = frame.snapshot();
  }
  void end(RunNotices& /*notices*/) override { ended = true; }

  std::optional<int> count;
  std::vector<int> numbers;
  int new_ones = 0;
  bool ended = false;
  std::shared_ptr<const FrameSnapshot> snapshot;

 private:
  std::string& order_;
  char letter_;
};

TEST(FrameLoop, ShowsEachFrameToEachSinkInOrder) {
  Loaded loaded(kFalling);
  std::string order;
  Watcher a(order, 'a'), b(order, 'b');
  FrameLoop loop(*loaded.source, loaded.world);
  loop.add(a);
  loop.add(b);
  loop.run();
  EXPECT_EQ(order, "abababababababab");
  EXPECT_EQ(a.numbers, (std::vector<int>{1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(a.count, std::optional<int>(8));
  EXPECT_EQ(a.new_ones, 0) << "nobody films";
  EXPECT_TRUE(a.ended && b.ended);
  EXPECT_EQ(a.snapshot, b.snapshot) << "copied once";
  EXPECT_EQ(loop.frames(), 8);
  EXPECT_EQ(loop.progress().taken, 8);
  // 7 steps of 20 ms; semi-implicit Euler falls g t (t + dt) / 2 with substeps of dt <= 20 ms.
  const double t = 0.14, mean_y = loaded.world.nodes(loaded.scene.bodies[0].name).positions_m[0].y,
               fallen = -0.02 - mean_y;
  EXPECT_GE(fallen, 0.5 * 9.81 * t * t - 1e-4);
  EXPECT_LE(fallen, 0.5 * 9.81 * t * (t + 0.02) + 1e-4);
}

TEST(FrameLoop, StopsWhenItShould) {
  for (const bool by_number : {true, false}) {
    Loaded loaded(kFalling);
    int asked = 0;
    FrameLoop loop(*loaded.source, loaded.world,
                   by_number
                       ? FrameLoop::Options{.most_frames = 3, .should_stop = {}}
                       : FrameLoop::Options{.most_frames = 0, .should_stop = [&] { return ++asked > 3; }});
    loop.run();
    EXPECT_EQ(loop.frames(), 3);
  }
}

TEST(FrameLoop, LookingOnChangesNoBit) {
  const auto hash_with = [](bool watched) {
    Loaded loaded(kFilmed);
    std::string order;
    Watcher watcher(order, 'w');
    ReportSink report(loaded.scene);
    FrameLoop loop(*loaded.source, loaded.world);
    if (watched) loop.add(watcher);
    if (watched) loop.add(report);
    loop.run();
    EXPECT_EQ(watcher.new_ones, watched ? 4 : 0);
    return state_hash(loaded.world);
  };
  EXPECT_EQ(hash_with(true), hash_with(false));
}

TEST(FrameLoop, GoesOnAfterACheckpointWithTheSameBits) {
  const std::string scene_path = testing::TempDir() + "frame_loop.yaml", path = scene_path + ".checkpoint";
  const std::string struck = std::string(kFalling) + kRisingBall;
  std::ofstream(scene_path) << struck;
  Loaded whole(struck.c_str()), first(struck.c_str()), second(struck.c_str());
  FrameLoop(*whole.source, whole.world).run();
  FrameLoop half(*first.source, first.world, {.most_frames = 4, .should_stop = {}});
  half.run();
  write_checkpoint(path, scene_path, half.progress(), first.world);
  FrameLoop rest(*second.source, second.world);
  rest.go_on_from(read_checkpoint(path, scene_path, *second.source, second.world));
  rest.run();
  EXPECT_EQ(rest.frames(), 4);
  EXPECT_EQ(state_hash(second.world), state_hash(whole.world));
}

TEST(FrameLoop, ARecordedSourceReplays) {
  const std::string path = testing::TempDir() + "frame_loop.rec";
  std::filesystem::remove(path);
  Loaded loaded(kFilmed);
  RecordingFilter recorded(std::move(loaded.source), path);
  FrameLoop loop(recorded, loaded.world);
  loop.run();
  recorded.finish();
  Loaded again(kFilmed);
  again.scene.source = {};
  again.scene.source.kind = SourceKind::recording;
  again.scene.source.path = path;
  const std::unique_ptr<FrameSource> source = open_scene_source(again.scene);
  const auto perception = make_perception(again.devices, again.scene, source->rig(), {});
  World replayed(again.devices, again.scene, {}, perception.get());
  FrameLoop replay(*source, replayed);
  replay.run();
  EXPECT_EQ(replay.frames(), 4);
  EXPECT_EQ(state_hash(replayed), state_hash(loaded.world));
}

/// Its first frame is bad, its second is well.
struct Faulty final : SourceFilter {
  using SourceFilter::SourceFilter;
  NextFrame next(FrameSet& frame) override {
    return taken_++ == 0 ? NextFrame::bad_frame : SourceFilter::next(frame);
  }
  std::string status() const override { return "camera 'a': dark; camera 'b': dark"; }
  std::string damage() const override { return "cut off"; }

 private:
  int taken_ = 0;
};

TEST(FrameLoop, CountsBadFramesAndSaysEachThingOnce) {
  Loaded loaded(kFilmed);
  Faulty source(std::move(loaded.source));
  FrameLoop loop(source, loaded.world);
  loop.run();
  EXPECT_EQ(loop.bad_frames(), 1);
  EXPECT_EQ(loop.frames(), 4);
  EXPECT_EQ(loop.notices().statuses(),
            (std::vector<std::string>{"cut off", "camera 'a': dark", "camera 'b': dark"}));
}

TEST(SceneSource, TakesPhotographsWhereASceneAsksForThem) {
  Loaded loaded(kFilmed);
  loaded.scene.view.photographs = 2;
  const std::unique_ptr<FrameSource> source = open_scene_source(loaded.scene);
  FrameSet frame;
  ASSERT_EQ(source->next(frame), NextFrame::success);
  EXPECT_EQ(frame.colors.size(), source->rig().cameras.size());
}

TEST(Sinks, NameTheNumberThatIsWrong) {
  Loaded loaded(kFalling);
  const std::string stem = (std::filesystem::temp_directory_path() / "tactus_wrong_sink").string();
  const auto message = [](auto&& make) { return test::message_of(make, ErrorKind::usage); };
  EXPECT_EQ(message([&] { make_budget_sink(-0.01, loaded.world); }),
            "budget_s of a frame is -0.01, expected > 0");
  EXPECT_EQ(message([&] { make_vtk_sink(0, stem); }),
            "every, the frames from one VTK file to the next, is 0, expected > 0");
  EXPECT_EQ(message([&] {
              make_picture_sink(loaded.scene, loaded.source->rig(), loaded.assets, loaded.world, stem, 0);
            }),
            "frames_per_s of a film is 0, expected > 0");
}

TEST(UsdSink, TakesEachFrameWhereTheSceneNamesNoInterval) {
  Loaded loaded(kFalling);
  const std::filesystem::path stem = std::filesystem::temp_directory_path() / "tactus_usd_sink";
  EXPECT_EQ(test::message_of([&] { make_usd_sink(loaded.scene, loaded.assets, stem, 0); }, ErrorKind::usage),
            "frames_per_s of a USD file is 0, expected > 0");
  ASSERT_EQ(loaded.scene.output.usd_every, 0);
  const std::unique_ptr<FrameSink> usd = make_usd_sink(loaded.scene, loaded.assets, stem, 50);
  FrameLoop loop(*loaded.source, loaded.world);
  loop.add(*usd);
  loop.run();
  std::ifstream file(stem.string() + ".usda");
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  EXPECT_NE(text.find("endTimeCode = 7\n"), std::string::npos) << "8 frames from 0 on";
  EXPECT_NE(text.find("timeCodesPerSecond = 50\n"), std::string::npos);
  std::filesystem::remove(stem.string() + ".usda");
}

TEST(Perception, AFrameWithoutSilhouettesIsNoNewImage) {
  Loaded loaded(kFilmed);
  FrameSet frame;
  ASSERT_EQ(loaded.source->next(frame), NextFrame::success);
  EXPECT_TRUE(loaded.perception->download().triangles.empty()) << "before the first image";
  loaded.world.set_surface(loaded.perception->observe(&frame, 0));
  loaded.world.step(0);
  const std::size_t triangles = loaded.perception->download().triangles.size();
  EXPECT_GT(triangles, 100U);
  for (BitMask& mask : frame.silhouettes) mask = {};
  const Observation seen = loaded.perception->observe(&frame, 0.02);
  EXPECT_FALSE(seen.is_new);
  loaded.world.set_surface(seen);
  const StepReport report = loaded.world.step(0.02);
  ASSERT_EQ(report.notices.size(), 1U);
  EXPECT_EQ(report.notices[0].code, "hull.blind");
  EXPECT_EQ(loaded.perception->download().triangles.size(), triangles) << "the surface goes on";
}

TEST(Perception, AnObservationIsForOneWorld) {
  Loaded loaded(kFilmed), other(kFilmed);
  FrameSet frame;
  ASSERT_EQ(loaded.source->next(frame), NextFrame::success);
  const std::string expected = "set_surface: the observation is not of this World's Perception";
  const Observation seen = other.perception->observe(&frame, 0);
  EXPECT_EQ(test::message_of([&] { loaded.world.set_surface(seen); }, ErrorKind::usage), expected);
  Observation made_up;
  made_up.is_new = true;
  EXPECT_EQ(test::message_of([&] { loaded.world.set_surface(made_up); }, ErrorKind::usage), expected);
}

}  // namespace
}  // namespace tactus
