#pragma once
/// From images to the surface and the tools that touch bodies.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tactus/base/vec.h"
#include "tactus/reconstruct/visual_hull.h"
#include "tactus/rig/sources/frame_source.h"
#include "tactus/sim/notice.h"

namespace tactus {

struct BodyAssets;
struct Scene;

/// How long a stage on the host took, on the clock of now_s().
struct HostTime {
  const char* stage;
  double begin_s, end_s;
};

struct SeenTools;

/// Everything that the world learns from images, apart from the mesh itself: that stays on the devices. Made
/// by Perception::observe, taken by World::set_surface.
struct Observation {
  bool is_new = false;  ///< images came; else nothing below is set
  std::int64_t tick = 0;
  double captured_s = 0;                   ///< on the clock of now_s()
  double released_s = 0;                   ///< when a live set was there; 0: the images are not live
  double observe_s = 0;                    ///< that observe() took
  std::vector<HostTime> times;             ///< of its stages
  std::shared_ptr<const SeenTools> tools;  ///< poses of tracked tools
  const void* made_by = nullptr;           ///< the Perception's inside: only its World takes it
  std::vector<Notice> notices;
};

/// Whether the pose of a tracked tool is known: blade_state_name() says it in words.
enum class BladeState : std::uint8_t;
const char* blade_state_name(BladeState state);

/// Where a tool was found: its longest axis, from end to end, and how well it is known.
struct ToolAxis {
  std::string name;
  BladeState state{};
  double two_sigma_m = 0;
  Vec3f from_m, to_m;  ///< world
};

/// In the order in which they are made: the reduction that is missed least comes first.
enum class QualityReduction : std::uint8_t {
  photographs,  ///< the real surface is drawn without them
  hull,         ///< voxels are twice as large, and the hull isn't checked
  liquid,       ///< half as many iterations a step, at least three
  samples,      ///< samples of the real surface are twice as far apart
};
inline constexpr std::size_t kQualityReductions = 4;
/// "the hull's voxels are twice as large".
const char* quality_reduction_text(QualityReduction quality_reduction);

/// Owns all that looks at images: the pipelines of the surface, the checks of masks and hull, the tracked
/// tools. observe() does the host's part of a frame. The surface itself is made by stages in the schedule of
/// the World that was constructed with this object, so a frame is one submission and the mesh never leaves
/// the devices. One thread calls it.
///
///   Perception perception(devices, scene, rig, assets);
///   World world(devices, scene, assets, &perception);
///   per frame: world.set_surface(perception.observe(&frame, dt_s)); world.step(dt_s);
class Perception {
 public:
  /// @param can_reduce prepares for a coarser hull on demand, which takes memory
  /// @throws Error naming the fault of the rig; usage Error for a rig without cameras.
  Perception(DeviceSet& devices, const Scene& scene, const Rig& rig, const BodyAssets& assets,
             bool can_reduce = false);
  ~Perception();
  Perception(const Perception&) = delete;
  Perception& operator=(const Perception&) = delete;

  /// @param frame the rig's new images, or nullptr when nothing new came. They are read until the World's
  /// next step has ended @param dt_s as World::step's
  Observation observe(const FrameSet* frame, double dt_s);
  /// After the last frame: notices that came later than their frames, as those of the check of masks.
  std::vector<Notice> last_notices();

  /// The hull that makes the surface at present.
  const VisualHull& hull() const;
  /// Edge of a voxel of the hull that isn't reduced.
  float voxel_size_m() const;
  const Box3f& workspace_m() const;
  /// The surface of the last frame. Synchronizes.
  TriangleMesh download();

  struct Impl;
  /// For the library itself: its header is not installed.
  Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// nullptr for a rig without cameras: a World needs none.
std::unique_ptr<Perception> make_perception(DeviceSet& devices, const Scene& scene, const Rig& rig,
                                            const BodyAssets& assets, bool can_reduce = false);

}  // namespace tactus
