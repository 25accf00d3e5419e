// When a client sends packets over two connections: networks and computers on a clock that is made up.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <random>
#include <vector>

#include "tactus/rig/live/client_connection.h"

namespace tactus {
namespace {

/// Packets every 33 ms, ways of 40 ms; one in 50 takes 240 ms. Three of those within ten seconds are seen.
TEST(CopyRule, BeginsAfterThreeLatePacketsAndEndsTenSecondsAfterTheLast) {
  PacketsOnTheWay way;
  CopyRule rule;
  double now = 100, last_late_s = 0;
  std::uint64_t sequence = 0;
  const auto send = [&](double way_s) {
    ASSERT_TRUE(way.has_room(now));
    way.send(++sequence, false, now);
    now += way_s;
    if (way.receive(sequence, now).is_late) rule.late(now - way_s, last_late_s = now);
  };
  for (int k = 0; k < 300; ++k) send(0.035 + 0.01 * (k % 2));
  EXPECT_EQ(last_late_s, 0) << "jitter is not late";
  for (int late = 1; late <= 3; ++late) {
    EXPECT_FALSE(rule.is_on(now));
    for (int k = 0; k < 20; ++k) send(0.040);
    send(0.240);
    EXPECT_EQ(last_late_s, now);
  }
  EXPECT_TRUE(rule.is_on(now));
  while (now < last_late_s + 9.9) send(0.040);
  EXPECT_TRUE(rule.is_on(now));
  while (now < last_late_s + 10.1) send(0.040);
  EXPECT_FALSE(rule.is_on(now));
}

/// Receipts of a computer that other programs keep busy: most take 25 ms, one in ten 90 ms; the shortest ever
/// took one. Late is from 2 x 1 + 30 + 4 x 24 = 128 ms on. (2 x shortest + 30 ms would call one in ten late,
/// and begin copies, which load the computer more.)
TEST(CopyRule, DoesNotBeginOnABusyComputer) {
  PacketsOnTheWay way;
  CopyRule rule;
  double now = 100;
  int late = 0;
  for (std::uint64_t sequence = 1; sequence <= 600; ++sequence) {
    ASSERT_TRUE(way.has_room(now));
    way.send(sequence, false, now);
    now += sequence == 1 ? 0.001 : sequence % 10 == 9 ? 0.090 : 0.025;
    if (!way.receive(sequence, now).is_late) continue;
    ++late;
    rule.late(now, now);
  }
  EXPECT_EQ(late, 0);
  EXPECT_EQ(way.take_lost().count, 0);
  EXPECT_FALSE(rule.is_on(now));
}

/// A server that refuses for too many bytes would refuse the copies' originals, too.
TEST(CopyRule, GivesWayToAServerThatSaysTooMuch) {
  CopyRule rule;
  for (const double t : {100.0, 101.0, 102.0}) rule.late(t, t);
  EXPECT_TRUE(rule.is_on(102));
  rule.refused(102);
  EXPECT_FALSE(rule.is_on(102));
  rule.late(110.5, 110.5);
  EXPECT_FALSE(rule.is_on(111.9));
  EXPECT_TRUE(rule.is_on(112.1));
}

/// A packet that the client itself held up says nothing of the network.
TEST(CopyRule, DoesNotCountPacketsThatTheClientHeldUp) {
  CopyRule rule;
  for (const double t : {100.0, 101.0, 102.0}) {
    rule.woke(t + 0.02, t + 0.05);  // 30 ms late
    rule.late(t, t + 0.2);
  }
  EXPECT_FALSE(rule.is_on(102.2));
  for (const double t : {103.0, 104.0, 105.0}) {
    rule.woke(t - 0.02, t - 0.015);  // 5 ms late, and before they were sent
    rule.late(t, t + 0.2);
  }
  EXPECT_TRUE(rule.is_on(105.2));
}

/// A client with four connections, 30 packets a second, and ways that a function makes up: what RigClient
/// does, on a clock of its own.
class CopyRehearsal {
 public:
  static constexpr int kConnections = 4;
  static constexpr double kFrame_s = 1.0 / 30;
  /// @param arrives_s when the receipt comes of a packet that a connection sends now
  template <class F>
  void run(double seconds, F&& arrives_s) {
    for (const double end_s = now_s_ + seconds; now_s_ < end_s; now_s_ += kFrame_s) {
      take_receipts(now_s_);
      send(arrives_s);
    }
  }
  int packets = 0, copied = 0;
  int in_time = 0;  ///< of which a receipt came within 66 ms

