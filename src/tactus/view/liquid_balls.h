#pragma once
/// The shapes in which a liquid's particles are drawn. Internal to view/.
#include <vector>

#include "tactus/view/scene.h"

namespace tactus {

/// A ball, longer or shorter along one axis. Its volume is that of its radius.
struct LiquidBall {
  Vec3f center_m{};
  float radius_m = 0;
  Vec3f axis{0, 1, 0};
  float stretch = 1;  ///< length along the axis over the radius
};

/// One a particle, but none where it spreads in a film. In a crowd balls are so wide that no hole is left
/// between four of them; a lone one has the particle's volume. A few that hang together draw nearer to one
/// another; in a line they are a jet, each as long as it is to the next one. On a wet surface a particle lies
/// as a cap, and in its film it is part of the film, unless it lies in a pool.
/// @param scene whose meshes with films are wet
std::vector<LiquidBall> liquid_balls(const ViewLiquid& liquid, const ViewScene& scene);

}  // namespace tactus
