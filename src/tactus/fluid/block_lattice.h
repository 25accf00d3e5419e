#pragma once
/// The lattice of particles that fills a box: counted before it takes memory.
#include <string>
#include <vector>

#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"

namespace tactus {

/// A particle on the host.
struct LiquidParticle {
  Vec3f x_m, v_m_s;
  Index id = 0;
};

/// Particles along each edge of a box: as many as fit `spacing_m` apart or farther. Nearer, a block would
/// burst.
struct BlockLattice {
  Box3f box_m;
  Vec3i n;
  /// An edge of more than 2e9 spacings counts as 2e9.
  static BlockLattice of(const Box3f& box_m, float spacing_m);
  /// A box may hold more than 2^63.
  double count() const { return static_cast<double>(n.x) * n.y * n.z; }
  Vec3f at(Index x, Index y, Index z) const;
  /// Calls use(x_m) for each particle until it returns false. @returns whether it never did
  template <class Use>
  bool for_each(const Use& use) const {
    for (Index z = 0; z < n.z; ++z)
      for (Index y = 0; y < n.y; ++y)
        for (Index x = 0; x < n.x; ++x)
          if (!use(at(x, y, z))) return false;
    return true;
  }
};

/// The particles of a lattice; ids are numbers. @throws Error when there are more than kMostLiquidParticles.
std::vector<LiquidParticle> fill_box(const Box3f& box_m, float spacing_m);

/// More can't be indexed: a list of neighbours has 64 places (NearLists::kCapacity) a particle.
inline constexpr Index kMostLiquidParticles = 33'500'000;

/// Volume of a box or a rate over that of a particle, as text: "1.25e+11".
std::string particles_text(double count);

}  // namespace tactus
