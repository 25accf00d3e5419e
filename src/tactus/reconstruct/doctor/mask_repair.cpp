#include "tactus/reconstruct/doctor/mask_repair.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace tactus {
namespace {

/// Samples that count lie one sample within the edge of the carved space, and the next sample may miss it by
/// another.
constexpr double kReachSamples = 2;
/// Points along a ray, per sample of the lattice.
constexpr double kStepsPerSample = 4;
constexpr std::size_t kTurnsPerView = 4;

/// The pixels of one mask that are to blame for the space that its view carves alone, and the range of that
/// space along their rays.
struct Blame {
  BitMask pixels;
  double begin_m = 1e30, end_m = 0;  ///< distances from the camera
};

/// Sets the pixels of a disc.
void mark_disc(BitMask& mask, const Pixel& center, double radius_px) {
  const auto first = [](double low) { return static_cast<Index>(std::ceil(std::max(low, 0.0))); };
  const auto last = [](double high, Index size) {
    return static_cast<Index>(std::floor(std::min(high, size - 1.0)));
  };
  const Index y_end = last(center.v_px + radius_px, mask.height_px);
  for (Index y = first(center.v_px - radius_px); y <= y_end; ++y) {
    const double half_px = std::sqrt(std::max(sqr(radius_px) - sqr(y - center.v_px), 0.0));
    const Index x_end = last(center.u_px + half_px, mask.width_px);
    for (Index x = first(center.u_px - half_px); x <= x_end; ++x) mask.set(x, y);
  }
}

Blame blame_pixels(const Camera& camera, const BitMask& mask, double spacing_m,
                   std::span<const Vec3f> points_m) {
  Blame blame{BitMask(mask.width_px, mask.height_px)};
  const double reach_m = kReachSamples * spacing_m;
  for (const Vec3f point_m : points_m) {
    const Vec3d p = vec_cast<double>(point_m);
    const double distance_m = length(p - camera.center_world());
    blame.begin_m = std::min(blame.begin_m, std::max(distance_m - reach_m, 1e-3 * spacing_m));
    blame.end_m = std::max(blame.end_m, distance_m + reach_m);
    const Pixel at = project(camera, p);
    mark_disc(blame.pixels, at, reach_m * std::max(camera.fx_px, camera.fy_px) / at.z_m);
  }
  for (std::size_t i = 0; i < mask.words.size(); ++i) blame.pixels.words[i] &= ~mask.words[i];
  return blame;
}

/// Background that is connected (over edges of pixels) to the image's border: not a hole.
BitMask open_background(const BitMask& mask) {
  BitMask open(mask.width_px, mask.height_px);
  std::vector<Vec2i> front;
  const auto visit = [&](Index x, Index y) {
    if (x < 0 || y < 0 || x >= mask.width_px || y >= mask.height_px || mask(x, y) || open(x, y)) return;
    open.set(x, y);
    front.push_back({x, y});
  };
  for (Index x = 0; x < mask.width_px; ++x) {
    visit(x, 0);
    visit(x, mask.height_px - 1);
  }
  for (Index y = 0; y < mask.height_px; ++y) {
    visit(0, y);
    visit(mask.width_px - 1, y);
  }
  while (!front.empty()) {
    const Vec2i p = front.back();
    front.pop_back();
    visit(p.x - 1, p.y);
    visit(p.x + 1, p.y);
    visit(p.x, p.y - 1);
    visit(p.x, p.y + 1);
  }
  return open;
}

/// The points to fill next: all that are carved through holes within the mask; when those are few, the
/// largest region carved from its outside. Empty when both are below `least` samples.
struct NextFill {
  std::vector<Vec3f> points_m;
  bool through_holes = false;
};
NextFill choose(const Camera& camera, const BitMask& open, std::span<const std::vector<Vec3f>> regions_m,
                double least) {
  NextFill holes{{}, true}, best;
  for (const std::vector<Vec3f>& region_m : regions_m) {
    std::vector<Vec3f> inner_m, outer_m;
    for (const Vec3f point_m : region_m) {
      const Pixel at = project(camera, vec_cast<double>(point_m));
      const auto x = static_cast<Index>(std::floor(at.u_px + 0.5)),
                 y = static_cast<Index>(std::floor(at.v_px + 0.5));
      const bool is_open = open(clamp(x, 0, open.width_px - 1), clamp(y, 0, open.height_px - 1));
      (is_open ? outer_m : inner_m).push_back(point_m);
    }
    if (static_cast<double>(inner_m.size()) >= least)
      holes.points_m.insert(holes.points_m.end(), inner_m.begin(), inner_m.end());
    if (static_cast<double>(outer_m.size()) >= least && outer_m.size() > best.points_m.size())
      best.points_m = std::move(outer_m);
  }
  return holes.points_m.empty() ? best : holes;
}

bool others_keep(std::span<const Camera> cameras, std::span<const BitMask> masks, std::size_t own, Vec3d p) {
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (c == own || masks[c].words.empty()) continue;
    const Pixel at = project(cameras[c], p);
    if (!(at.z_m > 0)) continue;
    const double u = std::floor(at.u_px + 0.5), v = std::floor(at.v_px + 0.5);
    const bool seen = u >= 0 && v >= 0 && u < cameras[c].width_px && v < cameras[c].height_px;
    if (seen && !masks[c](static_cast<Index>(u), static_cast<Index>(v))) return false;
  }
  return true;
}

