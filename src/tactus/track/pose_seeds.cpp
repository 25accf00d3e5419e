#include "tactus/track/pose_seeds.h"

#include <algorithm>
#include <cmath>

#include "tactus/geom/image/mask_cleaning.h"
#include "tactus/geom/maths/rotation.h"
#include "tactus/geom/maths/symmetric_eigen.h"

namespace tactus {
namespace {

constexpr std::size_t kMostParts = 4, kMostLines = 3;
constexpr double kLeastLength_px = 10, kLeastElongation = 2.5;
constexpr int kRolls = 8;

/// Pixels of a mask that hang together, over edges and corners; clears them.
void take_part(BitMask& mask, Vec2i start, std::vector<Vec2i>& pixels) {
  pixels.assign(1, start);
  mask.clear(start.x, start.y);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const Vec2i p = pixels[i];
    for (Index y = std::max(p.y - 1, Index{0}); y <= std::min(p.y + 1, mask.height_px - 1); ++y) {
      for (Index x = std::max(p.x - 1, Index{0}); x <= std::min(p.x + 1, mask.width_px - 1); ++x) {
        if (!mask(x, y)) continue;
        mask.clear(x, y);
        pixels.push_back({x, y});
      }
    }
  }
}

/// Its main axis, between its ends along that. Nothing where it is not long.
std::optional<ThinPart> straight_part(const std::vector<Vec2i>& pixels) {
  const auto n = static_cast<double>(pixels.size());
  Vec2d mean{};
  for (const Vec2i p : pixels)
    mean = mean + (1 / n) * Vec2d{static_cast<double>(p.x), static_cast<double>(p.y)};
  double xx = 0, xy = 0, yy = 0;
  for (const Vec2i p : pixels) {
    const double x = p.x - mean.x, y = p.y - mean.y;
    xx += x * x / n;
    xy += x * y / n;
    yy += y * y / n;
  }
  const double angle = 0.5 * std::atan2(2 * xy, xx - yy), middle = 0.5 * (xx + yy),
               half = std::hypot(0.5 * (xx - yy), xy);
  if (middle + half < kLeastElongation * kLeastElongation * std::max(middle - half, 1.0 / 12)) return {};
  const Vec2d along{std::cos(angle), std::sin(angle)};
  double begin = 0, end = 0;
  for (const Vec2i p : pixels) {
    const double s = along.x * (p.x - mean.x) + along.y * (p.y - mean.y);
    begin = std::min(begin, s);
    end = std::max(end, s);
  }
  if (end - begin < kLeastLength_px) return {};
  return ThinPart{mean + begin * along, mean + end * along};
}

/// The plane of a camera's centre and a part of its picture: normal, world.
Vec3d plane_of(const Camera& camera, const ThinPart& part) {
  return normalized(cross(pixel_ray_world(camera, part.from_px.x, part.from_px.y),
                          pixel_ray_world(camera, part.to_px.x, part.to_px.y)));
}

struct Line {
  Vec3d through_m, direction;
};

/// Where on the line it is nearest to the ray through a pixel [m].
double place_on(const Line& line, const Camera& camera, Vec2d px) {
  const Vec3d ray = pixel_ray_world(camera, px.x, px.y), from = line.through_m - camera.center_world();
  const double b = dot(line.direction, ray);
  return (b * dot(ray, from) - dot(line.direction, from)) / std::max(1 - b * b, 1e-6);
}

/// Farthest distance of a part's ends from the line's picture.
double off_px(const Line& line, const Camera& camera, const ThinPart& part) {
  double most = 0;
  for (const Vec2d px : {part.from_px, part.to_px}) {
    const double s = place_on(line, camera, px);
    const Pixel p = project(camera, line.through_m + s * line.direction);
    most = std::max(most, p.z_m > 0 ? std::hypot(p.u_px - px.x, p.v_px - px.y) : 1e9);
  }
  return most;
}

/// The part of a camera that lies best on a line, or none.
const ThinPart* part_on(const Line& line, const Camera& camera, const std::vector<ThinPart>& parts,
                        double tolerance_px) {
  const ThinPart* best = nullptr;
  for (const ThinPart& part : parts) {
    if (off_px(line, camera, part) > tolerance_px) continue;
    if (best == nullptr || part.length_px() > best->length_px()) best = &part;
  }
  return best;
}

double middle_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The line that the planes of parts have in common, and the stretch of it that they show.
SeenLine refine(const Line& rough, std::span<const Camera> cameras, std::span<const ThinPart* const> parts) {
  Mat3d normals = Mat3d::zero();
  Vec3d offsets{};
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (parts[c] == nullptr) continue;
    const Vec3d n = plane_of(cameras[c], *parts[c]);
    normals = normals + outer(n, n);
    offsets += dot(n, cameras[c].center_world() - rough.through_m) * n;
  }
  const SymmetricEigen axes = symmetric_eigen(normals);
  Line line{rough.through_m, axes.vectors.row[2]};
  for (int k = 0; k < 2; ++k)
    line.through_m +=
        dot(axes.vectors.row[k], offsets) / std::max(axes.values[k], 1e-9) * axes.vectors.row[k];
  std::vector<double> begins, ends;
  SeenLine seen;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (parts[c] == nullptr) continue;
    const double a = place_on(line, cameras[c], parts[c]->from_px),
                 b = place_on(line, cameras[c], parts[c]->to_px);
    begins.push_back(std::min(a, b));
    ends.push_back(std::max(a, b));
    seen.support_px += parts[c]->length_px();
    ++seen.cameras;
  }
  seen.from_m = line.through_m + middle_of(begins) * line.direction;
  seen.to_m = line.through_m + middle_of(ends) * line.direction;
  return seen;
}

}  // namespace

