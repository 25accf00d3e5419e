// What a server checks of a camera before its images are unpacked; keys, settings and messages. No sockets.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <random>

#include "support/message_of.h"
#include "tactus/rig/live/camera_gate.h"
#include "tactus/rig/live/live_keys.h"
#include "tactus/rig/live/live_message.h"
#include "tactus/rig/live_address.h"
#include "tactus/rig/wire/set_assembler.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;
using test::message_of;

constexpr Vec2i kSize{160, 120};

/// What one camera says of itself, in a simulated second: no sockets, no clock.
PacketHead head_of(const LiveCamera& camera, std::uint64_t boot, std::uint64_t sequence, double theirs_s) {
  PacketHead head;
  head.camera = camera.name;
  head.contents = PacketHead::kMask;
  head.calibration = camera.calibration;
  head.boot = boot;
  head.sequence = sequence;
  head.trigger = static_cast<std::int64_t>(sequence);
  head.captured_s = head.sent_s = theirs_s;
  head.size_px = camera.size_px;
  return head;
}

constexpr double kFrame_s = 1.0 / 30;

TEST(CameraGate, RefusesTimesOffItsClockUntilTheyAgreeForASecond) {
  const LiveCamera camera{"cam0", kSize, 11, false};
  CameraGate gate(camera, {});
  double now = 100, captured_s = 0;
  std::uint64_t sequence = 0;
  const auto check = [&](double theirs_s) {
    now += kFrame_s;
    return gate.check(head_of(camera, 1, ++sequence, theirs_s), now, captured_s);
  };
  for (int k = 0; k < 40; ++k) ASSERT_EQ(check(now), Refusal::none);
  for (const double bad : {-1e9, 1e9, now + 3, now - 3}) EXPECT_EQ(check(bad), Refusal::clock) << bad;
  for (int k = 0; k < 5; ++k) {
    ASSERT_EQ(check(now), Refusal::none) << "one bad packet costs itself alone";
    EXPECT_NEAR(captured_s, now, 0.1);
  }
  int refused = 0;  // its clock is set: an hour later
  while (refused < 100 && check(now + 3600) == Refusal::clock) ++refused;
  EXPECT_NEAR(refused, 30, 2) << "a second";
  EXPECT_NEAR(captured_s, now, 0.1);
}

/// Else whoever starts a camera's client twice loses both: each boot made the other an old one.
TEST(CameraGate, ASecondClientWaitsUntilTheFirstIsSilent) {
  const LiveCamera camera{"cam0", kSize, 11, false};
  CameraGate gate(camera, {});
  double captured_s = 0, now = 100;
  for (std::uint64_t k = 1; k <= 90; ++k, now += kFrame_s) {
    EXPECT_EQ(gate.check(head_of(camera, 1, k, now), now, captured_s), Refusal::none) << k;
    EXPECT_EQ(gate.check(head_of(camera, 2, k, now), now, captured_s), Refusal::other_client) << k;
  }
  now += 0.25;  // the first has ended; a new start gets in at once
  EXPECT_EQ(gate.check(head_of(camera, 3, 1, now), now, captured_s), Refusal::none);
  EXPECT_EQ(gate.check(head_of(camera, 1, 90, now), now, captured_s), Refusal::old_boot)
      << "again what was there";
  now += 0.25;
  EXPECT_EQ(gate.check(head_of(camera, 1, 91, now), now, captured_s), Refusal::none) << "it was only paused";
}

/// A limit of p a second lets p t through in t seconds, and half as much again as a second's at once: for
/// 74,000 offers a second, 20 t + 30 hellos and 120 t + 180 packets.
TEST(CameraGate, HellosAndPacketsHaveARate) {
  CameraGate gate({"cam0", kSize, 11, false}, {});
  int hellos = 0, packets = 0;
  constexpr double kOffers_1_s = 74'000, kSeconds = 10;
  for (int k = 0; k < static_cast<int>(kSeconds * kOffers_1_s); ++k) {
    const double now = 100 + k / kOffers_1_s;
    hellos += gate.take_small_message(now) ? 1 : 0;
    packets += gate.check_rate(200, now) == Refusal::none ? 1 : 0;
  }
  EXPECT_NEAR(hellos, 20 * kSeconds + 30, 1);
  EXPECT_NEAR(packets, 120 * kSeconds + 180, 1);
}

