#include "tactus/fluid/liquid_mesh.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tactus/base/math.h"
#include "tactus/geom/mesh/polygonize.h"

namespace tactus {
namespace {

/// In spacings: how far particles count, where the surface is, and the grid of marching cubes.
constexpr float kReach = 2, kRadius = 0.545F, kCell = 0.5F;
/// Finer grids than that take minutes: a spray over a large box is meshed coarser.
constexpr float kMostCells = 600;

/// Cells of the grid below along its longest edge: 64 million take half a gigabyte.
constexpr float kMostReaches = 400;

float longest(Vec3f edge) { return std::max({edge.x, edge.y, edge.z}); }

/// Particles, sorted by the cells of a grid whose edge is the reach, or longer where few fly far.
class Field {
 public:
  Field(std::vector<Vec3f> x_m, const Box3f& box_m, float spacing_m)
      : low_m_(box_m.min),
        reach_m_(kReach * spacing_m),
        cell_m_(std::max(reach_m_, longest(box_m.extent()) / kMostReaches)),
        radius_m_(kRadius * spacing_m) {
    for (int a = 0; a < 3; ++a)
      dims_[a] = static_cast<Index>(std::floor((box_m.max[a] - box_m.min[a]) / cell_m_)) + 1;
    first_.resize(static_cast<std::size_t>(dims_.x) * static_cast<std::size_t>(dims_.y) *
                      static_cast<std::size_t>(dims_.z) +
                  1);
    for (const Vec3f x : x_m) ++first_[slot(cell(x)) + 1];
    for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
    x_m_.resize(x_m.size());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (const Vec3f x : x_m) x_m_[next[slot(cell(x))]++] = x;
  }

  float operator()(Vec3f at_m) const {
    const Vec3i middle = cell(at_m);
    Vec3f sum{};
    float weights = 0;
    for (Index z = std::max(middle.z - 1, 0); z <= std::min(middle.z + 1, dims_.z - 1); ++z) {
      for (Index y = std::max(middle.y - 1, 0); y <= std::min(middle.y + 1, dims_.y - 1); ++y) {
        // Cells of a row are neighbours in the list, too.
        const std::size_t begin = first_[slot({std::max(middle.x - 1, 0), y, z})],
                          end = first_[slot({std::min(middle.x + 1, dims_.x - 1), y, z}) + 1];
        for (std::size_t i = begin; i < end; ++i) {
          const Vec3f r = x_m_[i] - at_m;
          const float t = 1 - dot(r, r) / sqr(reach_m_);
          if (t <= 0.F) continue;
          sum += (t * t * t) * r;
          weights += t * t * t;
        }
      }
    }
    return weights > 0.F ? length((1 / weights) * sum) - radius_m_ : reach_m_ - radius_m_;
  }

 private:
  Vec3i cell(Vec3f x) const {
    Vec3i c;
    for (int a = 0; a < 3; ++a)
      c[a] = std::clamp(static_cast<Index>(std::floor((x[a] - low_m_[a]) / cell_m_)), Index{0}, dims_[a] - 1);
    return c;
  }
  std::size_t slot(Vec3i c) const {
    return static_cast<std::size_t>(c.x) +
           static_cast<std::size_t>(dims_.x) *
               (static_cast<std::size_t>(c.y) +
                static_cast<std::size_t>(dims_.y) * static_cast<std::size_t>(c.z));
  }
  Vec3f low_m_;
  float reach_m_, cell_m_, radius_m_;
  Vec3i dims_;
  std::vector<std::size_t> first_;
  std::vector<Vec3f> x_m_;
};

}  // namespace

TriangleMesh liquid_mesh(std::span<const Vec3f> x_m, float spacing_m) {
  std::vector<Vec3f> here;
  for (const Vec3f x : x_m) {
    if (dot(x, x) < 1e30F) here.push_back(x);
  }
  if (here.empty()) return {};
  Box3f box{here.front(), here.front()};
  for (const Vec3f x : here) box = {min(box.min, x), max(box.max, x)};
  const Vec3f margin = (kRadius + 2 * kCell) * spacing_m * Vec3f{1, 1, 1};
  box = {box.min - margin, box.max + margin};
  const Vec3f extent = box.extent();
  const float cells = longest(extent) / (kCell * spacing_m);
  const Field field(std::move(here), box, spacing_m);
  return polygonize(box, static_cast<Index>(std::ceil(std::min(cells, kMostCells))), field);
}

}  // namespace tactus
