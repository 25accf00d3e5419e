#pragma once
/// Takes over the changes of a cut to bodies that touch one another, between frames.
#include "tactus/contact/pairs/pair_weights.h"

namespace tactus {

/// Thread: changed cube.
struct SetSolidCubes {
  View<const Index> places;
  View<const SolidCube> cubes;  ///< of those
  View<const float> samples_m;  ///< likewise
  View<SolidCube> all_cubes;
  View<float> all_samples_m;
  TACTUS_HD void operator()(Index i) const {
    all_cubes[places[i]] = cubes[i];
    for (Index k = 0; k < CubeSamples::kCount; ++k)
      all_samples_m[places[i] * CubeSamples::kCount + k] = samples_m[i * CubeSamples::kCount + k];
  }
};

/// Thread: changed point.
struct SetPairPoints {
  View<const PairPointChange> changes;
  View<EmbeddedPoint> points;
  View<PointRest> rest;
  View<Index> rows;
  TACTUS_HD void operator()(Index i) const {
    const PairPointChange& change = changes[i];
    points[change.place] = change.point;
    rest[change.place] = change.rest;
    for (int k = 0; k < 8; ++k) rows[8 * change.place + k] = change.rows[k];
  }
};

/// Thread: point. A point that touched a cube that is no more touches nothing. Then adds the weights of the
/// point and of where it touches, after all were set to 0.
struct WeighPairs {
  PairTable table;
  PairState state;
  View<const Index> gone;  ///< ascending
  TACTUS_HD void operator()(Index i) const {
    PairContact& c = state.contact[i];
    if (is_gone(c.cube) || (c.touching != 0 && is_gone(c.anchor_cube))) c = {};
    if (c.touching == 1) add_pair_weights(table, state, i, c, 1);
  }

 private:
  TACTUS_HD bool is_gone(Index cube) const {
    if (cube < 0) return false;
    Index low = 0, high = gone.size();
    while (low < high) {
      const Index middle = (low + high) / 2;
      if (gone[middle] < cube)
        low = middle + 1;
      else
        high = middle;
    }
    return low < gone.size() && gone[low] == cube;
  }
};

/// Thread: patch. Copies the cell, part and rows of each of its cubes, in the order of their boxes.
struct PlaceCubes {
  PairTable table;
  PairState state;
  TACTUS_HD void operator()(Index patch) const {
    const IndexRange cubes = table.patch_cubes.ranges[patch];
    for (Index k = cubes.begin; k < cubes.end; ++k) {
      const SolidCube& cube = table.cubes[table.patch_cubes.values[k]];
      CubePlace& place = state.cube_places[k];
      place.cell = cube.cell;
      place.part = table.part[cube.row[0]];
      for (int n = 0; n < 8; ++n) place.row[n] = cube.row[n];
    }
  }
};

/// Thread: patch. Nodes of patches go on from where they are.
struct StartPatches {
  PairTable table;
  PairState state;
  TACTUS_HD void operator()(Index patch) const {
    const IndexRange own = table.patch_nodes.ranges[patch];
    const ContactNodes& nodes = table.bodies[table.patches[patch].body].nodes;
    for (Index k = own.begin; k < own.end; ++k) state.last_x_m[k] = nodes.x_m[table.patch_nodes.values[k]];
  }
};

}  // namespace tactus
