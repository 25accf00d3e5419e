#pragma once
/// A world, and the perception of its rig's images where the rig has cameras.
#include <memory>

#include "tactus/world/world_impl.h"

namespace tactus::test {

/// Constructed before the World that it belongs to.
struct OwnedPerception {
  std::unique_ptr<Perception> owned;
};

class FilmedWorld : private OwnedPerception, public World {
 public:
  FilmedWorld(DeviceSet& devices, const Scene& scene, const Rig& rig, const BodyAssets& assets,
              bool can_reduce = false)
      : OwnedPerception{make_perception(devices, scene, rig, assets, can_reduce)},
        World(devices, scene, assets, owned.get()) {}

  /// @param frame new images, or nullptr for none
  StepReport step(const FrameSet* frame, double dt_s) {
    if (owned != nullptr) set_surface(owned->observe(frame, dt_s));
    return World::step(dt_s);
  }
  StepReport step(const FrameSet& frame, double dt_s) { return step(&frame, dt_s); }
  const TrackedBlades& tracked_blades() const { return owned->impl().tracked_blades(); }

  // From the inside.
  const std::vector<std::unique_ptr<SoftBody>>& bodies() const { return impl().bodies(); }
  const SceneLiquid* liquid() const { return impl().liquid(); }
  const Schedule& schedule() const { return impl().schedule(); }
  const std::vector<PlannedLine>& plans() const { return impl().plans(); }
  ExecContext& context() { return impl().context(); }
  void archive(StateArchive& a, const FrameSet* last) { impl().archive(a, last); }
};

}  // namespace tactus::test
