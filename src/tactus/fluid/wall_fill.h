#pragma once
/// The substitute for liquid behind walls: a share of the density.
#include "tactus/fluid/liquid_views.h"

namespace tactus {

/// The density that all walls near a particle bring to it, over that at rest. A wall that ends at edges fills
/// the space that is behind it and behind the planes beside it: fill_1 share_2 share_3. The spaces behind two
/// walls at an inner edge overlap: 1 - (1 - fill_1)(1 - fill_2), which misses the lattice's edge by 0.004.
/// Those behind two walls that face each other do not: fill_1 + fill_2. Between, with across = -n_1 . n_2 (at
/// least 0),
///
///   fill = 1 - prod_k (1 - fill_k) + sum_k<l across_kl fill_k fill_l prod_m (1 - fill_m)     (m not k, l),
///
/// which has both for three walls, too: a gap with a floor is 1 - (1 - fill_1 - fill_2)(1 - fill_3).
class WallFill {
 public:
  /// Sets `slope_1_m` and `share` of the walls, too: positions stay for a step, so the first call keeps them
  /// for all.
  TACTUS_HD static float of(const NearWalls& near, Index i, const LiquidConstants& liquid) {
    WallFill f(near, i);
    f.fill_behind(liquid);
    if (f.n_ == 1) return 1.F - (1.F - f.own_[0]);  // joined() of one wall, bit for bit
    f.end_at_edges(liquid);
    return f.joined();
  }

 private:
  NearWalls near_;
  Index i_, n_;
  float own_[kNearWalls];  ///< 0 of those that are beside another

  TACTUS_HD WallFill(const NearWalls& near, Index i) : near_(near), i_(i), n_(near.count[i]) {}
  TACTUS_HD NearWall& wall(Index k) const { return near_.at(i_, k); }

  /// Nearer than `closest_m`, where a particle is put back, the fill goes on linearly. A wall that gives way
  /// is softer: pressure and a light node would else swing faster than the step can follow. As density and
  /// force are softened alike, energy is kept.
  TACTUS_HD void fill_behind(const LiquidConstants& liquid) {
    TACTUS_ROLLED
    for (Index k = 0; k < n_; ++k) {
      NearWall& w = wall(k);
      const float in = max(liquid.closest_m - w.distance_m, 0.F), s = w.distance_m + in,
                  soft = 1.F / tactus::sqrt(1.F + liquid.mass_kg * w.inverse_mass_1_kg),
                  slope = soft * liquid.kernel.fill_slope_1_m(s);
      own_[k] = w.is_beside() ? 0.F : soft * liquid.kernel.fill(s) + in * slope;
      w.slope_1_m = w.is_beside() ? 0.F : slope;
      w.share = w.is_beside() ? 0.F : 1.F;
    }
  }
  TACTUS_HD void end_at_edges(const LiquidConstants& liquid) {
    TACTUS_ROLLED
    for (Index l = 0; l < n_; ++l) {
      const Index k = ended_by(l);
      if (k < 0 || goes_on(l, liquid)) continue;
      NearWall& beside = wall(l);
      const float share = liquid.kernel.share(beside.distance_m);
      const float slope_1_m = own_[k] * liquid.kernel.share_slope_1_m(beside.distance_m),
                  rest = wall(k).share * liquid.kernel.share(wall(k).distance_m);
      own_[k] *= share;
      TACTUS_ROLLED
      for (Index m = 0; m < n_; ++m) {
        if (m != k && ended_by(m) != k) continue;
        wall(m).slope_1_m *= share;
        wall(m).share *= share;
      }
      beside.slope_1_m = slope_1_m;
      beside.share = rest;
    }
  }
  /// The wall that wall l is beside; -1: none.
  TACTUS_HD Index ended_by(Index l) const {
    if (!wall(l).is_beside()) return -1;
    TACTUS_ROLLED
    for (Index k = 0; k < n_; ++k)
      if (wall(k).collider == wall(l).collider && wall(k).side == 0) return k;
    return -1;
  }
  /// Whether something else stands beyond the plane of wall l, as a floor does on which a box stands: nothing
  /// gets in between, so no edge is there.
  TACTUS_HD bool goes_on(Index l, const LiquidConstants& liquid) const {
    TACTUS_ROLLED
    for (Index k = 0; k < n_; ++k)
      if (!wall(k).is_beside() && dot(wall(k).n, wall(l).n) < -NearWalls::kSamePlane &&
          wall(k).distance_m + wall(l).distance_m < 0.5F * liquid.spacing_m)
        return true;
    return false;
  }
  TACTUS_HD float joined() const {
    float open[kNearWalls], grows[kNearWalls], all_open = 1;  // grows: with own_[k]
    TACTUS_ROLLED
    for (Index k = 0; k < n_; ++k) {
      open[k] = max(1.F - own_[k], 0.F);
      all_open *= 1.F - own_[k];
    }
    TACTUS_ROLLED
    for (Index k = 0; k < n_; ++k) {
      grows[k] = 1.F;
      TACTUS_ROLLED
      for (Index l = 0; l < n_; ++l) grows[k] *= l == k ? 1.F : open[l];
    }
    float fill = 1.F - all_open;
    TACTUS_ROLLED
    for (Index k = 0; k + 1 < n_; ++k) {
      TACTUS_ROLLED
      for (Index l = k + 1; l < n_; ++l) fill += add_across(k, l, open, grows);
    }
    TACTUS_ROLLED
    for (Index k = 0; k < n_; ++k) {
      const Index of = ended_by(k);
      wall(k).slope_1_m *= grows[of < 0 ? k : of];
    }
    return fill;
  }
  /// The fill that walls k and l add because they face each other; `grows` gets its slopes.
  TACTUS_HD float add_across(Index k, Index l, const float* open, float* grows) const {
    const float across = max(-dot(wall(k).n, wall(l).n), 0.F);
    if (!(across > 0.F) || wall(k).is_beside() || wall(l).is_beside()) return 0;
    float others = 1;
    TACTUS_ROLLED
    for (Index m = 0; m < n_; ++m) others *= m == k || m == l ? 1.F : open[m];
    grows[k] += across * own_[l] * others;
    grows[l] += across * own_[k] * others;
    if (n_ > 2) {
      TACTUS_ROLLED
      for (Index m = 0; m < n_; ++m) {
        float rest = 1;
        TACTUS_ROLLED
        for (Index o = 0; o < n_; ++o) rest *= o == k || o == l || o == m ? 1.F : open[o];
        grows[m] -= m == k || m == l ? 0.F : across * own_[k] * own_[l] * rest;
      }
    }
    return across * own_[k] * own_[l] * others;
  }
};

/// dt p / rho^2 with which a wall pushes a particle that has `push` itself: p is that at the wall, a distance
/// s deeper or higher in a liquid that rests, p_i - rho g . n s. (The missing layer's pressure would be p_i -
/// 2 rho g . n s, and the wall stands for both sides of its pairs.)
/// @param falls_m_s dt g
TACTUS_HD inline float push_at_wall(const LiquidConstants& liquid, const NearWall& wall, float push,
                                    Vec3f falls_m_s) {
  const float away_m = wall.is_beside() ? wall.distance_m : max(wall.distance_m, liquid.closest_m);
  const float deeper = -dot(falls_m_s, wall.n) * away_m;
  return max(0.F, push + deeper / liquid.density_kg_m3);
}

}  // namespace tactus
