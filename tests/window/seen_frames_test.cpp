/// The past of a run: which frames are kept, and that they are simulated again with the same bits.
#include "tactus/window/seen_frames.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "tactus/base/timing.h"
#include "tactus/run/scene_source.h"
#include "tactus/window/live_run.h"
#include "tactus/window/panel_model.h"

namespace tactus {
namespace {

SeenFrame seen(int number, std::size_t vertices, bool has_state = true) {
  auto snapshot = std::make_shared<FrameSnapshot>();
  snapshot->real.positions_m.resize(vertices);
  auto frame = std::make_shared<ViewedFrame>();
  frame->snapshot = snapshot;
  frame->number = number;
  if (!has_state) return {frame, nullptr};
  return {frame, std::make_shared<PastState>(PastState{std::string(100, 'x'), {}, number})};
}

TEST(SeenFrames, AreFoundByTheirNumbers) {
  SeenFrames past(1 << 20);
  EXPECT_EQ(past.nearest(3).frame, nullptr);
  EXPECT_EQ(past.moved(3, 1).frame, nullptr);
  EXPECT_EQ(past.state_at(3), nullptr);
  for (const int number : {1, 2, 5, 9}) past.add(seen(number, 10, number != 5));
  EXPECT_EQ(past.range().first, 1);
  EXPECT_EQ(past.range().last, 9);
  EXPECT_EQ(past.nearest(4).frame->number, 5);
  EXPECT_EQ(past.nearest(3).frame->number, 2);
  EXPECT_EQ(past.nearest(100).frame->number, 9);
  EXPECT_EQ(past.moved(5, -1).frame->number, 2);
  EXPECT_EQ(past.moved(5, 1).frame->number, 9);
  EXPECT_EQ(past.moved(4, 1).frame->number, 5) << "4 is gone";
  EXPECT_EQ(past.moved(4, -1).frame->number, 2);
  EXPECT_EQ(past.moved(1, -3).frame->number, 1);
  EXPECT_EQ(past.state_at(5)->number, 2) << "5 has no state";
  EXPECT_EQ(past.state_at(9)->number, 9);
  past.forget_after(5);
  EXPECT_EQ(past.range().last, 5);
  past.add(seen(6, 10));
  EXPECT_EQ(past.moved(5, 1).frame->number, 6);
  past.clear();
  EXPECT_EQ(past.bytes(), 0U);
}

/// A thousand frames in the memory of fifty: the limit holds, the first and the last are there, and gaps are
/// smaller the newer a frame is.
TEST(SeenFrames, FitIntoTheirMemoryAndThinOut) {
  const std::size_t one = bytes_of(*seen(1, 100).frame) + 100;
  SeenFrames past(50 * one);
  for (int number = 1; number <= 1000; ++number) past.add(seen(number, 100));
  EXPECT_LE(past.bytes(), 50 * one);
  EXPECT_GT(past.bytes(), 48 * one);
  EXPECT_EQ(past.range().first, 1);
  EXPECT_EQ(past.range().last, 1000);
  const auto gap_after = [&](int number) { return past.moved(number, 1).frame->number - number; };
  EXPECT_EQ(gap_after(999), 1);
  EXPECT_LE(gap_after(past.nearest(990).frame->number), 4);
  EXPECT_LE(gap_after(past.nearest(100).frame->number), 400);
  SeenFrames none(0);
  none.add(seen(1, 10));
  EXPECT_EQ(none.range().last, 0);
}

/// A soft box that falls onto a plane, with or without a recorded figure that comes near.
Scene falling_box() {
  Scene scene;
  scene.source.kind = SourceKind::none;
  scene.source.fps = 100;
  scene.source.frames.last = 1'000'000;
  BodyDescription& body = scene.bodies.emplace_back();
  body.name = "box";
  body.shape.size_m = {0.1, 0.1, 0.1};
  body.placement.position_m = {0, 0.06, 0};
  body.spacing_m = 0.025;
  scene.obstacles.emplace_back().name = "floor";
  return scene;
}

/// Twelve frames of a hand that moves.
Scene recorded_hand(const std::string& path) {
  Scene scene = falling_box();
  scene.source.kind = SourceKind::synthetic;
  scene.source.figure = "hand";
  scene.source.fps = 30;
  scene.source.frames.last = 11;
  scene.reconstruction.resolution = 24;
  RecordingFilter recorded(open_scene_source(scene), path);
  FrameSet frame;
  while (recorded.next(frame) != NextFrame::no_more_data) {
  }
  recorded.finish();
  scene.source = {};
  scene.source.kind = SourceKind::recording;
  scene.source.path = path;
  return scene;
}

std::shared_ptr<const ViewedFrame> next_frame(LiveRun& run) {
  for (const double until_s = now_s() + 30; now_s() < until_s;) {
    run.rethrow_failure();
    if (auto frame = run.take_frame()) return frame;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return nullptr;
}

/// Bytes of the states after frames first, ..., last; steps through the run.
std::vector<std::string> states(LiveRun& run, int first, int last) {
  std::vector<std::string> all;
  for (int number = first; number <= last; ++number) {
    const auto frame = next_frame(run);
    EXPECT_NE(frame, nullptr);
    if (frame == nullptr) return all;
    EXPECT_EQ(frame->number, number);
    const auto state = run.past().state_at(number);
    EXPECT_NE(state, nullptr);
    if (state == nullptr) return all;
    EXPECT_EQ(state->number, number);
    all.push_back(state->bytes);
    if (number < last) run.control().step();
  }
  return all;
}

/// The saved state is all that the coming frames depend on, so equal bytes are more than equal hashes of
/// positions.
void expect_same_again(Scene scene) {
  LiveRun run(std::move(scene), {.devices = "cpu", .tools = {}});
  run.control().set_paused(true);
  run.start({});
  const std::vector<std::string> first = states(run, 1, 10);
  ASSERT_EQ(first.size(), 10U);
  EXPECT_NE(first[3], first[4]);
  run.simulate_again(run.past().state_at(4));
  const std::vector<std::string> again = states(run, 5, 10);
  ASSERT_EQ(again.size(), 6U);
  for (std::size_t i = 0; i < again.size(); ++i) EXPECT_TRUE(again[i] == first[i + 4]) << "frame " << i + 5;
  EXPECT_EQ(run.past().range().first, 1) << "the past before it stays";
  EXPECT_EQ(run.past().range().last, 10);
}

TEST(SimulatedAgain, HasTheSameBitsWithoutCameras) { expect_same_again(falling_box()); }

TEST(SimulatedAgain, HasTheSameBitsWithARecording) {
  const std::string path = ::testing::TempDir() + "seen_frames_hand.rec";
  std::filesystem::remove(path);
  expect_same_again(recorded_hand(path));
  std::filesystem::remove(path);
}

TEST(SimulatedAgain, LiveCamerasCannot) {
  Scene scene = falling_box();
  scene.source.kind = SourceKind::live;
  EXPECT_NE(LiveRun(scene, {.devices = "cpu", .tools = {}}).why_not_again().find("live cameras"),
            std::string::npos);
}

/// The slider and its text, as tests of panels read them.
TEST(SimulatedAgain, PanelsSayFromWhere) {
  RunHistory history;
  history.add(seen(9, 1).frame);
  const auto past = [&](const ShownPast& shown) {
    return panel_model("demo", history, LiveRun::State::running, true, {}, 0, "", shown);
  };
  EXPECT_EQ(past({}).past.text, "");
  EXPECT_EQ(past({{1, 9}, nullptr, 0, ""}).past.text, "seen: frames 1 to 9");
  const PanelModel model = past({{1, 9}, seen(5, 1).frame, 4, ""});
  EXPECT_EQ(model.past.text, "b: simulate again from frame 4");
  EXPECT_EQ(model.past.shown, 5);
  EXPECT_TRUE(model.past.can_go_on_from);
  EXPECT_NE(model.clock.find("frame 5"), std::string::npos) << "numbers are those of the frame that is shown";
  const PanelModel live = past({{1, 9}, seen(5, 1).frame, 0, "live cameras can't give their frames again"});
  EXPECT_EQ(live.past.text, "live cameras can't give their frames again");
  EXPECT_FALSE(live.past.can_go_on_from);
}

}  // namespace
}  // namespace tactus
