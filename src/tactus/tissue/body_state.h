#pragma once
/// State of a soft body that changes from step to step, one entry per lattice node. Plain data on one device.
#include "tactus/compute/exec_context.h"
#include "tactus/geom/lattice/cube_lattice.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {

struct BodyState {
  Buffer<Vec3f> x_m;      ///< positions, world
  Buffer<Vec3f> v_m_s;    ///< velocities
  Buffer<Vec3f> f_ext_N;  ///< external forces besides gravity; they stay until their source writes others
};

/// Nodes of a body that one device holds, and of those the ones that move there. A device that has the whole
/// body counts its nodes as the body does, with virtual ones. Others have the virtual elements behind their
/// regular nodes, in regions (tissue/lattice_part.h).
struct NodeWindow {
  Slab held;  ///< of the body
  Slab own;   ///< counted from the first that is held
  Slab virtual_nodes =
      {};  ///< own region of the virtual elements, counted likewise; empty: the device has the whole body
  Index places = 0;         ///< in all regions
  Index first_virtual = 0;  ///< of the body
  bool owns(Index node) const { return node >= held.begin + own.begin && node < held.begin + own.end; }
  bool holds(Index node) const { return node >= held.begin && node < held.end; }
  Index count() const { return held.count() + places; }
  /// Number in the body of this device's node i. One virtual node may have a place in each region.
  Index body_node(Index i) const {
    return i < held.count() ? held.begin + i : first_virtual + (i - held.count()) % virtual_nodes.count();
  }
};
inline NodeWindow all_nodes(const CubeLattice& lattice) {
  return {{0, lattice.node_count()}, {0, lattice.node_count()}};
}

/// The body at rest where its lattice was built. Synchronizes.
inline BodyState rest_state(ExecContext& ctx, const CubeLattice& lattice) {
  const std::vector<Vec3f> zero(lattice.nodes.size());
  return {to_device(ctx, lattice.rest_positions_m()), to_device(ctx, zero), to_device(ctx, zero)};
}

}  // namespace tactus
