#include "plain_voxel_loop.h"

#include <tbb/parallel_for.h>

namespace tactus::bench {

PlainVoxelLoop::PlainVoxelLoop(std::span<const Camera> cameras, std::span<const BitMask> masks, Box3f box_m,
                               Index n)
    : box_m_(box_m),
      n_(n),
      inside_(static_cast<std::size_t>(n) * static_cast<std::size_t>(n) * static_cast<std::size_t>(n)) {
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    View view{{}, cameras[c].width_px, cameras[c].height_px, {}};
    const Mat3d KR = cameras[c].intrinsics() * cameras[c].T_cam_world.R;
    const Vec3d Kt = cameras[c].intrinsics() * cameras[c].T_cam_world.t;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) view.P[4 * i + j] = static_cast<float>(KR(i, j));
      view.P[4 * i + 3] = static_cast<float>(Kt[i]);
    }
    for (Index y = 0; y < view.height_px; ++y) {
      for (Index x = 0; x < view.width_px; ++x) view.mask.push_back(masks[c](x, y) ? 1 : 0);
    }
    views_.push_back(std::move(view));
  }
}

void PlainVoxelLoop::run() {
  tbb::parallel_for(Index{0}, n_, [this](Index z) { run_slice(z); });
}

void PlainVoxelLoop::run_slice(Index z) {
  const Vec3f size = (1.F / static_cast<float>(n_)) * box_m_.extent();
  const auto along = [](float low, float step, Index i) {
    return low + step * (static_cast<float>(i) + 0.5F);
  };
  const float pz = along(box_m_.min.z, size.z, z);
  std::uint8_t* out = inside_.data() + static_cast<std::size_t>(z) * static_cast<std::size_t>(n_) *
                                           static_cast<std::size_t>(n_);
  for (Index y = 0; y < n_; ++y) {
    const float py = along(box_m_.min.y, size.y, y);
    for (Index x = 0; x < n_; ++x) {
      const float px = along(box_m_.min.x, size.x, x);
      std::uint8_t in = 1;
      for (const View& v : views_) {
        const float w = v.P[8] * px + v.P[9] * py + v.P[10] * pz + v.P[11];
        if (w <= 0) continue;
        const float inverse_w = 1.F / w;
        const auto u =
            static_cast<Index>((v.P[0] * px + v.P[1] * py + v.P[2] * pz + v.P[3]) * inverse_w + 0.5F);
        const auto r =
            static_cast<Index>((v.P[4] * px + v.P[5] * py + v.P[6] * pz + v.P[7]) * inverse_w + 0.5F);
        if (u < 0 || u >= v.width_px || r < 0 || r >= v.height_px) continue;
        if (v.mask[static_cast<std::size_t>(r) * static_cast<std::size_t>(v.width_px) +
                   static_cast<std::size_t>(u)] == 0) {
          in = 0;
          break;
        }
      }
      *out++ = in;
    }
  }
}

}  // namespace tactus::bench
