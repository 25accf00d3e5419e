#pragma once
/// Vertices of the hull that keeps points carved by up to m cameras (k of n): a point is outside when more
/// than m cameras see background there, so an edge is left where the (m+1)-th silhouette is left.
#include "tactus/reconstruct/vertex_kernels.h"

namespace tactus {

/// In place of BrickSigns when views are tolerated. Plain code: only the strict kernel is optimised.
struct TolerantSigns {
  BrickSigns plain;
  Index tolerated;  ///< m, 1 .. EmitTolerantVertices::kMostTolerated

  static constexpr int kSubNodes = 64, kThreads = 8 * kSubNodes;
  struct Shared {
    CameraBits sub_mixed[8];
    std::uint32_t sub_outside[8];
    std::uint32_t inside[8 * kSubNodes];  ///< 0 or 1, x fastest
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Vec3i brick = plain.grid.brick_at(plain.bricks[b.index()]), first = kBrick * brick;
    const CameraBits candidates = plain.block_cameras[plain.grid.block_of(brick)];
    b.for_threads(8, [&](int sub) {
      const Vec3i at = first + Vec3i{(sub & 1) * 4, (sub >> 1 & 1) * 4, (sub >> 2) * 4};
      CameraBits mixed = 0;
      Index outside = 0;
      for (CameraBits left = candidates; left != 0; left &= left - 1) {
        const int c = lowest_bit(left);
        const std::uint32_t verdict = classify_footprint(plain.cameras[c], plain.cells.data(),
                                                         vec_cast<float>(at) + Vec3f{2, 2, 2}, 2.F);
        outside += (verdict & kOutsideFootprint) != 0 ? 1 : 0;
        mixed |= (verdict & kInsideFootprint) != 0 ? 0 : camera_bit(c);
      }
      s.sub_outside[sub] = outside > tolerated ? 1U : 0U;
      s.sub_mixed[sub] = plain.sub_cameras[b.index() * 8 + sub] = outside > tolerated ? 0 : mixed;
    });
    b.for_threads(kThreads, [&](int t) {
      const Vec3i in{t & 7, t >> 3 & 7, t >> 6};
      s.inside[t] = is_inside(s, first + in, (in.x >> 2) + (in.y >> 2) * 2 + (in.z >> 2) * 4) ? 1U : 0U;
    });
    b.for_threads(kBrickRows, [&](int t) {
      std::uint32_t row = 0;
      for (int x = 0; x < kBrick; ++x) row |= s.inside[t * kBrick + x] << x;
      plain.rows[b.index() * kBrickRows + t] = static_cast<std::uint8_t>(row);
    });
  }

 private:
  TACTUS_HD bool is_inside(const Shared& s, Vec3i node, int sub) const {
    const Vec3i last = plain.grid.last_node;
    const bool real =
        min(node.x, min(node.y, node.z)) > 0 && node.x < last.x && node.y < last.y && node.z < last.z;
    if (!real || s.sub_outside[sub] != 0) return false;
    Index carvers = 0;
    for (CameraBits left = s.sub_mixed[sub]; left != 0; left &= left - 1) {
      const HullCamera& c = plain.cameras[lowest_bit(left)];
      carvers += sample_silhouette(c, plain.bits.data(), project_node(c, vec_cast<float>(node))) < 0 ? 1 : 0;
    }
    return carvers <= tolerated;
  }
};

/// In place of EmitVertices when views are tolerated.
struct EmitTolerantVertices {
  EmitVertices plain;
  Index tolerated;  ///< m, 1 .. kMostTolerated

  static constexpr int kThreads = EmitVertices::kThreads, kMostTolerated = 7;
  using Shared = EmitVertices::Shared;

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const EmitVertices::Run run = plain.run_of(b.index());
    s.list(b, plain.crossings, plain.row_start);
    const Vec3i brick = kBrick * plain.table.brick_at(b.index());
    for (Index first = 0; first < run.count; first += kThreads) {
      const int count = min(run.count - first, Index{kThreads});
      b.for_threads(count, [&](int t) {
        plain.load_edge(s, t, first + t, b.index(), brick);
        const Vec3f inner{s.inner_x[t], s.inner_y[t], s.inner_z[t]},
            step{s.step_x[t], s.step_y[t], s.step_z[t]};
        plain.place_vertex(s, t, min(s.leave(t), leave_silhouettes(s.cameras_near(t), inner, step, brick)));
      });
      plain.write(b, s, run.begin + first, count);
    }
  }

 private:
  /// The (m+1)-th smallest parameter at which a silhouette is left, 0 for one that is already left.
  TACTUS_HD float leave_silhouettes(CameraBits near, Vec3f inner, Vec3f step, Vec3i brick) const {
    float smallest[kMostTolerated + 1];
    for (float& t : smallest) t = 1;
    for (; near != 0; near &= near - 1) {
      float leave = leave_silhouette(plain.cameras[lowest_bit(near)], inner, step, brick);
      for (Index i = 0; i <= tolerated; ++i) {
        const float larger = max(smallest[i], leave);
        smallest[i] = min(smallest[i], leave);
        leave = larger;
      }
    }
    return smallest[tolerated];
  }

  /// As EmitVertices walks: the first background sample on the way, then refined to sub-pixel.
  TACTUS_HD float leave_silhouette(const HullCamera& c, Vec3f inner, Vec3f step, Vec3i brick) const {
    const std::uint32_t* words = plain.bits.data();
    const Vec3f from = project_node(c, inner), way = project_node(c, inner + step) - from;
    const auto value = [&](float t) {
      return sample_silhouette(c, words,
                               {fma(t, way.x, from.x), fma(t, way.y, from.y), fma(t, way.z, from.z)});
    };
    float outside = 1, outside_value = sample_silhouette(c, words, from + way);
    if (!(outside_value < 0)) return 1;
    if (value(0) < 0) return 0;
    const int steps = EmitVertices::steps_along(c, brick);
    const float stride = 1.F / static_cast<float>(steps);
    for (int k = steps - 1; k > 0; --k) {
      const float at = static_cast<float>(k) * stride, v = value(at);
      outside = v < 0 ? at : outside;
      outside_value = v < 0 ? v : outside_value;
    }
    float inside = max(outside - stride, 0.F), inside_value = 0.5F;
    for (int i = 0; i < EmitVertices::kBisections; ++i) {
      const float middle = 0.5F * (inside + outside), v = value(middle);
      outside = v < 0 ? middle : outside;
      outside_value = v < 0 ? v : outside_value;
      inside = v < 0 ? inside : middle;
      inside_value = v < 0 ? inside_value : v;
    }
    return fma(outside - inside, inside_value / (inside_value - outside_value), inside);
  }
};

}  // namespace tactus
