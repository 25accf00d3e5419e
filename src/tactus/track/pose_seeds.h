#pragma once
/// Where a long, thin tool may be, from silhouettes alone: the seeds of pose searches. No voxels, so no grid
/// decides.
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"
#include "tactus/track/outline.h"

namespace tactus {

/// A straight, thin part of a picture.
struct ThinPart {
  Vec2d from_px, to_px;
  double length_px() const;
};
/// Pixels of a mask that a disc of this radius does not fit into.
BitMask thin_pixels(const BitMask& mask, int radius_px);
/// The parts of a mask that a disc of this radius does not fit into, the longest first; at most four.
std::vector<ThinPart> thin_parts(const BitMask& mask, int radius_px);

/// A piece of a straight line in space, and how many pixels of thin parts lie on it in all cameras.
struct SeenLine {
  Vec3d from_m, to_m;
  double support_px = 0;
  int cameras = 0;
};
/// Lines that thin parts of three or more cameras have in common, the best first; each part is used once.
std::vector<SeenLine> seen_lines(std::span<const Camera> cameras,
                                 std::span<const std::vector<ThinPart>> parts, double tolerance_px);

/// How a model may lie along a line: either way round, at either end of its seen stretch, with eight rolls.
std::vector<Rigidd> poses_along(const OutlineMesh& mesh, const SeenLine& line);

/// A pose after half a turn about each of the model's axes: of a flat tool, they look much alike.
std::array<Rigidd, 3> turned_over(const OutlineMesh& mesh, const Rigidd& T_world_model);

/// A model's longest axis, where the model begins and ends along it, and how far it reaches from it.
struct LongAxis {
  Vec3d direction;
  Vec3d across[2];        ///< the axes across it, in which it is widest and thinnest
  double begin_m, end_m;  ///< about OutlineMesh::center_m
  double radius_m;
};
LongAxis long_axis(const OutlineMesh& mesh);

}  // namespace tactus
