// The process that holds a server's sockets: messages to it, its ends, and what a client does of late
// packets.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "tactus/base/timing.h"
#include "tactus/rig/live.h"
#include "tactus/rig/live/client_connection.h"
#include "tactus/rig/live/live_keys.h"
#include "tactus/rig/live/socket_process.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;

constexpr int kCameras = 3;
constexpr Vec2i kSize{160, 120};
constexpr double kFps = 30;

/// Children of this process that hold sockets. (A process that was killed and not yet waited for has no
/// name.)
std::vector<pid_t> socket_processes() {
  std::vector<pid_t> found;
  for (const fs::directory_entry& entry : fs::directory_iterator("/proc")) {
    std::ifstream stat(entry.path() / "stat");
    pid_t pid = 0, parent = 0;
    std::string name, state;
    if (stat >> pid >> name >> state >> parent && parent == ::getpid() && name == "(tactus-sockets)" &&
        state != "Z")
      found.push_back(pid);
  }
  return found;
}

/// A server and clients on threads of their own, thirty times a second.
class LiveSockets : public ::testing::Test {
 protected:
  void SetUp() override {
    LiveSettings settings;
    settings.address = "tcp://127.0.0.1:*";
    settings.sync = LiveSync::trigger;
    settings.fps = kFps;
    std::vector<LiveCamera> cameras;
    for (int c = 0; c < kCameras; ++c) cameras.push_back({"cam" + std::to_string(c), kSize, 1, false});
    RigServer::Keys keys{make_live_key(kServerName, ""), {}};
    std::vector<LiveKey> of_clients;
    for (const LiveCamera& camera : cameras) {
      of_clients.push_back(make_live_key(camera.name, keys.server.public_key));
      keys.clients.push_back({camera.name, of_clients.back().public_key});
    }
    server_ = std::make_unique<RigServer>(cameras, settings, keys);
    for (std::size_t c = 0; c < kCameras; ++c)
      clients_.push_back(std::make_unique<RigClient>(cameras[c], server_->address(), of_clients[c]));
    sender_ = std::thread([this] {
      for (std::int64_t tick = 0; !stops_; ++tick) {
        for (const auto& client : clients_) {
          CameraImages images;
          images.mask = BitMask(kSize.x, kSize.y);
          images.mask.words[0] = static_cast<std::uint32_t>(tick);
          client->put(images, tick, now_s());
        }
        std::this_thread::sleep_for(std::chrono::duration<double>(1 / kFps));
      }
    });
    ASSERT_LT(seconds_until_whole(), 10);
  }
  void TearDown() override {
    stops_ = true;
    if (sender_.joinable()) sender_.join();
  }
  /// Until three sets in a row were complete and right; at most 15.
  double seconds_until_whole() {
    const double begin_s = now_s();
    LiveSet set;
    for (int whole = 0; whole < 3 && now_s() < begin_s + 15;) {
      if (!server_->wait(set, now_s() + 0.1)) {
        whole = 0;
        continue;
      }
      bool ok = set.is_complete;
      for (const CameraImages& images : set.images)
        ok = ok && images.mask.words[0] == static_cast<std::uint32_t>(set.tick);
      whole = ok ? whole + 1 : 0;
    }
    return now_s() - begin_s;
  }
  std::unique_ptr<RigServer> server_;
  std::vector<std::unique_ptr<RigClient>> clients_;
  std::atomic<bool> stops_ = false;
  std::thread sender_;
};

/// As libzmq's own assertions end it, and as whoever is out of memory does. Two seconds, and ten sets at
/// 30/s.
TEST_F(LiveSockets, TheirEndCostsTwoSecondsAndNotTheRun) {
  std::int64_t ends = 0;
  for (const int signal : {SIGABRT, SIGKILL, SIGSEGV}) {
    const std::vector<pid_t> before = socket_processes();
    ASSERT_EQ(before.size(), 1U);
    ::kill(before[0], signal);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));  // sets that were on the way
    EXPECT_LT(seconds_until_whole(), 2) << "signal " << signal;
    ++ends;
    EXPECT_EQ(server_->status().socket_restarts, ends);
    EXPECT_EQ(server_->socket_restarts(), ends);
  }
}

