#pragma once
/// A scene and its frames as messages of the web stream.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tactus/web/stream_message.h"
#include "tactus/world/world.h"

namespace tactus {

/// Where and by which program a run is made, for its viewers.
struct RunFacts {
  std::string version, commit, machine, devices;
};

/// Contents of one frame's message.
struct StreamFrame {
  std::shared_ptr<const FrameSnapshot> snapshot;
  int number = 0;
  double time_s = 0, captured_unix_s = 0;
  std::shared_ptr<const std::string> status;  ///< JSON (run_status.h), or none
};

/// Owns all it needs of the scene: colours, names, and meshes that stand still. Any thread may encode.
class StreamScene {
 public:
  StreamScene(const Scene& scene, const Rig& rig, const BodyAssets& assets, RunFacts facts);

  /// The first message of a stream: what doesn't move, and the facts of the run. @param control whether
  /// viewers may pause, step and hold tools @param parameters that they may change
  std::string setting(bool control, std::span<const SceneParameter> parameters = {}) const;
  std::string frame(const StreamFrame& frame) const;
  /// Surfaces of a snapshot with the normals of pictures.
  struct Surface {
    BlockStyle style;
    TriangleMesh mesh;
  };
  std::vector<Surface> surfaces(const FrameSnapshot& snapshot) const;
  /// Everything of a snapshot that is no surface.
  void add_points(const FrameSnapshot& snapshot, StreamMessage& message) const;

  const std::string& name() const { return name_; }
  const RunFacts& facts() const { return facts_; }
  /// Names of the obstacles that a program or viewer holds.
  const std::vector<std::string>& held() const { return held_; }

 private:
  struct Thing {
    std::string name;
    Vec3f color;
    bool is_cuttable = false;
  };
  std::string setting_json(bool control, std::span<const SceneParameter> parameters) const;

  std::string name_;
  RunFacts facts_;
  ViewDescription view_;
  std::vector<Thing> bodies_;
  std::vector<std::string> moving_, held_;
  std::optional<LiquidDescription> liquid_;
  std::vector<Vec3f> frusta_, depth_frusta_, edges_;
  std::vector<Thing> still_names_;
  std::vector<TriangleMesh> still_meshes_;
};

/// The rim of a camera's image at a depth and the rays to its corners, as pairs of points.
std::vector<Vec3f> frustum_lines(const Camera& camera, double depth_m);
/// The twelve edges of a box, likewise.
std::vector<Vec3f> box_lines(const Box3f& box_m);

}  // namespace tactus
