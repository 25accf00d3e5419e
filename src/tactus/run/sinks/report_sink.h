#pragma once
/// JSON of a run, for scripts (docs/results.md).
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tactus/run/frame_loop.h"
#include "tactus/sim/scene.h"
#include "tactus/track/blade_tracker.h"

namespace tactus {

/// Results of a run over all its frames.
struct RunSummary {
  int substeps = 0, settling_substeps = 0;
  Index max_vertices = 0, max_triangles = 0, pushed_out = 0;
  double max_force_N = 0, max_correction_m = 0;
  std::vector<LiquidReport> liquid;                                  ///< per frame
  std::vector<int> liquid_steps;                                     ///< per frame
  std::vector<double> liquid_waiting_ml;                             ///< per frame
  std::vector<SceneFilmReport> films;                                ///< per frame
  std::vector<std::vector<LiquidReaction>> liquid_forces;            ///< per frame
  std::vector<std::vector<BodyContact>> contacts;                    ///< per frame
  std::vector<std::vector<TrackedBlade>> blades;                     ///< per frame, those that are tracked
  std::vector<std::vector<ProbeReading>> probes;                     ///< per frame, in the scene's order
  std::vector<std::vector<BodyMonitors>> monitors;                   ///< per frame and body
  std::vector<std::vector<std::vector<MotionForce>>> motion_forces;  ///< per frame, body and moved region

  void add(const StepReport& report);
};

/// Keeps the results of every frame, for to_json().
class ReportSink final : public FrameSink {
 public:
  /// @param contacts_of bodies whose contacts it reports point by point; the world was asked for them
  explicit ReportSink(const Scene& scene, std::vector<std::string> contacts_of = {})
      : scene_(scene), contacts_of_(std::move(contacts_of)) {}
  void frame(RunFrame& frame) override;
  /// @param loop that showed its frames to this sink @param devices their names
  nlohmann::json to_json(const FrameLoop& loop, World& world, const std::string& devices) const;

 private:
  Scene scene_;
  std::vector<std::string> contacts_of_;
  std::map<std::string, nlohmann::json> points_;  ///< by body: a list per frame
  RunSummary summary_;
};

}  // namespace tactus
