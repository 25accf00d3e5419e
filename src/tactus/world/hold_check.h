#pragma once
/// Looks before the first frame for bodies that rely on the box of a liquid: its faces hold the liquid alone.
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tactus/contact/obstacles.h"
#include "tactus/sim/body/soft_body.h"
#include "tactus/sim/notice.h"
#include "tactus/sim/scene.h"

namespace tactus {

/// Whether a body is in the box of the scene's liquid, or hangs over it.
bool is_over_liquid(const Scene& scene, const SoftBody& body);

struct UnheldBody {
  std::string body;
  Notice notice;
};

/// A warning, with the obstacle that would do, for each body that is_over_liquid(), and that nothing there
/// bears: no region holds it, no obstacle or other body is under it, and it doesn't float. None where
/// obstacles move: they may catch it. Bodies on one that is told of aren't told of.
std::vector<UnheldBody> bodies_without_floor(const Scene& scene,
                                             std::span<const std::unique_ptr<SoftBody>> bodies,
                                             std::span<const ObstacleDescription> obstacles);

}  // namespace tactus
