#include "tactus/xr/headset.h"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>

#include "tactus/base/error.h"
#include "tactus/io/scene_file.h"
#include "tactus/view/renderer.h"
#include "xr/mock_runtime.h"

namespace tactus {
namespace {

// A ball that is held, at the middle of the scene's picture; the body is beside it.
constexpr const char* kScene = R"(
source: {kind: none, frames: 0-99999, fps: 60}
bodies:
  - name: block
    shape: {kind: box, size_m: [0.1, 0.1, 0.1]}
    placement: {position_m: [0.5, 0.05, 0]}
    spacing_m: 0.05
    material: {young_modulus_pa: 20000}
obstacles:
  - {name: ball, kind: sphere, radius_m: 0.025, placement: {position_m: [0, 0.1, 0]}, held: true}
view:
  show_frusta: false
  camera: {target_m: [0, 0.1, 0], distance_m: 0.8}
)";
constexpr double kRadius_m = 0.025;
const Vec3d kBall_m{0, 1, -0.55};  // in the room: HeadsetOptions::at_m
const Vec3d kHead_m{0.02, 1.05, 0};

std::string scene_path() {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "tactus_headset_test";
  std::filesystem::create_directories(folder);
  const std::string path = folder / "ball.yaml";
  std::ofstream(path) << kScene;
  return path;
}

mock::Runtime& runtime() {
  static auto* const made = [] {
    void* library = dlopen(MOCK_RUNTIME, RTLD_NOW);
    return reinterpret_cast<mock::Runtime* (*)()>(dlsym(library, "tactus_mock_runtime"))();
  }();
  return *made;
}

mock::Pose pose_at(Vec3d p) {
  const Vec3f t = vec_cast<float>(p);
  return {{0, 0, 0, 1}, {t.x, t.y, t.z}};
}

struct Shown {
  std::string error, text;  ///< of the exception, and all that stood on standard error
};

/// Runs the scene as the script says.
Shown show(mock::Script script) {
  script.head = pose_at(kHead_m);
  runtime() = {std::move(script), {}};
  ::setenv("XR_RUNTIME_JSON", MOCK_MANIFEST, 1);
  Shown shown;
  testing::internal::CaptureStderr();
  try {
    show_in_headset(read_scene(scene_path()), {.named = "ball.yaml", .devices = "cpu"});
  } catch (const Error& e) {
    shown.error = e.what();
  }
  shown.text = testing::internal::GetCapturedStderr();
  EXPECT_TRUE(runtime().record.faults.empty()) << runtime().record.faults.front();
  return shown;
}

struct Pixel {
  double x, y;  ///< y counts from below, as OpenGL's rows
};

/// Where an eye sees a point of the room, by the definition of its four tangents.
Pixel seen(std::size_t eye, Vec3d p_m) {
  const mock::Script& script = runtime().script;
  const mock::Edges& e = script.edges.at(eye);
  const Vec3d eye_m = kHead_m + Vec3d{(eye == 0 ? -0.5 : 0.5) * static_cast<double>(script.ipd_m), 0, 0};
  const Vec3d d = p_m - eye_m;
  const mock::EyePicture& picture = runtime().record.eyes.at(eye);
  const auto left = static_cast<double>(e.left), right = static_cast<double>(e.right),
             down = static_cast<double>(e.down), up = static_cast<double>(e.up);
  return {(d.x / -d.z - left) / (right - left) * picture.width_px,
          (d.y / -d.z - down) / (up - down) * picture.height_px};
}

double depth_m(std::size_t eye, int x, int y) {
  const mock::EyePicture& p = runtime().record.eyes.at(eye);
  const auto d = static_cast<double>(p.depth.at(static_cast<std::size_t>(y * p.width_px + x)));
  const auto near_m = static_cast<double>(p.near_m), far_m = static_cast<double>(p.far_m);
  return near_m * far_m / (far_m - d * (far_m - near_m));
}

/// Middle of the pixels about `at` that are as near as the ball.
std::optional<Pixel> ball_about(std::size_t eye, Pixel at) {
  constexpr int kHalf_px = 14;
  double x = 0, y = 0;
  int count = 0;
  for (int j = static_cast<int>(at.y) - kHalf_px; j <= static_cast<int>(at.y) + kHalf_px; ++j)
    for (int i = static_cast<int>(at.x) - kHalf_px; i <= static_cast<int>(at.x) + kHalf_px; ++i)
      if (depth_m(eye, i, j) < -kBall_m.z + 0.01) {
        x += i + 0.5;
        y += j + 0.5;
        ++count;
      }
  if (count < 200) return std::nullopt;  // pi 10^2 px
  return Pixel{x / count, y / count};
}

void expect_ball_at(Vec3d p_m) {
  for (const std::size_t eye : {0U, 1U}) {
    const Pixel expected = seen(eye, p_m);
    const std::optional<Pixel> found = ball_about(eye, expected);
    ASSERT_TRUE(found) << "eye " << eye;
    EXPECT_NEAR(found->x, expected.x, 1) << "eye " << eye;
    EXPECT_NEAR(found->y, expected.y, 1) << "eye " << eye;
  }
}

class Headset : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = Renderer::why_unavailable(); !why.empty()) GTEST_SKIP() << why;
  }
};