/// A process that stands still is ended after a second of silence, and another takes its place.
TEST_F(LiveSockets, APauseOfTheirsCostsThreeSeconds) {
  const std::vector<pid_t> before = socket_processes();
  ASSERT_EQ(before.size(), 1U);
  ::kill(before[0], SIGSTOP);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_LT(seconds_until_whole(), 3);
  EXPECT_EQ(server_->status().socket_restarts, 1);
  const std::vector<pid_t> after = socket_processes();
  ASSERT_EQ(after.size(), 1U) << "the paused one is gone";
  EXPECT_NE(after[0], before[0]);
}

TEST_F(LiveSockets, NoneIsLeftWhenTheServerEnds) {
  EXPECT_EQ(socket_processes().size(), 1U);
  stops_ = true;
  sender_.join();
  server_.reset();
  EXPECT_EQ(socket_processes().size(), 0U);
}

double resident_mb(pid_t pid) {
  std::ifstream statm("/proc/" + std::to_string(pid) + "/statm");
  double all = 0, resident = 0;
  statm >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

/// Speaks ZMTP 3.1 without ZeroMQ, which would keep a message back until its last part is there.
class EndlessMessage {
 public:
  explicit EndlessMessage(const std::string& address)
      : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
    EXPECT_EQ(::connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    const timeval most{2, 0};
    ::setsockopt(fd_, SOL_SOCKET, SO_SNDTIMEO, &most, sizeof most);
    std::string greeting("\xff\0\0\0\0\0\0\0\0\x7f\x03\x01NULL", 16);
    greeting.resize(64);
    const std::string ready(
        "\x04\x1c\x05READY\x0bSocket-Type\0\0\0\x06"
        "DEALER",
        30);
    EXPECT_TRUE(send(greeting) && send(ready));
    part_ = std::string("\x03\0\0\0\0\0\0\x40\0", 9) + std::string(0x4000, 'x');  // more follow
  }
  ~EndlessMessage() { ::close(fd_); }
  EndlessMessage(const EndlessMessage&) = delete;
  EndlessMessage& operator=(const EndlessMessage&) = delete;
  /// @returns whether the connection took it.
  bool send_part() { return send(part_); }
  double part_mb() const { return 1e-6 * static_cast<double>(part_.size()); }

 private:
  bool send(const std::string& bytes) {
    std::size_t sent = 0;
    while (sent < bytes.size()) {
      const ssize_t n = ::send(fd_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (n <= 0) return false;
      sent += static_cast<std::size_t>(n);
    }
    return true;
  }
  int fd_;
  std::string part_;
};

/// ZeroMQ keeps all parts of a message until the last one is there. Memory is looked at every 50 ms above
/// 256 MB, and two looks find the connection; 2 GB/s would be 200 MB more. Others' sets go on.
TEST(PlainSockets, AMessageThatNeverEndsEndsItsConnection) {
  if (::mallinfo2().uordblks == 0) GTEST_SKIP() << "a sanitizer's malloc doesn't tell what is in use";
  LiveSettings settings;
  settings.address = "tcp://127.0.0.1:*";
  settings.sync = LiveSync::trigger;
  const LiveCamera camera{"cam0", kSize, 1, false};
  RigServer server({camera}, settings, std::nullopt);
  RigClient client(camera, server.address(), std::nullopt);
  std::int64_t tick = 0;
  const auto has_set = [&] {
    CameraImages images;
    images.mask = BitMask(kSize.x, kSize.y);
    client.put(images, ++tick, now_s());
    LiveSet set;
    return server.wait(set, now_s() + 1 / kFps);
  };
  const double begin_s = now_s();
  while (!has_set() && now_s() < begin_s + 10) continue;
  ASSERT_EQ(socket_processes().size(), 1U);
  const pid_t pid = socket_processes()[0];
  EndlessMessage endless(server.address());
  double sent_mb = 0, most_mb = 0;
  for (int k = 0; sent_mb < 3000 && endless.send_part(); ++k) {
    sent_mb += endless.part_mb();
    if (k % 1000 == 0) most_mb = std::max(most_mb, resident_mb(pid));
  }
  EXPECT_LT(sent_mb, 3000) << "it is still open";
  EXPECT_LT(most_mb, 1000);
  int sets = 0;
  for (int k = 0; k < 60; ++k) sets += has_set() ? 1 : 0;
  EXPECT_GE(sets, 54) << "the honest camera's connection stays";
  EXPECT_EQ(server.socket_restarts(), 0);
  EXPECT_LT(resident_mb(pid), 200) << "and the memory is given back";
}

/// Two ends of a link, and what was sent through it.
class Links : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, fd_.data()), 0);
    there_ = std::make_unique<SocketLink>(fd_[0], 1 << 20);
    here_ = std::make_unique<SocketLink>(fd_[1], 1 << 20);
  }
  std::array<int, 2> fd_{};
  std::unique_ptr<SocketLink> there_, here_;
};

