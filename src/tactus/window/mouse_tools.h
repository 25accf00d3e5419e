#pragma once
/// Tools and tissue in the hand of a mouse.
#include <optional>
#include <span>

#include "tactus/run/run_control.h"
#include "tactus/window/viewed_frame.h"
#include "tactus/window/window_input.h"

namespace tactus {

/// Where the line of sight under a place of the picture first meets a body.
struct PickedPoint {
  std::size_t body = 0;
  Index vertex = 0;  ///< nearest of the triangle that it meets
  Vec3f at_m;
};
std::optional<PickedPoint> pick(std::span<const TriangleMesh> bodies, const ViewCamera& camera,
                                PicturePoint at_px, PicturePoint size_px);

/// Turns the mouse's ways into requests to a run. Knows no window.
class MouseTools {
 public:
  /// @param tools names of held obstacles and blades of the scene, the first is in the hand. Keeps
  /// references.
  MouseTools(const Scene& scene, std::span<const std::string> tools, RunControl& control);

  /// In the hand; "": there is none.
  std::string tool() const { return tools_.empty() ? "" : tools_[in_hand_].name; }
  std::size_t tool_count() const { return tools_.size(); }
  void take_next_tool();
  /// @param frame the one that is seen
  void follow(const WindowInput& input, const ViewedFrame& frame, const ViewCamera& camera,
              PicturePoint size_px);
  /// Tissue that is held, and where it is pulled.
  struct Spring {
    Vec3f from_m, to_m;
  };
  std::optional<Spring> spring(const ViewedFrame& frame) const;
  /// A run began anew: nothing is held.
  void release();

 private:
  struct Tool {
    std::string name;
    bool is_blade = false, is_hook = false;
    Vec3d from_m, to_m;  ///< a blade's edge in its own coordinates: from the tip
  };
  struct Grasp {
    PickedPoint point;
    Grab grab;
    float depth_m = 0;
  };
  void hold_tool(const WindowInput& input, const ViewedFrame& frame, const ViewCamera& camera,
                 PicturePoint size_px);
  void put_blade(const WindowInput& input, const ViewedFrame& frame, const ViewCamera& camera,
                 PicturePoint size_px);
  void turn_hook(const Tool& tool, const ViewedTool& seen, const ViewedFrame& frame,
                 const ViewCamera& camera);
  void pull(const WindowInput& input, const ViewedFrame& frame, const ViewCamera& camera,
            PicturePoint size_px);
  Rigidd pose_of(const Tool& tool, Vec3f at_m, const ViewCamera& camera) const;

  const Scene& scene_;
  RunControl& control_;
  std::vector<Tool> tools_;
  std::size_t in_hand_ = 0;
  std::optional<float> blade_depth_m_;  ///< of its tip's plane
  std::optional<Grasp> grasp_;
};

}  // namespace tactus
