#pragma once
/// Which camera carves space that all others keep, on a coarse lattice of samples.
#include "tactus/base/vec.h"
#include "tactus/compute/atomic.h"
#include "tactus/compute/kernel.h"

namespace tactus {

/// A camera's pinhole and where its mask lies: 32 pixels a word.
struct ScoreCamera {
  Vec3f row[3];
  float offset[3];
  Index width_px, height_px, begin, row_words;
};

/// Which camera carves each sample of a lattice. One block is 4^3 samples.
struct BlameSamples {
  View<const ScoreCamera> cameras;
  View<const std::uint32_t> masks;
  Vec3i samples;  ///< of the lattice, multiples of 4
  Vec3f origin_m;
  float spacing_m;
  View<std::int8_t> blame;  ///< out, x fastest: kNobody, kSeveral, or the one camera that carves the sample

  static constexpr std::int8_t kNobody = -1, kSeveral = -2;
  static constexpr int kThreads = 64, kGrain = 16;
  struct Shared {
    Index carvers[kThreads], last[kThreads];
    bool decided;
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec3i blocks{samples.x / 4, samples.y / 4, samples.z / 4};
    const Vec3i first{b.index() % blocks.x * 4, b.index() / blocks.x % blocks.y * 4,
                      b.index() / (blocks.x * blocks.y) * 4};
    b.for_each_thread([&](int t) { s.carvers[t] = s.last[t] = 0; });
    b.on_one_thread([&] { s.decided = false; });
    const std::uint32_t* words = masks.data();
    for (Index c = 0; c < cameras.size() && !s.decided; ++c) {
      const ScoreCamera camera = cameras[c];
      b.for_each_thread([&](int t) {
        const Vec3f at = vec_cast<float>(first + Vec3i{t & 3, t >> 2 & 3, t >> 4});
        const Vec3f p = origin_m + spacing_m * at;
        const float z = dot(camera.row[2], p) + camera.offset[2];
        const bool in_front = z > 1e-6F;
        const float inverse_z = 1.F / (in_front ? z : 1.F);
        const float u = (dot(camera.row[0], p) + camera.offset[0]) * inverse_z + 0.5F;
        const float v = (dot(camera.row[1], p) + camera.offset[1]) * inverse_z + 0.5F;
        const bool seen = in_front & (u >= 0.F) & (v >= 0.F) & (u < static_cast<float>(camera.width_px)) &
                          (v < static_cast<float>(camera.height_px));
        const Index x = static_cast<Index>(seen ? u : 0.F), y = static_cast<Index>(seen ? v : 0.F);
        const std::uint32_t bit = words[camera.begin + y * camera.row_words + (x >> 5)] >> (x & 31) & 1U;
        const Index carves = static_cast<Index>(seen) & static_cast<Index>(bit ^ 1U);
        s.carvers[t] += carves;
        s.last[t] = carves != 0 ? c : s.last[t];
      });
      if ((c & 1) == 0) continue;  // most blocks are nobody's after a few cameras
      b.on_one_thread([&] {
        Index least = 2;
        for (int t = 0; t < kThreads; ++t) least = min(least, s.carvers[t]);
        s.decided = least >= 2;
      });
    }
    b.for_each_thread([&](int t) {
      const Vec3i at = first + Vec3i{t & 3, t >> 2 & 3, t >> 4};
      const Index verdict = s.carvers[t] == 0 ? kNobody : (s.carvers[t] == 1 ? s.last[t] : kSeveral);
      blame[at.x + samples.x * (at.y + samples.y * at.z)] = static_cast<std::int8_t>(verdict);
    });
  }
};

/// The one camera that carves sample `i` alone, where also no other camera carves any of the six neighbours;
/// else negative. (Silhouettes rightly shave skins off one another's hulls, not insides.) Not at the
/// lattice's faces.
TACTUS_HD inline Index blamed_view(const std::int8_t* blame, Vec3i samples, Index i) {
  const std::int8_t who = blame[i];
  if (who < 0) return who;
  const Index step_y = samples.x, step_z = samples.x * samples.y;
  const auto free = [&](Index k) { return blame[k] == BlameSamples::kNobody || blame[k] == who; };
  const bool deep = free(i - 1) && free(i + 1) && free(i - step_y) && free(i + step_y) && free(i - step_z) &&
                    free(i + step_z);
  return deep ? who : BlameSamples::kSeveral;
}

/// Counts samples that no camera carves, and for each camera those that are its blame.
struct CountBlame {
  static constexpr int kGrain = 64;
  View<const std::int8_t> blame;
  Vec3i samples;
  View<std::uint32_t> counts;  ///< out: per camera; the last: kept by all
  /// One row along x.
  TACTUS_HD void operator()(Index row) const {
    const Index y = row % samples.y, z = row / samples.y;
    if (y == 0 || z == 0 || y + 1 == samples.y || z + 1 == samples.z) return;
    std::uint32_t kept = 0;
    for (Index x = 1; x + 1 < samples.x; ++x) {
      const Index who = blamed_view(blame.data(), samples, row * samples.x + x);
      kept += who == BlameSamples::kNobody ? 1U : 0U;
      if (who >= 0) atomic_add(counts[who], 1U);
    }
    if (kept != 0) atomic_add(counts[counts.size() - 1], kept);
  }
};

}  // namespace tactus
