#pragma once
/// What the benchmark of neighbour search runs beside the library.
#include "tactus/geom/search/neighbour_visit.h"

namespace tactus::bench {

/// rho_i = sum_j (h^2 - r_ij^2)^3: the density of Mueller et al. 2003, without its constant.
struct DensityPass {
  template <int kLanes>
  struct Own {
    float sum[kLanes];
  };
  float reach_m2;
  View<float> density;
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index) const {
    own.sum[t] = 0;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index, Vec3f, float r2_m2, bool near) const {
    const float w = reach_m2 - r2_m2;
    own.sum[t] += near ? w * w * w : 0.F;
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    density[i] = own.sum[t];
  }
};

/// Place of a particle along the Z-order curve of a cube of 2^bits cells a side (Goswami et al. 2010).
struct ZIndex {
  View<const Vec3f> x_m;
  Vec3f origin_m;
  float inverse_cell_1_m;
  View<std::uint32_t> key;
  View<Index> order;
  TACTUS_HD void operator()(Index i) const {
    const Vec3f c = inverse_cell_1_m * (x_m[i] - origin_m);
    key[i] = spread(c.x) | spread(c.y) << 1 | spread(c.z) << 2;
    order[i] = i;
  }

 private:
  TACTUS_HD static std::uint32_t spread(float c) {
    auto v = static_cast<std::uint32_t>(floor_to_int(c)) & 1023U;
    v = (v | v << 16) & 0x030000ffU;
    v = (v | v << 8) & 0x0300f00fU;
    v = (v | v << 4) & 0x030c30c3U;
    return (v | v << 2) & 0x09249249U;
  }
};

/// Particles in sorted order, and where each cell begins and ends.
struct GatherSorted {
  View<const Vec3f> x_m;
  View<const Index> id, order;
  View<const std::uint32_t> key;
  View<SearchParticle> particles;
  View<Index> begin, end;
  TACTUS_HD void operator()(Index slot) const {
    const Index i = order[slot];
    particles[slot] = {x_m[i], id[i]};
    const auto cell = static_cast<Index>(key[slot]);
    if (slot == 0 || key[slot - 1] != key[slot]) begin[cell] = slot;
    if (slot + 1 == order.size() || key[slot + 1] != key[slot]) end[cell] = slot + 1;
  }
};

}  // namespace tactus::bench
