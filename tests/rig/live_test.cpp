// A server of live cameras and its clients, over the loopback; and what strangers send it.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <zmq.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "support/message_of.h"
#include "tactus/base/timing.h"
#include "tactus/rig/live/camera_gate.h"
#include "tactus/rig/live/live_message.h"
#include "tactus/rig/live/rig_client.h"
#include "tactus/rig/wire/set_assembler.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;
using test::message_of;

constexpr int kCameras = 3;
constexpr Vec2i kSize{160, 120};

/// A disc that says which camera and tick it is of.
BitMask mask_of(int camera, std::int64_t tick) {
  BitMask mask(kSize.x, kSize.y);
  const double x_px = 40 + static_cast<double>(tick % 80), y_px = 40 + 10 * camera;
  for (Index y = 0; y < kSize.y; ++y) {
    for (Index x = 0; x < kSize.x; ++x) {
      if (std::hypot(x - x_px, y - y_px) < 20) mask.set(x, y);
    }
  }
  return mask;
}

class Live : public ::testing::Test {
 protected:
  void SetUp() override {
    settings_.address = "tcp://127.0.0.1:*";
    settings_.sync = LiveSync::trigger;
    const LiveKey server = make_live_key(kServerName, "");
    keys_.server = server;
    for (int c = 0; c < kCameras; ++c) {
      cameras_.push_back({"cam" + std::to_string(c), kSize, 11U + static_cast<unsigned>(c), false});
      client_keys_.push_back(make_live_key(cameras_.back().name, server.public_key));
      keys_.clients.push_back({cameras_.back().name, client_keys_.back().public_key});
    }
    status_key_ = make_live_key(kStatusName, server.public_key);
    keys_.clients.push_back({kStatusName, status_key_.public_key});
  }
  void start() {
    server_ = std::make_unique<RigServer>(cameras_, settings_, keys_);
    for (int c = 0; c < kCameras; ++c) clients_.push_back(client(c));
    wait_until([&] {
      send(tick_++);
      const LiveStatus s = server_->status();
      return std::all_of(s.cameras.begin(), s.cameras.end(), [](const auto& cam) { return cam.in_sets > 0; });
    });
    take_all();
  }
  std::unique_ptr<RigClient> client(int c) const {
    return std::make_unique<RigClient>(cameras_[static_cast<std::size_t>(c)], server_->address(),
                                       client_keys_[static_cast<std::size_t>(c)]);
  }
  void send(std::int64_t tick) {
    for (std::size_t c = 0; c < clients_.size(); ++c) {
      CameraImages images;
      images.mask = mask_of(static_cast<int>(c), tick);
      clients_[c]->put(images, tick, now_s());
    }
  }
  /// Until so, at most ten seconds.
  template <class F>
  void wait_until(F&& is_so) {
    for (const double end_s = now_s() + 10; now_s() < end_s;) {
      if (is_so()) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    FAIL() << "it never came to that: " << live_status_json(server_->status());
  }
  void take_all() {
    for (LiveSet set; server_->wait(set, now_s() + 0.1);) continue;
  }
  /// Twenty ticks; every set is complete and right.
  void expect_whole_sets() {
    for (int i = 0; i < 20; ++i) {
      const std::int64_t tick = tick_++;
      send(tick);
      LiveSet set;
      ASSERT_TRUE(server_->wait(set, now_s() + 2)) << live_status_json(server_->status());
      EXPECT_EQ(set.tick, tick);
      EXPECT_TRUE(set.is_complete);
      for (int c = 0; c < kCameras; ++c)
        EXPECT_EQ(set.images[static_cast<std::size_t>(c)].mask, mask_of(c, tick));
    }
  }
  std::int64_t refused(int camera, Refusal why) const {
    return server_->status().cameras[static_cast<std::size_t>(camera)].refused[static_cast<std::size_t>(why)];
  }

  std::vector<LiveCamera> cameras_;
  LiveSettings settings_;
  RigServer::Keys keys_;
  std::vector<LiveKey> client_keys_;
  LiveKey status_key_;
  std::unique_ptr<RigServer> server_;
  std::vector<std::unique_ptr<RigClient>> clients_;
  std::int64_t tick_ = 0;
};

/// Whoever speaks ZeroMQ and has a key, but is no client of ours.
class Stranger {
 public:
  Stranger(const std::string& address, const LiveKey& key)
      : context_(zmq_ctx_new()), socket_(zmq_socket(context_, ZMQ_DEALER)) {
    const int now = 0;
    zmq_setsockopt(socket_, ZMQ_LINGER, &now, sizeof now);
    zmq_setsockopt(socket_, ZMQ_CURVE_SERVERKEY, key.server_key.c_str(), key.server_key.size());
    zmq_setsockopt(socket_, ZMQ_CURVE_PUBLICKEY, key.public_key.c_str(), key.public_key.size());
    zmq_setsockopt(socket_, ZMQ_CURVE_SECRETKEY, key.secret_key.c_str(), key.secret_key.size());
    zmq_connect(socket_, address.c_str());
  }
  ~Stranger() {
    zmq_close(socket_);
    zmq_ctx_term(context_);
  }
  Stranger(const Stranger&) = delete;
  Stranger& operator=(const Stranger&) = delete;
  void send(const std::string& bytes) { zmq_send(socket_, bytes.data(), bytes.size(), ZMQ_DONTWAIT); }