/// Of packets of 1000 bytes and 50,000 bytes a second: 50 a second, and 75 at once. The packets' own rate
/// would let 120 a second through.
TEST(CameraGate, BytesHaveARate) {
  LiveSettings settings;
  settings.bytes_per_s = 50'000;
  CameraGate gate({"cam0", kSize, 11, false}, settings);
  int taken = 0, too_much = 0;
  for (int k = 0; k < 1000; ++k) {
    const Refusal refusal = gate.check_rate(1000, 100 + k * 0.01);
    taken += refusal == Refusal::none ? 1 : 0;
    too_much += refusal == Refusal::too_much ? 1 : 0;
  }
  EXPECT_NEAR(taken, 50 * 10 + 75, 1);
  EXPECT_EQ(taken + too_much, 1000);
}

/// One camera of four sends heads with random bytes changed, and triggers of other ticks, as its key allows.
/// The others' sets stay complete but for it, in 99.5 % of the ticks, and no sum overflows (run under UBSan).
/// 10 M heads with TACTUS_LONG_TESTS.
TEST(CameraGate, ChangedHeadsOfOneCameraCostItsImagesAlone) {
  constexpr int kRig = 4;
  const int ticks = std::getenv("TACTUS_LONG_TESTS") != nullptr ? 1'000'000 : 10'000, heads_a_tick = 10;
  for (const bool by_trigger : {true, false}) {
    std::vector<LiveCamera> cameras;
    std::vector<CameraGate> gates;
    for (int c = 0; c < kRig; ++c) {
      cameras.push_back({"cam" + std::to_string(c), kSize, 11, false});
      gates.emplace_back(cameras.back(), LiveSettings{});
    }
    SetAssembler assembler({.cameras = kRig, .by_trigger = by_trigger});
    std::mt19937 random(7);
    std::uint64_t sequence = 0;
    int whole = 0, admitted = 0;
    const auto offer = [&](int c, const PacketHead& head, double now) {
      double captured_s = 0;
      if (gates[static_cast<std::size_t>(c)].check(head, now, captured_s) != Refusal::none) return;
      const SetAssembler::Place place = assembler.admit({c, head.trigger, captured_s, now});
      if (place.refusal == Refusal::none) assembler.fill(place), ++admitted;
    };
    for (int tick = 1; tick <= ticks; ++tick) {
      const double now = 100 + tick * kFrame_s;
      for (int c = 0; c < kRig - 1; ++c)
        offer(c, head_of(cameras[static_cast<std::size_t>(c)], 1, static_cast<std::uint64_t>(tick), now),
              now);
      for (int k = 0; k < heads_a_tick; ++k) {
        std::string bytes;
        PacketHead head = head_of(cameras.back(), 1, ++sequence, now);
        head.trigger = tick;
        if (random() % 4 == 0) head.trigger += static_cast<int>(random() % 17) - 8;  // of a set that is open
        CameraImages none;
        none.mask = BitMask(1, 1);
        PacketCoder().pack(head, none, bytes);
        for (int n = static_cast<int>(random() % 4); n >= 0; --n)
          bytes[48 + random() % 56] = static_cast<char>(random());
        if (random() % 4 == 0) {
          const double extreme[] = {-1e300, 1e300, 1.7e308, -1.7e308, 9e9, -9e9, NAN, INFINITY, 0, now - 0.9};
          const double t = extreme[random() % std::size(extreme)];
          for (const std::size_t at : {80, 88}) std::memcpy(&bytes[at], &t, sizeof t);
        }
        PacketHead read;
        if (parse_packet_head(bytes, read) != Refusal::none) continue;
        read.size_px = kSize;
        offer(kRig - 1, read, now);
      }
      while (const auto set = assembler.release(now + 0.0331)) {
        bool has_others = true;
        for (int c = 0; c < kRig - 1; ++c) has_others = has_others && assembler.has(set->slot, c);
        whole += has_others ? 1 : 0;
        assembler.recycle(set->slot);
      }
    }
    EXPECT_GE(whole, static_cast<int>(0.995 * ticks)) << (by_trigger ? "by trigger" : "by time");
    EXPECT_GT(admitted, 3 * ticks);
  }
}

