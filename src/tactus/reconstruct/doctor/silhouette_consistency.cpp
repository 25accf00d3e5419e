#include "tactus/reconstruct/doctor/silhouette_consistency.h"

#include <algorithm>
#include <cmath>

#include "tactus/geom/image/mask_bounds.h"
#include "tactus/geom/image/mask_growth.h"

namespace tactus {
namespace {

constexpr double kMaskGrowth = 0.6;  ///< of the spacing's image

struct FloatCamera {
  Vec3f row[3];
  float offset[3];
  Index width_px, height_px;

  explicit FloatCamera(const Camera& camera) { set_projection(*this, camera); }
  struct Place {
    Index x, y;
    bool seen;
  };
  Place place(Vec3f p) const {
    const float z = dot(row[2], p) + offset[2];
    const bool in_front = z > 1e-6F;
    const float inverse_z = 1.F / (in_front ? z : 1.F);
    const float u = (dot(row[0], p) + offset[0]) * inverse_z + 0.5F,
                v = (dot(row[1], p) + offset[1]) * inverse_z + 0.5F;
    const bool seen = in_front & (u >= 0.F) & (v >= 0.F) & (u < static_cast<float>(width_px)) &
                      (v < static_cast<float>(height_px));
    return {static_cast<Index>(seen ? u : 0.F), static_cast<Index>(seen ? v : 0.F), seen};
  }
};

}  // namespace

double SilhouetteConsistency::image_of_spacing_px(const Camera& camera) const {
  const Vec3d middle = 0.5 * vec_cast<double>(box_m_.min + box_m_.max);
  const double z_m = std::abs((camera.T_cam_world * middle).z);
  return clamp(std::max(camera.fx_px, camera.fy_px) * spacing_m_ / std::max(z_m, spacing_m_), 1.0, 64.0);
}

SilhouetteConsistency::SilhouetteConsistency(const Box3f& box_m, std::span<const SeenView> trusted,
                                             int samples)
    : box_m_(box_m), trusted_(trusted.begin(), trusted.end()) {
  const Vec3f extent = box_m.extent();
  spacing_m_ = static_cast<double>(max(extent.x, max(extent.y, extent.z))) / samples;
  const auto step = static_cast<float>(spacing_m_);
  struct Carver {
    FloatCamera camera;
    BitMask mask;
  };
  std::vector<Carver> carvers;
  for (const SeenView& view : trusted_) {
    trusted_cells_.push_back(cells_of(view));
    if (!view.has_mask()) continue;
    carvers.push_back({FloatCamera(view.camera), {}});
    grow_mask(*view.mask, static_cast<int>(std::lround(kMaskGrowth * image_of_spacing_px(view.camera))),
              carvers.back().mask);
  }
  // Row by row, so that each camera tests only the samples that those before kept.
  std::vector<Vec3f> row;
  for (float z = box_m.min.z + 0.5F * step; z < box_m.max.z; z += step) {
    for (float y = box_m.min.y + 0.5F * step; y < box_m.max.y; y += step) {
      row.clear();
      for (float x = box_m.min.x + 0.5F * step; x < box_m.max.x; x += step) row.push_back({x, y, z});
      for (const Carver& c : carvers) {
        std::erase_if(row, [&](Vec3f p) {
          const FloatCamera::Place at = c.camera.place(p);
          return at.seen && !c.mask(at.x, at.y);
        });
      }
      points_m_.insert(points_m_.end(), row.begin(), row.end());
    }
  }
}

SilhouetteConsistency::Cells SilhouetteConsistency::cells_of(const SeenView& view) const {
  Cells cells;
  if (!view.has_mask()) return cells;
  const BitMask& mask = *view.mask;
  cells.step_px = static_cast<Index>(std::ceil(image_of_spacing_px(view.camera)));
  cells.columns = ceil_div(mask.width_px, cells.step_px);
  cells.rows = ceil_div(mask.height_px, cells.step_px);
  cells.set.resize(static_cast<std::size_t>(cells.columns) * static_cast<std::size_t>(cells.rows));
  for (Index y = 0; y < cells.rows; ++y) {
    for (Index x = 0; x < cells.columns; ++x) {
      const Index u = min(x * cells.step_px + cells.step_px / 2, mask.width_px - 1),
                  v = min(y * cells.step_px + cells.step_px / 2, mask.height_px - 1);
      const bool set = mask(u, v);
      cells.set[static_cast<std::size_t>(y * cells.columns + x)] = set ? 1 : 0;
      cells.set_count += set ? 1 : 0;
    }
  }
  return cells;
}

bool SilhouetteConsistency::carve(const SeenView& view, std::vector<std::uint8_t>& kept) const {
  if (!view.has_mask()) return true;
  const FloatCamera camera(view.camera);
  BitMask mask;
  grow_mask(*view.mask, static_cast<int>(std::lround(kMaskGrowth * image_of_spacing_px(view.camera))), mask);
  // Where a silhouette ends within its image, samples outside of that image are not the object.
  const PixelRect rect = bounds_of(*view.mask);
  const bool ends_within = !rect.empty() && rect.min_x > 0 && rect.min_y > 0 &&
                           rect.max_x + 1 < view.mask->width_px && rect.max_y + 1 < view.mask->height_px;
  std::size_t seen = 0;
  for (std::size_t i = 0; i < points_m_.size(); ++i) {
    const FloatCamera::Place at = camera.place(points_m_[i]);
    seen += at.seen ? 1U : 0U;
    if (at.seen ? !mask(at.x, at.y) : ends_within) kept[i] = 0;
  }
  return 2 * seen >= points_m_.size();
}

double SilhouetteConsistency::recall(const SeenView& view, const Cells& cells,
                                     std::span<const std::uint8_t> kept) const {
  if (!view.has_mask() || cells.set_count == 0) return 1;
  const FloatCamera camera(view.camera);
  std::vector<std::uint8_t> covered(cells.set.size(), 0);
  for (std::size_t i = 0; i < points_m_.size(); ++i) {
    if (kept[i] == 0) continue;
    const FloatCamera::Place at = camera.place(points_m_[i]);
    if (!at.seen) continue;
    // A square of a cell's size about the sample touches up to four cells.
    const Index half = cells.step_px / 2;
    const Index x0 = max(at.x - half, 0) / cells.step_px, y0 = max(at.y - half, 0) / cells.step_px,
                x1 = min(x0 + 1, cells.columns - 1), y1 = min(y0 + 1, cells.rows - 1);
    for (const Index y : {y0, y1}) {
      for (const Index x : {x0, x1}) covered[static_cast<std::size_t>(y * cells.columns + x)] = 1;
    }
  }
  std::int64_t both = 0;
  for (std::size_t i = 0; i < covered.size(); ++i) both += covered[i] & cells.set[i];
  return static_cast<double>(both) / static_cast<double>(cells.set_count);
}

std::vector<double> SilhouetteConsistency::recalls(std::span<const SeenView> further) const {
  std::vector<std::uint8_t> kept(points_m_.size(), 1);
  std::vector<bool> looks_here;
  for (const SeenView& view : further) looks_here.push_back(carve(view, kept));
  std::vector<double> result;
  for (std::size_t v = 0; v < trusted_.size(); ++v)
    result.push_back(recall(trusted_[v], trusted_cells_[v], kept));
  for (std::size_t v = 0; v < further.size(); ++v)
    result.push_back(looks_here[v] ? recall(further[v], cells_of(further[v]), kept) : 0);
  return result;
}

double SilhouetteConsistency::covered(const SeenView& view) const {
  const std::vector<std::uint8_t> kept(points_m_.size(), 1);
  return recall(view, cells_of(view), kept);
}

BitMask SilhouetteConsistency::silhouette(const Camera& camera) const {
  BitMask mask(camera.width_px, camera.height_px);
  const FloatCamera c(camera);
  const auto reach = static_cast<Index>(std::ceil(image_of_spacing_px(camera)));
  for (const Vec3f p : points_m_) {
    const FloatCamera::Place at = c.place(p);
    if (!at.seen) continue;
    for (Index y = max(at.y - reach, 0); y <= min(at.y + reach, camera.height_px - 1); ++y) {
      for (Index x = max(at.x - reach, 0); x <= min(at.x + reach, camera.width_px - 1); ++x) mask.set(x, y);
    }
  }
  return mask;
}

}  // namespace tactus
