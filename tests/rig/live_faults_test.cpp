// Eight processes of clients and a network that fails (faulty_network.h): some seconds of it, or with
// TACTUS_LONG_TESTS ten minutes each.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <thread>

#include "rig/faulty_network.h"
#include "rig/lossy_link.h"
#include "tactus/base/timing.h"
#include "tactus/rig/live.h"
#include "tactus/rig/live/live_keys.h"

namespace tactus {
namespace {

constexpr int kCameras = 8;
constexpr double kFps = 30;
constexpr Vec2i kSize{640, 480};

bool long_tests() { return std::getenv("TACTUS_LONG_TESTS") != nullptr; }

double resident_mb() {
  std::ifstream statm("/proc/self/statm");
  double all = 0, resident = 0;
  statm >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

class LiveFaults : public ::testing::Test {
 protected:
  void SetUp() override {
    settings_.address = "tcp://127.0.0.1:*";
    settings_.fps = kFps;
    settings_.sync = LiveSync::trigger;
    keys_.server = make_live_key(kServerName, "");
    for (int c = 0; c < kCameras; ++c) {
      cameras_.push_back({"cam" + std::to_string(c), kSize, 1, false});
      client_keys_.push_back(make_live_key(cameras_.back().name, keys_.server.public_key));
      keys_.clients.push_back({cameras_.back().name, client_keys_.back().public_key});
    }
  }
  void TearDown() override {
    for (const pid_t child : children_) {
      ::kill(child, SIGKILL);
      ::waitpid(child, nullptr, 0);
    }
  }
  /// A client's process: masks whose first word is the tick.
  pid_t start(int camera) const {
    const pid_t child = ::fork();
    if (child != 0) return child;
    const auto c = static_cast<std::size_t>(camera);
    // Packets are counted, so each goes over one connection; but over a lossy link, as a client does it.
    RigClient client(cameras_[c],
                     network_ ? network_->address()
                     : link_  ? link_->address()
                              : server_->address(),
                     network_ ? std::nullopt : std::optional(client_keys_[c]), link_ ? connections_ : 1);
    CameraImages images;
    auto tick = static_cast<std::int64_t>(std::max(0.0, (now_s() - begin_s_) * kFps));
    for (;; ++tick) {
      const double captured_s = begin_s_ + static_cast<double>(tick) / kFps, wait_s = captured_s - now_s();
      if (wait_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(wait_s));
      images.mask = BitMask(kSize.x, kSize.y);
      images.mask.words[0] = static_cast<std::uint32_t>(tick);
      client.put(images, tick, captured_s);
    }
  }
  void start_all() {
    begin_s_ = now_s() + 0.5;
    for (int c = 0; c < kCameras; ++c) children_.push_back(start(c));
  }
  /// Over a network that can look into packets, so without keys.
  void start_all(const test::NetworkFaults& faults) {
    server_ = std::make_unique<RigServer>(cameras_, settings_, std::nullopt);
    network_ = std::make_unique<test::FaultyNetwork>(server_->address(), faults);
    start_all();
  }
  struct Outcome {
    std::int64_t sets = 0, complete = 0, missing_ticks = 0, mixed = 0;
    double grown_mb = 0;
    std::int64_t replaced = 0;  ///< by clients that were late themselves: the machine was busy
  };
  /// What holds of every network, and what it was.
  void expect_well(const Outcome& o) const {
    EXPECT_LE(o.missing_ticks, o.replaced / kCameras);  // what no client sent
    EXPECT_EQ(o.mixed, 0);
    EXPECT_LT(o.grown_mb, 1);
    const auto& n = network_->counts();
    EXPECT_EQ(n.crowded, 0);
    if (!long_tests()) return;
    std::printf(
        "%lld sets, %.4f complete, %.2f MB more, %lld images replaced; of %ld packets %ld dropped, %ld late, "
        "%ld twice, %ld overtaken\n",
        static_cast<long long>(o.sets), share(o), o.grown_mb, static_cast<long long>(o.replaced),
        n.packets.load(), n.dropped.load(), n.late.load(), n.twice.load(), n.overtaken.load());
  }
  static double share(const Outcome& o) {
    return static_cast<double>(o.complete) / static_cast<double>(o.sets);
  }
  /// From the second second on. @param see each set
  Outcome watch(double seconds, const std::function<void(const LiveSet&)>& see = {}) {
    Outcome o;
    LiveSet set;
    std::int64_t first = -1, last = -1;
    LiveStatus before;
    double minute_mb = 0;
    while (now_s() < begin_s_ + seconds) {
      const std::int64_t sets_before = server_->status().sets;
      if (!server_->wait(set, now_s() + 0.2) || set.tick < 2 * kFps) continue;
      if (minute_mb == 0 && now_s() > begin_s_ + 60) minute_mb = resident_mb();
      if (first < 0) {
        before = server_->status();
        if (before.sets != sets_before + 1)
          continue;  // this thread was held up: which one is the last counted?
        first = set.tick;
      }
      last = set.tick;
      for (std::size_t c = 0; c < kCameras; ++c)
        o.mixed +=
            set.is_in[c] && set.images[c].mask.words[0] != static_cast<std::uint32_t>(set.tick) ? 1 : 0;
      if (see) see(set);
    }
    // Of the server, as a newer set may replace one before this thread woke up; `first` is in neither count.
    const LiveStatus after = server_->status();
    o.sets = after.sets - before.sets;
    o.complete = after.complete_sets - before.complete_sets;
    o.missing_ticks = last - first - o.sets;
    if (minute_mb > 0) o.grown_mb = resident_mb() - minute_mb;
    for (const LiveCameraStatus& camera : server_->status().cameras) o.replaced += camera.replaced;
    return o;
  }
  static double seconds() { return long_tests() ? 600 : 4; }

  LiveSettings settings_;
  RigServer::Keys keys_;
  std::vector<LiveCamera> cameras_;
  std::vector<LiveKey> client_keys_;
  std::unique_ptr<RigServer> server_;
  std::unique_ptr<test::FaultyNetwork> network_;
  std::unique_ptr<test::LossyLink> link_;
  int connections_ = RigClient::kConnections;
  std::vector<pid_t> children_;
  double begin_s_ = 0;
};

/// 0.98^8 of the sets are complete: 0.851. Of 90 sets the share has a standard deviation of 0.038, of 18,000
/// of 0.0027.
TEST_F(LiveFaults, OfTwoPercentDroppedEveryTickIsReleased) {
  start_all({.drop = 0.02});
  const Outcome o = watch(seconds());
  expect_well(o);
  EXPECT_GT(network_->counts().dropped, 0);
  EXPECT_NEAR(share(o), 0.851, long_tests() ? 0.01 : 0.15);
}

TEST_F(LiveFaults, TwoPercentLateByLessThanTheDeadline) {
  if (!long_tests()) GTEST_SKIP() << "ten minutes: set TACTUS_LONG_TESTS=1";
  start_all({.late = 0.02});
  const Outcome o = watch(seconds());
  expect_well(o);
  EXPECT_GE(share(o), 0.999);
}

/// Packets that the next overtook, and those that come twice, are refused as repeated.
TEST_F(LiveFaults, DuplicatesReorderingAndJitterMixNoTicks) {
  start_all({.twice = 0.05, .overtaken = 0.02, .jitter_s = 0.005});
  const Outcome o = watch(seconds());
  expect_well(o);
  const auto& n = network_->counts();
  std::int64_t repeated = 0;
  for (const LiveCameraStatus& camera : server_->status().cameras)
    repeated += camera.refused[static_cast<std::size_t>(Refusal::repeated)];
  // The newest of both kinds may still be on the way. Of packets that are both, one is refused; one that was
  // overtaken may be followed by another such.
  EXPECT_GT(n.twice + n.overtaken, 0);
  EXPECT_GE(static_cast<double>(repeated), 0.95 * static_cast<double>(n.twice + n.overtaken) - 16);
  EXPECT_NEAR(share(o), 0.851, long_tests() ? 0.01 : 0.15);
}

/// A way of 20 +- 5 ms on which 2 % of the TCP segments come 200 ms late, and what follows with them. With
/// one connection a camera stands still for a tenth of the time, and of eight cameras one nearly always. With
/// copies, a packet is late where both its connections stand still: at most 0.06^2 of them, as a client sees
/// within two packets which do. Of sets of eight 3 % then miss one; 27 of 30 leaves as much again for the
/// first seconds, in which clients learn that packets are late, and for a busy machine.
TEST_F(LiveFaults, CopiesOverOtherConnectionsPassALossyLink) {
  settings_.deadline_s = 0.066;
  server_ = std::make_unique<RigServer>(cameras_, settings_, keys_);
  link_ = std::make_unique<test::LossyLink>(server_->address(), test::LinkFaults{});
  start_all();
  watch(12);  // clients learn
  const LiveStatus before = server_->status();
  const double begin_s = now_s();
  for (LiveSet set; now_s() < begin_s + 10;) server_->wait(set, now_s() + 0.1);
  const LiveStatus after = server_->status();
  const double complete_1_s =
      static_cast<double>(after.complete_sets - before.complete_sets) / (now_s() - begin_s);
  std::printf("%.1f of %.0f sets a second are complete; %ld of %ld segments came late\n", complete_1_s, kFps,
              link_->lost(), link_->segments());
  EXPECT_GT(link_->lost(), 100);
  EXPECT_GE(complete_1_s, 27);
}

/// Connections stay open and nothing passes. A client with one connection notices after three seconds without
/// a receipt, and connects anew at once; one more second is for a machine that is busy.
TEST_F(LiveFaults, AConnectionThatBringsNothingBackIsMadeAnew) {
  server_ = std::make_unique<RigServer>(cameras_, settings_, keys_);
  link_ = std::make_unique<test::LossyLink>(server_->address(), test::LinkFaults{0, 0, 0, 0});
  connections_ = 1;
  start_all();
  double forgotten_s = 0, back_s = 0;
  watch(7.5, [&](const LiveSet& set) {
    const double captured_s = static_cast<double>(set.tick) / kFps, now = now_s() - begin_s_;
    if (forgotten_s == 0 && now > 2.2) {
      link_->forget_connections();
      forgotten_s = now;
    } else if (forgotten_s > 0 && back_s == 0 && set.is_complete && captured_s > forgotten_s + 0.1) {
      back_s = now;
    }
  });
  ASSERT_GT(back_s, 0);
  EXPECT_GT(back_s - forgotten_s, 2.5);
  EXPECT_LT(back_s - forgotten_s, 4);
}

/// Killed without a word; another process takes its place.
TEST_F(LiveFaults, AKilledClientIsBackWithinASecond) {
  server_ = std::make_unique<RigServer>(cameras_, settings_, keys_);
  start_all();
  double killed_s = 0, restarted_s = 0, back_s = 0;
  std::int64_t others = 0;
  watch(5, [&](const LiveSet& set) {
    const double now = now_s() - begin_s_;
    if (killed_s == 0 && now > 2.2) {
      ::kill(children_[3], SIGKILL);
      ::waitpid(children_[3], nullptr, 0);
      killed_s = now;
    }
    if (restarted_s == 0 && killed_s > 0 && now > killed_s + 1) {
      EXPECT_FALSE(set.is_in[3]);
      children_[3] = start(3);
      restarted_s = now;
    } else if (back_s == 0 && restarted_s > 0 && set.is_in[3]) {
      back_s = now;
    }
    for (std::size_t c = 0; c < kCameras; ++c) others += c != 3 && !set.is_in[c] ? 1 : 0;
  });
  ASSERT_GT(back_s, 0);
  EXPECT_LT(back_s - restarted_s, 1);
  // Of 630 masks of others. Were they taken away with the killed one's for the second it is gone, 210 would
  // be missing; on a busy machine some miss the deadline by themselves.
  EXPECT_LE(others, 63);
}

}  // namespace
}  // namespace tactus
