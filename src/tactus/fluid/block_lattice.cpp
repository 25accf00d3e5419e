#include "tactus/fluid/block_lattice.h"

#include <algorithm>
#include <string>

#include "tactus/base/error.h"
#include "tactus/geom/search/neighbour_visit.h"

namespace tactus {

static_assert(std::int64_t{kMostLiquidParticles} * NearLists::kCapacity < std::int64_t{1} << 31);

BlockLattice BlockLattice::of(const Box3f& box_m, float spacing_m) {
  constexpr float kRounding = 1e-3F;  // of an edge of whole spacings
  const Vec3f edge = box_m.extent();
  const auto along = [&](float m) {
    return static_cast<Index>(std::clamp(m / spacing_m + kRounding, 1.F, 2e9F));
  };
  return {box_m, {along(edge.x), along(edge.y), along(edge.z)}};
}

Vec3f BlockLattice::at(Index x, Index y, Index z) const {
  const Vec3f edge = box_m.extent();
  return box_m.min + Vec3f{(static_cast<float>(x) + 0.5F) / static_cast<float>(n.x) * edge.x,
                           (static_cast<float>(y) + 0.5F) / static_cast<float>(n.y) * edge.y,
                           (static_cast<float>(z) + 0.5F) / static_cast<float>(n.z) * edge.z};
}

std::string particles_text(double count) {
  return count < 1e15 ? std::to_string(static_cast<std::int64_t>(count)) : number_text(count);
}

std::vector<LiquidParticle> fill_box(const Box3f& box_m, float spacing_m) {
  const BlockLattice lattice = BlockLattice::of(box_m, spacing_m);
  if (lattice.count() > kMostLiquidParticles)
    throw Error("liquid: a block holds " + particles_text(lattice.count()) + " particles, at most " +
                std::to_string(kMostLiquidParticles) + " can be indexed");
  std::vector<LiquidParticle> particles;
  particles.reserve(static_cast<std::size_t>(lattice.count()));
  lattice.for_each([&](Vec3f x_m) {
    particles.push_back({x_m, {}, static_cast<Index>(particles.size())});
    return true;
  });
  return particles;
}

}  // namespace tactus