/// Sets the pixels to blame behind which all others keep something. Returns their number.
std::int64_t fill(std::span<const Camera> cameras, std::vector<BitMask>& masks, std::size_t own,
                  const Blame& blame, double step_m) {
  const Vec3d eye = cameras[own].center_world();
  BitMask filled(blame.pixels.width_px, blame.pixels.height_px);
  tbb::parallel_for(Index{0}, filled.height_px, [&](Index y) {
    for (Index x = 0; x < filled.width_px; ++x) {
      if (!blame.pixels(x, y)) continue;
      const Vec3d ray = pixel_ray_world(cameras[own], x, y);
      bool kept = false;
      for (double at_m = blame.begin_m; at_m <= blame.end_m && !kept; at_m += step_m)
        kept = others_keep(cameras, masks, own, eye + at_m * ray);
      if (kept) filled.set(x, y);
    }
  });
  for (std::size_t i = 0; i < filled.words.size(); ++i) masks[own].words[i] |= filled.words[i];
  return filled.area_px();
}

}  // namespace

std::vector<RepairedMask> repair_masks(ExecContext& ctx, ViewScores& scores, std::span<const ViewScore> found,
                                       std::vector<BitMask>& silhouettes, const MaskRepairOptions& options) {
  std::vector<ViewScore> now(found.begin(), found.end());
  std::vector<bool> hopeless(now.size());
  std::vector<RepairedMask> repairs;
  const std::span<const Camera> cameras = scores.cameras();
  const double spacing_m = static_cast<double>(scores.spacing_m());
  // Every turn fills at least one pixel or drops a view, and the views' regions get fewer.
  for (std::size_t turn = 0; turn < kTurnsPerView * now.size(); ++turn) {
    std::size_t worst = now.size();
    for (std::size_t c = 0; c < now.size(); ++c) {
      if (!now[c].is_suspect || hopeless[c] || silhouettes[c].words.empty()) continue;
      if (worst == now.size() || now[c].carved_alone > now[worst].carved_alone) worst = c;
    }
    if (worst == now.size()) break;
    const std::vector<std::vector<Vec3f>> regions_m = scores.carved_alone_m(ctx, static_cast<Index>(worst));
    double samples = 0;
    for (const auto& region_m : regions_m) samples += static_cast<double>(region_m.size());
    BitMask& mask = silhouettes[worst];
    const BitMask open = open_background(mask);
    const NextFill next =
        choose(cameras[worst], open, regions_m, options.least_share / now[worst].carved_alone * samples);
    Blame blame = blame_pixels(cameras[worst], mask, spacing_m, next.points_m);
    if (next.through_holes) {
      for (std::size_t i = 0; i < open.words.size(); ++i) blame.pixels.words[i] &= ~open.words[i];
    }
    const std::int64_t n = fill(cameras, silhouettes, worst, blame, spacing_m / kStepsPerSample);
    hopeless[worst] = n == 0;
    if (n == 0) continue;
    const auto same = std::find_if(repairs.begin(), repairs.end(),
                                   [&](const RepairedMask& r) { return r.camera == worst; });
    if (same == repairs.end())
      repairs.push_back({worst, n});
    else
      same->filled_px += n;
    now = scores.measure(ctx, silhouettes);
  }
  return repairs;
}

std::string repairs_text(std::span<const Camera> cameras, std::span<const RepairedMask> repairs) {
  std::string text;
  for (const RepairedMask& r : repairs) {
    text += (text.empty() ? "" : "; ") + std::to_string(r.filled_px) + " px of the mask of camera '" +
            cameras[r.camera].name + "' were filled";
  }
  return text;
}

}  // namespace tactus
