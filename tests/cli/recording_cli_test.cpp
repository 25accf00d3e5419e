// tactus run --record and --source.
#include <csignal>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "cli/program.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/rig/wire/recording_file.h"

namespace tactus::test {
namespace {

class RecordingCli : public ProgramTest {
 protected:
  void scene(const std::string& frames) const {
    write("s.yaml", "source: {kind: synthetic, figure: hand, scale: 0.6, frames: " + frames +
                        ", depth_cameras: 1}\n"
                        "reconstruction: {resolution: 24}\n"
                        "bodies:\n  - name: block\n    shape: {kind: box, size_m: [0.3, 0.3, 0.3]}\n"
                        "    placement: {position_m: [0, 0.2, 0]}\n    spacing_m: 0.05\n"
                        "    fixed: [{kind: half_space, point_m: [0, -0.14, 0]}]\n");
  }
  int also_right_ = 0;  ///< exit code that is expected beside 0
  /// The state after a run.
  std::string hash_of(const std::string& arguments) const {
    const Outcome o =
        run_tactus("run " + path("s.yaml") + " --view none --json " + path("r.json") + " " + arguments);
    EXPECT_TRUE(o.code == 0 || o.code == also_right_) << o.text;
    return o.code == 0 || o.code == also_right_ ? read_json("r.json")["state_hash"].get<std::string>()
                                                : o.text;
  }
};

TEST_F(RecordingCli, ReplaysToTheSameStateOnEveryDeviceSet) {
  scene("0-7");
  const std::string all = hash_of("--devices cpu --record " + path("a.rec"));
  for (const char* devices : {"cpu", "cpu:3", "cpu", "cpu:3", "cpu"})
    EXPECT_EQ(hash_of(std::string("--devices ") + devices + " --source " + path("a.rec")), all) << devices;
  EXPECT_NE(hash_of("--devices cpu --frames 7 --source " + path("a.rec")), all);
}

/// Nothing is told to a program that is killed with SIGKILL.
TEST_F(RecordingCli, KilledWhileRecordingItReplaysToTheLastWholeSet) {
  scene("0-9999");
  const Outcome o = run_and_signal(
      {"run", path("s.yaml"), "--devices", "cpu", "--view", "none", "--record", path("a.rec"), "--verbose"},
      "frame 5 ", SIGKILL);
  ASSERT_EQ(o.code, -1) << o.text;
  also_right_ = 6;
  const std::string replayed = hash_of("--devices cpu --source " + path("a.rec"));
  also_right_ = 0;
  const nlohmann::json json = read_json("r.json");
  const int frames = json["frames"];
  EXPECT_GE(frames, 6);
  const std::string reported = json["statuses"][0];
  EXPECT_TRUE(reported.starts_with("the recording is not whole: it was cut off after " +
                                   std::to_string(frames) + " frames, at byte "))
      << reported;
  EXPECT_EQ(hash_of("--devices cpu --frames " + std::to_string(frames)), replayed);
}

/// A bit of a frame in the middle, or the second half of the file: the run says where in the terminal and in
/// JSON, goes on with what is whole, and ends with 6.
TEST_F(RecordingCli, ADamagedOneIsNamedAndEndsWithItsOwnCode) {
  scene("0-7");
  hash_of("--devices cpu --record " + path("whole.rec"));
  std::stringstream bytes;
  bytes << std::ifstream(path("whole.rec"), std::ios::binary).rdbuf();
  const std::string whole = bytes.str();
  const auto played = [&](const std::string& damaged) {
    write("bad.rec", damaged);
    const Outcome o = run_tactus("run " + path("s.yaml") + " --devices cpu --view none --source " +
                                 path("bad.rec") + " --json " + path("bad.json"));
    EXPECT_EQ(o.code, 6) << o.text;
    EXPECT_NE(o.text.find("at byte "), std::string::npos) << o.text;
    const nlohmann::json json = read_json("bad.json");
    EXPECT_NE(json["statuses"].dump().find("at byte "), std::string::npos) << json["statuses"];
    return json["frames"].get<int>();
  };
  std::string flipped = whole;
  flipped[whole.size() / 2] ^= 1;
  EXPECT_GE(played(flipped), 7);
  const int before = played(whole.substr(0, whole.size() / 2));
  EXPECT_GE(before, 2);
  EXPECT_LE(before, 6);
  // Other verbs that replay it say so, too.
  for (const std::string& verb : {"reconstruct --devices cpu --resolution 32 --json " + path("r.json") +
                                      " --source recording " + path("bad.rec"),
                                  "masks --out " + path("masks") + " --source recording " + path("bad.rec"),
                                  "doctor " + path("bad.rec")}) {
    const Outcome o = run_tactus(verb);
    EXPECT_EQ(o.code, 6) << verb << o.text;
    EXPECT_NE(o.text.find("at byte "), std::string::npos) << verb << o.text;
  }
  EXPECT_NE(read_json("r.json")["damage"].dump().find("at byte "), std::string::npos);
}

/// A live recording begins with ticks at which no camera was there yet, and no frame is shown of them. Its
/// damage is told all the same, whether it lies in those ticks or behind them.
TEST_F(RecordingCli, DamageOfOneThatBeginsWithoutImagesIsNamed) {
  scene("0-7");
  const SyntheticOptions film = [] {
    SyntheticOptions options;
    options.rig = {.camera_count = 4, .width_px = 64, .height_px = 48, .focal_px = 60};
    options.rig.depth_width_px = options.rig.depth_height_px = 32;
    return options;
  }();
  SyntheticSource source(film);
  {
    RecordingWriter writer(path("whole.rec"), source.rig(), 30);
    FrameSet none, frame;
    for (int i = 0; i < 3; ++i) writer.add(NextFrame::nothing_new, none, "");
    for (int i = 0; i < 4; ++i) {
      source.next(frame);
      writer.add(NextFrame::success, frame, "");
    }
    writer.finish();
  }
  std::stringstream bytes;
  bytes << std::ifstream(path("whole.rec"), std::ios::binary).rdbuf();
  const std::string whole = bytes.str();
  std::vector<std::size_t> chunks;
  for (std::size_t at = 0; (at = whole.find("TCHK", at)) != std::string::npos; ++at) chunks.push_back(at);
  ASSERT_EQ(chunks.size(), 9U);  // rig, three ticks, four sets, end
  const auto damaged = [&](std::size_t at) {
    std::string text = whole;
    text[at] = static_cast<char>(text[at] ^ 1);
    return text;
  };
  EXPECT_EQ(hash_of("--devices cpu --source " + path("whole.rec")).size(), hash_of("--devices cpu").size());
  for (const std::string& bad : {whole.substr(0, chunks[8]), whole.substr(0, chunks[5] + 40),
                                 damaged(chunks[1]), damaged(chunks[2] + 9), damaged(chunks[2] + 40),
                                 damaged(chunks[3] + 20), damaged(chunks[4] + 50), damaged(chunks[7] + 3)}) {
    write("bad.rec", bad);
    const Outcome o = run_tactus("run " + path("s.yaml") + " --devices cpu --view none --source " +
                                 path("bad.rec") + " --json " + path("bad.json"));
    EXPECT_EQ(o.code, 6) << o.text;
    EXPECT_NE(o.text.find("at byte "), std::string::npos) << o.text;
    EXPECT_NE(read_json("bad.json")["statuses"].dump().find("at byte "), std::string::npos);
  }
}

TEST_F(RecordingCli, WrongFilesHaveOneMessage) {
  scene("0-1");
  expect_refused("run " + path("s.yaml") + " --view none --source " + path("s.yaml"), 2,
                 {path("s.yaml") + ":1", "'source'"});
  expect_refused("run " + path("s.yaml") + " --view none --source " + path("none"), 1, {path("none")});
  expect_refused("run " + path("s.yaml") + " --view none --record " + path("s.yaml"), 2,
                 {"is not overwritten"});
}

/// A budget that is never reached changes no bit; one that no frame meets makes every reduction, each
/// with a notice.
TEST_F(RecordingCli, ABudgetSavesOnlyWhenFramesTakeLonger) {
  scene("0-11");
  const auto run = [&](const std::string& budget) {
    const Outcome o =
        run_tactus("run " + path("s.yaml") + " --view none --devices cpu --json " + path("r.json") + budget);
    EXPECT_EQ(o.code, 0) << o.text;
    EXPECT_EQ(o.text.find("warning: after frame"), std::string::npos) << o.text;
    EXPECT_EQ(o.text.find("info: after frame") != std::string::npos, budget == " --budget 0.1ms") << o.text;
    return read_json("r.json");
  };
  const nlohmann::json none = run(""), ample = run(" --budget 10s"), tight = run(" --budget 0.1ms");
  EXPECT_EQ(ample["state_hash"], none["state_hash"]);
  EXPECT_EQ(ample["budget"]["quality_reductions"].back(), 0);
  EXPECT_FALSE(none.contains("budget"));
  EXPECT_EQ(tight["budget"]["quality_reductions"].back(), 2);  // hull, samples: no photographs, no liquid
  EXPECT_EQ(tight["budget"]["frames_above"], 12);
  EXPECT_EQ(tight["notices"].size(), 3U);  // two reductions, and that the budget can't be met
  const std::string command = "run " + path("s.yaml") + " --view none --budget ";
  for (const std::string wrong : {"0", "-3ms", "11min", "fast", "nan"})
    expect_refused(command + wrong, 2, {"--budget '" + wrong + "'", "11ms"});
  expect_refused(command + "9ms --checkpoint " + path("c"), 2, {"--budget '9ms'", "--checkpoint"});
}

}  // namespace
}  // namespace tactus::test
