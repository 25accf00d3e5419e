#include "tactus/perception/perception_impl.h"

#include "tactus/base/error.h"
#include "tactus/base/timing.h"

namespace tactus {
namespace {

Box3f workspace_of(const Scene& scene, const Rig& rig) {
  if (const auto& box = scene.reconstruction.workspace_m)
    return {vec_cast<float>(box->min_m), vec_cast<float>(box->max_m)};
  return rig.workspace_m;
}

HullOptions hull_options(const Scene& scene, const Rig& rig) {
  if (rig.cameras.empty()) throw usage_error("the rig has no cameras: a World needs no Perception then");
  HullOptions options;
  options.workspace_m = workspace_of(scene, rig);
  options.slack_px = rig.slack_px;
  options.resolution = scene.reconstruction.resolution;
  options.depth_jump_m = static_cast<float>(scene.reconstruction.depth_jump_m);
  options.tolerated_views = scene.reconstruction.tolerated_views;
  options.min_views = scene.reconstruction.min_views;
  options.max_active_bricks = scene.reconstruction.max_active_bricks;
  options.max_vertices = scene.reconstruction.max_vertices;
  options.max_triangles = scene.reconstruction.max_triangles;
  // Contact's samples before thinning, two for each triangle of which a vertex has two: about 150 bytes each.
  options.beside_vertex_bytes = 600;
  return options;
}

/// With voxels twice as large.
HullOptions coarse(HullOptions options) {
  options.resolution = ceil_div(options.resolution, 2);
  return options;
}

std::span<const Camera> depth_cameras(const Scene& scene, const Rig& rig) {
  if (!scene.reconstruction.depth) return {};
  return rig.depth_cameras;
}

}  // namespace

Perception::Impl::Impl(DeviceSet& devices, const Scene& scene, const Rig& rig, const BodyAssets& assets,
                       bool can_reduce)
    : devices_(devices),
      workspace_m_(workspace_of(scene, rig)),
      blade_count_(scene.blades.size()),
      uses_depth_(!depth_cameras(scene, rig).empty()),
      fine_(devices, rig.cameras, depth_cameras(scene, rig),
            {.hull = hull_options(scene, rig), .smoothing_steps = scene.reconstruction.smooth}),
      coarse_(can_reduce ? std::make_unique<SurfacePipeline>(
                               devices, rig.cameras, depth_cameras(scene, rig),
                               SurfaceOptions{.hull = coarse(hull_options(scene, rig)),
                                              .smoothing_steps = scene.reconstruction.smooth})
                         : nullptr),
      hull_check_(devices.context(0), rig.cameras, workspace_m_, fine_.voxel_size_m(), uses_depth_),
      tracked_blades_(scene, assets, rig),
      clock_(scene.frame.max_dt_s, scene.frame.dt_s) {
  if (scene.reconstruction.repair_masks)
    view_scores_.emplace(devices.context(0), rig.cameras, ViewScoreOptions{.workspace_m = workspace_m_});
}

Perception::Perception(DeviceSet& devices, const Scene& scene, const Rig& rig, const BodyAssets& assets,
                       bool can_reduce)
    : impl_(std::make_unique<Impl>(devices, scene, rig, assets, can_reduce)) {}
Perception::~Perception() = default;

Observation Perception::observe(const FrameSet* frame, double dt_s) { return impl_->observe(frame, dt_s); }
std::vector<Notice> Perception::last_notices() { return impl_->last_notices(); }
const VisualHull& Perception::hull() const { return impl_->hull(); }
float Perception::voxel_size_m() const { return impl_->voxel_size_m(); }
const Box3f& Perception::workspace_m() const { return impl_->workspace_m(); }
TriangleMesh Perception::download() { return impl_->download(); }

std::unique_ptr<Perception> make_perception(DeviceSet& devices, const Scene& scene, const Rig& rig,
                                            const BodyAssets& assets, bool can_reduce) {
  if (rig.cameras.empty()) return nullptr;
  return std::make_unique<Perception>(devices, scene, rig, assets, can_reduce);
}

Observation Perception::Impl::observe(const FrameSet* frame, double dt_s) {
  const double begin_s = now_s();
  // No cone bounds a hull then: it would be all of the workspace.
  const bool is_blind =
      frame != nullptr && std::all_of(frame->silhouettes.begin(), frame->silhouettes.end(),
                                      [](const BitMask& mask) { return mask.words.empty(); });
  const FrameTimes times = clock_.next(dt_s, frame != nullptr && !is_blind);  // the World notes its notices
  Observation seen;
  seen.made_by = this;
  if (is_blind) {
    // One text for all such frames: each text is logged once.
    seen.notices.push_back({"hull.blind", Severity::warning,
                            "no camera has a silhouette; the real surface goes on with its motion",
                            "look at the cameras and the masks"});
  }
  if (frame == nullptr || is_blind) return seen;
  seen.is_new = true;
  seen.tick = frame->tick;
  seen.captured_s = frame->captured_s > 0 ? frame->captured_s : begin_s;
  seen.released_s = frame->captured_s > 0 ? frame->released_s : 0;
  frame_ = frame;
  masks_ = follow_blades(silhouettes(*frame, seen), *frame, times.dt_capture_s, seen);
  const auto tools = std::make_shared<SeenTools>();
  tools->motions = tracked_blades_.motions();
  tools->reaches = tracked_blades_.reaches();
  for (std::size_t b = 0; b < blade_count_; ++b) tools->strips.push_back(tracked_blades_.strip(b));
  seen.tools = tools;
  seen.observe_s = now_s() - begin_s;
  return seen;
}

std::span<const DepthImage> Perception::Impl::depths(const FrameSet& frame) const {
  if (!uses_depth_) return {};
  return frame.depths_m;
}

std::span<const BitMask> Perception::Impl::silhouettes(const FrameSet& frame, Observation& seen) {
  if (!view_scores_) return frame.silhouettes;
  const double begin_s = now_s();
  ExecContext& ctx = devices_.context(0);
  const std::vector<ViewScore> found = view_scores_->measure(ctx, frame.silhouettes);
  repaired_ = frame.silhouettes;
  const std::vector<RepairedMask> repairs = repair_masks(ctx, *view_scores_, found, repaired_);
  const std::string suspect = suspect_views_text(view_scores_->cameras(), found);
  if (!suspect.empty()) seen.notices.push_back({"views.suspect", Severity::warning, suspect, ""});
  if (!repairs.empty())
    seen.notices.push_back(
        {"views.repaired", Severity::warning, repairs_text(view_scores_->cameras(), repairs), ""});
  seen.times.push_back({"views", begin_s, now_s()});
  return repaired_;
}

std::span<const BitMask> Perception::Impl::follow_blades(std::span<const BitMask> masks,
                                                         const FrameSet& frame, double dt_s,
                                                         Observation& seen) {
  if (tracked_blades_.empty()) return masks;
  const double begin_s = now_s();
  masks = tracked_blades_.follow(masks, dt_s, {frame.markers, depths(frame)}, seen.notices);
  seen.times.push_back({"blades", begin_s, now_s()});
  return masks;
}

std::vector<Notice> Perception::Impl::last_notices() {
  std::vector<Notice> notices = tracked_blades_.last_notices();
  const std::vector<HullFinding> found = hull_check_.last_news();
  if (!found.empty()) notices.push_back({"hull.check", Severity::warning, findings_text(found), ""});
  return notices;
}

void Perception::Impl::prepare_check() {
  if (!is_reduced_ && frame_ != nullptr)
    hull_check_.prepare(frame_->silhouettes, tracked_blades_.empty() ? std::span<const BitMask>() : masks_);
}

HullReport Perception::Impl::report(const Readback& readback, std::vector<Notice>& notices) {
  const auto warn = [&](const char* code, const std::string& text) {
    if (!text.empty()) notices.push_back({code, Severity::warning, text, ""});
  };
  HullReport report = hull().report(readback);
  if (const auto& overflow = report.overflow)
    warn("hull.overflow", overflow->text("reconstruction." + overflow->option));
  warn("hull.depth", report.depth);
  // A hull that lacks capacity is open, which is no fault of the rig.
  if (frame_ != nullptr && !report.overflow && !is_reduced_)
    warn("hull.check", hull_check_.report(devices_.context(0)));
  frame_ = nullptr;
  return report;
}

/// Each submits the work of the fine or the coarse pipeline.
std::vector<Stage> Perception::Impl::surface_stages() {
  const auto stages_of = [this](SurfacePipeline& surface) {
    return surface.stages([this, &surface] { surface.hull().upload(masks_, depths(*frame_)); });
  };
  std::vector<Stage> stages = stages_of(fine_);
  if (!coarse_) return stages;
  const std::vector<Stage> coarse = stages_of(*coarse_);
  for (std::size_t k = 0; k < stages.size(); ++k) {
    stages[k].submit = [this, of_fine = std::move(stages[k].submit), of_coarse = coarse[k].submit](
                           BlockPlace at) { is_reduced_ ? of_coarse(at) : of_fine(at); };
  }
  return stages;
}

void Perception::Impl::add_stages(Schedule& schedule, Readback& readback) {
  for (Stage& stage : surface_stages()) schedule.add(std::move(stage));
  schedule.add({.name = "hull/check",
                .timed_as = "check",
                .rate = Rate::capture,
                .reads = {VisualHull::kMesh},
                .submit = [this](BlockPlace) {
                  if (!is_reduced_) hull_check_.measure(devices_.context(0), fine_.hull().mesh());
                }});
  fine_.hull().add_reports(readback);
  if (coarse_) coarse_->hull().add_reports(readback);
}

}  // namespace tactus
