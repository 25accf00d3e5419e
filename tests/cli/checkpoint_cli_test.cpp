// tactus run --checkpoint and --restart.
#include <csignal>
#include <fstream>

#include "cli/program.h"

namespace tactus::test {
namespace {

class CheckpointCli : public ProgramTest {
 protected:
  std::string scene(const std::string& more = "") const {
    return write("s.yaml",
                 "source: {kind: synthetic, figure: hand, scale: 0.6, frames: 0-5, depth_cameras: 0}\n"
                 "reconstruction: {resolution: 24}\n"
                 "bodies:\n  - name: block\n    shape: {kind: box, size_m: [0.3, 0.3, 0.3]}\n"
                 "    placement: {position_m: [0, 0.2, 0]}\n    spacing_m: 0.05\n"
                 "    fixed: [{kind: half_space, point_m: [0, -0.14, 0]}]\n"
                 "probes: [{name: top, body: block, position_m: [0, 0.15, 0]}]\n" +
                     more);
  }
  Outcome run(const std::string& arguments) const {
    return run_tactus("run " + path("s.yaml") + " --devices cpu --view none " + arguments);
  }
};

TEST_F(CheckpointCli, ARunGoesOnWithTheSameBits) {
  scene();
  ASSERT_EQ(run("--json " + path("all.json")).code, 0);
  ASSERT_EQ(run("--frames 3 --checkpoint " + path("c") + " --json " + path("a.json")).code, 0);
  const Outcome rest = run("--restart " + path("c") + " --json " + path("b.json"));
  ASSERT_EQ(rest.code, 0) << rest.text;
  nlohmann::json joined = read_json("a.json")["probes"]["top"];
  const nlohmann::json rest_json = read_json("b.json");
  for (const auto& x : rest_json["probes"]["top"]) joined.push_back(x);
  EXPECT_EQ(joined, read_json("all.json")["probes"]["top"]);
  EXPECT_EQ(joined.size(), 6U);
  EXPECT_NE(joined[2], joined[5]);
}

TEST_F(CheckpointCli, OfTheLastFrameNothingIsLeftToRun) {
  scene();
  ASSERT_EQ(run("--checkpoint " + path("c")).code, 0);
  const Outcome rest = run("--restart " + path("c") + " --json " + path("b.json"));
  EXPECT_EQ(rest.code, 1);
  EXPECT_NE(rest.text.find("its frames end where '" + path("c") + "' was written: nothing is left to run"),
            std::string::npos)
      << rest.text;
  EXPECT_FALSE(std::filesystem::exists(path("b.json")));
}

TEST_F(CheckpointCli, WhatIsNoCheckpointOfTheSceneHasOneMessage) {
  scene();
  ASSERT_EQ(run("--frames 2 --checkpoint " + path("c")).code, 0);
  std::string bytes;
  std::getline(std::ifstream(path("c"), std::ios::binary), bytes, '\0');
  EXPECT_EQ(bytes.substr(0, 8), "TACTUSCP");
  std::filesystem::copy_file(path("c"), path("cut"));
  std::filesystem::resize_file(path("cut"), std::filesystem::file_size(path("c")) / 2);
  const auto expect = [&](const std::string& file, const std::string& text) {
    const Outcome o = run("--restart " + path(file));
    EXPECT_NE(o.code, 0);
    EXPECT_NE(o.text.find(text), std::string::npos) << o.text;
  };
  expect("cut", "it was cut short, or something was added");
  expect("s.yaml", "it is no checkpoint of tactus run");
  expect("none", "none");
  scene("contact: {friction: 0.1}\n");
  expect("c", "the checkpoint is of another scene than " + path("s.yaml") + ", or that was changed since");
}

TEST_F(CheckpointCli, AnInterruptedRunGoesOn) {
  scene();
  std::string text;
  std::ifstream in(path("s.yaml"));
  for (std::string line; std::getline(in, line);) text += line + "\n";
  write("s.yaml", text.replace(text.find("0-5"), 3, "0-9999"));
  const Outcome o = run_and_signal(
      {"run", path("s.yaml"), "--devices", "cpu", "--view", "none", "--checkpoint", path("c"), "--verbose"},
      "frame 2 ", SIGINT);
  ASSERT_EQ(o.code, 130) << o.text;
  const Outcome rest = run("--frames 1 --restart " + path("c"));
  EXPECT_EQ(rest.code, 0) << rest.text;
}

}  // namespace
}  // namespace tactus::test
