#include "tactus/reconstruct/hull_check.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tactus/base/bits.h"
#include "tactus/base/error.h"
#include "tactus/base/math.h"
#include "tactus/geom/image/mask_cleaning.h"
#include "tactus/geom/image/mask_metrics.h"
#include "tactus/geom/image/rasterize.h"
#include "tactus/reconstruct/doctor/frontier_points.h"
#include "tactus/reconstruct/doctor/rig_doctor.h"
#include "tactus/reconstruct/doctor/workspace_from_cones.h"

namespace tactus {
namespace {

/// A tile is as wide as this part of the image, and at least as wide as so many voxels: then the vertices of
/// a surface that covers it leave none out (a full image has 8192 / (40 * 30) = 7 vertices a tile).
constexpr double kTilesAlong = 40, kVoxelsInTile = 2.5;
/// With fewer tiles the share of those covered means little.
constexpr Index kLeastTiles = 12;
/// Share of the surface that few cameras see from which its components are looked at.
constexpr double kSuspectSurface = 0.02;
/// Recall of the tiles below which the host measures: of the worst view, of all. Tiles flatter thin hulls.
constexpr double kSuspectRecall = 0.93, kSuspectMean = 0.95;
constexpr Index kMostTicksToHost = 4096;
/// The findings of the host come so many ticks later, however fast it is: then a run has them in the same
/// frame on every machine.
constexpr Index kTicksToAnswer = 8;
/// A mask with fewer pixels says little about its view.
constexpr std::int64_t kLeastPixels = 100;

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

/// Share of a mask that a grid of such voxels may lose: parts thinner than the grid vanish. With the mean
/// thickness t = 2 area / perimeter in voxels, right rigs of the built-in figures lost 0.14 (t = 3), 0.05
/// (4.6), 0.03 (6) and 0.016 (9): below 1.5 / t^2.
double share_too_thin(const BitMask& mask, double voxel_px) {
  BitMask inner = mask;
  MaskCleaner(mask.width_px, mask.height_px).erode(inner, 1);
  const auto area = static_cast<double>(mask.area_px()),
             perimeter = area - static_cast<double>(inner.area_px());
  const double thickness = 2 * area / std::max(perimeter, 1.0) / std::max(voxel_px, 1e-6);
  return std::min(1.5 / sqr(thickness), 0.5);
}

/// @throws Error when one is fatal and no frame before was well.
std::string texts_of(std::span<const HullFinding> found, bool was_well) {
  if (any_fatal(found) && !was_well) throw Error(findings_text(found));
  return findings_text(found);
}

}  // namespace

HullCheck::HullCheck(ExecContext& ctx, std::span<const Camera> cameras, const Box3f& workspace_m,
                     float voxel_size_m, bool has_depth)
    : cameras_(cameras.begin(), cameras.end()), workspace_m_(workspace_m), has_depth_(has_depth) {
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
    voxel_px_.push_back(voxel_px);
    c.tiles_per_px = 1.F / static_cast<float>(tile_px);
    // A quotient may round up to the next tile at the far edge.
    c.tiles_x = ceil_div(camera.width_px, tile_px) + 1;
    c.word_begin = words;
    words += ceil_div(c.tiles_x * (ceil_div(camera.height_px, tile_px) + 1), 32);
    layout_.push_back(c);
  }
  find_workspace_tiles();
  content_.resize(cameras_.size());
  given_.resize(cameras_.size());
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

/// Counts the set tiles of each mask and clears those outside of the workspace's image; finds whether most
/// masks have something there. (A camera that does not look at the workspace at all can't miss anything in
/// it.)
void HullCheck::find_content() {
  Index masks = 0, with_content = 0;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    content_[c] = {};
    if (given_[c].words.empty()) continue;
    std::uint32_t watched = 0;
    for (std::size_t w = begin_of(c); w < begin_of(c + 1); ++w) {
      content_[c].tiles += popcount(mask_tiles_[w]);
      mask_tiles_[w] &= in_workspace_[w];
      content_[c].within += popcount(mask_tiles_[w]);
      watched |= in_workspace_[w];
    }
    ++masks;
    with_content += content_[c].within != 0 || (content_[c].tiles != 0 && watched == 0) ? 1 : 0;
  }
  something_seen_ = 2 * with_content > masks;
}

