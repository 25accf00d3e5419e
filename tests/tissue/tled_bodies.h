#pragma once
/// Bodies that tests of finite elements share.
#include <cmath>
#include <random>

#include "tactus/geom/lattice/cube_lattice.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/tissue/tled/tled.h"

namespace tactus {

/// Tests of what every law must do go through these: a new row is tested without a change here.
inline constexpr MaterialLaw kEveryLaw[] = {
#define TACTUS_ROW(word, Law) MaterialLaw::word,
    TACTUS_MATERIAL_LAWS(TACTUS_ROW)
#undef TACTUS_ROW
};

inline constexpr float kH = 0.005F;
inline std::size_t at(Index i) { return static_cast<std::size_t>(i); }

inline CubeLattice box(Vec3i cubes, float spacing_m = kH, Vec3f origin_m = {}) {
  return lattice_from_box(origin_m, cubes, {.spacing_m = spacing_m});
}
/// A ball: rows of every length, so tiles and groups are filled only in part.
inline CubeLattice ball(float radius_m) {
  const Vec3f r{radius_m, radius_m, radius_m};
  return lattice_from_sdf([&](Vec3f p) { return length(p) - radius_m; }, {-1.F * r, r}, {.spacing_m = kH});
}

inline std::vector<Vec3f> moved(const CubeLattice& lattice, const Mat3f& F) {
  std::vector<Vec3f> x = lattice.rest_positions_m();
  for (Vec3f& p : x) p = F * p;
  return x;
}
inline std::vector<Vec3f> shaken(const CubeLattice& lattice, float size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> u(-size, size);
  std::vector<Vec3f> x = lattice.rest_positions_m();
  for (Vec3f& p : x) p = p + Vec3f{u(random), u(random), u(random)};
  return x;
}

inline std::vector<Vec3f> forces(ExecContext& ctx, Tled& tled, const CubeLattice& lattice,
                                 const std::vector<Vec3f>& x) {
  BodyState state = rest_state(ctx, lattice);
  state.x_m = to_device(ctx, x);
  tled.compute_forces(ctx, state);
  return tled.forces_N(ctx);
}

/// Six cubes in a row that touch at corners only.
inline CubeLattice corner_chain() {
  CubeLattice lattice = lattice_from_sdf(
      [](Vec3f p) {
        const Vec3f c = p / kH;
        for (int k = 0; k < 6; ++k) {
          const Vec3f d = c - Vec3f{0.5F + static_cast<float>(k), 0.5F + static_cast<float>(k),
                                    0.5F + static_cast<float>(k)};
          if (max(abs(d.x), max(abs(d.y), abs(d.z))) < 0.4F) return -0.1F * kH;
        }
        return 0.1F * kH;
      },
      {{0, 0, 0}, {6 * kH, 6 * kH, 6 * kH}}, {.spacing_m = kH});
  return lattice;
}

inline double kinetic_J(ExecContext& ctx, const CubeLattice& lattice, const BodyState& body) {
  const auto v = to_host(ctx, body.v_m_s.const_view());
  double energy = 0;
  for (std::size_t i = 0; i < v.size(); ++i)
    energy += 0.5 * static_cast<double>(lattice.node_mass_kg[i]) * static_cast<double>(dot(v[i], v[i]));
  return energy;
}

}  // namespace tactus
