#pragma once
/// Parts of what a world's probes read.
#include <vector>

#include "tactus/world/world.h"

namespace tactus {

inline std::vector<Vec3f> probe_positions_m(World& world) {
  std::vector<Vec3f> at_m;
  for (const ProbeReading& probe : world.probes()) at_m.push_back(probe.position_m);
  return at_m;
}

inline std::vector<CubeStrain> probe_strains(World& world) {
  std::vector<CubeStrain> strains;
  for (const ProbeReading& probe : world.probes()) strains.push_back(probe.strain);
  return strains;
}

}  // namespace tactus
