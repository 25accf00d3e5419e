#pragma once
/// Walls that are near particles, and the liquid's impulses on them.
#include "tactus/compute/atomic.h"
#include "tactus/fluid/wall_fill.h"
#include "tactus/geom/search/neighbour_cells.h"

namespace tactus {

/// Impulses on walls, as integers: in any order, the same sums. They are in units of the liquid's own
/// (LiquidConstants::impulse_unit_N_s), so that neither a drop's are rounded nor a lake's are too large.
struct WallSums {
  std::uint64_t impulse[3] = {};
  TACTUS_HD void add_atomically(Vec3f impulse_N_s, float unit_N_s) {
    for (int a = 0; a < 3; ++a) atomic_add(impulse[a], units(impulse_N_s[a] / unit_N_s));
  }
  TACTUS_HD Vec3f value(float unit_N_s) const {
    const auto of = [&](std::uint64_t u) {
      return unit_N_s * static_cast<float>(static_cast<std::int64_t>(u));
    };
    return {of(impulse[0]), of(impulse[1]), of(impulse[2])};
  }

 private:
  TACTUS_HD static std::uint64_t units(float value) {
    constexpr float kMost = 4.6e18F;  // 2^62
    if (value != value) return 0;
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(clamp(value, -kMost, kMost)));
  }
};

/// Sums of a wall are kept in copies, so that threads seldom wait for one another: each has a cache line of
/// its own, since a GPU adds to a line one after the other (a floor under 16,000 particles: up to 30 us).
struct alignas(128) WallSumsCopy {
  static constexpr Index kOfEach = 32;
  WallSums sums;
};

/// Where particles leave: beyond open faces of the box, and in the sinks. Nothing gets through its walls.
struct LiquidEnds {
  Box3f box_m;
  Index open_faces;
  View<const Box3f> sinks_m;
  View<std::uint32_t> taken;  ///< (1)
  /// x, or nowhere (NaN): a particle without a position has left by the next search.
  TACTUS_HD Vec3f kept(Vec3f x) const {
    for (int a = 0; a < 3; ++a) {
      if ((open_faces >> (2 * a) & 1) == 0) x[a] = max(x[a], box_m.min[a]);
      if ((open_faces >> (2 * a + 1) & 1) == 0) x[a] = min(x[a], box_m.max[a]);
    }
    bool stays = holds(box_m, x);
    for (Index k = 0; k < sinks_m.size(); ++k) stays = stays && !holds(sinks_m[k], x);
    if (stays) return x;
    atomic_add(taken[0], 1U);
    const float nan = std::bit_cast<float>(0x7fc00000U);
    return {nan, nan, nan};
  }

 private:
  TACTUS_HD static bool holds(const Box3f& box, Vec3f x) {
    const Vec3f out = max(box.min - x, x - box.max);
    return max(out.x, max(out.y, out.z)) <= 0.F;
  }
};

/// The faces of the box within reach of every particle. Faces are numbered -x, +x, -y, +y, -z, +z.
struct FindBoxWalls {
  static constexpr int kFaces = 6;
  View<const SearchParticle> particles;
  Box3f box_m;
  Index open_faces;  ///< bits: nothing stops there
  float reach_m;
  NearWalls near;
  TACTUS_HD void operator()(Index i) const {
    const Vec3f x = particles[i].x_m;
    Index count = 0;  // faces are never the same plane: there is nothing to look up
    for (int face = 0; face < kFaces; ++face) {
      const int a = face / 2;
      const float sign = face % 2 == 0 ? 1.F : -1.F,
                  distance_m = sign * (x[a] - (face % 2 == 0 ? box_m.min[a] : box_m.max[a]));
      if (!(distance_m < reach_m) || (open_faces >> face & 1) != 0) continue;
      Vec3f n{};
      n[a] = sign;
      const NearWall wall{n, distance_m, {}, face, 0.F, {}};
      if (count < kNearWalls)
        store_wide(near.at(i, count++), wall);
      else
        near.add_to_full(i, wall);
    }
    near.count[i] = count;
  }
};

