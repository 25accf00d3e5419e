#pragma once
/// What `tactus run` says of a run: JSON for scripts.
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tactus/sim/simulation.h"

namespace tactus {

/// What the run found over all its frames.
struct RunSummary {
  int frames = 0, bad_frames = 0, substeps = 0, settling_substeps = 0;
  int open_frames = 0;  ///< whose surface had too little room: it is not closed
  Index max_vertices = 0, max_triangles = 0, pushed_out = 0;
  double max_force_N = 0, max_correction_m = 0;
  std::vector<float>
      least_volume;  ///< per body: smallest share of a cube's volume at rest; 1 without elements
  std::vector<std::string> statuses;
  std::vector<LiquidReport> liquid;                                 ///< per frame
  std::vector<std::vector<LiquidReaction>> liquid_forces;           ///< per frame
  std::vector<std::vector<BodyContact>> contacts;                   ///< per frame
  std::vector<std::vector<TrackedBlade>> blades;                    ///< per frame, those that are tracked
  std::vector<Notice> notices;                                      ///< each once, at most 1000
  std::vector<std::vector<Vec3f>> probes;                           ///< per frame, in the scene's order
  std::vector<std::vector<CubeStrain>> probe_strains;               ///< likewise
  std::vector<std::vector<BodyMonitors>> monitors;                  ///< per frame and body
  std::vector<std::vector<std::vector<Vec3d>>> motion_forces_N;     ///< per frame, body and moved region
  std::vector<std::vector<std::vector<Vec3d>>> motion_torques_N_m;  ///< likewise

  void add(const StepReport& report);
  /// How far the elements of each body were pressed together.
  void add_strain(const Simulation& simulation);
  /// Keeps a status once.
  void note(const std::string& status, Severity severity = Severity::warning);
  void note(const Notice& notice);
};

nlohmann::json to_json(const RunSummary& summary, const Scene& scene, Simulation& simulation,
                       const std::string& devices);

/// Of positions and velocities of all bodies' nodes and of the real surface, in hexadecimal: the same on
/// every set of devices. Synchronizes.
std::string state_hash(Simulation& simulation);

}  // namespace tactus
