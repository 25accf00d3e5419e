#include <gtest/gtest.h>

#include <random>

#include "tactus/contact/walls/wall_grid_kernels.h"

namespace tactus {
namespace {

/// Whatever is within reach of a particle must meet a cell that is marked: 2,000 boxes of up to 30 mm at up
/// to the reach from one of 20 particles, both also outside of the grid's box. And far from them nothing
/// does: a mark covers the particle's cell and `spread` cells on each side.
TEST(WallGrid, MarksAllThatIsWithinReachOfAParticle) {
  constexpr float kReach_m = 0.004F;
  const WallGrid grid = WallGrid::over({{-0.15F, 0.3F, -0.1F}, {0.2F, 0.6F, 0.05F}}, kReach_m);
  std::mt19937 random(1);
  const auto any = [&](float low, float high) {
    return std::uniform_real_distribution<float>(low, high)(random);
  };
  std::vector<SearchParticle> particles(20);
  for (SearchParticle& p : particles) p.x_m = {any(-0.2F, 0.25F), any(0.25F, 0.65F), any(-0.1F, 0.05F)};
  std::vector<std::uint32_t> marks(static_cast<std::size_t>(grid.words())), near(marks.size()), counts{7, 7};
  const View<std::uint32_t> marked(marks.data(), grid.words()), spread(near.data(), grid.words());
  const MarkCells mark{grid, View<const SearchParticle>(particles.data(), 20), marked};
  for (Index i = 0; i < 20; ++i) mark(i);
  const SpreadMarks widen{
      grid, View<const std::uint32_t>(marked), spread, View<std::uint32_t>(counts.data(), 2), {}, {}};
  for (Index row = 0; row < grid.rows * grid.layers; ++row) widen(row);
  EXPECT_EQ(counts, (std::vector<std::uint32_t>{0, 0}));
  const auto meets = [&](Vec3f low, Vec3f high) {
    return grid.meets(View<const std::uint32_t>(spread), low, high);
  };
  for (int k = 0; k < 2000; ++k) {
    const Vec3f x = particles[static_cast<std::size_t>(k) % particles.size()].x_m;
    const Vec3f corner = x + kReach_m * normalized(Vec3f{any(-1, 1), any(-1, 1), any(-1, 1)});
    const Vec3f other = corner + Vec3f{any(-0.03F, 0.03F), any(-0.03F, 0.03F), any(-0.03F, 0.03F)};
    EXPECT_TRUE(meets(min(corner, other), max(corner, other))) << k;
  }
  const float beyond_m = static_cast<float>(grid.spread + 1) / grid.inverse_cell_1_m;
  int far = 0;
  for (int k = 0; k < 2000; ++k) {
    const Vec3f x{any(-0.15F, 0.2F), any(0.3F, 0.6F), any(-0.1F, 0.05F)};
    bool is_far = true;
    for (const SearchParticle& p : particles) {
      const Vec3f d = min(max(p.x_m, Vec3f{-0.15F, 0.3F, -0.1F}), Vec3f{0.2F, 0.6F, 0.05F}) - x;
      is_far = is_far && std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)}) > beyond_m;
    }
    if (!is_far) continue;
    ++far;
    EXPECT_FALSE(meets(x, x)) << k;
  }
  EXPECT_GT(far, 100);
}

}  // namespace
}  // namespace tactus
