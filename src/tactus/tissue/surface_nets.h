#pragma once
/// Smooth closed surfaces of solids that are given by a function or by labels, on the host.
#include <functional>
#include <set>

#include "tactus/geom/lattice/cube_lattice.h"
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// The surface distance_m = 0 within the box by naive surface nets (Gibson 1998): one vertex in every grid
/// cell that the surface crosses, at the mean of its edge crossings; one quad per crossed edge. Outside the
/// box counts as outside, so the surface is closed; it is a manifold where it is smooth at the scale of
/// `spacing_m`.
/// @throws Error for a spacing that is not positive, an empty solid, or a grid beyond 2^31 points.
TriangleMesh surface_nets(const std::function<float(Vec3f)>& distance_m, const Box3f& box_m, float spacing_m);

/// The boundary of the labelled voxels, in the body's coordinates: surface nets of their smoothed indicator,
/// sampled at `spacing_m`.
TriangleMesh surface_of_labels(const LabelVolume& volume, const std::set<VoxelLabel>& solid, float spacing_m);

}  // namespace tactus
