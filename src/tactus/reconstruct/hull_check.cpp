#include "tactus/reconstruct/hull_check.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/bits.h"
#include "tactus/base/error.h"

namespace tactus {
namespace {

/// A tile is as wide as this part of the image, and at least as wide as so many voxels: then the vertices of
/// a surface that covers it leave none out (a full image has 8192 / (40 * 30) = 7 vertices a tile).
constexpr double kTilesAlong = 40, kVoxelsInTile = 2.5;
/// With fewer tiles the share of those covered means little.
constexpr Index kLeastTiles = 12;
/// Share of the surface that few cameras see from which its pieces are looked at, and how often.
constexpr double kSuspectSurface = 0.02;
constexpr Index kTicksBetweenPieces = 64;

/// The ray through a pixel meets the box.
bool meets(const Camera& camera, double u_px, double v_px, const Box3f& box) {
  const Vec3d from = camera.center_world(), ray = pixel_ray_world(camera, u_px, v_px);
  double enter = 0, leave = 1e30;
  for (int i = 0; i < 3; ++i) {
    const double low = (static_cast<double>(box.min[i]) - from[i]) / ray[i],
                 high = (static_cast<double>(box.max[i]) - from[i]) / ray[i];
    if (ray[i] == 0) {
      if (from[i] < static_cast<double>(box.min[i]) || from[i] > static_cast<double>(box.max[i]))
        return false;
      continue;
    }
    enter = std::max(enter, std::min(low, high));
    leave = std::min(leave, std::max(low, high));
  }
  return enter <= leave;
}

}  // namespace

HullCheck::HullCheck(ExecContext& ctx, std::span<const Camera> cameras, const Box3f& workspace_m,
                     float voxel_size_m)
    : cameras_(cameras.begin(), cameras.end()), workspace_m_(workspace_m) {
  const float near_m = 0.5F * voxel_size_m;
  low_m_ = workspace_m.min + Vec3f{near_m, near_m, near_m};
  high_m_ = workspace_m.max - Vec3f{near_m, near_m, near_m};
  const Vec3d middle = 0.5 * vec_cast<double>(workspace_m.min + workspace_m.max);
  Index words = 0;
  for (const Camera& camera : cameras) {
    check_camera(camera);
    const Mat3d KR = camera.intrinsics() * camera.T_cam_world.R;
    const Vec3d Kt = camera.intrinsics() * camera.T_cam_world.t;
    CheckCamera c{};
    for (int i = 0; i < 3; ++i) {
      c.row[i] = vec_cast<float>(KR.row[i]);
      c.offset[i] = static_cast<float>(Kt[i]);
    }
    c.width_px = camera.width_px;
    c.height_px = camera.height_px;
    const double distance_m = std::max(length(camera.center_world() - middle), 1e-6);
    const double voxel_px = camera.fx_px * static_cast<double>(voxel_size_m) / distance_m;
    const double wide = std::max(camera.width_px / kTilesAlong, kVoxelsInTile * voxel_px);
    const auto tile_px = static_cast<Index>(clamp(std::ceil(wide), 4.0, camera.width_px / 4.0 + 4));
    tile_px_.push_back(tile_px);
    c.tiles_per_px = 1.F / static_cast<float>(tile_px);
    // A quotient may round up to the next tile at the far edge.
    c.tiles_x = ceil_div(camera.width_px, tile_px) + 1;
    c.word_begin = words;
    words += ceil_div(c.tiles_x * (ceil_div(camera.height_px, tile_px) + 1), 32);
    layout_.push_back(c);
  }
  find_workspace_tiles();
  mask_tiles_.resize(static_cast<std::size_t>(words));
  Device& device = ctx.device();
  device_cameras_ = to_device(ctx, layout_);
  tiles_ = Buffer<std::uint32_t>(device, words);
  sums_ = Buffer<CheckSums>(device, 1);
  covered_ = HostBuffer<std::uint32_t>(device, words);
  host_sums_ = HostBuffer<CheckSums>(device, 1);
  vertices_ = HostBuffer<Index>(device, 1);
}

void HullCheck::find_workspace_tiles() {
  const CheckCamera& last = layout_.back();
  const Index rows = ceil_div(last.height_px, tile_px_.back()) + 1;
  in_workspace_.resize(static_cast<std::size_t>(last.word_begin + ceil_div(last.tiles_x * rows, 32)));
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const Index px = tile_px_[c];
    const CheckCamera& camera = layout_[c];
    for (Index y = 0; y < camera.height_px / px; ++y) {
      for (Index x = 0; x < camera.width_px / px; ++x) {
        const Index tile = y * camera.tiles_x + x;
        const bool seen = meets(cameras_[c], (x + 0.5) * px - 0.5, (y + 0.5) * px - 0.5, workspace_m_);
        if (seen)
          in_workspace_[static_cast<std::size_t>(camera.word_begin + (tile >> 5))] |= 1U << (tile & 31);
      }
    }
  }
}

/// A tile counts when its four quarter points are set and it lies in the image of the workspace.
void HullCheck::take_mask(std::size_t number, const BitMask& mask) {
  const Index px = tile_px_[number], quarter = px / 4;
  const CheckCamera& c = layout_[number];
  if (mask.width_px != c.width_px || mask.height_px != c.height_px) return;
  for (Index y = 0; y < c.height_px / px; ++y) {
    for (Index x = 0; x < c.width_px / px; ++x) {
      const Index left = x * px + quarter, top = y * px + quarter, right = (x + 1) * px - 1 - quarter,
                  bottom = (y + 1) * px - 1 - quarter, tile = y * c.tiles_x + x;
      const std::uint32_t set =
          mask(left, top) && mask(right, top) && mask(left, bottom) && mask(right, bottom);
      mask_tiles_[static_cast<std::size_t>(c.word_begin + (tile >> 5))] |= set << (tile & 31);
    }
  }
}

