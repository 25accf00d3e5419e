// A server of live cameras and its clients, over the loopback; and what strangers send it.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <zmq.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>

#include "support/message_of.h"
#include "tactus/base/timing.h"
#include "tactus/rig/live/live_message.h"
#include "tactus/rig/live/rig_client.h"

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
  expect(Refusal::old_boot, [&] { return packet(cam2, 77, 5000 + ++sequence, tick_); });
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
  LiveKey mixed = key;
  mixed.secret_key = make_live_key("x", "").secret_key;
  write_live_key(folder + "/mixed.key", mixed);
  EXPECT_NE(message_of([&] { read_live_key(folder + "/mixed.key"); }).find("are no pair"), std::string::npos);
  write_live_clients(live_clients_path(folder), {{"cam0", key.public_key}});
  EXPECT_EQ(read_live_clients(live_clients_path(folder))[0].public_key, key.public_key);
  fs::remove_all(folder);
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