double ThinPart::length_px() const { return std::hypot(to_px.x - from_px.x, to_px.y - from_px.y); }

BitMask thin_pixels(const BitMask& mask, int radius_px) {
  MaskCleaner cleaner(mask.width_px, mask.height_px);
  BitMask thick = mask, thin = mask;
  cleaner.erode(thick, radius_px);
  cleaner.dilate(thick, radius_px + 1);
  for (std::size_t i = 0; i < thin.words.size(); ++i) thin.words[i] &= ~thick.words[i];
  return thin;
}

std::vector<ThinPart> thin_parts(const BitMask& mask, int radius_px) {
  BitMask thin = thin_pixels(mask, radius_px);
  std::vector<ThinPart> parts;
  std::vector<Vec2i> pixels;
  for (std::size_t i = 0; i < thin.words.size(); ++i) {
    const auto row = static_cast<Index>(i) / thin.words_per_row(),
               word = static_cast<Index>(i) % thin.words_per_row();
    while (thin.words[i] != 0) {
      take_part(thin, {32 * word + static_cast<Index>(std::countr_zero(thin.words[i])), row}, pixels);
      if (const auto part = straight_part(pixels)) parts.push_back(*part);
    }
  }
  std::sort(parts.begin(), parts.end(),
            [](const ThinPart& a, const ThinPart& b) { return a.length_px() > b.length_px(); });
  if (parts.size() > kMostParts) parts.resize(kMostParts);
  return parts;
}

