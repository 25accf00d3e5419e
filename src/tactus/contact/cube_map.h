#pragma once
/// A cube of a lattice as it is deformed, and how far its points are, at rest, from the body's surface.
#include "tactus/base/vec.h"
#include "tactus/compute/view.h"

namespace tactus {

/// x(q) = sum_k w_k(q) x_k, the trilinear map of a cube with corners x_k [P 15]; q is 0..1 along each edge.
struct CubeMap {
  Vec3f c, x, y, z, xy, yz, zx, xyz;  ///< coefficients of 1, q.x, .., q.x q.y, .., q.x q.y q.z

  TACTUS_HD static CubeMap of(const Vec3f* corner) {
    CubeMap m;
    m.c = corner[0];
    m.x = corner[1] - corner[0];
    m.y = corner[2] - corner[0];
    m.z = corner[4] - corner[0];
    m.xy = (corner[3] - corner[1]) - m.y;
    m.zx = (corner[5] - corner[4]) - m.x;
    m.yz = (corner[6] - corner[4]) - m.y;
    m.xyz = (((corner[7] - corner[6]) - m.x) - m.xy) - m.zx;
    return m;
  }
  TACTUS_HD Vec3f at(Vec3f q) const {
    return c + q.x * (x + q.y * (xy + q.z * xyz)) + q.y * (y + q.z * yz) + q.z * (z + q.x * zx);
  }
  /// Columns of dx/dq.
  struct Jacobian {
    Vec3f a, b, c;
    TACTUS_HD float det() const { return dot(a, cross(b, c)); }
    /// dq of J dq = r.
    TACTUS_HD Vec3f solve(Vec3f r) const {
      const float inverse = 1.F / det();
      return {inverse * dot(r, cross(b, c)), inverse * dot(a, cross(r, c)), inverse * dot(a, cross(b, r))};
    }
    /// J^-T g: a gradient in q as a gradient in space.
    TACTUS_HD Vec3f gradient(Vec3f g) const {
      return (1.F / det()) * (g.x * cross(b, c) + g.y * cross(c, a) + g.z * cross(a, b));
    }
  };
  TACTUS_HD Jacobian jacobian(Vec3f q) const {
    return {x + q.y * xy + q.z * (zx + q.y * xyz), y + q.x * xy + q.z * (yz + q.x * xyz),
            z + q.y * yz + q.x * (zx + q.y * xyz)};
  }
  /// Newton's method for x(q) = p from the q given. Returns whether p is in the cube; q is meant then.
  TACTUS_HD bool find(Vec3f p, Vec3f& q) const {
    constexpr int kMost = 8;
    constexpr float kDone = 1e-3F;  // quadratic convergence: the error left is its square
    TACTUS_ROLLED
    for (int k = 0; k < kMost; ++k) {
      const Vec3f step = jacobian(q).solve(p - at(q));
      q += step;
      // A step of an affine cube is exact. Bent ones are within a factor of it.
      if (!(is_in(q, 1.F))) return false;
      if (max(abs(step.x), max(abs(step.y), abs(step.z))) < kDone) return is_in(q, kEdge);
    }
    return false;
  }
  /// Rounding must not let a point fall between two cubes.
  static constexpr float kEdge = 1e-4F;
  TACTUS_HD static bool is_in(Vec3f q, float slack) {
    return min(q.x, min(q.y, q.z)) >= -slack && max(q.x, max(q.y, q.z)) <= 1 + slack;
  }
  TACTUS_HD static float weight(Vec3f q, int corner) {
    return ((corner & 1) != 0 ? q.x : 1 - q.x) * ((corner & 2) != 0 ? q.y : 1 - q.y) *
           ((corner & 4) != 0 ? q.z : 1 - q.z);
  }
};

/// Signed distance to the body's surface at rest, negative inside, and its gradient with respect to q.
struct RestDistance {
  float distance_m = 0;
  Vec3f gradient_m;
};

/// Samples of that distance over a cube, with kEdge a side.
struct CubeSamples {
  static constexpr Index kCuts = 4, kEdge = kCuts + 1, kCount = kEdge * kEdge * kEdge;
  View<const float> m;  ///< of all cubes
  TACTUS_HD static Index place(Index i, Index j, Index k) { return (k * kEdge + j) * kEdge + i; }
  TACTUS_HD RestDistance at(Index cube, Vec3f q) const {
    const auto cell = [](float u) { return clamp(floor_to_int(kCuts * u), Index(0), kCuts - 1); };
    const Index i = cell(q.x), j = cell(q.y), k = cell(q.z);
    const float u = kCuts * q.x - static_cast<float>(i), v = kCuts * q.y - static_cast<float>(j),
                w = kCuts * q.z - static_cast<float>(k);
    const float* s = m.data() + (cube * kCount + place(i, j, k));
    constexpr Index kY = kEdge, kZ = kEdge * kEdge;
    const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
    const float x00 = mix(s[0], s[1], u), x10 = mix(s[kY], s[kY + 1], u), x01 = mix(s[kZ], s[kZ + 1], u),
                x11 = mix(s[kZ + kY], s[kZ + kY + 1], u);
    const float xy0 = mix(x00, x10, v), xy1 = mix(x01, x11, v);
    const float dx = mix(mix(s[1] - s[0], s[kY + 1] - s[kY], v),
                         mix(s[kZ + 1] - s[kZ], s[kZ + kY + 1] - s[kZ + kY], v), w);
    return {mix(xy0, xy1, w), static_cast<float>(kCuts) * Vec3f{dx, mix(x10 - x00, x11 - x01, w), xy1 - xy0}};
  }
};

}  // namespace tactus
