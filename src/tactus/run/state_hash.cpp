#include "tactus/run/state_hash.h"

#include <cstdio>

#include "tactus/base/byte_io.h"

namespace tactus {

std::string state_hash(Simulation& simulation) {
  std::uint64_t hash = fnv1a("");
  const auto add = [&hash](const std::vector<Vec3f>& values) {
    hash = fnv1a({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Vec3f)}, hash);
  };
  for (const auto& body : simulation.bodies()) {
    add(body->positions_m(simulation.context()));
    add(body->velocities_m_s(simulation.context()));
  }
  const FrameSnapshot snapshot = simulation.snapshot();
  add(snapshot.real.positions_m);
  if (simulation.liquid() != nullptr) add(snapshot.liquid_m);
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

}  // namespace tactus
