#pragma once
/// The part of a liquid that is on one device.
#include "tactus/compute/time_stamp.h"
#include "tactus/fluid/dfsph_kernels.h"
#include "tactus/fluid/split_kernels.h"
#include "tactus/geom/search/neighbour_search.h"

namespace tactus {

/// Owns the memory of one device. Particles are in slots; slots change in every step.
struct LiquidPart {
  /// With capacity for so many, a GPU sorts particles by bricks of cells, not by rows: its caches then hold
  /// more of the near particles. A step of DFSPH takes 7 % less for 700,000 particles, 10 % for 8,000,000;
  /// fewer fit into caches anyhow. Cores visit rows together.
  static constexpr Index kLeastInBricks = 400'000;
  /// @param max_particles of the whole liquid: all may come to one part @param arrivals that come before the
  /// oldest leave @param walls colliders of walls @param part its number @param parts of the liquid
  LiquidPart(Device& device, Index max_particles, Index arrivals, float reach_m, Index walls, Index part,
             Index parts);

  NearWalls near_walls() { return {wall_count.view(), walls.view()}; }
  NearLists near_lists() { return {list_count.view(), near.view(), pair_weight.view()}; }
  /// Particles that `count` counts.
  Count given() const { return Count(count.const_view(), id.size()); }
  /// (1) Number of the first copy; of one part, empty.
  View<const Index> first_copy() const {
    return import.empty() ? View<const Index>{} : View<const Index>(&import.const_view().data()->base, 1);
  }
  Count ghosts() const { return Count(ghost_count.const_view(), ghost_slot.size()); }
  LiquidShown shown();

  Index number;
  NeighbourSearch search;
  Buffer<Index> count, id, wall_count, list_count, near;
  Buffer<float> pair_weight;  ///< dfsph, on a CPU: pair_slope()
  Buffer<Vec3f> x_m, v_m_s;
  Buffer<float> density_kg_m3, push;    ///< push: p / rho^2 of the last step; dfsph
  Buffer<float> alpha, found, kappa_v;  ///< dfsph
  Buffer<float> relative_m_s;           ///< dfsph: speed relative to neighbours and walls, in the last step
  Buffer<float> shear_m2_s;             ///< viscosity, of a liquid that thins
  Buffer<DfsphSums> sums;               ///< dfsph
  Buffer<LiquidMotion> motion, v_star, moved;
  Buffer<LiquidNormal> surface, smooth;  ///< with surface tension
  Buffer<float> curvature;
  Buffer<NearWall> walls;
  Buffer<WallSumsCopy> wall_sums;
  Buffer<WallSums> wall_totals;
  Buffer<LiquidCounters> counters;
  Buffer<LiquidReport> reports;
  Buffer<Box3f> sinks;
  Buffer<std::uint32_t> ages;  ///< LiquidAges; empty where no particles come
  // With several parts:
  Buffer<Index> own, ghost_count;  ///< (1) each; ghosts: copies of others' particles, in this step
  Buffer<LiquidSlabs> slabs;       ///< (1)
  Buffer<LiquidShown> shown_by;    ///< per part
  Buffer<Index> export_count, export_list, slot_of, ghost_slot;
  Buffer<LiquidImport> import;
  Buffer<LiquidOriginal> originals;
  Buffer<Index> layers;              ///< particles at the end of the frame: LiquidLayers
  TimeStamp timed_begin, timed_end;  ///< of the pass that tells how fast a device is
};

}  // namespace tactus
