#include "tactus/run/sinks/usd_sink.h"

#include "tactus/view/scene.h"

namespace tactus {

UsdSink::UsdSink(const Scene& scene, const std::string& stem, double frames_per_s)
    : scene_(scene), usd_(stem + ".usda", frames_per_s / std::max(scene.output.usd_every, 1)) {}

void UsdSink::frame(RunFrame& frame) {
  if ((frame.number - 1) % scene_.output.usd_every != 0) return;
  const std::shared_ptr<const FrameSnapshot> seen = frame.snapshot();
  if (!seen->real.triangles.empty()) usd_.add("real", seen->real, clay_material().color, time_code_);
  for (std::size_t b = 0; b < seen->bodies.size(); ++b)
    usd_.add(scene_.bodies[b].name, seen->bodies[b], vec_cast<float>(scene_.bodies[b].colour), time_code_);
  for (std::size_t k = 0; k < seen->obstacles.size(); ++k)
    usd_.add("obstacle_" + std::to_string(k), seen->obstacles[k], {0.6F, 0.6F, 0.62F}, time_code_);
  for (std::size_t k = 0; k < seen->blades.size(); ++k)
    usd_.add("blade_" + std::to_string(k), seen->blades[k], steel_material().color, time_code_);
  if (scene_.fluid)
    usd_.add_points("liquid", seen->liquid_m, static_cast<float>(scene_.fluid->spacing_m),
                    {0.5F, 0.02F, 0.03F}, time_code_);
  usd_.end_frame(time_code_++);
}

void UsdSink::end(RunNotices&) { usd_.write(); }

}  // namespace tactus