TEST_F(Headset, SixtyFramesAreSeenByBothEyes) {
  const Shown shown = show({});
  EXPECT_EQ(shown.error, "");
  const mock::Record& record = runtime().record;
  EXPECT_EQ(record.frames, 60);
  EXPECT_GE(record.focused_frames, 58);  // events of the first frames come one by one
  expect_ball_at(kBall_m);
  const std::optional<Pixel> left = ball_about(0, seen(0, kBall_m)), right = ball_about(1, seen(1, kBall_m));
  ASSERT_TRUE(left && right);
  // f IPD / z, and the shift of the pictures' middles: their edges aren't alike.
  const double f_px = 400 / 1.8, shift_px = 0.2 * f_px;
  EXPECT_NEAR(left->x - right->x - shift_px, f_px * 0.064 / 0.55, 1);
}

TEST_F(Headset, DepthIsThatOfTheSurface) {
  ASSERT_EQ(show({.end_after = 3}).error, "");
  for (const std::size_t eye : {0U, 1U}) {
    const Pixel middle = seen(eye, kBall_m);
    const int x = static_cast<int>(middle.x), y = static_cast<int>(middle.y);
    // The ray of that pixel's middle meets the ball's front.
    const mock::Edges& e = runtime().script.edges.at(eye);
    const Vec3d ray{static_cast<double>(e.left) + (x + 0.5) / 400 * 1.8,
                    static_cast<double>(e.down) + (y + 0.5) / 400 * 1.9, -1};
    const Vec3d to_ball_m = kBall_m - kHead_m - Vec3d{eye == 0 ? -0.032 : 0.032, 0, 0};
    const Vec3d along = 1 / length(ray) * ray;
    const double middle_m = dot(along, to_ball_m);
    const double off2 = dot(to_ball_m, to_ball_m) - middle_m * middle_m;
    const double front_m = middle_m - std::sqrt(kRadius_m * kRadius_m - off2);
    EXPECT_NEAR(depth_m(eye, x, y), -along.z * front_m, 1e-3) << "eye " << eye;
  }
}

TEST_F(Headset, ControllerMovesTheToolAndALostPoseIsSaid) {
  const Vec3d step_m{0.08, 0.03, 0};
  mock::Script script{.end_after = 90};
  script.before_frame = [&](int frame) {
    mock::Hand& hand = runtime().script.hands[1];
    hand.is_tracked = frame < 60;
    hand.pulls_trigger = frame >= 10;
    hand.pose = pose_at(kBall_m + (frame >= 20 ? step_m : Vec3d{}));
  };
  const Shown shown = show(script);
  EXPECT_EQ(shown.error, "");
  expect_ball_at(kBall_m + step_m);
  EXPECT_NE(shown.text.find("the right controller is no longer tracked: 'ball' stays where it is"),
            std::string::npos)
      << shown.text;
}

TEST_F(Headset, WithoutDepthLayerAndFloorItIsSeenToo) {
  const Shown shown = show({.offers_depth = false, .knows_floor = false, .end_after = 3});
  EXPECT_EQ(shown.error, "");
  EXPECT_TRUE(runtime().record.eyes[0].depth.empty());
  EXPECT_NE(shown.text.find("where the floor is"), std::string::npos) << shown.text;
}

TEST_F(Headset, LostSessionIsOneMessage) {
  for (const mock::Script& script : {mock::Script{.lose_after = 5}, mock::Script{.warn_after = 5}}) {
    const Shown shown = show(script);
    EXPECT_NE(shown.error.find("the headset is lost (XR_ERROR_SESSION_LOST)"), std::string::npos)
        << shown.error;
    EXPECT_EQ(runtime().record.frames, 5);
  }
}

TEST_F(Headset, NoHeadsetAndNoEglAreOneMessage) {
  EXPECT_NE(show({.has_headset = false}).error.find("finds no headset"), std::string::npos);
  EXPECT_NE(show({.offers_egl = false}).error.find("XR_MNDX_egl_enable"), std::string::npos);
}

struct Ended {
  int code;
  std::string text;  ///< on standard error
};

Ended run_program(const std::string& environment) {
  const std::string log = scene_path() + ".log";
  const std::string command = environment + " '" + TACTUS_PROGRAM + "' xr '" + scene_path() +
                              "' --devices cpu --quiet 2>'" + log + "'";
  const int status = std::system(command.c_str());
  std::ostringstream text;
  text << std::ifstream(log).rdbuf();
  return {WEXITSTATUS(status), text.str()};
}

void expect_one_line(const std::string& text) {
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << text;
}

TEST_F(Headset, ProgramFailsWithOneLine) {
  const std::string mock = std::string("XR_RUNTIME_JSON='") + MOCK_MANIFEST + "' ";
  const Ended absent = run_program("XR_RUNTIME_JSON=/nowhere/runtime.json");
  EXPECT_EQ(absent.code, 1);
  EXPECT_NE(absent.text.find("no OpenXR runtime answers"), std::string::npos) << absent.text;
  expect_one_line(absent.text);
  const Ended lost = run_program(mock + "MOCK_XR_LOSE_AFTER=3");
  EXPECT_EQ(lost.code, 1);
  EXPECT_NE(lost.text.find("the headset is lost"), std::string::npos) << lost.text;
  expect_one_line(lost.text);
  const Ended done = run_program(mock + "MOCK_XR_END_AFTER=3");
  EXPECT_EQ(done.code, 0) << done.text;
  EXPECT_EQ(done.text, "");
}

}  // namespace
}  // namespace tactus
