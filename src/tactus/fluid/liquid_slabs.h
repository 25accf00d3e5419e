#pragma once
/// How a liquid is cut into slabs, one for each device. No result depends on where the cuts are.
#include <array>
#include <span>
#include <vector>

#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"

namespace tactus {

/// A liquid is on that many devices at most.
inline constexpr int kMostLiquidParts = 16;

/// Part p owns the particles in [begin_m[p], begin_m[p + 1]) of an axis; the first and the last have no end.
struct LiquidSlabs {
  Index axis = 0, parts = 1;
  float begin_m[kMostLiquidParts + 1] = {};
  TACTUS_HD float along(Vec3f x_m) const { return axis == 0 ? x_m.x : (axis == 1 ? x_m.y : x_m.z); }
  TACTUS_HD Index owner(Vec3f x_m) const {
    const float s = along(x_m);
    Index part = 0;
    while (part + 1 < parts && s >= begin_m[part + 1]) ++part;
    return part;
  }
  /// Whether x is in a slab or nearer to it than that.
  TACTUS_HD bool reaches(Index part, Vec3f x_m, float within_m) const {
    const float s = along(x_m);
    return (part == 0 || s >= begin_m[part] - within_m) &&
           (part + 1 == parts || s < begin_m[part + 1] + within_m);
  }
};

/// Particles in equal layers of a box, along each axis; particles outside count to the first or the last
/// layer.
struct LiquidLayers {
  static constexpr Index kLayers = 1024, kCounts = 3 * kLayers;
  Box3f box_m;
  TACTUS_HD Index at(Vec3f x_m, Index axis) const {
    const float edge = box_m.max[axis] - box_m.min[axis];
    const float s = clamp((x_m[axis] - box_m.min[axis]) / edge, 0.F, 1.F);
    return axis * kLayers + min(static_cast<Index>(s * kLayers), kLayers - 1);
  }
  /// Where a layer begins.
  float begin_m(Index axis, Index layer) const {
    const float share = static_cast<float>(layer) / kLayers;
    return box_m.min[axis] + share * (box_m.max[axis] - box_m.min[axis]);
  }
};

/// Moves the cuts of slabs so that all devices are done at the same time.
class LiquidBalance {
 public:
  /// Nothing moves while no device has more than that over the mean.
  static constexpr double kUneven = 1.05;
  /// The axis changes where the liquid is longer by that along another.
  static constexpr float kLonger = 1.25F;
  /// Weight of the newest measured speeds in their running mean.
  static constexpr double kNewest = 0.3;

  LiquidBalance(const Box3f& box_m, int parts);

  const LiquidSlabs& slabs() const { return slabs_; }
  /// Cuts for so many particles a layer (kCounts), each on as fast a device.
  void begin(std::span<const Index> counts);
  /// Moves cuts halfway to where they belong. @param counts (kCounts) of particles a layer, of all parts
  /// @param seconds per part, that each took for its particles; empty, or a part not measured (0): all are as
  /// fast. @returns whether cuts moved
  bool move(std::span<const Index> counts, std::span<const Index> particles_of_part,
            std::span<const double> seconds);

 private:
  std::vector<float> cuts_for(std::span<const Index> counts, Index axis) const;
  Index longest_axis(std::span<const Index> counts) const;
  void measure(std::span<const Index> particles_of_part, std::span<const double> seconds);

  LiquidLayers layers_;
  LiquidSlabs slabs_;
  std::vector<double> speed_;  ///< per part: particles a second, over the mean
};

}  // namespace tactus