/// Of all sizes up to a megabyte, more than the system's buffers hold: in order, whole, and none waits.
TEST_F(Links, FramesComeWholeAndInOrder) {
  std::mt19937 random(3);
  std::vector<std::string> bodies;
  for (int i = 0; i < 200; ++i)
    bodies.emplace_back(random() % (i % 20 == 0 ? 1'000'000 : 300), static_cast<char>(i));
  std::size_t sent = 0, received = 0;
  LinkFrame frame;
  while (received < bodies.size()) {
    if (sent < bodies.size()) {
      there_->send({LinkFrame::message, std::string(sent % 256, 'i'), "cam", bodies[sent]});
      ++sent;
    }
    there_->flush();
    while (here_->receive(frame)) {
      ASSERT_EQ(frame.identity.size(), received % 256);
      ASSERT_EQ(frame.user, "cam");
      ASSERT_TRUE(frame.body == bodies[received]) << received;
      ++received;
    }
    ASSERT_TRUE(here_->is_open());
  }
  EXPECT_EQ(there_->waiting_bytes(), 0U);
}

/// Whatever bytes come: it is closed or waits for more, and never reads beyond them.
TEST_F(Links, WhatIsNoFrameClosesThem) {
  std::mt19937 random(5);
  for (int i = 0; i < 2000; ++i) {
    SetUp();
    std::string bytes(1 + random() % 64, '\0');
    for (char& c : bytes) c = static_cast<char>(random() % 4 == 0 ? random() : random() % 8);
    ASSERT_EQ(::send(fd_[0], bytes.data(), bytes.size(), 0), static_cast<ssize_t>(bytes.size()));
    for (LinkFrame frame; here_->receive(frame);)
      ASSERT_LE(frame.identity.size() + frame.user.size() + frame.body.size() + 7, bytes.size());
  }
  SetUp();
  const std::string too_long("\xff\xff\xff\x7f\x04", 5);
  ::send(fd_[0], too_long.data(), too_long.size(), 0);
  LinkFrame frame;
  EXPECT_FALSE(here_->receive(frame));
  EXPECT_FALSE(here_->is_open());
}

TEST(SocketSettings, AreReadAsTheyWereWrittenOrNotAtAll) {
  const SocketSettings settings{
      "tcp://127.0.0.1:7", false, "secret", {{"cam0", "key0"}, {"cam1", "key1"}}, 9, 3};
  const std::string bytes = socket_settings_bytes(settings);
  const auto back = parse_socket_settings(bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->address, settings.address);
  EXPECT_FALSE(back->is_plain);
  EXPECT_EQ(back->clients[1].public_key, "key1");
  EXPECT_EQ(back->most_bytes, 9);
  for (std::size_t n = 0; n < bytes.size(); ++n) EXPECT_FALSE(parse_socket_settings(bytes.substr(0, n)));
}

TEST(PacketsOnTheWay, AreTwoAndTheLostAreForgotten) {
  PacketsOnTheWay way;
  EXPECT_TRUE(way.has_room(0));
  way.send(1, false, 0);
  way.send(2, true, 0.01);
  EXPECT_FALSE(way.has_room(0.02));
  EXPECT_NEAR(way.age_s(0.02), 0.02, 1e-12);
  EXPECT_TRUE(way.receive(2, 0.03).is_copy) << "its receipt stands for the one before";
  EXPECT_EQ(way.age_s(0.03), 0);
  way.send(3, false, 1);
  way.send(4, false, 1);
  EXPECT_TRUE(way.has_room(1.2)) << "four times the longest way is over";
  EXPECT_EQ(way.take_lost().count, 2);
  EXPECT_EQ(way.take_lost().count, 0);
}

}  // namespace
}  // namespace tactus