void HullCheck::prepare(std::span<const BitMask> given, std::span<const BitMask> carved) {
  if (given.size() != cameras_.size())
    throw Error("hull check: " + std::to_string(given.size()) + " masks for " +
                std::to_string(cameras_.size()) + " cameras");
  has_tools_ = false;
  for (std::size_t c = 0; c < carved.size(); ++c) has_tools_ |= carved[c] != given[c];
  taken_tiles_.assign(mask_tiles_.size(), 0U);
  if (has_tools_) {
    std::fill(mask_tiles_.begin(), mask_tiles_.end(), 0U);
    for (std::size_t c = 0; c < carved.size(); ++c) take_mask(c, carved[c]);
    taken_tiles_ = mask_tiles_;
  }
  std::fill(mask_tiles_.begin(), mask_tiles_.end(), 0U);
  for (std::size_t c = 0; c < given.size(); ++c) {
    given_[c] = given[c];
    take_mask(c, given[c]);
  }
  for (std::size_t w = 0; w < mask_tiles_.size() && has_tools_; ++w)
    taken_tiles_[w] = mask_tiles_[w] & ~taken_tiles_[w];
  find_content();
}

void HullCheck::measure(ExecContext& ctx, const MeshView& mesh) {
  mesh_ = mesh;
  ctx.fill_bytes(tiles_.view(), 0);
  ctx.fill_bytes(sums_.view(), 0);
  const View<const Index> count(mesh.vertex_count.device_count, 1);
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
  if (has_tools_) q.vertices = std::max(q.vertices, Index{1});  // all may be a tool
  q.something_seen = something_seen_;
  const CheckSums sums = *host_sums_.data();
  seen_by_few_ = static_cast<double>(sums.seen_by_few) / std::max(sums.looked_at, 1U);
  q.on_faces = static_cast<double>(sums.on_faces) / std::max(sums.looked_at, 1U);
  q.views.resize(cameras_.size());
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    ViewQuality& view = q.views[c];
    const Content content = content_[c];
    view.looks_elsewhere = content.tiles >= kLeastTiles && content.within == 0;
    if (content.within < kLeastTiles) continue;
    Index common = 0;
    for (std::size_t w = begin_of(c); w < begin_of(c + 1); ++w)
      common += popcount(mask_tiles_[w] & (covered_.data()[w] | taken_tiles_[w]));
    view.is_used = true;
    view.recall = view.iou = static_cast<double>(common) / content.within;
    view.outside = 1 - static_cast<double>(content.within) / content.tiles;
  }
  return q;
}

TriangleMesh HullCheck::to_host_mesh(ExecContext& ctx) const {
  TriangleMesh mesh;
  const Index vertices = std::min(*vertices_.data(), mesh_.positions_m.size());
  mesh.positions_m = to_host(ctx, mesh_.positions_m.part(0, vertices));
  const Index triangles = to_host(ctx, View<const Index>(mesh_.triangle_count.device_count, 1))[0];
  for (const Vec3i t : to_host(ctx, mesh_.triangles.part(0, std::min(triangles, mesh_.triangles.size()))))
    if (max(t.x, max(t.y, t.z)) < std::ssize(mesh.positions_m)) mesh.triangles.push_back({t.x, t.y, t.z});
  return mesh;
}

/// The mask where its tiles lie in the image of the workspace.
BitMask HullCheck::within_workspace(std::size_t number, BitMask mask) const {
  const CheckCamera& c = layout_[number];
  const Index px = tile_px_[number];
  for (Index y = 0; y < mask.height_px; ++y) {
    for (Index x = 0; x < mask.width_px; ++x) {
      const Index tile = y / px * c.tiles_x + x / px;
      const std::uint32_t word = in_workspace_[static_cast<std::size_t>(c.word_begin + (tile >> 5))];
      if ((word >> (tile & 31) & 1U) == 0) mask.clear(x, y);
    }
  }
  return mask;
}

