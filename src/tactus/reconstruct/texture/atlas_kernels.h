#pragma once
/// The photo that a triangle is cut from, for texture atlases.
#include "tactus/reconstruct/texture/texture_kernels.h"

namespace tactus {

/// The best camera of those that see all three corners, looked at along the corners' normals.
struct ChooseTrianglePhotos {
  static constexpr int kGrain = 256;
  View<const TextureCamera> cameras;
  View<const Vec3f> positions_m, normals;
  View<const Vec3i> triangles;
  PhotoScore score;
  CameraBits live;  ///< cameras that have a photo of this tick
  View<Index> chosen;

  TACTUS_HD void operator()(Index i) const {
    const Vec3i t = triangles[i];
    float best = 0;
    Index found = -1;
    for (Index c = 0; c < cameras.size(); ++c) {
      if ((live & camera_bit(c)) == 0) continue;
      float least = 3.402823466e38F;
      for (int corner = 0; corner < 3; ++corner) {
        const Vec3f n = normals[t[corner]];
        least = min(least, score(cameras[c], positions_m[t[corner]], n, -n));
      }
      found = least > best ? c : found;
      best = max(best, least);
    }
    chosen[i] = found;
  }
};

}  // namespace tactus