/// Of each mask, what lies in the image of the workspace; whether most masks have something there. (A camera
/// that does not look at the workspace at all can't miss anything in it.)
void HullCheck::find_content(std::span<const BitMask> given) {
  Index masks = 0, with_content = 0;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (given[c].words.empty()) continue;
    std::uint32_t any = 0, inside = 0, watched = 0;
    for (std::size_t w = begin_of(c); w < begin_of(c + 1); ++w) {
      any |= mask_tiles_[w];
      mask_tiles_[w] &= in_workspace_[w];
      inside |= mask_tiles_[w];
      watched |= in_workspace_[w];
    }
    ++masks;
    with_content += inside != 0 || (any != 0 && watched == 0) ? 1 : 0;
  }
  something_seen_ = 2 * with_content > masks;
}

void HullCheck::prepare(std::span<const BitMask> given) {
  if (given.size() != cameras_.size())
    throw Error("hull check: " + std::to_string(given.size()) + " masks for " +
                std::to_string(cameras_.size()) + " cameras");
  std::fill(mask_tiles_.begin(), mask_tiles_.end(), 0U);
  for (std::size_t c = 0; c < given.size(); ++c) take_mask(c, given[c]);
  find_content(given);
}

void HullCheck::measure(ExecContext& ctx, const DeviceMesh& mesh) {
  mesh_ = mesh;
  ctx.fill_bytes(tiles_.view(), 0);
  ctx.fill_bytes(sums_.view(), 0);
  const View<const Index> count(&mesh.counts.data()->vertices, 1);
  ctx.parallel_for("check/tiles", kSamples / MarkTiles::kThreads,
                   MarkTiles{device_cameras_.const_view(), mesh.positions_m, count, kSamples, low_m_, high_m_,
                             few_cameras(cameras_.size()), tiles_.view(), sums_.view()});
  ctx.download(tiles_.const_view(), covered_.span());
  ctx.download(sums_.const_view(), host_sums_.span());
  ctx.download(count, vertices_.span());
}

HullQuality HullCheck::quality(ExecContext& ctx) {
  ctx.synchronize();
  HullQuality q;
  q.vertices = *vertices_.data();
  q.something_seen = something_seen_;
  const CheckSums sums = *host_sums_.data();
  seen_by_few_ = static_cast<double>(sums.seen_by_few) / std::max(sums.looked_at, 1U);
  q.on_faces = static_cast<double>(sums.on_faces) / std::max(sums.looked_at, 1U);
  q.views.resize(cameras_.size());
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    Index set = 0, common = 0;
    for (std::size_t w = begin_of(c); w < begin_of(c + 1); ++w) {
      set += popcount(mask_tiles_[w]);
      common += popcount(mask_tiles_[w] & covered_.data()[w]);
    }
    if (set < kLeastTiles) continue;
    q.views[c].is_used = true;
    q.views[c].recall = q.views[c].iou = static_cast<double>(common) / set;
  }
  return q;
}

/// Pieces are sorted out on the host, so only where a part of the surface is seen by few, and seldom.
std::vector<HullFinding> HullCheck::pieces(ExecContext& ctx, const HullQuality& q) {
  if (seen_by_few_ < kSuspectSurface || --ticks_to_pieces_ > 0) return {};
  ticks_to_pieces_ = kTicksBetweenPieces;
  TriangleMesh mesh;
  mesh.positions_m = to_host(ctx, mesh_.positions_m.part(0, std::min(q.vertices, mesh_.positions_m.size())));
  const PartCounts counts = to_host(ctx, mesh_.counts)[0];
  for (const Vec3i t :
       to_host(ctx, mesh_.triangles.part(0, std::min(counts.triangles, mesh_.triangles.size()))))
    if (max(t.x, max(t.y, t.z)) < std::ssize(mesh.positions_m)) mesh.triangles.push_back({t.x, t.y, t.z});
  return find_pieces_seen_by_few(cameras_, mesh, few_cameras(cameras_.size()));
}

std::vector<HullFinding> HullCheck::news(ExecContext& ctx) {
  const HullQuality q = quality(ctx);
  std::vector<HullFinding> all = judge_hull(cameras_, q, workspace_m_);
  if (!any_fatal(all)) {
    const std::vector<HullFinding> found = pieces(ctx, q);
    all.insert(all.end(), found.begin(), found.end());
  }
  std::vector<HullFinding> fresh;
  for (const HullFinding& f : all) {
    const bool known = std::any_of(told_.begin(), told_.end(), [&](const HullFinding& t) {
      return t.fault == f.fault && t.camera == f.camera;
    });
    if (!known) fresh.push_back(f);
  }
  told_.insert(told_.end(), fresh.begin(), fresh.end());
  was_well_ |= q.something_seen && !any_fatal(all);
  return fresh;
}

std::string HullCheck::tell(ExecContext& ctx) {
  const bool was_well = was_well_;
  const std::vector<HullFinding> found = news(ctx);
  if (any_fatal(found) && !was_well) throw Error(findings_text(found));
  return findings_text(found);
}

}  // namespace tactus
