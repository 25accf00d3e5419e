// Sets from a simulated network of eight cameras: ten minutes of 30 ticks a second, in a second or two.
#include "tactus/rig/wire/set_assembler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>
#include <random>

#include "tactus/rig/wire/clock_fit.h"

namespace tactus {
namespace {

constexpr int kCameras = 8;
constexpr double kPeriod_s = 1.0 / 30;

struct Network {
  double drop = 0, late = 0, late_s = 0.020, jitter_s = 0.0005, way_s = 0.0003, repeat = 0;
  double drift = 0;     ///< the clocks of the cameras are off by up to that
  double offset_s = 0;  ///< and by up to that
  bool by_trigger = true;
  double seconds = 600;
  std::function<bool(int camera, double time_s)> is_off = [](int, double) { return false; };
};

struct Packet {
  double arrived_s = 0, captured_s = 0, sent_s = 0;  ///< the latter two on the camera's clock
  int camera = 0;
  std::int64_t tick = 0;
  bool operator>(const Packet& b) const { return arrived_s > b.arrived_s; }
};

struct Outcome {
  std::int64_t ticks = 0, mixed = 0;
  SetAssembler::Counts counts;
  RefusalCounts refused{};
  double worst_clock_s = 0;                       ///< after ten seconds
  std::map<int, std::vector<double>> present_at;  ///< per camera: captures of sets with it
  double worst_wait_s = 0;                        ///< from a set's capture to its release
};

class Rehearsal {
 public:
  Rehearsal(const Network& network, SetAssembler::Options options)
      : network_(network),
        assembler_((options.cameras = kCameras, options.by_trigger = network.by_trigger, options)) {
    for (int c = 0; c < kCameras; ++c) {
      drift_[c] = network.drift * (2.0 * c / (kCameras - 1) - 1);
      offset_s_[c] = network.offset_s * ((c * 5) % kCameras) / kCameras;
    }
  }
  Outcome run() {
    const auto ticks = static_cast<std::int64_t>(network_.seconds / kPeriod_s);
    for (std::int64_t tick = 0; tick < ticks; ++tick) {
      send(tick);
      drain(static_cast<double>(tick + 1) * kPeriod_s);
    }
    drain(1e9);
    outcome_.ticks = ticks;
    outcome_.counts = assembler_.counts();
    return outcome_;
  }

 private:
  double uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  void send(std::int64_t tick) {
    constexpr double kWork_s = 0.004;  // from the capture to the packet
    const double time_s = static_cast<double>(tick) * kPeriod_s;
    for (int c = 0; c < kCameras; ++c) {
      if (network_.is_off(c, time_s) || uniform() < network_.drop) continue;
      const auto theirs = [&](double t) { return offset_s_[c] + t * (1 + drift_[c]); };
      Packet packet{0, theirs(time_s), theirs(time_s + kWork_s), c, tick};
      const int copies = uniform() < network_.repeat ? 2 : 1;
      for (int copy = 0; copy < copies; ++copy) {
        packet.arrived_s = time_s + kWork_s + network_.way_s + network_.jitter_s * uniform() +
                           (uniform() < network_.late ? network_.late_s : 0);
        way_.push(packet);
      }
    }
  }
  /// All that happens before `until_s`, in order: packets and deadlines.
  void drain(double until_s) {
    for (;;) {
      const double packet_s = way_.empty() ? 1e9 : way_.top().arrived_s;
      const double deadline_s = assembler_.next_deadline_s().value_or(1e9);
      const double now_s = std::min(packet_s, deadline_s);
      if (now_s >= until_s) return;
      if (packet_s <= deadline_s) {
        arrive(way_.top());
        way_.pop();
      }
      release(now_s);
    }
  }
  void arrive(const Packet& packet) {
    ClockFit& fit = fits_[packet.camera];
    fit.add(packet.sent_s, packet.arrived_s);
    const double captured_s = fit.to_ours(packet.captured_s);
    if (packet.arrived_s > 10)
      outcome_.worst_clock_s =
          std::max(outcome_.worst_clock_s,
                   std::abs(captured_s - static_cast<double>(packet.tick) * kPeriod_s - network_.way_s));
    const SetAssembler::Place place =
        assembler_.admit({packet.camera, packet.tick, captured_s, packet.arrived_s});
    if (place.refusal != Refusal::none) {
      ++outcome_.refused[static_cast<std::size_t>(place.refusal)];
      return;
    }
    images_[place.slot][packet.camera] = packet.tick;
    assembler_.fill(place);
  }
  void release(double now_s) {
    while (const auto set = assembler_.release(now_s)) {
      std::int64_t tick = -1;
      for (int c = 0; c < kCameras; ++c) {
        if (!assembler_.has(set->slot, c)) continue;
        const std::int64_t of_camera = images_[set->slot][c];
        if (tick >= 0 && of_camera != tick) ++outcome_.mixed;
        tick = of_camera;
        outcome_.present_at[c].push_back(static_cast<double>(tick) * kPeriod_s);
      }
      EXPECT_GT(set->tick, last_tick_);
      last_tick_ = set->tick;
      outcome_.worst_wait_s = std::max(outcome_.worst_wait_s, now_s - set->captured_s);
      assembler_.recycle(set->slot);
    }
  }

