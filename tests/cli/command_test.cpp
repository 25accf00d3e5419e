// The command itself: help, version, misspelt flags, signals, exit codes, what a run tells.
#include <csignal>
#include <fstream>
#include <sstream>
#include <thread>

#include "cli/program.h"
#include "tactus/cli/exit_codes.h"
#include "tactus/cli/interrupt.h"
#include "tactus/run/progress_text.h"

namespace tactus::test {
namespace {

namespace fs = std::filesystem;

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::string read(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

class Command : public ProgramTest {
 protected:
  /// A cube that falls, seen by nobody.
  std::string cube_scene(const std::string& more = "") const {
    return write(
        "s.yaml",
        "source: {kind: none, frames: 0-5}\n"
        "bodies:\n  - {name: b, shape: {kind: box, size_m: [0.1, 0.1, 0.1]}, spacing_m: 0.05, placement: "
        "{position_m: [0, 0.3, 0]}, material: {model: tled}}\n" +
            more);
  }
};

TEST_F(Command, VersionIsAVerbAndAFlag) {
  const Outcome verb = run_tactus("version"), flag = run_tactus("--version");
  EXPECT_EQ(verb.code, 0);
  EXPECT_EQ(verb.text, flag.text);
  EXPECT_TRUE(verb.text.starts_with("tactus 0.")) << verb.text;
}

TEST_F(Command, HelpOfAVerbIsThatOfItsFlag) {
  for (const std::string verb : {"run", "reconstruct", "bench", "calibrate", "calibrate rig", "help"}) {
    const Outcome help = run_tactus("help " + verb), flag = run_tactus(verb + " --help");
    EXPECT_EQ(help.code, 0) << verb;
    EXPECT_EQ(help.text, flag.text) << verb;
    EXPECT_TRUE(has(help.text, "--quiet") || has(help.text, "--help")) << help.text;
  }
  EXPECT_EQ(run_tactus("help").text, run_tactus("--help").text);
  const Outcome wrong = run_tactus("help recnstruct");
  EXPECT_EQ(wrong.code, 2);
  EXPECT_TRUE(has(wrong.text, "did you mean 'reconstruct'?")) << wrong.text;
}

TEST_F(Command, TheWordThatIsMissingIsNamed) {
  expect_refused("", 2, {"'tactus' lacks a command; known: run, "});
  expect_refused("calibrate", 2, {"'tactus calibrate' lacks a command"});
  expect_refused("reconstruct", 2, {"'tactus reconstruct' lacks 'what': folder, rig file, or figure"});
  expect_refused("synth hand", 2, {"'tactus synth' lacks '--out': folder to make"});
}

/// A flag gets the nearest one that its verb has, wherever it stands, with a value or without.
TEST_F(Command, MisspeltFlagsGetTheNearest) {
  const std::vector<std::pair<std::string, std::string>> wrongs = {
      {"run s.yaml --devcies cpu", "--devices"},
      {"run --devcies cpu s.yaml", "--devices"},
      {"run s.yaml --devcies=cpu", "--devices"},
      {"run --veiw none s.yaml", "--view"},
      {"reconstruct hand --resolutoin 64", "--resolution"},
      {"reconstruct --resolutoin", "--resolution"},
      {"doctor rig.yaml --josn x", "--json"},
      {"calibrate rig --squaremm 30", "--square-mm"},
      {"run s.yaml --quite", "--quiet"},
      {"bench hull --devises cpu", "--devices"},
  };
  for (const auto& [arguments, flag] : wrongs) {
    const Outcome o = run_tactus(arguments);
    EXPECT_EQ(o.code, 2) << arguments;
    EXPECT_TRUE(has(o.text, "has no flag '--")) << o.text;
    EXPECT_TRUE(has(o.text, "did you mean '" + flag + "'?")) << arguments << "\n" << o.text;
  }
  EXPECT_TRUE(has(run_tactus("run s.yaml --zzzzzzz").text, "known: ")) << "nothing is near";
  EXPECT_TRUE(has(run_tactus("calibrate intrinsic x").text, "did you mean 'intrinsics'?"));
}

/// The help, the man page and docs/results.md name every exit code.
TEST_F(Command, EveryExitCodeIsDocumented) {
  const std::string help = run_tactus("--help").text, man = run_tactus("help --man").text,
                    document = read(TACTUS_SOURCE_DIR "/docs/results.md");
  for (const ExitCode& e : kExitCodes) {
    EXPECT_TRUE(has(help, "\n  " + std::to_string(e.code) + "  " + e.meaning)) << e.code;
    EXPECT_TRUE(has(man, ".TP\n\\fB" + std::to_string(e.code) + "\\fR\n")) << e.code;
    EXPECT_TRUE(has(document, "\n| " + std::to_string(e.code) + " | ")) << e.code;
  }
}

/// A cube of 1 kPa whose top is pulled up at 200 km/s: beyond what a body is stepped at.
TEST_F(Command, ABodyThatBlewUpEndsWithItsOwnCode) {
  const std::string scene = write("s.yaml",
                                  "source: {kind: none, frames: 0-5}\n"
                                  "bodies:\n  - {name: b, shape: {kind: box, size_m: [0.1, 0.1, 0.1]}, "
                                  "spacing_m: 0.05, material: {model: tled, "
                                  "young_modulus_pa: 1000}, moved: [{name: pull, kind: half_space, point_m: "
                                  "[0, 0.04, 0], normal: [0, -1, 0], path: "
                                  "[{time_s: 0.005, displacement_m: [0, 1000, 0]}]}]}\n");
  const Outcome o = run_tactus("run " + scene + " --view none --devices cpu --json " + path("r.json"));
  EXPECT_EQ(o.code, kExitBlewUp) << o.text;
  EXPECT_TRUE(has(o.text, "blew up")) << o.text;
  EXPECT_EQ(read_json("r.json")["frames"], 6);  // all results are there
}

/// A lost terminal is an interrupt; under nohup it is nothing.
TEST_F(Command, HangUpKeepsTheResultsSoFar) {
  const std::string scene = cube_scene();
  std::ofstream(scene, std::ios::app) << "\n";
  std::string text = read(scene);
  text.replace(text.find("0-5"), 3, "0-99999");
  write("s.yaml", text);
  const Outcome o = run_and_signal(
      {"run", scene, "--devices", "cpu", "--view", "none", "--json", path("r.json"), "--verbose"}, "frame 3 ",
      SIGHUP);
  EXPECT_EQ(o.code, kExitInterrupted) << o.text;
  const nlohmann::json json = read_json("r.json");
  EXPECT_GE(json["frames"], 4);
  EXPECT_LT(json["frames"], 99999);
}

/// Files have at most so many bytes (a full disk is met in the same way), and what was begun goes.
TEST_F(Command, AFilmThatDoesNotFitLeavesNothingHidden) {
  const std::string scene = cube_scene("view: {size_px: [320, 240]}\n");
  const std::string command = "bash -c 'ulimit -f 1; " + program() + " run " + scene +
                              " --devices cpu --out " + path("out") + " 2>&1'";
  FILE* pipe = popen(command.c_str(), "r");
  std::string text;
  char buffer[4096];
  while (const std::size_t n = fread(buffer, 1, sizeof buffer, pipe)) text.append(buffer, n);
  EXPECT_NE(pclose(pipe), 0) << text;
  if (has(text, "OpenGL")) GTEST_SKIP() << "no pictures here: " << text;
  EXPECT_TRUE(has(text, "error: ")) << text;
  for (const std::string& name : files()) EXPECT_FALSE(has(name, ".part")) << name;
}

/// A reader that has seen enough ends the program; nothing half-written stays.
TEST_F(Command, AReaderThatLeavesEndsTheProgramCleanly) {
  const std::string command =
      program() + " reconstruct hand --moving --frames 0-40 --resolution 24 --devices cpu --mesh " +
      path("m.ply") + " 2>/dev/null | head -2 >/dev/null";
  EXPECT_EQ(std::system(command.c_str()), 0);
  for (const std::string& name : files()) EXPECT_FALSE(has(name, ".part")) << name;
}

/// Three moments lie in a row of cells of 480 px, with margins of 12, below a title of 44 and above a line of
/// 28; one alone is a picture of the scene's size. What isn't a moment of the run is named.
TEST_F(Command, MomentsAreOnTheContactSheet) {
  const std::string run =
      "run " + cube_scene("view: {size_px: [320, 240]}\n") + " --devices cpu --out " + path("o");
  expect_refused(run + " --moments 3,3", 2, {"--moments: 3", "expected a frame of 4 or later"});
  expect_refused(run + " --moments -1", 2, {"--moments"});
  expect_refused(run + " --moments 2 --frames 2", 2, {"--moments: 2", "last of --frames 2"});
  expect_refused(run + " --moments 2 --view none", 2, {"--moments: 2", "--view file"});
  const auto size_of_sheet = [&] {
    std::ifstream file(path("o/s.png"), std::ios::binary);
    unsigned char head[24] = {};
    file.read(reinterpret_cast<char*>(head), sizeof head);
    return std::pair{256 * head[18] + head[19], 256 * head[22] + head[23]};
  };
  const Outcome three = run_tactus(run + " --moments 1,3,4");
  if (has(three.text, "OpenGL")) GTEST_SKIP() << "no pictures here: " << three.text;
  ASSERT_EQ(three.code, 0) << three.text;
  EXPECT_EQ(size_of_sheet(), (std::pair{12 + 3 * 492, 44 + 360 + 28 + 12}));
  ASSERT_EQ(run_tactus(run + " --moments 2").code, 0);
  EXPECT_EQ(size_of_sheet(), (std::pair{320, 240}));
  EXPECT_TRUE(has(run_tactus(run + " --moments 2,99").text, "99 never came: the run had 6 frames"));
}

TEST_F(Command, SaysWhereTheWindowIs) {
  for (const std::string wrong : {"window", "File", ""})
    expect_refused("run " + cube_scene() + " --view '" + wrong + "'", 2,
                   {"--view: '" + wrong + "', expected none or file", "`tactus view SCENE` opens a window"});
}

TEST_F(Command, ABudgetNeedsItsUnit) {
  expect_refused("run " + cube_scene() + " --view none --budget 11", 2, {"--budget '11'", "needs cameras"});
  const std::string scene =
      write("f.yaml", "source: {kind: synthetic, figure: sphere}\nreconstruction: {resolution: 16}\n");
  for (const std::string wrong : {"11", "0", "11 ms ago", "60fps"})
    expect_refused("run " + scene + " --view none --budget '" + wrong + "'", 2,
                   {"--budget '" + wrong + "'", "with its unit, as 11ms or 0.011s"});
}

/// Nobody films: nothing is reconstructed, time passes, and the cube falls freely.
TEST_F(Command, ASceneThatNobodyFilmsHasNoHull) {
  const Outcome o = run_tactus("run " + cube_scene("probes: [{name: p, body: b, position_m: [0, 0, 0]}]\n") +
                               " --view none --devices cpu --json " + path("r.json"));
  ASSERT_EQ(o.code, 0) << o.text;
  const nlohmann::json json = read_json("r.json");
  EXPECT_EQ(json["frames"], 6);
  for (const char* stage : {"hull", "mesh", "upload", "check"})
    EXPECT_FALSE(json["ms"].contains(stage)) << stage;
  // Five intervals of 1/30 s: g t^2 / 2 = 0.1363 m, and symplectic Euler adds g t dt / 2 (dt <= 1/30 s over
  // the substeps of a frame, at least 2).
  const double fallen_m = json["probes"]["p"][0][1].get<double>() - json["probes"]["p"][5][1].get<double>();
  EXPECT_NEAR(fallen_m, 0.5 * 9.81 * 25 / 900, 0.5 * 9.81 * 5 / 900 / 2);
  for (const char* wrong : {"--record r.rec", "--budget 11ms"})
    EXPECT_TRUE(has(run_tactus("run " + path("s.yaml") + " --view none " + wrong).text, "needs cameras"))
        << wrong;
}

/// Checkpoints of such a scene go on with the same bits.
TEST_F(Command, ARunThatNobodyFilmsGoesOnWithTheSameBits) {
  const std::string scene = cube_scene(), flags = " --view none --devices cpu --json ";
  EXPECT_EQ(run_tactus("run " + scene + flags + path("all.json")).code, 0);
  EXPECT_EQ(
      run_tactus("run " + scene + flags + path("a.json") + " --frames 3 --checkpoint " + path("c")).code, 0);
  EXPECT_EQ(run_tactus("run " + scene + flags + path("b.json") + " --restart " + path("c")).code, 0);
  EXPECT_EQ(read_json("b.json")["frames"], 3);
  EXPECT_EQ(read_json("b.json")["state_hash"], read_json("all.json")["state_hash"]);
}

/// A block half in a table: said before anything moves, in the terminal and in the JSON.
TEST_F(Command, ABodyHalfInAnObstacleIsTold) {
  const std::string table =
      "obstacles: [{name: table, kind: box, size_m: [1, 0.1, 1], placement: {position_m: [0, ";
  const auto notices = [&](const std::string& more) {
    const Outcome o = run_tactus("run " + cube_scene(more) + " --frames 1 --view none --devices cpu --json " +
                                 path("r.json"));
    EXPECT_EQ(o.code, 0) << o.text;
    std::string text;
    const nlohmann::json json = read_json("r.json");
    for (const nlohmann::json& n : json["notices"])
      if (n["code"] == "body.overlap") text += n["text"].get<std::string>();
    EXPECT_EQ(has(o.text, "lies in obstacle 'table' at the start"), !text.empty()) << o.text;
    return text;
  };
  // The cube reaches from 0.25 to 0.35 m; the table's top is at 0.3, 0.25 (it rests) and 0.2 m.
  EXPECT_TRUE(has(notices(table + "0.251, 0]}}]\n"), "body 'b'"));
  EXPECT_EQ(notices(table + "0.2, 0]}}]\n"), "");
  EXPECT_EQ(notices(table + "0.15, 0]}}]\n"), "");
}

TEST(Progress, TellsOneNumberAndTheTimeLeft) {
  EXPECT_EQ(progress_text(30, 120, 10), "frame 30 of 120, 30 s left");
  EXPECT_EQ(progress_text(1, 1000, 0.5), "frame 1 of 1000, 8 min 20 s left");
  EXPECT_EQ(progress_text(10, 100, 1000), "frame 10 of 100, 2 h 30 min left");
  EXPECT_EQ(progress_text(120, 120, 10), "frame 120 of 120");
  EXPECT_EQ(progress_text(7, std::nullopt, 10), "frame 7");
}

/// A frame that isn't finished after the first signal is given up, within 2 s; what is between frames isn't.
TEST(FramePatience, GivesAFrameUpAndNothingElse) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto work = [](bool in_frame) {
    install_interrupt_handler();
    FramePatience patience([] { std::fputs("the frames before are written; ", stderr); });
    patience.begin();
    std::raise(SIGTERM);
    if (!in_frame) patience.end();
    std::this_thread::sleep_for(std::chrono::seconds(in_frame ? 60 : 2));
    std::_Exit(7);
  };
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EXIT(work(true), testing::ExitedWithCode(kExitInterrupted), "are written; .*this frame is given up");
  // 1.2 s of patience; the program that waits starts anew, which takes a loaded machine longer than the rest.
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
  EXPECT_EXIT(work(false), testing::ExitedWithCode(7), "interrupted");
}

}  // namespace
}  // namespace tactus::test
