#pragma once
/// The rotation nearest to a 3x3 matrix, from a good guess: for host and device.
#include "tactus/base/vec.h"

namespace tactus {

/// One step of a Newton iteration on rotations for max tr(R^T A) (Wahba 1965): the polar decomposition's
/// rotation where det A > 0, the nearest proper rotation where A is inverted, one of the best where A is flat
/// or zero. A is scaled to Frobenius norm 1 (or is 0). With B = R^T A and S its symmetric part the step
/// solves (tr(S) 1 - S) w = axial(B - B^T). Where the matrix is not safely positive definite (far from the
/// maximum) it is shifted until it is, by Gershgorin's bound, and by the size of the right side, so steps
/// stay below 1 rad. Converges quadratically where A is regular: a turn of 0.1 rad is down to 4e-4 after one
/// step and to float round-off after two. No branches: lanes of a loop take it together.
TACTUS_HD inline Quatf improve_rotation(const Quatf& q, const Mat3f& A) {
  const Mat3f R = rotation_matrix(q);
  const Mat3f B = transpose(R) * A;
  const Vec3f g{B(2, 1) - B(1, 2), B(0, 2) - B(2, 0), B(1, 0) - B(0, 1)};
  float hxx = B(1, 1) + B(2, 2), hyy = B(0, 0) + B(2, 2), hzz = B(0, 0) + B(1, 1);
  const float hxy = -0.5F * (B(0, 1) + B(1, 0)), hxz = -0.5F * (B(0, 2) + B(2, 0)),
              hyz = -0.5F * (B(1, 2) + B(2, 1));
  const float gg = dot(g, g);
  const float minor = hxx * hyy - hxy * hxy;
  const float det =
      hxx * (hyy * hzz - hyz * hyz) - hxy * (hxy * hzz - hyz * hxz) + hxz * (hxy * hyz - hyy * hxz);
  const float row = min(hxx - abs(hxy) - abs(hxz), min(hyy - abs(hxy) - abs(hyz), hzz - abs(hxz) - abs(hyz)));
  const bool safe = (hxx > 0.05F) & (minor > 0.01F) & (det > 0.01F) & (gg < 1.F);
  const float shift = safe ? 0.F : max(0.F, sqrt(gg) + 0.02F - row);
  hxx += shift;
  hyy += shift;
  hzz += shift;
  const float cxx = hyy * hzz - hyz * hyz, cxy = hxz * hyz - hxy * hzz, cxz = hxy * hyz - hxz * hyy;
  const float cyy = hxx * hzz - hxz * hxz, cyz = hxy * hxz - hxx * hyz, czz = hxx * hyy - hxy * hxy;
  const float s = 0.5F / (hxx * cxx + hxy * cxy + hxz * cxz);
  const float x = s * (cxx * g.x + cxy * g.y + cxz * g.z), y = s * (cxy * g.x + cyy * g.y + cyz * g.z),
              z = s * (cxz * g.x + cyz * g.y + czz * g.z);
  const Quatf turn{1.F, x, y, z};  // by 2 atan(|w| / 2)
  return normalized(q * turn);
}

}  // namespace tactus