/// NaN and infinity are no JSON.
TEST(LiveStatusJson, HoldsNumbersAlone) {
  LiveStatus status;
  status.release_ms_p50 = NAN;
  status.cameras.resize(1);
  status.cameras[0].skew_ms = INFINITY;
  status.cameras[0].drift_ppm = -INFINITY;
  const std::string text = live_status_json(status);
  EXPECT_EQ(text.find("null"), std::string::npos) << text;
}

TEST(LiveKeys, AreForTheirOwnersEyes) {
  std::string folder = (fs::temp_directory_path() / "tactus-keys-XXXXXX").string();
  ASSERT_NE(::mkdtemp(folder.data()), nullptr);
  const LiveKey key = make_live_key("cam0", make_live_key("server", "").public_key);
  const std::string path = live_key_path(folder, "cam0");
  write_live_key(path, key);
  struct stat status {};
  ASSERT_EQ(::stat(path.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600U);
  const LiveKey back = read_live_key(path);
  EXPECT_EQ(back.secret_key, key.secret_key);
  EXPECT_EQ(back.server_key, key.server_key);
  EXPECT_NE(message_of([&] { write_live_key(path, key); }).find("a key is not overwritten"),
            std::string::npos);
  for (const mode_t mode : {0640, 0604, 0660}) {
    ::chmod(path.c_str(), mode);
    EXPECT_NE(message_of([&] { read_live_key(path); }).find("expected mode 0600"), std::string::npos);
  }
  ::chmod(path.c_str(), 0600);
  // Who may write into the folder may put another key in its place; but not in a folder like /tmp.
  for (const mode_t mode : {0777, 0770, 0702}) {
    ::chmod(folder.c_str(), mode);
    EXPECT_NE(message_of([&] { read_live_key(path); }).find("chmod go-w"), std::string::npos) << mode;
  }
  for (const mode_t mode : {01777, 0755, 0700}) {
    ::chmod(folder.c_str(), mode);
    EXPECT_EQ(message_of([&] { read_live_key(path); }).find("chmod go-w"), std::string::npos) << mode;
  }
  LiveKey mixed = key;
  mixed.secret_key = make_live_key("x", "").secret_key;
  write_live_key(folder + "/mixed.key", mixed);
  EXPECT_NE(message_of([&] { read_live_key(folder + "/mixed.key"); }).find("are no pair"), std::string::npos);
  write_live_clients(live_clients_path(folder), {{"cam0", key.public_key}});
  EXPECT_EQ(read_live_clients(live_clients_path(folder))[0].public_key, key.public_key);
  fs::remove_all(folder);
}

TEST(LiveSettings, KnowAddressesOfEveryNetwork) {
  for (const char* every : {"tcp://0.0.0.0:1", "tcp://*:1", "tcp://[::]:1"})
    EXPECT_TRUE(is_every_interface(every));
  for (const char* one : {"tcp://127.0.0.1:1", "tcp://192.168.1.2:1", "tcp://[::1]:1"})
    EXPECT_FALSE(is_every_interface(one));
}

TEST(LiveMessage, IsReadAsItWasWrittenOrNotAtAll) {
  const std::string bytes = live_message_bytes({LiveMessage::kHello, 3, 1ULL << 40, "cam7"});
  const auto message = parse_live_message(bytes);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->kind, LiveMessage::kHello);
  EXPECT_EQ(message->detail, 3U);
  EXPECT_EQ(message->number, 1ULL << 40);
  EXPECT_EQ(message->camera, "cam7");
  for (std::size_t n = 0; n < bytes.size(); ++n) EXPECT_FALSE(parse_live_message(bytes.substr(0, n)));
  EXPECT_FALSE(parse_live_message(bytes + "x"));
}

}  // namespace
}  // namespace tactus
