// tactus keys, client, serve, run --source RIG, rig status: programs that talk over the loopback.
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <thread>

#include "cli/program.h"

namespace tactus::test {
namespace {

class LiveCli : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    if (IsSkipped()) return;
    if (run_tactus("info").text.find("without  ZeroMQ") != std::string::npos)
      GTEST_SKIP() << "built without ZeroMQ";
    const Outcome film = run_tactus(
        "synth sphere --moving --frames 4 --cameras 3 --depth-cameras 1 --no-colors --out " + path("film"));
    ASSERT_EQ(film.code, 0) << film.text;
    // A port of its own, as tests run side by side.
    const int port = 20000 + static_cast<int>(::getpid()) % 10000;
    rig_ = path("film/rig.yaml");
    std::ofstream(rig_, std::ios::app) << "live: {address: 'tcp://127.0.0.1:" << port << "'}\n";
    write("s.yaml",
          "source: {kind: synthetic, figure: sphere, depth_cameras: 0}\nreconstruction: {resolution: 16}\n"
          "bodies:\n  - {name: b, shape: {kind: box, size_m: [0.2, 0.2, 0.2]}, spacing_m: 0.1}\n");
  }
  /// A program beside the test, that ends by itself.
  void start(const std::string& arguments) const {
    const std::string command = program() + " " + arguments + " >>" + path("log") + " 2>&1 &";
    ASSERT_EQ(std::system(command.c_str()), 0);
  }
  void start_clients(const std::string& flags) const {
    for (const char* camera : {"cam0", "cam1", "cam2", "tof"})
      start("client " + std::string(camera) + " " + rig_ + " --seconds 3 " + flags);
  }
  std::string rig_;
};

TEST_F(LiveCli, AWholeLoopIsRecordedAndReplayed) {
  ASSERT_EQ(run_tactus("keys " + rig_).code, 0);
  const std::string run = "run " + path("s.yaml") + " --devices cpu --view none ";
  start_clients("");
  const Outcome live = run_tactus(run + "--source " + rig_ + " --frames 30 --record " + path("r") +
                                  " --json " + path("live.json"));
  ASSERT_EQ(live.code, 0) << live.text;
  const nlohmann::json json = read_json("live.json");
  EXPECT_EQ(json["frames"], 30);
  // Medians of stages that follow one another: no stage is longer than the whole.
  const auto p50_ms = [&](const char* stage) { return json["ms"][stage]["p50"].get<double>(); };
  for (const char* stage : {"capture to set", "set to hull", "hull to bodies"}) {
    EXPECT_GT(p50_ms(stage), 0) << stage;
    EXPECT_LT(p50_ms(stage), p50_ms("latency")) << stage;
  }
  ASSERT_EQ(run_tactus(run + "--source " + path("r") + " --json " + path("again.json")).code, 0);
  EXPECT_EQ(read_json("again.json")["state_hash"], json["state_hash"]);
  EXPECT_FALSE(read_json("again.json")["ms"].contains("capture to set"));
}

TEST_F(LiveCli, ServeTellsWhoIsThere) {
  start_clients("--plain");
  start("serve " + rig_ + " --plain --seconds 3 --record " + path("r"));
  // Rates are there after the first whole second.
  const auto is_there = [&] {
    if (run_tactus("rig status " + rig_ + " --plain --json " + path("status.json")).code != 0) return false;
    const nlohmann::json status = read_json("status.json");
    return status["complete_sets"] > 5 &&
           std::all_of(status["cameras"].begin(), status["cameras"].end(), [](const nlohmann::json& camera) {
             return camera["present"] == true && camera["packets_per_s"] > 8;  // 30 on a machine that is free
           });
  };
  bool was_there = false;
  for (int i = 0; i < 10 && !was_there; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    was_there = is_there();
  }
  EXPECT_TRUE(was_there) << read_json("status.json");
  std::this_thread::sleep_for(std::chrono::milliseconds(2000));  // until it has ended
  EXPECT_EQ(
      run_tactus("reconstruct --source recording " + path("r") + " --frames 10 --resolution 16 --devices cpu")
          .code,
      0);
}

/// With keys a server may listen on every network. It says so, once.
TEST_F(LiveCli, OneLineSaysThatEveryNetworkLeadsThere) {
  const auto served = [&](const std::string& address) {
    std::stringstream text;
    text << std::ifstream(rig_).rdbuf();
    std::string open = text.str();
    const std::string own = "tcp://127.0.0.1:";
    open.replace(open.find(own), own.size(), address);
    write("film/open.yaml", open);
    return run_tactus("serve " + path("film/open.yaml") + " --seconds 0.2");
  };
  ASSERT_EQ(run_tactus("keys " + rig_).code, 0);
  const std::string line = "every network of this computer leads there";
  for (const char* every : {"tcp://0.0.0.0:", "tcp://*:"}) {
    const Outcome outcome = served(every);
    EXPECT_EQ(outcome.code, 0) << outcome.text;
    const std::size_t at = outcome.text.find(line);
    ASSERT_NE(at, std::string::npos) << outcome.text;
    EXPECT_EQ(outcome.text.find(line, at + 1), std::string::npos) << outcome.text;
  }
  const Outcome here = served("tcp://127.0.0.1:");
  EXPECT_EQ(here.code, 0) << here.text;
  EXPECT_EQ(here.text.find(line), std::string::npos) << here.text;
}

TEST_F(LiveCli, KeysThatExistAreKept) {
  const auto key_of = [&](const std::string& camera) {
    std::stringstream text;
    text << std::ifstream(path("film/keys/" + camera + ".key")).rdbuf();
    return text.str();
  };
  ASSERT_EQ(run_tactus("keys " + rig_).code, 0);
  const std::string first = key_of("cam0"), second = key_of("cam1"), server = key_of("server");
  ASSERT_EQ(std::filesystem::remove(path("film/keys/cam1.key")), true);
  ASSERT_EQ(run_tactus("keys " + rig_).code, 0);
  EXPECT_EQ(key_of("cam0"), first);
  EXPECT_EQ(key_of("server"), server);
  EXPECT_NE(key_of("cam1"), second) << "it was taken away";
}

TEST_F(LiveCli, WhatIsWrongHasOneMessage) {
  expect_refused("client cam0 " + rig_, 1, {"cam0.key", "'tactus keys RIG' makes keys"});
  expect_refused("client cam9 " + rig_, 2, {"no camera 'cam9'", "cam0"});
  expect_refused("client cam0 " + rig_ + " --plain --server tcp://192.0.2.1:7447", 2,
                 {"is another computer"});
  expect_refused("run " + path("s.yaml") + " --view none --source " + rig_, 1, {"server.key"});
  ASSERT_EQ(run_tactus("keys " + rig_).code, 0);
  const std::string key = path("film/keys/cam0.key");
  ::chmod(key.c_str(), 0644);
  expect_refused("client cam0 " + rig_, 1, {"cam0.key", "expected mode 0600"});
  ::chmod(key.c_str(), 0600);
  expect_refused("client cam1 " + rig_ + " --key " + key, 2, {"camera 'cam0's", "'cam1'"});
  expect_refused("rig status " + rig_, 1, {"nobody answers"});
}

}  // namespace
}  // namespace tactus::test
