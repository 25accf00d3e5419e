#pragma once
/// Averages over a surface that depend on distances, not on its triangles.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tactus/geom/mesh/mesh.h"

namespace tactus {

/// A surface as samples of equal share of each triangle, for averages around a point with the weight
/// area (1 - d^2 / R^2)^3. Such an average is a smooth function of the point, even where triangles are
/// needles. A sample counts by how much it faces the same way, so the other side of a thin sheet or of a cut
/// doesn't.
class SurfaceSamples {
 public:
  struct Sample {
    Vec3f x_m, normal;
    float area_m2 = 0;
    std::array<Index, 3> corners{};
    Vec3f shares{};  ///< of the corners
  };
  /// @param reach_m R, > 0 @param box_m samples of triangles that meet it are made
  SurfaceSamples(const TriangleMesh& mesh, float reach_m, const Box3f& box_m);

  float reach_m() const { return reach_m_; }
  /// Calls f(sample, weight, gradient of the weight along the point [1/m]) for all samples around a point of
  /// the surface with this unit normal.
  template <class F>
  void around(Vec3f p_m, Vec3f normal, F&& f) const {
    const Vec3i low = cell_of(p_m - Vec3f{reach_m_, reach_m_, reach_m_}),
                high = cell_of(p_m + Vec3f{reach_m_, reach_m_, reach_m_});
    const float per_m2 = 1 / (reach_m_ * reach_m_);
    for (Index z = low.z; z <= high.z; ++z)
      for (Index y = low.y; y <= high.y; ++y) {
        const auto row = static_cast<std::size_t>((z * cells_.y + y) * cells_.x);
        const std::size_t from = first_[row + static_cast<std::size_t>(low.x)],
                          to = first_[row + static_cast<std::size_t>(high.x) + 1];
        for (std::size_t k = from; k < to; ++k) {
          const Sample& s = samples_[k];
          const Vec3f off = p_m - s.x_m;
          const float near = 1 - dot(off, off) * per_m2, facing = dot(normal, s.normal) - kSameWay;
          if (near <= 0 || facing <= 0) continue;
          const float weight = s.area_m2 * facing * near * near;
          f(s, weight * near, (-6 * per_m2 * weight) * off);
        }
      }
  }

 private:
  static constexpr float kSameWay = 0.2F;  ///< cosine
  Vec3i cell_of(Vec3f p_m) const;

  float reach_m_, cell_m_;
  Vec3f low_m_{};
  Vec3i cells_{1, 1, 1};
  std::vector<Sample> samples_;     ///< by cells
  std::vector<std::size_t> first_;  ///< per cell, and the end
};

}  // namespace tactus
