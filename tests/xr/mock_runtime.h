#pragma once
/// An OpenXR runtime for tests: a library that the loader finds by XR_RUNTIME_JSON. It draws nothing and
/// needs no display; it keeps what a program handed it, and what the program did that a runtime needn't bear.
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace tactus::mock {

struct Pose {
  std::array<float, 4> orientation{0, 0, 0, 1};  ///< x y z w
  std::array<float, 3> position_m{};
};

struct Hand {
  bool is_tracked = false, pulls_trigger = false;
  Pose pose;
};

/// Tangents of the edges.
struct Edges {
  float left, right, down, up;
};

/// What the runtime does. The program's frames are counted from 1 where they have a layer.
struct Script {
  bool has_headset = true, offers_egl = true, offers_depth = true, knows_floor = true;
  int end_after = 60;  ///< the wearer ends the session after so many frames
  int lose_after = 0;  ///< calls fail with XR_ERROR_SESSION_LOST after so many; 0: never
  int warn_after = 0;  ///< likewise, by an event that says so
  std::function<void(int frame)> before_frame{};  ///< may be empty; moves hands, say
  Pose head{};                                    ///< of its middle
  std::array<Edges, 2> edges{Edges{-1.0F, 0.8F, -1.0F, 0.9F}, Edges{-0.8F, 1.0F, -1.0F, 0.9F}};
  float ipd_m = 0.064F;
  std::array<Hand, 2> hands{};
};

/// The last picture of an eye, rows from below.
struct EyePicture {
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> rgba;
  std::vector<float> depth;  ///< in [0, 1]; empty where there was no depth layer
  float near_m = 0, far_m = 0;
};

struct Record {
  int frames = 0, focused_frames = 0;  ///< with a layer
  std::array<EyePicture, 2> eyes;
  std::vector<std::string> faults;
};

struct Runtime {
  Script script;
  Record record;
};

}  // namespace tactus::mock

/// The one in this process.
extern "C" tactus::mock::Runtime* tactus_mock_runtime();