/// The end of a step of one particle, once its walls know their slopes: their forces on it, and its new
/// velocity and position. No particle gets nearer to a wall than closest_m: it is put back there, by a tenth
/// of a spacing a step, and loses the velocity towards the wall.
struct LiquidStepped {
  static constexpr float kFarthestBack = 0.1F;  ///< in spacings: newcomers to a pool must not blow it up
  View<Vec3f> x_m, v_m_s;                       ///< by slot
  View<Index> id;
  LiquidEnds ends;
  View<WallSumsCopy> wall_sums;
  View<const float> shear_m2_s = {};     ///< by slot of the search; empty: that of all
  View<const LiquidNormal> smooth = {};  ///< SmoothNormals; empty: without surface tension

  /// @param push dt p / rho^2 @param before the velocity at the begin of the step @param v at its end,
  /// without the forces of walls
  TACTUS_HD void end(const LiquidConstants& liquid, const NearWalls& walls, const SearchParticle& particle,
                     Index i, float push, Vec3f before, const StepTime& time, Vec3f v) const {
    Vec3f put_back{};
    if (walls.count[i] > 0) meet(liquid, walls, i, push, before, time, v, put_back);
    x_m[i] = ends.kept(particle.x_m + (time.dt_s * v + put_back));
    v_m_s[i] = v;
    id[i] = particle.id;
  }

 private:
  /// With which the line where the surface meets a wall pulls it: sigma sin(contact angle) per length. A
  /// particle stands for 2 V |m| of the surface. Of a surface that stands on the wall at the angle, each d of
  /// height has d / sin of area per length; the weights `layer` of layers at d/2 and 3 d/2 add up to one d.
  TACTUS_HD float pull_N(const LiquidConstants& liquid, const NearWall& wall, Index i) const {
    if (smooth.empty() || wall.is_beside()) return 0;
    const float layer = max(0.F, 1.F - 0.5F * wall.distance_m / liquid.spacing_m);
    const LiquidNormal at = smooth[i];
    const float line_m = layer * 2 * liquid.spacing_m * at.size * length(at.n - dot(at.n, wall.n) * wall.n);
    return liquid.tension_N_m * liquid.contact_sin * line_m;
  }
  TACTUS_HD void meet(const LiquidConstants& liquid, const NearWalls& walls, Index i, float push,
                      Vec3f before, const StepTime& time, Vec3f& v, Vec3f& put_back) const {
    const float dt_s = time.dt_s;
    TACTUS_ROLLED
    for (Index k = 0, n = walls.count[i]; k < n; ++k) {
      const NearWall wall = walls.read(i, k);
      const Vec3f rel = before - wall.velocity_m_s, slide = rel - dot(rel, wall.n) * wall.n;
      const float s = max(wall.distance_m, liquid.closest_m);
      float shear = liquid.shear_m2_s;
      if (!shear_m2_s.empty())
        shear = 0.5F * (shear_m2_s[i] + liquid.thinning.at(dot(slide, slide) / sqr(s)));
      // Friction must not turn the velocity round. A wall that gives way takes its share of a blow.
      const float yields = liquid.mass_kg * wall.inverse_mass_1_kg,
                  friction =
                      ViscousKernel::friction(s * liquid.kernel.inverse_d_1_m) / (s * liquid.spacing_m),
                  drag = wall.is_beside() ? 0.F : min(dt_s * shear * friction, 1.F);
      const float push_m_s =
          liquid.density_kg_m3 * wall.slope_1_m * push_at_wall(liquid, wall, push, dt_s * time.gravity_m_s2);
      Vec3f correction = push_m_s * wall.n - drag / (1.F + drag * yields) * slide;
      v += correction;
      const float approach = dot(v - wall.velocity_m_s, wall.n) + yields * dot(correction, wall.n);
      const float gap = wall.distance_m + dt_s * approach - liquid.closest_m;
      if (gap < 0.F && !wall.is_beside()) {
        const Vec3f stop = max(-approach, 0.F) / (1.F + yields) * wall.n;
        v += stop;
        correction += stop;
        const float left = liquid.closest_m - (wall.distance_m + dt_s * max(approach, 0.F));
        put_back += clamp(left, 0.F, kFarthestBack * liquid.spacing_m) / (1.F + yields) * wall.n;
      }
      const Vec3f impulse_N_s = dt_s * pull_N(liquid, wall, i) * wall.n - liquid.mass_kg * correction;
      walls.at(i, k).impulse_N_s = impulse_N_s;
      constexpr Index kCopies = WallSumsCopy::kOfEach;
      wall_sums[wall.collider * kCopies + i % kCopies].sums.add_atomically(impulse_N_s,
                                                                           liquid.impulse_unit_N_s);
    }
  }
};

}  // namespace tactus
