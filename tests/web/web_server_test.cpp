/// The server of viewers over loopback: who gets in, what is served, and that nobody holds up a run.
#include "tactus/web/web_server.h"

#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "support/message_of.h"
#include "tactus/base/byte_io.h"
#include "tactus/base/timing.h"
#include "tactus/io/scene_file.h"
#include "tactus/run/frame_loop.h"
#include "tactus/run/scene_source.h"
#include "tactus/web/web_files.h"
#include "tactus/web/web_sink.h"
#include "web/ws_client.h"

namespace tactus {
namespace {

using test::http_get;
using test::HttpAnswer;
using test::WsClient;

class WebServerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const std::string missing = web_missing(); !missing.empty()) GTEST_SKIP() << "without " << missing;
  }
  std::unique_ptr<WebServer> serve(WebSettings settings = {}) {
    settings.port = 0;
    auto server = std::make_unique<WebServer>(settings, "setting", [](std::string_view text) {
      return text == "hello" ? std::string("{}") : std::string();
    });
    server->listen();
    return server;
  }
  static std::string header(const std::string& name, const std::string& value) { return name + ": " + value; }
  static bool wait_until(const std::function<bool()>& done, double seconds = 5) {
    for (const double until = now_s() + seconds; now_s() < until;) {
      if (done()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return done();
  }
};

TEST_F(WebServerTest, ServesTheBundleAndNothingElse) {
  const auto server = serve();
  for (const WebFile& file : web_files()) {
    if (web_page_missing() != "" && file.name == "index.html") continue;
    const HttpAnswer answer = http_get(server->port(), "/" + std::string(file.name));
    EXPECT_EQ(answer.status, 200) << file.name;
    EXPECT_EQ(answer.body, file.text);
    EXPECT_NE(answer.head.find("Content-Security-Policy: default-src 'none'; script-src 'self'"),
              std::string::npos);
    EXPECT_NE(answer.head.find("nosniff"), std::string::npos);
  }
  for (const char* other : {"/none.js", "/../CMakeLists.txt", "/%2e%2e/%2e%2e/etc/passwd", "//etc/passwd",
                            "/etc/passwd", "/stream", "/index.html/../../etc/passwd", "/proc/self/environ"})
    EXPECT_GE(http_get(server->port(), other).status, 400) << other;
  EXPECT_EQ(http_get(server->port(), "/live.js", {}, "POST").status, 405);
  EXPECT_EQ(http_get(server->port(), "/live.js", {}, "PUT").status, 405);
  EXPECT_EQ(http_get(server->port(), "/live.js", {"Host: evil.example"}).status, 403) << "DNS rebinding";
}

TEST_F(WebServerTest, OthersPagesAndWrongTokensGet403) {
  const auto server = serve();
  const std::string host = "127.0.0.1:" + std::to_string(server->port());
  EXPECT_EQ(WsClient(server->port(), "/stream").status(), 101) << "a program has no origin";
  EXPECT_EQ(WsClient(server->port(), "/stream", {header("Origin", "http://" + host)}).status(), 101);
  EXPECT_EQ(WsClient(server->port(), "/stream", {header("Origin", "http://evil.example")}).status(), 403);
  EXPECT_EQ(WsClient(server->port(), "/stream", {header("Origin", "null")}).status(), 403);
  EXPECT_EQ(
      WsClient(server->port(), "/stream", {"Host: evil.example", "Origin: http://evil.example"}).status(),
      403);

  WebSettings elsewhere{.address = "0.0.0.0", .token = "0123456789abcdef"};
  const auto guarded = serve(elsewhere);
  EXPECT_EQ(WsClient(guarded->port(), "/stream").status(), 403);
  EXPECT_EQ(WsClient(guarded->port(), "/stream?token=").status(), 403);
  EXPECT_EQ(WsClient(guarded->port(), "/stream?token=0123456789abcdee").status(), 403);
  EXPECT_EQ(WsClient(guarded->port(), "/stream?token=0123456789abcdef0").status(), 403);
  EXPECT_EQ(
      WsClient(guarded->port(), "/stream?token=0123456789abcdef", {header("Origin", "http://evil.example")})
          .status(),
      403);
  EXPECT_EQ(WsClient(guarded->port(), "/stream?token=0123456789abcdef").status(), 101);
  EXPECT_NE(guarded->url().find("#token=0123456789abcdef"), std::string::npos);
  EXPECT_NE(
      test::message_of([&] { WebServer({.address = "0.0.0.0"}, "", {}); }, ErrorKind::usage).find("token"),
      std::string::npos);
}

TEST_F(WebServerTest, ATakenPortIsRefusedByName) {
  const auto server = serve();
  WebServer second({.port = server->port()}, "", {});
  const std::string error = test::message_of([&] { second.listen(); });
  EXPECT_NE(error.find("127.0.0.1:" + std::to_string(server->port())), std::string::npos) << error;
  EXPECT_NE(error.find("try another port"), std::string::npos) << error;
}

/// 192.0.2.1 is an address of documents (RFC 5737), of no computer.
TEST_F(WebServerTest, AnAddressOfNobodyHereIsRefusedByName) {
  WebServer server({.address = "192.0.2.1", .port = 8080, .token = "0123456789abcdef"}, "", {});
  const std::string error = test::message_of([&] { server.listen(); });
  EXPECT_NE(error.find("this computer has no such address"), std::string::npos) << error;
}

TEST_F(WebServerTest, WrongPathsAndQueriesOfStreamsAreTold) {
  const auto server = serve();
  for (const char* path : {"/", "/streams", "/stream/", "/live.js"})
    EXPECT_EQ(WsClient(server->port(), path).status(), 404) << path;
  for (const char* ahead : {"0", "10", "-1", "two", "2.0"})
    EXPECT_EQ(WsClient(server->port(), std::string("/stream?ahead=") + ahead).status(), 400) << ahead;
  const WsClient viewer(server->port(), "/stream?ahead=9");
  EXPECT_EQ(viewer.status(), 101);
  EXPECT_TRUE(wait_until([&] { return server->viewers() == 1; }));
}

TEST_F(WebServerTest, ViewersGetTheSettingTheStateAndTheNewestFrame) {
  const auto server = serve();
  server->publish_state("{\"state\":\"paused\"}");
  server->publish(std::make_shared<const std::string>("old"));
  server->publish(std::make_shared<const std::string>("new"));
  WsClient viewer(server->port(), "/stream");
  std::vector<std::string> got;
  for (int i = 0; i < 3; ++i) got.push_back(viewer.receive().value_or(WsClient::Message{}).bytes);
  EXPECT_EQ(got, (std::vector<std::string>{"setting", "{\"state\":\"paused\"}", "new"}));
  viewer.send("hello");
  EXPECT_EQ(viewer.receive().value_or(WsClient::Message{}).bytes, "{}") << "an answer to it alone";
}

/// A browser that draws slowly takes messages all the same, and they wait in it, older and older.
TEST_F(WebServerTest, AViewerThatSaysWhatItGotHasTheNewest) {
  const auto server = serve();
  WsClient viewer(server->port(), "/stream?ahead=2");
  const auto next = [&] { return viewer.receive(1).value_or(WsClient::Message{}).bytes; };
  const auto publish = [&](const char* frame) {
    server->publish(std::make_shared<const std::string>(frame));
  };
  ASSERT_EQ(next(), "setting");
  publish("1");
  EXPECT_EQ(next(), "1");
  publish("2");
  EXPECT_EQ(next(), "2");
  publish("3");
  publish("4");
  EXPECT_EQ(viewer.receive(0.3), std::nullopt) << "two are ahead";
  server->publish_state("{}");
  EXPECT_EQ(next(), "{}") << "texts don't wait";
  viewer.send(R"({"do":"got"})");
  EXPECT_EQ(next(), "4");
  viewer.send(R"({"do": "got", "frames": 2})");
  publish("5");
  EXPECT_EQ(next(), "5");
  publish("6");
  EXPECT_EQ(next(), "6");
  viewer.send(R"({"do":"got","frames":-5})");
  viewer.send(R"({"do":"got","frames":"x"})");
  publish("7");
  EXPECT_NE(next(), "7");
}

TEST_F(WebServerTest, MessagesThatNoViewerSendsEndTheConnection) {
  const auto server = serve();
  for (const unsigned char first_byte : {0x82, 0x01}) {  // binary; a part of a text
    WsClient viewer(server->port(), "/stream");
    ASSERT_TRUE(viewer.receive());
    viewer.send("hello", first_byte);
    EXPECT_FALSE(viewer.receive(3)) << int(first_byte);
  }
  WsClient viewer(server->port(), "/stream");
  ASSERT_TRUE(viewer.receive());
  viewer.send(std::string(5000, 'x'));
  EXPECT_FALSE(viewer.receive(3)) << "longer than any message";
  EXPECT_TRUE(wait_until([&] { return server->viewers() == 0; }));
}

/// A lost network, a closed lid: civetweb logs these, on a small stack.
TEST_F(WebServerTest, ViewersThatDropInTheMiddleOfAMessageEndNothing) {
  const auto server = serve();
  for (const std::string& length :
       {std::string("\xfe\x00\xc8", 3), std::string("\xff\0\0\0\0\x40\0\0\0", 9)}) {
    WsClient viewer(server->port(), "/stream");
    ASSERT_TRUE(viewer.receive());
    viewer.send_raw("\x81" + length + "aaaaabc");
  }
  EXPECT_TRUE(wait_until([&] { return server->viewers() == 0; }));
  WsClient viewer(server->port(), "/stream");
  EXPECT_TRUE(viewer.receive());
}

TEST_F(WebServerTest, AStalledViewerDelaysNobody) {
  const auto server = serve();
  const auto frame = std::make_shared<const std::string>(std::string(4 << 20, 'f'));
  WsClient stalled(server->port(), "/stream", {}, 4096);
  WsClient viewer(server->port(), "/stream");
  ASSERT_TRUE(wait_until([&] { return server->viewers() == 2; }));
  ASSERT_EQ(viewer.receive().value_or(WsClient::Message{}).bytes, "setting");
  double longest_s = 0;
  for (int i = 0; i < 50; ++i) {
    const double begin_s = now_s();
    server->publish(frame);
    longest_s = std::max(longest_s, now_s() - begin_s);
    ASSERT_EQ(viewer.receive().value_or(WsClient::Message{}).bytes.size(), frame->size()) << i;
  }
  // To publish is to store a pointer under a lock; the stalled viewer's socket holds a writer for 10 s. A
  // machine that does much else may take this thread's turn for some tenths of a second.
  EXPECT_LT(longest_s, 1);
}

TEST_F(WebServerTest, TooManyViewersAreTurnedAway) {
  const auto server = serve();
  std::vector<std::unique_ptr<WsClient>> all;
  for (int i = 0; i < WebServer::kMostViewers; ++i) {
    all.push_back(std::make_unique<WsClient>(server->port(), "/stream"));
    ASSERT_EQ(all.back()->status(), 101) << i;
    ASSERT_TRUE(all.back()->receive());
  }
  EXPECT_EQ(WsClient(server->port(), "/stream").status(), 503);
  all.pop_back();
  EXPECT_TRUE(wait_until([&] { return server->viewers() == WebServer::kMostViewers - 1; }));
  EXPECT_EQ(WsClient(server->port(), "/stream").status(), 101);
}

constexpr const char* kHeldBall = R"(
source: {kind: none, frames: 0-19, fps: 100}
bodies:
  - name: block
    shape: {kind: box, size_m: [0.04, 0.04, 0.04]}
    spacing_m: 0.02
    material: {young_modulus_pa: 20000}
obstacles:
  - {name: ball, kind: sphere, radius_m: 0.03, placement: {position_m: [0, 0.5, 0]}, held: true}
)";

