#pragma once
/// Looks at a scene before its first frame: values that would end a world, and bodies and obstacles that lie
/// in one another. Contact would push those apart at once, which looks like an explosion and is seldom meant.
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "tactus/contact/obstacles.h"
#include "tactus/sim/body/soft_body.h"
#include "tactus/sim/notice.h"
#include "tactus/sim/scene.h"

namespace tactus {

/// A scene that a program changed: read_scene() would refuse these, and a world would end at them.
/// @returns the scene @throws usage Error naming the field, its value and the range; likewise for a
/// mesh or label volume that `assets` lacks.
const Scene& checked(const Scene& scene, const BodyAssets& assets);

/// Box round an obstacle at its placement; none: it is a plane.
std::optional<Box3f> box_of(const ObstacleDescription& obstacle);

/// A warning for each body of which more than 5 % lies in an obstacle, or in a body that it touches. Nodes
/// that are fixed or moved don't count: they may be anywhere.
std::vector<Notice> overlaps_at_start(const Scene& scene, std::span<const std::unique_ptr<SoftBody>> bodies,
                                      std::span<const ObstacleDescription> obstacles);

/// A warning for each mesh that is too small to be meant.
void report_tiny_obstacles(std::span<const ObstacleDescription> obstacles, std::vector<Notice>& notices);

/// A warning for each body that lies farther outside of the workspace than the workspace is long: nothing
/// real can touch it there. @param workspace_m the reconstructed box
void report_far_bodies(const Scene& scene, std::span<const std::unique_ptr<SoftBody>> bodies,
                       const Box3f& workspace_m, std::vector<Notice>& notices);

}  // namespace tactus
