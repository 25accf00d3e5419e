#pragma once
/// Bodies that were crushed or blew up.
#include <vector>

#include "tactus/run/frame_sink.h"

namespace tactus {

/// Less than this of its volume at rest is bad strain.
inline constexpr double kBadVolume = 0.3;

/// Remembers how far the elements of each body were pressed together.
class CrushSink final : public FrameSink {
 public:
  void frame(RunFrame& frame) override;
  /// Crushed by some frame to less than kBadVolume of a cube. @param body in the scene's order
  bool is_crushed(std::size_t body) const {
    return body < least_volume_.size() && static_cast<double>(least_volume_[body]) < kBadVolume;
  }

 private:
  std::vector<float> least_volume_;  ///< per body: smallest share of a cube's volume at rest
};

}  // namespace tactus