 private:
  void *context_, *socket_;
};

std::string packet(const LiveCamera& camera, std::uint64_t boot, std::uint64_t sequence, std::int64_t tick) {
  PacketHead head;
  head.camera = camera.name;
  head.calibration = camera.calibration;
  head.boot = boot;
  head.sequence = sequence;
  head.trigger = tick;
  head.captured_s = head.sent_s = now_s();
  CameraImages images;
  images.mask = BitMask(kSize.x, kSize.y);
  std::string bytes;
  PacketCoder().pack(head, images, bytes);
  return bytes;
}

TEST_F(Live, SetsComeWholeOverCurve) {
  start();
  expect_whole_sets();
  EXPECT_EQ(server_->status().refused_keys, 0);
}

TEST_F(Live, AKeyThatIsNotInTheListIsRefused) {
  start();
  const LiveKey forged = make_live_key("cam0", keys_.server.public_key);
  RigClient stranger(cameras_[0], server_->address(), forged);
  wait_until([&] { return server_->status().refused_keys > 0; });
  expect_whole_sets();
  EXPECT_EQ(stranger.status().taken, 0);
}

TEST_F(Live, AKeyOfAnotherServerIsRefused) {
  start();
  LiveKey wrong = client_keys_[0];
  wrong.server_key = make_live_key("x", "").public_key;
  RigClient client(cameras_[0], server_->address(), wrong);
  CameraImages images;
  images.mask = mask_of(0, 0);
  client.put(images, 0, now_s());
  expect_whole_sets();
  EXPECT_EQ(client.status().sent, 0);
}

/// cam1's key sends for cam0.
TEST_F(Live, AnotherCamerasKeyIsRefusedAndCounted) {
  start();
  Stranger stranger(server_->address(), client_keys_[1]);
  wait_until([&] {
    stranger.send(packet(cameras_[0], 5, 1, 1'000'000));
    return refused(1, Refusal::other_camera) > 0;
  });
  expect_whole_sets();
  EXPECT_EQ(refused(0, Refusal::other_camera), 0);
}

/// With a camera's own key: it spoils its own pictures at most.
TEST_F(Live, BadPacketsAreRefusedByReasonAndTouchNoOtherCamera) {
  start();
  clients_.pop_back();  // cam2 has gone mad
  Stranger mad(server_->address(), client_keys_[2]);
  const LiveCamera& cam2 = cameras_[2];
  std::uint64_t sequence = 0;
  const std::string good = packet(cam2, 77, 1000, tick_);
  LiveCamera other = cam2;
  other.calibration ^= 1;
  const auto expect = [&](Refusal why, const std::function<std::string()>& bytes) {
    wait_until([&] {
      mad.send(bytes());
      std::this_thread::sleep_for(std::chrono::milliseconds(30));
      return refused(2, why) > 0;
    });
    EXPECT_GT(refused(2, why), 0) << refusal_text(why);
  };
  expect(Refusal::not_a_packet, [] { return std::string(200, 'x'); });
  expect(Refusal::too_short, [&] { return good.substr(0, 100); });
  expect(Refusal::too_long, [&] { return good + "more"; });
  expect(Refusal::too_long, [&] { return good + std::string(packet_limit(kSize), 'x'); });
  expect(Refusal::calibration, [&] { return packet(other, 77, ++sequence, tick_); });
  expect(Refusal::repeated, [&] { return std::string(good); });
  expect(Refusal::ahead, [&] { return packet(cam2, 77, 2000 + ++sequence, 1'000'000'000'000); });
  expect(Refusal::late, [&] { return packet(cam2, 77, 3000 + ++sequence, 0); });
  expect(Refusal::payload, [&] {
    send(++tick_);
    std::string damaged = packet(cam2, 78, 4000 + ++sequence, tick_);
    damaged[PacketHead::kBytes + 8] = 9;
    return damaged;
  });
  expect(Refusal::old_boot, [&] { return packet(cam2, 77, 1, tick_); });
  mad.send(std::string(10 * packet_limit(kSize), 'x'));  // ends its connection
  // What it sends while the connection breaks is lost.
  wait_until([&] {
    for (int i = 0; i < 500; ++i) mad.send(packet(cam2, 78, 9000 + ++sequence, tick_));
    return refused(2, Refusal::too_many) > 0;
  });
  for (int c = 0; c < 2; ++c) {
    for (const Refusal why : {Refusal::ahead, Refusal::repeated, Refusal::too_many, Refusal::payload})
      EXPECT_EQ(refused(c, why), 0) << refusal_text(why);
  }
  take_all();
  // The others' sets are whole but for it.
  for (int i = 0; i < 10; ++i) {
    ++tick_;
    send(tick_);
    LiveSet set;
    ASSERT_TRUE(server_->wait(set, now_s() + 2));
    EXPECT_EQ(set.tick, tick_);
    for (int c = 0; c < 2; ++c) EXPECT_EQ(set.images[static_cast<std::size_t>(c)].mask, mask_of(c, tick_));
  }
}

/// What a killed client leaves is a connection that says nothing more; the new one is another boot.
TEST_F(Live, ARestartedClientIsBackWithinASecond) {
  start();
  clients_[1].reset();
  const double begin_s = now_s();
  clients_[1] = client(1);
  LiveSet set;
  bool is_back = false;
  while (!is_back && now_s() - begin_s < 5) {
    send(tick_++);
    if (server_->wait(set, now_s() + 0.1)) is_back = set.is_in[1];
  }
  EXPECT_TRUE(is_back);
  EXPECT_LT(now_s() - begin_s, 1);
}

TEST_F(Live, ClientsFindARestartedServer) {
  start();
  settings_.address = server_->address();
  server_.reset();
  server_ = std::make_unique<RigServer>(cameras_, settings_, keys_);
  wait_until([&] {
    send(tick_++);
    LiveSet set;
    return server_->wait(set, now_s() + 0.05) && set.is_complete;
  });
}

TEST_F(Live, TheServerSendsTriggers) {
  settings_.sync = LiveSync::software;
  settings_.fps = 50;
  server_ = std::make_unique<RigServer>(cameras_, settings_, keys_);
  const auto one = client(0);
  ASSERT_TRUE(one->wait_trigger(now_s() + 5));
  std::int64_t last = *one->wait_trigger(now_s() + 5);
  for (int i = 0; i < 10; ++i) {
    const auto next = one->wait_trigger(now_s() + 5);
    ASSERT_TRUE(next);
    EXPECT_GT(*next, last);
    EXPECT_LE(*next, last + 5);
    last = *next;
  }
}

TEST_F(Live, TellsHowItGoesToTheStatusKeyAlone) {
  start();
  const auto text = ask_live_status(server_->address(), status_key_, 5);
  ASSERT_TRUE(text);
  EXPECT_NE(text->find("\"name\":\"cam2\""), std::string::npos) << *text;
  EXPECT_FALSE(ask_live_status(server_->address(), client_keys_[0], 0.3));
}

TEST_F(Live, PlainIsForThisComputerAlone) {
  settings_.address = "tcp://0.0.0.0:*";
  EXPECT_NE(message_of([&] { RigServer(cameras_, settings_, {}); }, ErrorKind::usage)
                .find("can be reached from other computers"),
            std::string::npos);
  EXPECT_NE(message_of([&] { RigClient(cameras_[0], "tcp://192.168.1.4:7447", {}); }, ErrorKind::usage)
                .find("is another computer"),
            std::string::npos);
  EXPECT_TRUE(is_loopback("tcp://127.0.0.1:1"));
  EXPECT_TRUE(is_loopback("tcp://[::1]:1"));
  for (const char* other : {"tcp://*:1", "tcp://localhost:1", "tcp://127.evil.org:1", "tcp://[::]:1"})
    EXPECT_FALSE(is_loopback(other)) << other;
  settings_.address = "tcp://127.0.0.1:*";
  server_ = std::make_unique<RigServer>(cameras_, settings_, std::nullopt);
  RigClient plain(cameras_[0], server_->address(), {});
  CameraImages images;
  images.mask = mask_of(0, 0);
  plain.put(images, 0, now_s());
  wait_until([&] { return server_->status().cameras[0].in_sets == 1; });
}

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

/// One camera of four sends heads with random bytes changed, as its key allows. The others' sets stay
/// complete but for it, in 99.5 % of the ticks, and no sum overflows (run under UBSan). 10 M heads with
/// TACTUS_LONG_TESTS.
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
