// A server of live cameras and its clients, over the loopback; and what strangers send it.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>
#include <zmq.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <thread>

#include "support/message_of.h"
#include "tactus/base/timing.h"
#include "tactus/rig/live.h"
#include "tactus/rig/live/live_keys.h"
#include "tactus/rig/live/live_message.h"
#include "tactus/rig/live_address.h"
#include "tactus/rig/wire/packet.h"

namespace tactus {
namespace {

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
  /// How many messages came since the last call.
  int take_all() {
    int count = 0;
    for (std::array<char, 8> start{}; zmq_recv(socket_, start.data(), start.size(), ZMQ_DONTWAIT) >= 0;)
      ++count;
    return count;
  }

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

/// A camera's key sends hellos and nonsense as fast as it can. The server reads a burst of 1.5 s of what
/// three cameras may say (2000 + 8 x 30 x 3 messages a second), then 11 messages every 2 ms: 5500 a second at
/// most. The others' sets stay whole.
TEST_F(Live, AFloodIsReadAtARateAndTouchesNoOtherCamera) {
  start();
  clients_.pop_back();
  std::atomic<bool> stops = false;
  std::thread flood([&] {
    Stranger mad(server_->address(), client_keys_[2]);
    const std::string hello = live_message_bytes({LiveMessage::kHello, 0, 7, cameras_[2].name});
    const std::string nonsense(100, 'x');
    for (int k = 0; !stops; ++k) mad.send(k % 2 == 0 ? hello : nonsense);
  });
  const std::int64_t before = server_->status().cameras[2].packets;
  const double begin_s = now_s();
  int whole = 0;
  for (int i = 0; i < 60; ++i) {
    send(++tick_);
    LiveSet set;
    if (server_->wait(set, now_s() + 2) && set.is_in[0] && set.is_in[1]) ++whole;
    std::this_thread::sleep_for(std::chrono::milliseconds(33));
  }
  const double lasted_s = now_s() - begin_s;
  const std::int64_t packets = server_->status().cameras[2].packets - before;
  stops = true;
  flood.join();
  EXPECT_GT(packets, 100);
  EXPECT_LT(static_cast<double>(packets), 1.5 * 2720 + 5500 * lasted_s);
  EXPECT_GE(whole, 54) << "nine of ten: the flood itself takes a core of this computer";
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

/// Triggers of depth cameras come in the middle of the others' period: a quarter either way tells it from the
/// beginning. The median of ten, as a busy machine delays some.
TEST_F(Live, DepthCamerasAreTriggeredHalfAPeriodLater) {
  settings_.sync = LiveSync::software;
  settings_.fps = 10;
  cameras_[1].is_depth = true;
  server_ = std::make_unique<RigServer>(cameras_, settings_, keys_);
  const auto optical = client(0), depth = client(1);
  ASSERT_TRUE(depth->wait_trigger(now_s() + 5));
  std::vector<double> later_periods;
  for (int i = 0; i < 10; ++i) {
    optical->wait_trigger(now_s());  // an old one
    const auto tick = optical->wait_trigger(now_s() + 5);
    const double at_s = now_s();
    auto of_depth = depth->wait_trigger(now_s() + 5);
    while (of_depth && *of_depth < tick) of_depth = depth->wait_trigger(now_s() + 5);
    ASSERT_TRUE(tick && of_depth);
    later_periods.push_back((now_s() - at_s) * settings_.fps);
  }
  std::nth_element(later_periods.begin(), later_periods.begin() + 5, later_periods.end());
  EXPECT_NEAR(later_periods[5], 0.5, 0.25);
}

/// Whoever connects and shows no key costs a place for two seconds.
TEST_F(Live, AConnectionThatShowsNoKeyIsEnded) {
  start();
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const std::string address = server_->address();
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
  ASSERT_EQ(::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  const timeval most{10, 0};
  ::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &most, sizeof most);
  const double begin_s = now_s();
  ssize_t n = 1;
  for (std::array<char, 256> bytes{}; n > 0;) n = ::recv(fd, bytes.data(), bytes.size(), 0);  // its greeting
  const double lasted_s = now_s() - begin_s;
  ::close(fd);
  EXPECT_EQ(n, 0) << "it is still open";
  EXPECT_NEAR(lasted_s, 2, 1);
}

TEST_F(Live, TellsHowItGoesToTheStatusKeyAlone) {
  start();
  const auto text = ask_live_status(server_->address(), status_key_, 5);
  ASSERT_TRUE(text);
  EXPECT_NE(text->find("\"name\":\"cam2\""), std::string::npos) << *text;
  EXPECT_FALSE(ask_live_status(server_->address(), client_keys_[0], 0.3));
}

/// Questions as fast as they go: 100 a second are answered, and 150 at once.
TEST_F(Live, QuestionsHaveARate) {
  start();
  Stranger asks(server_->address(), status_key_);
  const std::string question = live_message_bytes({LiveMessage::kAsk, 0, 0, {}});
  int answers = 0, ticks = 0;
  const std::int64_t before = server_->status().complete_sets;
  const double begin_s = now_s();
  for (; now_s() < begin_s + 2; ++ticks) {
    send(++tick_);
    for (int k = 0; k < 60; ++k) asks.send(question);
    std::this_thread::sleep_for(std::chrono::milliseconds(33));
    answers += asks.take_all();
  }
  EXPECT_GT(answers, 20);
  EXPECT_LE(answers, 150 + 100 * (now_s() - begin_s));
  EXPECT_GE(server_->status().complete_sets - before, 0.9 * ticks);
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
  EXPECT_TRUE(is_loopback("tcp://127.0.0.1:*"));
  for (const char* port : {"0", "65536", "99999", "-1", "79 33", "7933/x"})
    EXPECT_THROW(is_loopback(std::string("tcp://127.0.0.1:") + port), Error) << port;
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

}  // namespace
}  // namespace tactus
