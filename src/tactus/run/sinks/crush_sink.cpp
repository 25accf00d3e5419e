#include "tactus/run/sinks/crush_sink.h"
#include "tactus/world/world_impl.h"

#include <algorithm>

namespace tactus {

void CrushSink::frame(RunFrame& frame) {
  const auto& bodies = frame.world.impl().bodies();
  least_volume_.resize(bodies.size(), 1.F);
  for (std::size_t b = 0; b < bodies.size(); ++b)
    least_volume_[b] = std::min(least_volume_[b], bodies[b]->status().strain.smallest_J);
}

}  // namespace tactus
