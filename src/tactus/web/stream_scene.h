#pragma once
/// A scene and its frames as messages of the web stream.
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tactus/sim/scene.h"
#include "tactus/web/stream_message.h"
#include "tactus/world/world.h"

namespace tactus {

/// Where and by which program a run is made, for its viewers.
struct RunFacts {
  std::string version, commit, machine, devices;
  double budget_s = 0;  ///< of a frame (--budget); 0: the time from frame to frame
};

/// Vertices that a surface has more than once, at its creases. Which ones changes as it deforms; here they
/// stay until its triangles change, so that a viewer keeps its triangles.
class CreaseMemory {
 public:
  /// Splits a body's surface; its normals become area-weighted ones. @param film of its vertices, or none
  /// @param body its number
  /// @param first as of split_creases
  void split(TriangleMesh& mesh, std::string& film, std::size_t body, Index first);

 private:
  struct Split {
    std::vector<std::array<Index, 3>> whole, parted;  ///< triangles
    std::vector<Index> origin;                        ///< of each vertex after the split
  };
  std::map<std::size_t, Split> splits_;
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
  std::string frame(const StreamFrame& frame, CreaseMemory& creases) const;
  /// Surfaces of a snapshot with the normals of pictures.
  struct Surface {
    BlockStyle style;
    TriangleMesh mesh;
    std::string film;       ///< a byte a vertex (kFilmStep_m), or none
    bool is_sheet = false;  ///< film on an obstacle that stands still; not lifted, where that was asked
  };
  /// @param creases of earlier snapshots of this run: surfaces that weren't cut since keep their vertices
  /// @param lifts_sheets films on obstacles are as thick as they are; else flat
  std::vector<Surface> surfaces(const FrameSnapshot& snapshot, CreaseMemory& creases,
                                bool lifts_sheets = true) const;
  /// Lines and particles of a snapshot.
  struct Points {
    BlockKind kind;
    BlockStyle style;
    std::vector<Vec3f> positions_m;
  };
  /// `style` of both holds names of the snapshot and of this.
  std::vector<Points> points(const FrameSnapshot& snapshot) const;

  const std::string& name() const { return name_; }
  const RunFacts& facts() const { return facts_; }
  /// Names of the obstacles that a program or viewer holds.
  const std::vector<std::string>& held() const { return held_; }
  /// Bodies that may be grabbed.
  const std::vector<std::string>& grabbed() const { return grabbed_; }

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
  std::vector<std::string> moving_, held_, grabbed_;
  std::vector<BladeDescription> held_blades_;
  std::map<std::string, std::string> film_names_;  ///< of obstacles
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