  Network network_;
  SetAssembler assembler_;
  std::mt19937 random_{7};
  std::priority_queue<Packet, std::vector<Packet>, std::greater<>> way_;
  double drift_[kCameras] = {}, offset_s_[kCameras] = {};
  ClockFit fits_[kCameras];
  std::int64_t images_[SetAssembler::kSlots][kCameras] = {};
  std::int64_t last_tick_ = -1000;
  Outcome outcome_;
};

Outcome rehearse(const Network& network, const SetAssembler::Options& options = {}) {
  return Rehearsal(network, options).run();
}

std::int64_t refused(const Outcome& o, Refusal why) { return o.refused[static_cast<std::size_t>(why)]; }

class Sets : public ::testing::TestWithParam<bool> {
 protected:
  Network network() const {
    Network n;
    n.by_trigger = GetParam();
    n.offset_s = 1000;
    n.drift = 50e-6;
    return n;
  }
};

/// Independent drops: all eight cameras are in 0.98^8 = 0.8508 of the sets, with a standard deviation of
/// 0.0027.
TEST_P(Sets, OfTwoPercentDroppedEveryTickIsReleased) {
  Network n = network();
  n.drop = 0.02;
  const Outcome o = rehearse(n);
  EXPECT_EQ(o.counts.released, o.ticks);
  EXPECT_NEAR(static_cast<double>(o.counts.complete) / static_cast<double>(o.ticks), 0.851, 0.01);
  EXPECT_EQ(o.mixed, 0);
  EXPECT_LE(o.worst_wait_s, 0.0331);
}

TEST_P(Sets, OfTwoPercentLateByLessThanTheDeadlineAreComplete) {
  Network n = network();
  n.late = 0.02;
  const Outcome o = rehearse(n);
  EXPECT_EQ(o.counts.released, o.ticks);
  EXPECT_GE(static_cast<double>(o.counts.complete) / static_cast<double>(o.ticks), 0.999);
  EXPECT_EQ(o.mixed, 0);
}

/// Beyond the deadline they are counted and in no set.
TEST_P(Sets, WhatComesAfterTheDeadlineIsCountedAndInNoSet) {
  Network n = network();
  n.late = 0.02;
  n.late_s = 0.060;
  const Outcome o = rehearse(n);
  EXPECT_EQ(o.mixed, 0);
  const std::int64_t missing = o.ticks * kCameras - [&] {
    std::int64_t in = 0;
    for (const auto& [camera, times] : o.present_at) in += static_cast<std::int64_t>(times.size());
    return in;
  }();
  EXPECT_EQ(refused(o, Refusal::late), missing);
  EXPECT_NEAR(static_cast<double>(missing), 0.02 * static_cast<double>(o.ticks) * kCameras,
              300);  // 5 deviations
}

TEST_P(Sets, NeverMixTicks) {
  Network n = network();
  n.jitter_s = 0.005;
  n.drop = n.late = 0.02;
  n.late_s = 0.050;  // overtaken by the next tick's
  n.repeat = 0.02;
  const Outcome o = rehearse(n);
  EXPECT_EQ(o.mixed, 0);
  EXPECT_EQ(o.counts.released, o.ticks);
  EXPECT_GT(refused(o, Refusal::repeated) + refused(o, Refusal::late), 0);
}

/// 100 ppm are 60 ms in the ten minutes, and the way jumps by 5 ms.
TEST_P(Sets, FollowClocksThatDrift) {
  Network n = network();
  n.drift = 100e-6;
  n.jitter_s = 0.005;
  const Outcome o = rehearse(n);
  EXPECT_LE(o.worst_clock_s, 0.001);
  EXPECT_EQ(o.mixed, 0);
  EXPECT_GE(o.counts.complete, o.ticks - 3);  // the first before all were heard
}

TEST_P(Sets, GoOnWithoutACameraAndTakeItBack) {
  Network n = network();
  n.seconds = 30;
  n.is_off = [](int camera, double t) { return camera == 3 && t > 10 && t < 20; };
  const Outcome o = rehearse(n);
  EXPECT_EQ(o.counts.released, o.ticks);
  const std::vector<double>& times = o.present_at.at(3);
  const double back_s = *std::find_if(times.begin(), times.end(), [](double t) { return t > 15; });
  EXPECT_LE(back_s - 20, 0.1);
  // Others are in every set (but the first).
  for (const auto& [camera, at] : o.present_at) {
    if (camera == 3) continue;
    EXPECT_GE(static_cast<std::int64_t>(at.size()), o.ticks - 1) << camera;
  }
}

INSTANTIATE_TEST_SUITE_P(By, Sets, ::testing::Bool(),
                         [](const auto& p) { return p.param ? "Trigger" : "Time"; });

/// A camera that is missing costs the others the deadline for half a second, then nothing.
TEST(SetAssembler, DoesNotWaitForACameraThatIsGone) {
  SetAssembler a({.cameras = 2, .by_trigger = true});
  const auto arrive = [&](int camera, std::int64_t tick, double at_s) {
    const SetAssembler::Place place = a.admit({camera, tick, at_s, at_s});
    ASSERT_EQ(place.refusal, Refusal::none);
    a.fill(place);
  };
  const auto release = [&](double now_s) {
    const auto set = a.release(now_s);
    if (set) a.recycle(set->slot);
    return set.has_value();
  };
  arrive(0, 0, 0.001);
  release(0.001);
  arrive(1, 1, 0.0331);
  EXPECT_FALSE(release(0.034));  // camera 0 is due
  arrive(0, 1, 0.035);
  EXPECT_TRUE(release(0.035));
  arrive(1, 8, 0.50);
  EXPECT_FALSE(release(0.501));
  EXPECT_TRUE(release(0.5331));
  arrive(1, 9, 0.54);
  EXPECT_TRUE(release(0.541));  // 0.506 s after the last of camera 0
}

/// A server that is held up after the first packet finds two more and a deadline that is over. Without
/// Until::whole the first of the two would end the set, and the other would be late.
TEST(SetAssembler, PacketsThatWaitAreInTheirSetThoughTheDeadlineIsOver) {
  SetAssembler a({.cameras = 3, .by_trigger = true});
  const auto arrive = [&](int camera, std::int64_t tick, double arrived_s) {
    const SetAssembler::Place place =
        a.admit({camera, tick, static_cast<double>(tick) * kPeriod_s, arrived_s});
    ASSERT_EQ(place.refusal, Refusal::none) << camera << ' ' << tick;
    a.fill(place);
  };
  for (int c = 0; c < 3; ++c) arrive(c, 0, 0.001);
  a.recycle(a.release(0.001)->slot);
  const double held_up_s = kPeriod_s + 0.040;
  arrive(0, 1, kPeriod_s + 0.001);
  arrive(1, 1, held_up_s);
  EXPECT_FALSE(a.release(held_up_s, SetAssembler::Until::whole)) << "the third may wait, too";
  arrive(2, 1, held_up_s);
  const auto whole = a.release(held_up_s, SetAssembler::Until::whole);
  ASSERT_TRUE(whole);
  EXPECT_TRUE(whole->is_complete);
  a.recycle(whole->slot);
  arrive(0, 2, 2 * kPeriod_s + 0.001);
  const auto alone = a.release(2 * kPeriod_s + 0.040);
  ASSERT_TRUE(alone) << "none waits: the deadline ends the set";
  EXPECT_FALSE(alone->is_complete);
}

/// Six cameras capture on the beat. A seventh sends eight packets a period, each captured 0.45 periods later.
/// It has one of seven parts of the weight, so the beat moves by 0.45 / 7 = 0.064 periods, and a camera that
/// is new, 0.4 periods early, comes to the others' tick. (Were each packet to count, the beat would move by 8
/// / 14 of 0.45 = 0.26 periods, and 0.4 + 0.26 is more than half a period.)
TEST(SetAssembler, ACameraThatSendsMuchDoesNotMoveTheBeat) {
  SetAssembler a({.cameras = 8});
  int apart = 0;
  for (int k = 0; k < 600; ++k) {
    const double at_s = 10 + k * kPeriod_s;
    std::int64_t honest = -1;
    for (int c = 0; c < 7; ++c) {
      const bool is_new = c == 6;
      if (is_new && k < 500) continue;
      const double captured_s = at_s - (is_new ? 0.4 : 0) * kPeriod_s;
      const SetAssembler::Place place = a.admit({c, 0, captured_s, at_s + 0.001});
      if (c == 0) honest = place.slot;
      if (is_new && place.slot != honest) ++apart;
      if (place.refusal == Refusal::none) a.fill(place);
    }
    for (int n = 0; n < 8; ++n)
      a.admit({7, 0, at_s + 0.45 * kPeriod_s, at_s + (0.45 + 0.01 * n) * kPeriod_s});
    while (const auto set = a.release(at_s + 0.033)) a.recycle(set->slot);
  }
  EXPECT_EQ(apart, 0);
}

/// One camera with numbers from nowhere is refused; when most count anew, counting begins anew.
TEST(SetAssembler, OneCameraCannotMakeTheOthersLate) {
  SetAssembler a({.cameras = 3, .by_trigger = true});
  int released = 0;
  const auto tick = [&](std::int64_t number, double at_s, std::int64_t of_third) {
    int refusals = 0;
    for (int c = 0; c < 3; ++c) {
      const SetAssembler::Place place = a.admit({c, c == 2 ? of_third : number, at_s, at_s});
      if (place.refusal == Refusal::none) a.fill(place);
      refusals += place.refusal != Refusal::none ? 1 : 0;
    }
    while (const auto set = a.release(at_s + 0.033)) {
      a.recycle(set->slot);
      ++released;
    }
    return refusals;
  };
  double now_s = 0;
  for (int k = 0; k < 5; ++k) EXPECT_LE(tick(k, now_s += kPeriod_s, k), k == 0 ? 2 : 0);
  for (int k = 5; k < 50; ++k) EXPECT_EQ(tick(k, now_s += kPeriod_s, 1'000'000'000'000 + k), 1) << k;
  const int before = released;
  for (int k = 0; k < 50; ++k)
    EXPECT_LE(tick(k, now_s += kPeriod_s, k), k == 0 ? 2 : 0) << k;  // all restarted
  EXPECT_GE(released, before + 49);
}

/// A false pulse on its trigger line leaves one camera of four some numbers ahead, for good or once in a
/// while. Its sets would be released before the others' images of that number are captured, which then are
/// late. Captures are 3 ms off, packets take up to 20 ms. The others miss what was open when it began.
TEST(SetAssembler, ACameraThatCountsAheadCostsItsImagesAlone) {
  constexpr int kTicks = 300, kRig = 4;
  struct Case {
    int ahead, every;
    double period_s;  ///< of the triggers, where the rig's is kPeriod_s
  };
  for (const Case c : {Case{1, 1, kPeriod_s}, Case{2, 1, kPeriod_s}, Case{7, 1, kPeriod_s},
                       Case{1, 5, kPeriod_s}, Case{3, 4, kPeriod_s}, Case{1, 1, 0.5 * kPeriod_s},
                       Case{1, 1, 3 * kPeriod_s}, Case{0, 1, 0.4 * kPeriod_s}}) {
    SetAssembler a({.cameras = kRig, .by_trigger = true});
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::map<double, SetAssembler::Arrival> way;
    for (int tick = 0; tick < kTicks; ++tick) {
      const double at_s = 10 + tick * c.period_s;
      for (int camera = 0; camera < kRig; ++camera) {
        const bool is_ahead = camera == kRig - 1 && tick >= 50 && tick % c.every == 0;
        const double captured_s = at_s + 0.003 * uniform(random);
        const double arrived_s = captured_s + 0.3 * c.period_s * uniform(random);
        way[arrived_s] = {camera, tick + (is_ahead ? c.ahead : 0), captured_s, arrived_s};
      }
    }
    int with_others = 0;
    const auto release = [&](double now_s) {
      while (const auto set = a.release(now_s)) {
        with_others += a.has(set->slot, 0) && a.has(set->slot, 1) && a.has(set->slot, 2) ? 1 : 0;
        a.recycle(set->slot);
      }
    };
    for (const auto& [at_s, arrival] : way) {
      for (auto end_s = a.next_deadline_s(); end_s && *end_s < at_s; end_s = a.next_deadline_s())
        release(*end_s);
      const SetAssembler::Place place = a.admit(arrival);
      if (place.refusal == Refusal::none) a.fill(place);
      release(at_s);
    }
    release(1e9);
    EXPECT_GE(with_others, kTicks - 3)
        << c.ahead << " ahead, every " << c.every << ", " << c.period_s << " s";
  }
}

/// A camera whose images can't be unpacked is heard, and never in a set. After kFailures sets nobody waits
/// for it; when it delivers again, it is waited for at once.
TEST(SetAssembler, DoesNotWaitForACameraThatNeverDelivers) {
  SetAssembler a({.cameras = 2, .by_trigger = true});
  double worst_wait_s = 0;
  int complete = 0;
  const auto tick = [&](std::int64_t number, bool is_good) {
    const double at_s = static_cast<double>(number) * kPeriod_s;
    // The second comes 5 ms later, which is in time.
    a.fill(a.admit({0, number, at_s, at_s}));
    auto set = a.release(at_s + 0.001);
    const SetAssembler::Place place = a.admit({1, number, at_s, at_s + 0.005});
    if (is_good && place.refusal == Refusal::none) a.fill(place);
    if (is_good && place.refusal == Refusal::late && a.is_doubted(1)) a.trust(1);
    double wait_s = 0.001;
    for (; !set; wait_s += 0.001) set = a.release(at_s + wait_s);
    complete += set->is_complete ? 1 : 0;
    a.recycle(set->slot);
    return wait_s;
  };
  tick(0, true);
  tick(1, true);
  for (int k = 2; k < 100; ++k) {
    const double wait_s = tick(k, false);
    if (k >= 2 + SetAssembler::kFailures) worst_wait_s = std::max(worst_wait_s, wait_s);
  }
  EXPECT_LT(worst_wait_s, 0.002) << "the others' sets go at once";
  tick(100, true);
  complete = 0;
  for (int k = 101; k < 111; ++k) tick(k, true);
  EXPECT_EQ(complete, 10);
}

TEST(ClockFit, FindsOffsetAndDriftOfAClock) {
  ClockFit fit;
  std::mt19937 random(3);
  std::exponential_distribution<double> way_s(1 / 0.002);
  for (int i = 0; i < 3000; ++i) {
    const double ours = i / 30.0, theirs = 5000 + ours * (1 - 80e-6);
    fit.add(theirs, ours + 0.001 + way_s(random));
    if (i <= 400) continue;
    ASSERT_NEAR(fit.to_ours(theirs), ours + 0.001, 0.0005) << i;
  }
  EXPECT_NEAR(fit.drift(), 80e-6, 40e-6);
}

}  // namespace
}  // namespace tactus
