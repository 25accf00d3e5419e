#pragma once
/// A frame as a window shows it: plain data of its own.
#include <memory>
#include <string>
#include <vector>

#include "tactus/world/world.h"

namespace tactus {

/// A stage of the frame; percentiles over the newest frames (Timings).
struct StageTime {
  std::string name;
  double p50_ms = 0, p99_ms = 0;
};

/// A number that is shown as a curve.
struct ViewedValue {
  std::string name, unit;
  double value = 0;
};

/// A contact of a body: something pushes it there.
struct ContactArrow {
  Vec3f at_m, force_N;
};

/// An obstacle or a blade that the mouse may hold.
struct ViewedTool {
  std::string name;
  Rigidd T_world;
  double force_N = 0;  ///< of all bodies on it
};

struct ViewedFrame {
  std::shared_ptr<const FrameSnapshot> snapshot;
  std::vector<ColorImage> photos;  ///< of the rig's cameras, where the scene wears them
  int number = 0;                  ///< from 1
  double time_s = 0;               ///< of the source
  double shown_at_s = 0;           ///< on the clock of now_s()
  int substeps = 0;
  double frame_ms = 0;
  double budget_ms = 0;   ///< that a frame may take to keep pace with its source; 0: there is none
  double latency_ms = 0;  ///< from the capture of live images to this frame; 0: unknown
  std::vector<StageTime> stages;
  std::vector<ViewedValue> values;
  std::vector<ContactArrow> contacts;
  std::vector<std::string> notices;                               ///< the newest last
  std::shared_ptr<const std::vector<SceneParameter>> parameters;  ///< as this frame had them
  std::string refusal;                                            ///< of the last request; "": it was taken
  std::vector<ViewedTool> tools;                                  ///< in the order of LiveRun::tools
  double pull_N = 0;  ///< of the spring on the body that is grabbed
};

}  // namespace tactus
