// Ctrl-C while the program works: what was done so far is on disk, whole.
#include <csignal>
#include <opencv2/videoio.hpp>

#include "cli/program.h"

namespace tactus::test {
namespace {

namespace fs = std::filesystem;

class Interrupt : public ProgramTest {
 protected:
  /// No file is left under its working name.
  void expect_no_parts() const {
    for (const std::string& name : files()) EXPECT_EQ(name.find(".part"), std::string::npos) << name;
  }
};

TEST_F(Interrupt, ReconstructWritesTheFramesSoFar) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const Outcome o =
        run_and_signal({"reconstruct", "hand", "--moving", "--frames", "0-", "--devices", "cpu",
                        "--resolution", "32", "--verbose", "--json", path("r.json"), "--mesh", path("r.ply")},
                       "\n     1 ", signal);  // of a row
    EXPECT_EQ(o.code, 130) << o.text;
    const nlohmann::json json = read_json("r.json");
    EXPECT_GE(json["frames"].size(), 2U);
    EXPECT_LT(json["frames"].size(), 300U);
    for (const nlohmann::json& frame : json["frames"]) EXPECT_TRUE(frame.contains("iou_mean"));
    expect_no_parts();
  }
}

/// What was written is a rig of the frames so far, which reconstruct reads to its end.
TEST_F(Interrupt, SynthWritesARigOfTheFramesSoFar) {
  const Outcome o = run_and_signal({"synth", "hand", "--moving", "--frames", "9000", "--no-colors",
                                    "--cameras", "4", "--out", path("film"), "--verbose"},
                                   "frame 3 of 9000", SIGINT);
  ASSERT_EQ(o.code, 130) << o.text;
  const auto frames = read_json("film/truth/truth.json")["frames"].size();
  EXPECT_GE(frames, 3U);
  EXPECT_LT(frames, 9000U);
  EXPECT_NE(o.text.find(std::to_string(frames) + " frames of 4 cameras"), std::string::npos) << o.text;
  const Outcome hulls = run_tactus("reconstruct --source masks " + path("film/rig.yaml") +
                                   " --frames 0- --devices cpu --resolution 24 --json " + path("r.json"));
  EXPECT_EQ(hulls.code, 0) << hulls.text;
  EXPECT_EQ(read_json("r.json")["frames"].size(), frames);
  EXPECT_TRUE(read_json("r.json")["bad_frames"].empty());
  expect_no_parts();
}

TEST_F(Interrupt, RunClosesVideoSheetAndJson) {
  const std::string scene =
      write("s.yaml",
            "source: {kind: synthetic, figure: hand, scale: 0.8, moving: true}\n"
            "reconstruction: {resolution: 32}\n"
            "bodies:\n  - {name: b, shape: {kind: box, size_m: [0.2, 0.2, 0.2]}, spacing_m: 0.1}\n");
  const Outcome o = run_and_signal({"run", scene, "--devices", "cpu", "--frames", "100000", "--out",
                                    path("out"), "--json", path("run.json"), "--verbose"},
                                   "frame 3 ", SIGINT);
  if (o.text.find("OpenGL") != std::string::npos && o.code == 1)
    GTEST_SKIP() << "no pictures here: " << o.text;
  ASSERT_EQ(o.code, 130) << o.text;
  const int frames = read_json("run.json")["frames"];
  EXPECT_GE(frames, 4);
  EXPECT_LT(frames, 100000);
  cv::VideoCapture video(path("out/s.mp4"), cv::CAP_FFMPEG);
  ASSERT_TRUE(video.isOpened());
  int pictures = 0;
  while (video.grab()) ++pictures;
  EXPECT_EQ(pictures, frames);
  EXPECT_GT(fs::file_size(path("out/s.png")), 1000U);
  expect_no_parts();
}

TEST_F(Interrupt, RunThatHasNoFrameYetIsInterruptedNotFailed) {
  const std::string scene =
      write("s.yaml",
            "source: {kind: synthetic, figure: sphere}\nreconstruction: {resolution: 16}\n"
            "bodies:\n  - {name: b, shape: {kind: box, size_m: [0.2, 0.2, 0.2]}, spacing_m: 0.1}\n");
  // Told of before the first frame; whether one is finished by then depends on the machine.
  const Outcome o = run_and_signal({"run", scene, "--devices", "cpu", "--frames", "100000", "--view", "none",
                                    "--verbose", "--json", path("run.json")},
                                   "body 'b': ", SIGINT);
  EXPECT_EQ(o.code, 130) << o.text;
  EXPECT_GE(read_json("run.json")["frames"], 0);
  expect_no_parts();
}

/// A frame of 10,000 substeps of 68,921 nodes takes many seconds on any CPU.
TEST_F(Interrupt, SecondSignalEndsWithinAFrameAndLeavesNoPart) {
  const std::string scene =
      write("s.yaml",
            "source: {kind: synthetic, figure: sphere}\nreconstruction: {resolution: 16}\n"
            "frame: {dt_s: 1, substeps: 10000}\nbodies:\n"
            "  - {name: b, shape: {kind: box, size_m: [0.2, 0.2, 0.2]}, spacing_m: 0.005, material: {model: "
            "tled}}\n");
  for (const int again : {SIGINT, SIGTERM}) {
    const Outcome o = run_and_signal({"run", scene, "--devices", "cpu", "--frames", "2", "--out", path("out"),
                                      "--verbose", "--json", path("run.json")},
                                     "body 'b': 68921 nodes", SIGINT, again);
    if (o.text.find("OpenGL") != std::string::npos) GTEST_SKIP() << "no pictures here: " << o.text;
    EXPECT_EQ(o.code, -1) << o.text;  // killed by the signal
    EXPECT_NE(o.text.find("interrupted: this frame and the files are finished; once more ends at once"),
              std::string::npos)
        << o.text;
    EXPECT_FALSE(fs::exists(path("run.json")));
    expect_no_parts();  // the video had begun
  }
}

/// coreutils' timeout signals the program, then its process group: one request.
TEST_F(Interrupt, ASignalThatComesTwiceAtOnceCountsOnce) {
  const Outcome o = run_and_signal({"reconstruct", "hand", "--moving", "--frames", "0-", "--devices", "cpu",
                                    "--resolution", "32", "--verbose", "--json", path("r.json")},
                                   "\n     1 ", SIGTERM, SIGTERM, std::chrono::milliseconds(0));
  EXPECT_EQ(o.code, 130) << o.text;
  EXPECT_GE(read_json("r.json")["frames"].size(), 2U);
  expect_no_parts();
}

TEST_F(Interrupt, BenchStopsWithinABenchmarkAndKeepsFinishedRows) {
  const auto begin = std::chrono::steady_clock::now();
  const Outcome o =
      run_and_signal({"bench", "hull", "--devices", "cpu", "--json", path("b.json")}, "p99 [ms]", SIGINT);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  EXPECT_EQ(o.code, 130) << o.text;
  const nlohmann::json json = read_json("b.json");
  EXPECT_EQ(json["interrupted"], true);
  EXPECT_LT(json["rows"].size(), 10U);  // all would be 2 figures x 5 sizes
  for (const nlohmann::json& row : json["rows"]) EXPECT_GT(row["ms_p50"], 0);
  // A benchmark takes about a minute; the bandwidth's five repetitions and one step of work don't.
  EXPECT_LT(took.count(), 40);
}

}  // namespace
}  // namespace tactus::test
