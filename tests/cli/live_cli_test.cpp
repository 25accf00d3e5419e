// tactus keys, client, serve, run --source RIG, rig status: programs that talk over the loopback.
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <regex>
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
  /// The process of sockets whose parent runs with a file of this test; 0: none. (A shell around the program
  /// has no sockets.)
  pid_t socket_process() const {
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
      std::ifstream stat(entry.path() / "stat");
      pid_t pid = 0, parent = 0;
      std::string name, state;
      if (!(stat >> pid >> name >> state >> parent) || name != "(tactus-sockets)" || state == "Z") continue;
      if (text_of("/proc/" + std::to_string(parent) + "/cmdline").find(rig_) != std::string::npos) return pid;
    }
    return 0;
  }
  static std::string text_of(const std::string& file) {
    std::stringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
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

/// Their end is told, and costs sets alone: the scene goes on, and the recording has what it saw.
TEST_F(LiveCli, TheEndOfTheSocketsEndsNoRun) {
  ASSERT_EQ(run_tactus("keys " + rig_).code, 0);
  const std::string run = "run " + path("s.yaml") + " --devices cpu --view none ";
  start_clients("");
  int killed = 0;
  std::thread killer([&] {
    for (int k = 0; k < 200 && killed < 2; ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
      if (const pid_t pid = socket_process(); pid != 0 && ::kill(pid, SIGKILL) == 0) ++killed;
      if (std::filesystem::exists(path("live.json"))) break;
    }
  });
  const Outcome live = run_tactus(run + "--source " + rig_ + " --frames 75 --record " + path("r") +
                                  " --json " + path("live.json"));
  killer.join();
  ASSERT_EQ(live.code, 0) << live.text;
  ASSERT_GT(killed, 0);
  const std::string line = "the process of the live sockets was started again";
  EXPECT_NE(live.text.find(line), std::string::npos) << live.text;
  const nlohmann::json json = read_json("live.json");
  EXPECT_EQ(json["frames"], 75);
  EXPECT_GE(json["live"]["socket_restarts"], 1);
  EXPECT_NE(json["statuses"].dump().find(line), std::string::npos) << json["statuses"];
  const Outcome again = run_tactus(run + "--source " + path("r") + " --json " + path("again.json"));
  ASSERT_EQ(again.code, 0) << again.text;
  EXPECT_EQ(read_json("again.json")["frames"], 75);
  EXPECT_EQ(read_json("again.json")["state_hash"], json["state_hash"]);
}

/// One line of the server, one of the client that is refused. The first goes on.
TEST_F(LiveCli, ASecondClientOfACameraIsReportedOnBothSides) {
  start_clients("--plain");
  start("client cam0 " + rig_ + " --plain --seconds 3");
  const Outcome server = run_tactus("serve " + rig_ + " --plain --seconds 4");
  EXPECT_EQ(server.code, 0) << server.text;
  const auto count = [](const std::string& text, const std::string& line) {
    int found = 0;
    for (std::size_t at = text.find(line); at != text.npos; at = text.find(line, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count(server.text, "camera 'cam0': a second client sends for it, and is refused"), 1)
      << server.text;
  // On a busy computer the first may be silent long enough for the second, and then be the refused one.
  const int refused = count(text_of(path("log")), "the server refuses packets: other client");
  EXPECT_GE(refused, 1) << text_of(path("log"));
  EXPECT_LE(refused, 2) << text_of(path("log"));
}

/// A wrong address, a key that the server doesn't know and a server that isn't there look alike to a client.
/// It says so after three seconds, once, and once that somebody answers.
TEST_F(LiveCli, AClientThatNobodyAnswersSaysSo) {
  start("client cam0 " + rig_ + " --plain --seconds 8");
  const std::string alone = "warning: nobody answers at tcp://127.0.0.1:", answers = " answers\n";
  std::string text;
  for (int k = 0; k < 60 && text.find(alone) == text.npos; ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    text = text_of(path("log"));
  }
  ASSERT_NE(text.find(alone), text.npos) << text;
  EXPECT_EQ(run_tactus("serve " + rig_ + " --plain --seconds 2").code, 0);
  text = text_of(path("log"));
  EXPECT_EQ(text.find(alone), text.rfind(alone)) << text;
  EXPECT_NE(text.find(answers), text.npos) << text;
}

/// Frames of minutes: it ends in time, and a beat is not waited for.
TEST_F(LiveCli, ASlowClientEndsInTime) {
  const std::string film = text_of(rig_);
  write("film/slow.yaml", std::regex_replace(film, std::regex("frames_per_s: .*"), "frames_per_s: 0.01"));
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(run_tactus("client cam0 " + path("film/slow.yaml") + " --plain --seconds 0.5").code, 0);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
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
  // A camera that came after the keys is named.
  const std::string list = path("film/keys/clients.keys");
  std::string clients = text_of(list);
  const std::size_t line = clients.find("cam2 ");
  ASSERT_NE(line, std::string::npos) << clients;
  clients.erase(line, clients.find('\n', line) + 1 - line);
  std::ofstream(list) << clients;
  const Outcome served = run_tactus("serve " + rig_ + " --seconds 0.2");
  EXPECT_EQ(served.code, 0) << served.text;
  EXPECT_NE(served.text.find("camera 'cam2' has no key in"), std::string::npos) << served.text;
  EXPECT_EQ(served.text.find("camera 'cam1' has no key in"), std::string::npos) << served.text;
  // A link to itself is there, and is no key.
  std::filesystem::remove(path("film/keys/tof.key"));
  std::filesystem::create_symlink("tof.key", path("film/keys/tof.key"));
  const Outcome loop = run_tactus("keys " + rig_);
  EXPECT_EQ(loop.code, 1);
  EXPECT_NE(loop.text.find("'tactus keys RIG' makes keys"), std::string::npos) << loop.text;
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