void HullCheck::measure_exactly(Exam& exam) const {
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (exam.given[c].words.empty()) continue;
    const BitMask mask = within_workspace(c, exam.given[c]);
    ViewQuality& view = exam.quality.views[c];
    if (mask.area_px() < kLeastPixels) continue;
    const BitMask seen = render_silhouette(exam.mesh, cameras_[c]);
    view.is_used = true;
    view.recall = recall(seen, mask);
    view.iou = iou(seen, mask);
    view.too_thin = share_too_thin(mask, voxel_px_[c]);
  }
}

/// A tool that was taken out leaves next to nothing of thin masks, however right the rig is.
void HullCheck::measure_whole_masks(Exam& exam) const {
  constexpr int kLattice = 96;
  std::vector<BitMask> masks;
  for (std::size_t c = 0; c < cameras_.size(); ++c)
    masks.push_back(exam.given[c].words.empty() ? BitMask() : within_workspace(c, exam.given[c]));
  std::vector<SeenView> views;
  std::vector<std::size_t> of;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (masks[c].words.empty() || masks[c].area_px() < kLeastPixels) continue;
    views.push_back({cameras_[c], &masks[c]});
    of.push_back(c);
  }
  const std::optional<ConeBox> cones = workspace_from_cones(cameras_, masks);
  std::vector<double> recalls(views.size(), 0);
  if (cones) {
    const Box3f box{max(cones->box_m.min, workspace_m_.min), min(cones->box_m.max, workspace_m_.max)};
    const Vec3f extent = box.extent();
    if (extent.x > 0 && extent.y > 0 && extent.z > 0)
      recalls = SilhouetteConsistency(box, views, kLattice).recalls();
  }
  for (std::size_t v = 0; v < views.size(); ++v) {
    ViewQuality& view = exam.quality.views[of[v]];
    view.is_used = true;
    view.recall = view.iou = recalls[v];
  }
}

/// A recall that a thin hull may not have, or a mask that tiles can't tell about.
bool HullCheck::is_doubtful(const HullQuality& q) const {
  double mean = 0, least = 1;
  Index used = 0, unused = 0;
  for (std::size_t c = 0; c < q.views.size(); ++c) {
    unused += !q.views[c].is_used && content_[c].tiles > 0 ? 1 : 0;
    if (!q.views[c].is_used) continue;
    ++used;
    mean += q.views[c].recall;
    least = std::min(least, q.views[c].recall);
  }
  return unused > 0 || least < kSuspectRecall || mean < kSuspectMean * used;
}

void HullCheck::examine(Exam& exam) const {
  if (exam.exactly) exam.has_tools ? measure_whole_masks(exam) : measure_exactly(exam);
  exam.found = judge_hull(cameras_, exam.quality, workspace_m_);
  if (exam.is_first) name_cause(exam);
  if (!exam.has_phantoms || any_fatal(exam.found)) return;
  for (HullFinding& component :
       find_components_seen_by_few(cameras_, exam.mesh, few_cameras(cameras_.size())))
    exam.found.push_back(std::move(component));
}

/// Once, of cameras that have a mask.
void HullCheck::find_bounds(Exam& exam) {
  if (bounds_reported_ || has_depth_ || exam.mesh.positions_m.empty() || any_fatal(exam.found)) return;
  std::vector<Camera> used;
  for (std::size_t c = 0; c < cameras_.size(); ++c)
    if (!exam.given[c].words.empty()) used.push_back(cameras_[c]);
  bounds_reported_ = true;
  if (std::optional<HullFinding> bad = find_bad_bounds(used, exam.mesh.positions_m)) {
    // The workspace is not at fault where it cuts space that no camera bounds.
    std::erase_if(exam.found, [](const HullFinding& f) { return f.fault == HullFault::cut_by_workspace; });
    exam.found.push_back(std::move(*bad));
  }
}

