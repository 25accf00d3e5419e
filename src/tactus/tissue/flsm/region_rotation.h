#pragma once
/// The rotation nearest to a 3x3 matrix, from a good guess: for host and device.
#include "tactus/base/vec.h"

namespace tactus {

/// A 3x3 matrix by columns, without indices: stays in registers where lanes of a loop are worked on together.
struct Columns {
  Vec3f x, y, z;
};
TACTUS_HD inline Columns rotation_columns(const Quatf& q) {
  const float x2 = q.x + q.x, y2 = q.y + q.y, z2 = q.z + q.z;
  return {{1.F - (q.y * y2 + q.z * z2), q.x * y2 + q.w * z2, q.x * z2 - q.w * y2},
          {q.x * y2 - q.w * z2, 1.F - (q.x * x2 + q.z * z2), q.y * z2 + q.w * x2},
          {q.x * z2 + q.w * y2, q.y * z2 - q.w * x2, 1.F - (q.x * x2 + q.y * y2)}};
}

/// One step of a Newton iteration on rotations for max tr(R^T A) (Wahba 1965): the polar decomposition's
/// rotation where det A > 0, the nearest proper rotation where A is inverted, one of the best where A is flat
/// or zero. A is scaled to Frobenius norm 1 (or is 0). With B = R^T A and S its symmetric part the step
/// solves (tr(S) 1 - S) w = axial(B - B^T). Where the matrix is not safely positive definite (far from the
/// maximum) it is shifted until it is, by Gershgorin's bound, and by the size of the right side, so steps
/// stay below 1 rad. Converges quadratically where A is regular: a turn of 0.1 rad is down to 4e-4 after one
/// step and to float round-off after two. No branches: lanes of a loop take it together.
TACTUS_HD inline Quatf improve_rotation(const Quatf& q, const Columns& A) {
  const Columns R = rotation_columns(q);
  const float bxx = dot(R.x, A.x), bxy = dot(R.x, A.y), bxz = dot(R.x, A.z);
  const float byx = dot(R.y, A.x), byy = dot(R.y, A.y), byz = dot(R.y, A.z);
  const float bzx = dot(R.z, A.x), bzy = dot(R.z, A.y), bzz = dot(R.z, A.z);
  const float gx = bzy - byz, gy = bxz - bzx, gz = byx - bxy;
  const float hxy = -0.5F * (bxy + byx), hxz = -0.5F * (bxz + bzx), hyz = -0.5F * (byz + bzy);
  const float axy = abs(hxy), axz = abs(hxz), ayz = abs(hyz);
  const float txx = byy + bzz, tyy = bxx + bzz, tzz = bxx + byy;
  const float gg = gx * gx + gy * gy + gz * gz;
  const float minor = txx * tyy - hxy * hxy;
  const float det =
      txx * (tyy * tzz - hyz * hyz) - hxy * (hxy * tzz - hyz * hxz) + hxz * (hxy * hyz - tyy * hxz);
  const float row_x = txx - axy - axz, row_y = tyy - axy - ayz, row_z = tzz - axz - ayz;
  const float row_xy = row_x < row_y ? row_x : row_y;
  const float needed = sqrt(gg) + 0.02F - (row_xy < row_z ? row_xy : row_z);
  const float shift = needed > 0.F ? needed : 0.F;
  const bool safe = (txx > 0.05F) & (minor > 0.01F) & (det > 0.01F) & (gg < 1.F);
  const float add = safe ? 0.F : shift;
  const float hxx = txx + add, hyy = tyy + add, hzz = tzz + add;
  const float cxx = hyy * hzz - hyz * hyz, cxy = hxz * hyz - hxy * hzz, cxz = hxy * hyz - hxz * hyy;
  const float cyy = hxx * hzz - hxz * hxz, cyz = hxy * hxz - hxx * hyz, czz = hxx * hyy - hxy * hxy;
  const float s = 0.5F / (hxx * cxx + hxy * cxy + hxz * cxz);
  const float x = s * (cxx * gx + cxy * gy + cxz * gz), y = s * (cxy * gx + cyy * gy + cyz * gz),
              z = s * (cxz * gx + cyz * gy + czz * gz);
  // q * (1, w / 2): a turn by 2 atan(|w| / 2).
  const float nw = q.w - q.x * x - q.y * y - q.z * z, nx = q.x + q.w * x + q.y * z - q.z * y,
              ny = q.y + q.w * y + q.z * x - q.x * z, nz = q.z + q.w * z + q.x * y - q.y * x;
  const float n = 1.F / sqrt(nw * nw + nx * nx + ny * ny + nz * nz);
  return {n * nw, n * nx, n * ny, n * nz};
}

}  // namespace tactus