TEST_F(WebServerTest, ARunIsSeenStoppedAndTouched) {
  const Scene scene = parse_scene(kHeldBall, "scene.yaml");
  DeviceSet devices("cpu");
  const auto source = open_scene_source(scene);
  const BodyAssets assets = load_body_assets(scene);
  World world(devices, scene, assets);
  WebSink web(StreamScene(scene, source->rig(), assets, {"0", "abc", "machine", "cpu"}),
              {.server = {.port = 0},
               .allows_control = true,
               .parameters = {world.parameters().list().begin(), world.parameters().list().end()}});
  FrameLoop loop(*source, world, {.should_stop = [&] { return web.wait_for_turn([] { return false; }); }});
  web.join(loop, world);
  std::thread runs([&] { loop.run(); });
  const int port = std::stoi(web.url().substr(web.url().rfind(':') + 1));
  WsClient viewer(port, "/stream");
  const auto setting = viewer.receive();
  ASSERT_TRUE(setting && setting->is_binary);
  EXPECT_NE(setting->bytes.find("\"held\":[\"ball\"]"), std::string::npos);
  viewer.send(R"({"do":"set","parameter":"gravity_m_s2.y","value":-1.5})");
  viewer.send(R"({"do":"pose","obstacle":"ball","position_m":[0,0.25,0],"quaternion":[0,0,0,1]})");
  std::uint32_t last = 0;
  bool ended = false;
  while (!ended) {
    const auto message = viewer.receive();
    ASSERT_TRUE(message);
    if (!message->is_binary) {
      ended = nlohmann::json::parse(message->bytes).value("state", "") == "ended";
      continue;
    }
    std::uint32_t number = 0;
    std::memcpy(&number, message->bytes.data() + 16, 4);
    EXPECT_GT(number, last) << "frames never go back";
    last = number;
    EXPECT_NE(message->bytes.find("block"), std::string::npos);
  }
  runs.join();
  EXPECT_EQ(loop.frames(), 20);
  EXPECT_EQ(world.parameters().get("gravity_m_s2.y"), -1.5);
  EXPECT_NEAR(world.pose("ball").t.y, 0.25, 1e-12) << "where the viewer held it";
}

}  // namespace
}  // namespace tactus