 private:
  struct Receipt {
    double at_s;
    std::uint64_t sequence;
    int connection;
    double sent_s;
    bool operator>(const Receipt& b) const { return at_s > b.at_s; }
  };
  void take_receipts(double until_s) {
    for (; !receipts_.empty() && receipts_.top().at_s <= until_s; receipts_.pop()) {
      const Receipt r = receipts_.top();
      const auto receipt = ways_[static_cast<std::size_t>(r.connection)].receive(r.sequence, r.at_s);
      if (receipt.is_late) rule_.late(receipt.sent_s, r.at_s);
      rule_.receive(r.sequence, receipt.is_late || receipt.sent_s == 0, r.at_s);
      if (r.at_s - r.sent_s < 0.066 && r.sequence > last_in_time_) {
        last_in_time_ = r.sequence;
        ++in_time;
      }
    }
  }
  template <class F>
  void send(F&& arrives_s) {
    std::vector<int> to;
    for (int c = 0; c < kConnections; ++c) {
      PacketsOnTheWay& way = ways_[static_cast<std::size_t>(c)];
      if (way.has_room(now_s_)) to.push_back(c);
      const PacketsOnTheWay::Lost lost = way.take_lost();
      for (int k = 0; k < lost.count; ++k) rule_.late(lost.sent_s, now_s_);
    }
    std::stable_sort(to.begin(), to.end(), [&](int a, int b) {
      return ways_[static_cast<std::size_t>(a)].age_s(now_s_) <
             ways_[static_cast<std::size_t>(b)].age_s(now_s_);
    });
    ++packets;
    if (to.empty()) return;
    const bool is_copied = rule_.is_on(now_s_) && to.size() > 1;
    to.resize(is_copied ? 2 : 1);
    ++sequence_;
    copied += is_copied ? 1 : 0;
    if (is_copied) rule_.send(sequence_);
    for (const int c : to) {
      ways_[static_cast<std::size_t>(c)].send(sequence_, is_copied, now_s_);
      receipts_.push({arrives_s(c, now_s_), sequence_, c, now_s_});
    }
  }
  CopyRule rule_;
  std::array<PacketsOnTheWay, kConnections> ways_;
  std::priority_queue<Receipt, std::vector<Receipt>, std::greater<>> receipts_;
  double now_s_ = 100;
  std::uint64_t sequence_ = 0, last_in_time_ = 0;
};

/// A computer on which other programs take turns: all that would be answered in a pause is answered at its
/// end. Pauses of 150 to 400 ms begin once in a second on average, so the median stays short and packets are
/// late. A client that sends copies whenever three in ten seconds are late sends nearly all twice. Here a
/// try ends after four packets of which both copies are late, about four seconds, and rests last up to
/// 160 s: in ten minutes there are six tries, 24 s of 600. Twice that is allowed.
TEST(CopyRule, CopiesRestOnAComputerThatPauses) {
  std::mt19937 random(5);
  std::exponential_distribution<double> gap_s(1.0);
  std::uniform_real_distribution<double> pause_s(0.15, 0.4);
  double from_s = 0, until_s = 0;
  CopyRehearsal rehearsal;
  const auto arrives_s = [&](int, double now) {
    while (until_s < now) {
      from_s = std::max(until_s, now) + gap_s(random);
      until_s = from_s + pause_s(random);
    }
    const double at_s = now + 0.002;
    return at_s > from_s ? std::max(at_s, until_s) : at_s;
  };
  rehearsal.run(600, arrives_s);
  EXPECT_GT(rehearsal.copied, 0);
  EXPECT_LT(rehearsal.copied, 2 * 24 * 30);
}

/// The network of live_faults_test, with a way there and back of 40 +- 10 ms: each connection stands still by
/// itself for 200 ms, once in 50 packets, which is 0.12 of the time. One of two copies is then nearly always
/// saved by the other: copies are never given up. A packet is late where both connections stand still,
/// 0.12^2 of them at most: 98 % come in time.
TEST(CopyRule, CopiesGoOnOverALossyNetwork) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::array<double, CopyRehearsal::kConnections> free_s{};
  const auto arrives_s = [&](int c, double now) {
    double& free = free_s[static_cast<std::size_t>(c)];
    free = std::max(free, now + 0.030 + 0.02 * uniform(random) + (uniform(random) < 0.02 ? 0.2 : 0));
    return free;
  };
  CopyRehearsal rehearsal;
  rehearsal.run(20, arrives_s);
  const int packets = rehearsal.packets, copied = rehearsal.copied, in_time = rehearsal.in_time;
  rehearsal.run(600, arrives_s);
  EXPECT_GE(rehearsal.copied - copied, 0.95 * (rehearsal.packets - packets));
  EXPECT_GE(rehearsal.in_time - in_time, 0.98 * (rehearsal.packets - packets));
}

/// Rests of minutes end at once when the network is to blame again: the longest is 160 s.
TEST(CopyRule, RestsEnd) {
  CopyRule rule;
  double now = 100;
  std::uint64_t sequence = 0;
  double longest_s = 0;
  for (int tries = 0; tries < 12; ++tries) {
    const double since_s = now;
    for (; !rule.is_on(now); now += 0.5) rule.late(now, now);
    if (tries > 0) longest_s = std::max(longest_s, now - since_s);
    while (rule.is_on(now)) {
      rule.send(++sequence);
      now += 0.3;
      EXPECT_TRUE(rule.receive(sequence, true, now));
      rule.receive(sequence, true, now);
    }
  }
  EXPECT_NEAR(longest_s, CopyRule::kMostRest_s, 1);
}

}  // namespace
}  // namespace tactus