/// Once, of a hull that nothing else is said of: focal lengths that are wrong alike leave a hull that fits.
void HullCheck::find_focal_lengths(Exam& exam) {
  if (focal_asked_ || !exam.found.empty() || exam.has_tools || exam.mesh.positions_m.empty()) return;
  focal_asked_ = true;
  std::vector<SeenView> views;
  std::vector<Camera> cameras;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (exam.given[c].words.empty() || exam.given[c].area_px() < kLeastPixels) continue;
    views.push_back({cameras_[c], &exam.given[c]});
    cameras.push_back(cameras_[c]);
  }
  if (const std::optional<FocalFit> fit = better_focal_lengths(views))
    exam.found.push_back(
        {HullFault::focal_length, -1, false, fit->text(cameras) + "; `tactus doctor RIG` says more"});
}

/// Where the masks contradict the rig, one slip of all calibrations may explain it, as the doctor would.
void HullCheck::name_cause(Exam& exam) const {
  for (HullFinding& finding : exam.found) {
    if (finding.camera >= 0 || finding.fault == HullFault::cut_by_workspace) continue;
    if (const std::string cause = common_slip({cameras_, {exam.given}, workspace_m_}); !cause.empty())
      finding.text += ": " + cause;
    return;
  }
}

/// Notes whether the rig was ever right.
std::vector<HullFinding> HullCheck::take(Exam& exam) {
  find_bounds(exam);
  find_focal_lengths(exam);
  cause_asked_ |= !exam.found.empty();
  if (!any_fatal(exam.found)) was_well_ |= exam.quality.something_seen;
  return std::move(exam.found);
}

/// @param is_reduced a frame has no time: the host measures the first one at once, then those in doubt beside
/// the frames that follow, and these more and more seldom
std::vector<HullFinding> HullCheck::find(ExecContext& ctx, bool is_reduced) {
  Exam exam{.quality = quality(ctx),
            .has_phantoms = seen_by_few_ >= kSuspectSurface && cameras_.size() > 2,
            .has_tools = has_tools_,
            .is_first = !cause_asked_};
  if (is_reduced && waiting_) {
    if (--ticks_to_answer_ > 0) return {};
    worker_.finish();
    return take(*std::exchange(waiting_, nullptr));
  }
  exam.exactly = !is_reduced || host_interval_ == 1 || is_doubtful(exam.quality);
  const bool on_host =
      exam.quality.something_seen && exam.quality.vertices > 0 && (exam.exactly || exam.has_phantoms);
  if (!on_host) {
    exam.exactly = exam.has_phantoms = false;
    exam.given = given_;
    examine(exam);
    return take(exam);
  }
  if (is_reduced && --ticks_to_host_ > 0) return {};  // a doubt is no finding
  const bool at_once = !is_reduced || host_interval_ == 1;
  ticks_to_host_ = host_interval_;
  host_interval_ = std::min(2 * host_interval_, kMostTicksToHost);
  exam.mesh = to_host_mesh(ctx);
  exam.given = given_;
  if (at_once) {
    examine(exam);
    return take(exam);
  }
  waiting_ = std::make_unique<Exam>(std::move(exam));
  ticks_to_answer_ = kTicksToAnswer;
  worker_.add([this] { examine(*waiting_); });
  return {};
}

std::vector<HullFinding> HullCheck::fresh(const std::vector<HullFinding>& found) {
  std::vector<HullFinding> fresh;
  for (const HullFinding& f : found) {
    const bool known = std::any_of(reported_.begin(), reported_.end(), [&](const HullFinding& t) {
      return t.fault == f.fault && t.camera == f.camera;
    });
    if (!known) fresh.push_back(f);
  }
  reported_.insert(reported_.end(), fresh.begin(), fresh.end());
  return fresh;
}

std::vector<HullFinding> HullCheck::news(ExecContext& ctx) { return fresh(find(ctx, true)); }

std::vector<HullFinding> HullCheck::last_news() {
  if (!waiting_) return {};
  worker_.finish();
  return fresh(take(*std::exchange(waiting_, nullptr)));
}

std::string HullCheck::report(ExecContext& ctx) {
  const bool was_well = was_well_;
  return texts_of(news(ctx), was_well);
}

std::string HullCheck::judge(ExecContext& ctx) {
  const bool was_well = was_well_;
  return texts_of(find(ctx, false), was_well);
}

}  // namespace tactus
