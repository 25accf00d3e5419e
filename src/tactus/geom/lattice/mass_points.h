#pragma once
/// Where in each cube its mass is put, so that nodes have the moments of the body.
#include "tactus/geom/lattice/cube_lattice.h"

namespace tactus {

/// Finds mass_at of an uncut body, then shares masses. Nodes at the corners of cubes keep mass and centre of
/// mass, but their second moments are too large by h^2/6 of the mass along each axis: a cube of 4 across
/// would turn as if it were 12.5 % heavier. So mass moves inwards along each axis. Among two neighbours of
/// masses m and m', that of one moves towards the other by a first moment of k min(m, m') h / 12, and that of
/// the other against it. Mass and first moments stay, and second moments fall by k min(m, m') h^2 / 6. In the
/// interior the shares from both sides of a cube cancel: cubes at the surface are left with their mass k h /
/// 12 further in. Each axis has the k that makes the body's second moment exact; n / (n - 1) for n full
/// cubes.
///
/// All of a cube's mass goes to its own corners. So parts that a cut makes of it have their mass exactly, and
/// nodes that a cut doubles keep their sum.
///
/// Light corners need short steps, also where a cut leaves a cube alone, and contact throws them. So cubes
/// have the least of kMostUneven (CubeLattice::uneven) by which inertia is right within kInertiaBar, or
/// nearly as right as by the last. The first one suffices from five cubes across on. First moments that are
/// too large for it go to neighbours. Bodies that are one cube thick along an axis can't be mended along it,
/// and those of one row of cubes are left as they are.
void place_masses(CubeLattice& lattice);
inline constexpr double kMostUneven[] = {1.15, 1.25, 1.4, 1.6}, kInertiaBar = 0.01;

}  // namespace tactus
