#include "tactus/run/sinks/usd_sink.h"

#include <algorithm>

#include "tactus/sim/still_obstacles.h"
#include "tactus/view/scene.h"

namespace tactus {
namespace {

constexpr Vec3f kObstacle{0.62F, 0.65F, 0.69F}, kBlood{0.5F, 0.02F, 0.03F};

}  // namespace

UsdSink::UsdSink(const Scene& scene, const BodyAssets& assets, const std::string& stem, double frames_per_s)
    : scene_(scene),
      every_(std::max(scene.output.usd_every, 1)),
      usd_(stem + ".usda", frames_per_s / every_) {
  for (const StillObstacle& o : still_obstacles(scene, assets))
    usd_.add_still("obstacle " + o.name, o.mesh, kObstacle);
  for (const ObstacleSetting& o : scene.obstacles)
    if (o.moves()) moving_.push_back("obstacle " + o.name);
}

void UsdSink::frame(RunFrame& frame) {
  if ((frame.number - 1) % every_ != 0) return;
  const std::shared_ptr<const FrameSnapshot> seen = frame.snapshot();
  if (!seen->real.triangles.empty()) usd_.add("real", seen->real, clay_material().color, time_code_);
  for (std::size_t b = 0; b < seen->bodies.size(); ++b)
    usd_.add("body " + scene_.bodies[b].name, seen->bodies[b], vec_cast<float>(scene_.bodies[b].colour),
             time_code_);
  for (std::size_t k = 0; k < seen->obstacles.size(); ++k)
    usd_.add(moving_[k], seen->obstacles[k], kObstacle, time_code_);
  for (std::size_t k = 0; k < seen->blades.size(); ++k)
    usd_.add("blade " + std::to_string(k), seen->blades[k], steel_material().color, time_code_);
  if (scene_.fluid)
    usd_.add_points("liquid", seen->liquid_m, static_cast<float>(scene_.fluid->spacing_m), kBlood,
                    time_code_);
  usd_.end_frame(time_code_++);
}

void UsdSink::end(RunNotices&) { usd_.write(); }

}  // namespace tactus
