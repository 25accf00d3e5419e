/// What viewers may ask of a run, and the texts that they send.
#include "tactus/web/client_control.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/message_of.h"
#include "tactus/base/error.h"
#include "tactus/base/timing.h"
#include "tactus/rig/live_address.h"
#include "tactus/sim/scene.h"
#include "tactus/web/viewer_checks.h"
#include "tactus/web/web_server.h"

namespace tactus {
namespace {

using test::message_of;

ClientControl::Options open_to_all() {
  ClientControl::Options options;
  options.is_allowed = true;
  options.held = {"ball"};
  return options;
}

TEST(ClientMessage, ReadsAPose) {
  const ClientMessage m = parse_client_message(
      R"({"do":"pose","obstacle":"ball","position_m":[0.1,0.2,-0.3],"quaternion":[0,0,0.70710678118,0.70710678118]})");
  EXPECT_EQ(m.kind, ClientMessage::Kind::pose);
  EXPECT_EQ(m.name, "ball");
  EXPECT_EQ(m.T_world_obstacle.t.z, -0.3);
  // A quarter turn about z takes x to y.
  const Vec3d turned = m.T_world_obstacle.R * Vec3d{1, 0, 0};
  EXPECT_NEAR(turned.x, 0, 1e-9);
  EXPECT_NEAR(turned.y, 1, 1e-9);
}

TEST(ClientMessage, RefusesWhatItCannotUse) {
  const auto refused = [](const std::string& text) {
    return message_of([&] { parse_client_message(text); });
  };
  EXPECT_NE(refused(""), "");
  EXPECT_NE(refused("[1,2"), "");
  EXPECT_NE(refused("[]"), "");
  EXPECT_NE(refused(R"({"do":1})"), "");
  EXPECT_NE(refused(R"({"do":"paus"})").find("did you mean 'pause'"), std::string::npos);
  EXPECT_NE(refused(R"({"do":"\u001b[2J"})").find("\\x1b"), std::string::npos)
      << "no escapes reach a terminal";
  EXPECT_NE(refused(std::string(kMostClientBytes + 1, ' ')).find("at most 4096"), std::string::npos);
  EXPECT_EQ(refused(R"({"do":"got","frames":-1})"), "'frames': expected a whole number from 1 on");
  const std::string pose = R"({"do":"pose","obstacle":"ball",)";
  EXPECT_NE(refused(pose + R"("quaternion":[0,0,0,1]})").find("position_m"), std::string::npos);
  EXPECT_NE(refused(pose + R"("position_m":[0,0],"quaternion":[0,0,0,1]})").find("3 numbers"),
            std::string::npos);
  EXPECT_NE(refused(pose + R"("position_m":[0,0,"1"],"quaternion":[0,0,0,1]})").find("3 numbers"),
            std::string::npos);
  EXPECT_NE(refused(pose + R"("position_m":[0,0,1e9],"quaternion":[0,0,0,1]})").find("-100 to 100"),
            std::string::npos);
  EXPECT_NE(refused(pose + R"("position_m":[0,0,0],"quaternion":[0,0,0,0.5]})").find("expected 1"),
            std::string::npos);
  EXPECT_NE(refused(R"({"do":"set","parameter":"a","value":1e999})"), "");
  EXPECT_NE(refused(std::string(4000, '[')), "") << "deep nesting";
}

TEST(ClientControl, PausesStepsAndRuns) {
  RunControl run;
  ClientControl control(open_to_all(), run);
  EXPECT_EQ(control.handle(R"({"do":"pause"})"), "");
  EXPECT_EQ(run.state(), RunControl::State::paused);
  EXPECT_EQ(control.handle(R"({"do":"step"})"), "");
  EXPECT_EQ(run.wait_for_turn(), RunControl::Turn::go) << "one step";
  EXPECT_EQ(run.wait_for_turn(false, [] { return true; }), RunControl::Turn::stop) << "and no other";
  EXPECT_EQ(control.handle(R"({"do":"run"})"), "");
  EXPECT_EQ(run.state(), RunControl::State::running);
}

TEST(ClientControl, ViewersMayOnlyLookUnlessTheyAreLet) {
  ClientControl::Options options = open_to_all();
  options.is_allowed = false;
  RunControl run;
  ClientControl control(std::move(options), run);
  EXPECT_NE(control.handle(R"({"do":"pause"})").find("--web-control"), std::string::npos);
  EXPECT_NE(run.state(), RunControl::State::paused);
}

TEST(ClientControl, MovesOnlyWhatIsHeld) {
  RunControl run;
  ClientControl control(open_to_all(), run);
  const std::string there = R"("position_m":[0,0,0],"quaternion":[0,0,0,1]})";
  EXPECT_EQ(control.handle(R"({"do":"pose","obstacle":"ball",)" + there), "");
  EXPECT_TRUE(run.asked_pose("ball").has_value());
  const std::string error = control.handle(R"({"do":"pose","obstacle":"bal",)" + there);
  EXPECT_NE(error.find("did you mean 'ball'"), std::string::npos) << error;
  EXPECT_FALSE(run.asked_pose("bal").has_value());
}

TEST(ClientControl, SetsParametersInTheirRange) {
  ClientControl::Options options = open_to_all();
  SceneParameter friction;
  friction.name = "contact.friction";
  friction.most = 10;
  options.parameters = {friction};
  RunControl run;
  ClientControl control(std::move(options), run);
  EXPECT_EQ(control.handle(R"({"do":"set","parameter":"contact.friction","value":0.1})"), "");
  EXPECT_EQ(run.pending_parameters().at("contact.friction"), 0.1);
  EXPECT_NE(control.handle(R"({"do":"set","parameter":"contact.friction","value":-1})").find(">= 0"),
            std::string::npos);
  const std::string error = control.handle(R"({"do":"set","parameter":"contact.frictio","value":1})");
  EXPECT_NE(error.find("did you mean 'contact.friction'"), std::string::npos) << error;
  EXPECT_EQ(run.pending_parameters().at("contact.friction"), 0.1);
}

TEST(ClientMessage, ReadsAGrabAndHowAPoseIsReached) {
  const ClientMessage grab =
      parse_client_message(R"({"do":"grab","body":"liver","point_m":[0.1,0.2,-0.3],"target_m":[0,0.5,0]})");
  EXPECT_EQ(grab.kind, ClientMessage::Kind::grab);
  EXPECT_EQ(grab.name, "liver");
  EXPECT_EQ(grab.point_m.z, -0.3);
  EXPECT_EQ(grab.target_m.y, 0.5);
  const auto refused = [](const std::string& text) {
    return message_of([&] { parse_client_message(text); });
  };
  EXPECT_NE(refused(R"({"do":"grab","point_m":[0,0,0],"target_m":[0,0,0]})").find("'body'"),
            std::string::npos);
  EXPECT_NE(refused(R"({"do":"grab","body":"b","point_m":[0,0,0],"target_m":[0,0,1e9]})").find("'target_m'"),
            std::string::npos);
  const std::string pose = R"({"do":"pose","obstacle":"knife","position_m":[0,0,0],"quaternion":[0,0,0,1])";
  EXPECT_FALSE(parse_client_message(pose + "}").is_put);
  const ClientMessage put = parse_client_message(pose + R"(,"put":true,"most_m_s":0.5})");
  EXPECT_TRUE(put.is_put);
  EXPECT_EQ(put.most_m_s, 0.5);
  EXPECT_NE(refused(pose + R"(,"put":1})").find("true or false"), std::string::npos);
  EXPECT_NE(refused(pose + R"(,"most_m_s":0})").find("> 0"), std::string::npos);
}

TEST(ClientMessage, ReadsAFrameThatIsSeenAgain) {
  EXPECT_EQ(parse_client_message(R"({"do":"see","frame":12})").frame, 12);
  EXPECT_EQ(parse_client_message(R"({"do":"see","steps":-1})").steps, -1);
  EXPECT_EQ(parse_client_message(R"({"do":"again"})").kind, ClientMessage::Kind::again);
  const auto refused = [](const std::string& text) {
    return message_of([&] { parse_client_message(text); });
  };
  for (const char* both : {R"({"do":"see"})", R"({"do":"see","frame":1,"steps":1})"})
    EXPECT_NE(refused(both).find("either"), std::string::npos) << both;
  for (const char* frame : {"-1", "1.5", "1e10", "1e999", "\"1\"", "null", "[1]", "true"})
    EXPECT_NE(refused(std::string(R"({"do":"see","frame":)") + frame + "}"), "") << frame;
  EXPECT_NE(refused(R"({"do":"see","frame":-1})").find("'frame': expected a whole number, 0 to"),
            std::string::npos);
}

/// Messages of frames 1 to 4, of which 3 has no state.
struct SeenRun {
  SeenRun() {
    for (const int number : {1, 2, 3, 4}) add(number);
  }
  void add(int number, int run = 0) {
    const auto state = std::make_shared<const PastState>(PastState{"state", {}, number});
    past.add(std::make_shared<const std::string>(std::to_string(number)), number, run,
             number == 3 ? nullptr : state);
  }
  std::string shown;
  int changes = 0;
  WebPast past{{.most_bytes = 1000,
                .show = [this](const WebPast::Bytes& message) { shown = *message; },
                .changed = [this] { ++changes; }}};
};

TEST(WebPast, ShowsTheNewestUnlessAnOlderOneIsLookedAt) {
  SeenRun run;
  EXPECT_EQ(run.shown, "4");
  EXPECT_EQ(run.past.shown().seen, 0);
  run.past.see(2);
  EXPECT_EQ(run.shown, "2");
  run.add(5);
  EXPECT_EQ(run.shown, "2") << "a frame that was in work as it was paused replaces nothing";
  EXPECT_EQ(run.past.shown().last, 5);
  run.past.move(1);
  EXPECT_EQ(run.past.shown().seen, 3);
  EXPECT_EQ(run.past.shown().again_from, 2) << "3 has no state";
  run.past.move(100);
  EXPECT_EQ(run.past.shown().seen, 0) << "the newest is no past";
  run.past.move(-1);
  run.past.leave();
  EXPECT_EQ(run.shown, "5");
  EXPECT_EQ(run.changes, 5);
}

TEST(WebPast, GoesBackToTheFrameThatIsLookedAt) {
  SeenRun run;
  EXPECT_NE(message_of([&] { run.past.ask_again(); }).find("'see'"), std::string::npos);
  run.past.see(2);
  run.past.ask_again();
  run.past.see(1);  // somebody else looks on
  EXPECT_EQ(run.past.go_back()->number, 2);
  EXPECT_EQ(run.shown, "2");
  EXPECT_EQ(run.past.shown().last, 2);
  EXPECT_EQ(run.past.shown().seen, 0);
  run.add(4, 0);
  EXPECT_EQ(run.past.shown().last, 2) << "a frame from before counts no more";
  run.add(3, run.past.run());
  EXPECT_EQ(run.shown, "3");
}

TEST(WebPast, KeepsNothingWithoutMemory) {
  std::string shown;
  WebPast past(
      {.most_bytes = 0, .show = [&](const WebPast::Bytes& message) { shown = *message; }, .changed = {}});
  past.add(std::make_shared<const std::string>("1"), 1, 0, nullptr);
  EXPECT_EQ(shown, "1");
  EXPECT_NE(message_of([&] { past.see(1); }).find("--web-past"), std::string::npos);
  EXPECT_EQ(past.shown().last, 0);
}

/// To look at the past stops the run; to go on or to step leaves it.
TEST(ClientControl, LooksAtThePastAndGoesBack) {
  SeenRun seen;
  std::string why_not;
  ClientControl::Options options = open_to_all();
  options.past = &seen.past;
  options.why_not_again = [&] { return why_not; };
  RunControl run;
  ClientControl control(std::move(options), run);
  EXPECT_EQ(control.handle(R"({"do":"see","frame":1})"), "");
  EXPECT_EQ(run.state(), RunControl::State::paused);
  EXPECT_EQ(seen.shown, "1");
  EXPECT_EQ(control.handle(R"({"do":"step"})"), "");
  EXPECT_EQ(seen.shown, "4");
  EXPECT_EQ(control.handle(R"({"do":"see","steps":-2})"), "");
  EXPECT_EQ(seen.shown, "2");
  EXPECT_EQ(control.handle(R"({"do":"run"})"), "");
  EXPECT_EQ(seen.shown, "4");
  EXPECT_NE(control.handle(R"({"do":"again"})").find("'see'"), std::string::npos);
  EXPECT_EQ(control.handle(R"({"do":"see","frame":2})"), "");
  why_not = "a reason";
  EXPECT_NE(control.handle(R"({"do":"again"})").find("a reason"), std::string::npos);
  EXPECT_FALSE(run.goes_back());
  why_not = "";
  EXPECT_EQ(control.handle(R"({"do":"again"})"), "");
  EXPECT_TRUE(run.goes_back());
  EXPECT_EQ(run.wait_for_turn(), RunControl::Turn::restart);
  run.end();
  EXPECT_TRUE(run.begin());
  EXPECT_EQ(run.state(), RunControl::State::paused) << "a run that had ended";
}

/// A soft box that floats.
Scene floating_box() {
  Scene scene;
  scene.source.kind = SourceKind::none;
  scene.gravity_m_s2 = {};
  BodyDescription& body = scene.bodies.emplace_back();
  body.name = "box";
  body.shape.size_m = {0.1, 0.1, 0.1};
  body.spacing_m = 0.025;
  return scene;
}

/// Tissue that a viewer grabs is pulled, and let go when it says so or is gone for two seconds.
TEST(ClientControl, TissueIsHeldUntilTheViewerLetsGoOrIsGone) {
  DeviceSet devices("cpu");
  const Scene scene = floating_box();
  World world(devices, scene, {});
  ClientControl::Options options = open_to_all();
  options.grabbed = {"box"};
  RunControl run;
  ClientControl control(std::move(options), run);
  const auto pull_N = [&] {
    EXPECT_EQ(run.apply(world).errors, "");
    return length(world.step(0.01).grab_N);
  };
  pull_N();
  const std::string grab = R"({"do":"grab","body":"box","point_m":[0,0.05,0],"target_m":[0,0.07,0]})";
  EXPECT_EQ(control.handle(grab), "");
  EXPECT_GT(pull_N(), 0);
  EXPECT_EQ(control.handle(R"({"do":"release"})"), "");
  EXPECT_EQ(pull_N(), 0);

  EXPECT_EQ(control.handle(grab), "");
  control.let_go_of_old_grabs(now_s() + 1);
  EXPECT_GT(pull_N(), 0) << "one second";
  control.let_go_of_old_grabs(now_s() + ClientControl::kGrabLasts_s);
  EXPECT_EQ(pull_N(), 0) << "nobody said for two seconds that it is held";

  const std::string error =
      control.handle(R"({"do":"grab","body":"bos","point_m":[0,0,0],"target_m":[0,0,0]})");
  EXPECT_NE(error.find("did you mean 'box'"), std::string::npos) << error;
  EXPECT_EQ(control.handle(R"({"do":"grab","body":"box","point_m":[0,9,0],"target_m":[0,0,0]})"), "");
  EXPECT_NE(run.apply(world).errors.find("m from body 'box'"), std::string::npos);
}

TEST(WebAddress, IsReadOrRefusedByName) {
  EXPECT_EQ(parse_web_address("").port, 8090);
  EXPECT_EQ(parse_web_address("9000").port, 9000);
  EXPECT_EQ(parse_web_address("localhost:9000").address, "127.0.0.1");
  EXPECT_EQ(parse_web_address("0.0.0.0:80").address, "0.0.0.0");
  EXPECT_EQ(parse_web_address("192.168.1.20").port, 8090);
  EXPECT_FALSE(parse_web_address("0.0.0.0").is_loopback());
  EXPECT_FALSE(parse_web_address("127.0.0.2").is_loopback());
  for (const char* wrong :
       {"scene.yaml", "1.2.3", "1.2.3.256", "1.2.3.4:", "1.2.3.4:x", "1.2.3.4:65536", "[::1]:80", ":"})
    EXPECT_NE(message_of([&] { parse_web_address(wrong); }, ErrorKind::usage).find("--web"),
              std::string::npos)
        << wrong;
}

TEST(WebAddress, NameOfAServerInFrontIsReadOrRefused) {
  EXPECT_EQ(parse_web_name("lab.example:8443"), "lab.example:8443");
  EXPECT_EQ(parse_web_name("192.168.1.20"), "192.168.1.20");
  EXPECT_EQ(parse_web_name("lab:443"), "lab") << "as browsers send it";
  for (const char* wrong :
       {"", ":1", "lab:", "lab:0", "lab:65536", "lab:8x", "https://lab", "a b", "a\"b", "a:1:2"})
    EXPECT_NE(message_of([&] { parse_web_name(wrong); }, ErrorKind::usage).find("--web-name"),
              std::string::npos)
        << wrong;
  EXPECT_NE(message_of([&] { WebServer({.name = "lab"}, "", {}); }, ErrorKind::usage).find("token"),
            std::string::npos);
}

TEST(ViewerChecks, OriginHostAndToken) {
  EXPECT_TRUE(is_same_origin("http://127.0.0.1:8090", "127.0.0.1:8090"));
  EXPECT_TRUE(is_same_origin("https://lab:8090", "lab:8090"));
  for (const char* other :
       {"http://127.0.0.1:8091", "http://evil.example", "null", "", "http://127.0.0.1:8090.evil.example"})
    EXPECT_FALSE(is_same_origin(other, "127.0.0.1:8090")) << other;
  EXPECT_FALSE(is_same_origin("http://", ""));
  EXPECT_EQ(host_refusal(true, "localhost:8090"), "");
  EXPECT_EQ(host_refusal(true, "127.0.0.1:8090"), "");
  for (const char* other : {"evil.example:8090", "", "127.0.0.1.evil.example:80", "localhost.evil.example"})
    EXPECT_NE(host_refusal(true, other), "") << other;
  EXPECT_EQ(host_refusal(true, "lab.example:8443", "lab.example:8443"), "");
  EXPECT_EQ(host_refusal(true, "LAB.example:8443", "lab.example:8443"), "");
  EXPECT_EQ(host_refusal(true, "127.0.0.1:8090", "lab.example:8443"), "") << "on its own computer, too";
  for (const char* other : {"lab.example", "lab.example:8444", "evil.example:8443", "", "xlab.example:8443"})
    EXPECT_NE(host_refusal(true, other, "lab.example:8443"), "") << other;
  EXPECT_TRUE(is_same_token("abc", "abc"));
  for (const char* other : {"", "ab", "abd", "abcd", "xabc"})
    EXPECT_FALSE(is_same_token(other, "abc")) << other;
  EXPECT_EQ(make_web_token().size(), 32U);
  EXPECT_NE(make_web_token(), make_web_token());
}

}  // namespace
}  // namespace tactus