std::vector<SeenLine> seen_lines(std::span<const Camera> cameras,
                                 std::span<const std::vector<ThinPart>> parts, double tolerance_px) {
  std::vector<std::vector<ThinPart>> left(parts.begin(), parts.end());
  std::vector<SeenLine> lines;
  while (lines.size() < kMostLines) {
    double best_px = 0;
    Line best{};
    for (std::size_t a = 0; a < cameras.size(); ++a) {
      for (std::size_t b = a + 1; b < cameras.size(); ++b) {
        for (const ThinPart& in_a : left[a]) {
          for (const ThinPart& in_b : left[b]) {
            const Vec3d n = plane_of(cameras[a], in_a), m = plane_of(cameras[b], in_b), across = cross(n, m);
            if (length(across) < 0.2) continue;
            const double na = dot(n, cameras[a].center_world()), mb = dot(m, cameras[b].center_world());
            // The point of both planes that is nearest to the origin.
            const Vec3d through = (na * cross(m, across) + mb * cross(across, n)) / dot(across, across);
            const Line line{through, normalized(across)};
            double support_px = 0;
            for (std::size_t c = 0; c < cameras.size(); ++c)
              if (const ThinPart* part = part_on(line, cameras[c], left[c], tolerance_px))
                support_px += part->length_px();
            if (support_px > best_px) {
              best_px = support_px;
              best = line;
            }
          }
        }
      }
    }
    if (best_px == 0) break;
    std::vector<const ThinPart*> on_it;
    for (std::size_t c = 0; c < cameras.size(); ++c)
      on_it.push_back(part_on(best, cameras[c], left[c], tolerance_px));
    const SeenLine seen = refine(best, cameras, on_it);
    if (seen.cameras < 3) break;
    lines.push_back(seen);
    for (std::size_t c = 0; c < cameras.size(); ++c)
      if (on_it[c] != nullptr) left[c].erase(left[c].begin() + (on_it[c] - left[c].data()));
  }
  return lines;
}

LongAxis long_axis(const OutlineMesh& mesh) {
  Mat3d spread = Mat3d::zero();
  for (const Vec3d& p : mesh.vertices_m) spread = spread + outer(p - mesh.center_m, p - mesh.center_m);
  const Mat3d axes = symmetric_eigen(spread).vectors;
  LongAxis axis{axes.row[0], {axes.row[1], axes.row[2]}, 0, 0, 0};
  for (const Vec3d& p : mesh.vertices_m) {
    const Vec3d d = p - mesh.center_m;
    const double s = dot(d, axis.direction);
    axis.begin_m = std::min(axis.begin_m, s);
    axis.end_m = std::max(axis.end_m, s);
    axis.radius_m = std::max(axis.radius_m, length(d - s * axis.direction));
  }
  return axis;
}

std::array<Rigidd, 3> turned_over(const OutlineMesh& mesh, const Rigidd& T_world_model) {
  const LongAxis axis = long_axis(mesh);
  const Vec3d middle_m = mesh.center_m + 0.5 * (axis.begin_m + axis.end_m) * axis.direction;
  const auto turned = [&](Vec3d about) {
    const Mat3d R = T_world_model.R * rotation_from_vector(M_PI * about);
    return Rigidd{R, T_world_model * middle_m - R * middle_m};
  };
  return {turned(axis.direction), turned(axis.across[0]), turned(axis.across[1])};
}

std::vector<Rigidd> poses_along(const OutlineMesh& mesh, const SeenLine& line) {
  const LongAxis axis = long_axis(mesh);
  const double seen_m = length(line.to_m - line.from_m), long_m = axis.end_m - axis.begin_m;
  const Vec3d side =
      normalized(cross(std::abs(axis.direction.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}, axis.direction));
  const Mat3d model{{axis.direction, side, cross(axis.direction, side)}};
  std::vector<Rigidd> poses;
  for (const double way : {1.0, -1.0}) {
    const Vec3d direction = (way / seen_m) * (line.to_m - line.from_m);
    const Vec3d begin_m = way > 0 ? line.from_m : line.to_m, end_m = way > 0 ? line.to_m : line.from_m;
    const Vec3d up =
        normalized(cross(std::abs(direction.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}, direction));
    std::vector<Vec3d> centers{0.5 * (begin_m + end_m) - 0.5 * (axis.begin_m + axis.end_m) * direction};
    if (seen_m < 0.75 * long_m)
      centers = {begin_m - axis.begin_m * direction, end_m - axis.end_m * direction};
    for (int roll = 0; roll < kRolls; ++roll) {
      const Vec3d v = rotation_from_vector(2 * M_PI * roll / kRolls * direction) * up;
      const Mat3d R = transpose(Mat3d{{direction, v, cross(direction, v)}}) * model;
      for (const Vec3d& c : centers) poses.push_back({R, c - R * mesh.center_m});
    }
  }
  return poses;
}

}  // namespace tactus
