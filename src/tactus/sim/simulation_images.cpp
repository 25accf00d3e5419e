// A frame's input from images, its meshes for pictures, and the reductions made on demand.
#include <algorithm>

#include "tactus/sim/blade_mesh.h"
#include "tactus/sim/simulation.h"

namespace tactus {

std::span<const DepthImage> Simulation::depths(const FrameSet& frame) const {
  if (!uses_depth_) return {};
  return frame.depths_m;
}

std::span<const BitMask> Simulation::silhouettes(const FrameSet& frame, std::vector<Notice>& notices) {
  if (!view_scores_) return frame.silhouettes;
  const StageTimer timer(timings_, "views");
  ExecContext& ctx = devices_.context(0);
  const std::vector<ViewScore> found = view_scores_->measure(ctx, frame.silhouettes);
  repaired_ = frame.silhouettes;
  const std::vector<RepairedMask> repairs = repair_masks(ctx, *view_scores_, found, repaired_);
  const std::string suspect = suspect_views_text(view_scores_->cameras(), found);
  if (!suspect.empty()) notices.push_back({"views.suspect", Severity::warning, suspect, ""});
  if (!repairs.empty())
    notices.push_back(
        {"views.repaired", Severity::warning, repairs_text(view_scores_->cameras(), repairs), ""});
  return repaired_;
}

std::span<const BitMask> Simulation::follow_blades(std::span<const BitMask> masks, const FrameSet& frame,
                                                   double dt_s, std::vector<Notice>& notices) {
  if (tracked_blades_.empty()) return masks;
  const StageTimer timer(timings_, "blades");
  return tracked_blades_.follow(masks, dt_s, {frame.markers, depths(frame)}, notices);
}

void Simulation::move_tools(const FrameTimes& times, bool has_new_images) {
  if (moving_obstacles_.empty() && (tracked_blades_.empty() || !has_new_images)) return;
  moving_obstacles_.begin_frame(times.dt_s, clock_.simulated_s(), times.surface_age_s + times.dt_s);
  std::vector<ToolMotion> motions = moving_obstacles_.motions();
  const std::vector<ToolMotion> blades = tracked_blades_.motions();
  motions.insert(motions.end(), blades.begin(), blades.end());
  world_.move_tools(motions);
  tool_speeds_.clear();
  for (const Reach& r : moving_obstacles_.reaches()) tool_speeds_.push_back(r);
  for (const Reach& r : tracked_blades_.reaches()) tool_speeds_.push_back(r);
  if (!has_surface_) component_speeds_.clear();
  component_speeds_.insert(component_speeds_.end(), tool_speeds_.begin(), tool_speeds_.end());
}

FrameSnapshot Simulation::snapshot() {
  FrameSnapshot snapshot;
  snapshot.tick = tick_;
  snapshot.captured_s = captured_s_;
  ExecContext& ctx = devices_.context(0);
  if (has_surface_) snapshot.real = surface().download();
  for (const auto& body : bodies_) snapshot.bodies.push_back(body->surface(ctx));
  snapshot.obstacles = moving_obstacles_.meshes();
  snapshot.blades = tracked_blades_.meshes();
  snapshot.tools = tracked_blades_.axes();
  for (TriangleMesh& blade : scripted_blades(scene_, clock_.simulated_s()))
    snapshot.blades.push_back(std::move(blade));
  if (liquid_) snapshot.liquid_m = liquid_->positions_m();
  return snapshot;
}

std::vector<Notice> Simulation::last_notices() {
  std::vector<Notice> notices = tracked_blades_.last_notices();
  const std::vector<HullFinding> found = hull_check_.last_news();
  if (!found.empty()) notices.push_back({"hull.check", Severity::warning, findings_text(found), ""});
  return notices;
}

std::vector<QualityReduction> Simulation::quality_reductions() const {
  std::vector<QualityReduction> all;
  if (!coarse_surface_) return all;
  all.push_back(QualityReduction::hull);
  if (liquid_ && liquid_->can_be_reduced()) all.push_back(QualityReduction::liquid);
  // The paper's response sums over samples, whose volumes belong to their spacing.
  if (scene_.contact.response != ContactResponse::paper) all.push_back(QualityReduction::samples);
  return all;
}

void Simulation::reduce_quality(std::span<const QualityReduction> quality_reductions) {
  reductions_asked_ = 0;
  for (const QualityReduction s : quality_reductions) {
    const std::vector<QualityReduction> can = this->quality_reductions();
    if (std::find(can.begin(), can.end(), s) != can.end())
      reductions_asked_ |= 1U << static_cast<unsigned>(s);
  }
}

/// Sets up the reductions that the coming frame's stages make.
void Simulation::begin_quality() {
  if (reductions_made_ == reductions_asked_) return;
  reductions_made_ = reductions_asked_;
  world_.set_coarseness(is_reduced(QualityReduction::samples) ? 2 : 1);
  if (liquid_) liquid_->reduce_quality(is_reduced(QualityReduction::liquid));
  schedule_.select(reductions_made_ >> 1);
}

/// From the capture to the end of the frame; of live images by stages, too.
void Simulation::note_latency() {
  const double now = now_s();
  timings_.add("latency", captured_s_, now);
  if (!(released_s_ > 0)) return;
  timings_.add("capture to set", captured_s_, released_s_);
  timings_.add("set to hull", released_s_, meshed_s_);
  timings_.add("hull to bodies", meshed_s_, now);
}

void Simulation::note_shown() {
  if (released_s_ > 0) timings_.add("capture to snapshot", captured_s_, now_s());
}

/// Stages of the real surface: each submits the work of the fine or the coarse pipeline, as the
/// reductions say.
std::vector<Stage> Simulation::surface_stages() {
  const auto stages_of = [this](SurfacePipeline& surface) {
    return surface.stages([this, &surface] { surface.hull().upload(masks_, depths(*incoming_)); });
  };
  std::vector<Stage> stages = stages_of(fine_surface_);
  if (!coarse_surface_) return stages;
  const std::vector<Stage> coarse = stages_of(*coarse_surface_);
  for (std::size_t k = 0; k < stages.size(); ++k) {
    stages[k].submit = [this, of_fine = std::move(stages[k].submit),
                        of_coarse = coarse[k].submit](BlockPlace at) {
      is_reduced(QualityReduction::hull) ? of_coarse(at) : of_fine(at);
    };
  }
  return stages;
}

/// Adds the stages that make the real surface of new images.
void Simulation::add_surface_stages(StageDevices touching) {
  if (!is_filmed_)  // contact reads a surface that has no component
    return schedule_.add({.name = "surface/none",
                          .timed_as = "surface",
                          .rate = Rate::capture,
                          .writes = {"surface/samples"},
                          .submit = [](BlockPlace) {}});
  ExecContext& ctx = devices_.context(0);
  for (Stage& stage : surface_stages()) schedule_.add(std::move(stage));
  schedule_.add({.name = "hull/check",
                 .timed_as = "check",
                 .rate = Rate::capture,
                 .reads = {VisualHull::kMesh},
                 .submit = [this, &ctx](BlockPlace) {
                   if (!is_reduced(QualityReduction::hull))
                     hull_check_.measure(ctx, fine_surface_.hull().mesh());
                 }});
  schedule_.add({.name = "surface/update",
                 .timed_as = "surface",
                 .rate = Rate::capture,
                 .devices = touching,
                 .writes = {"surface/samples"},
                 .reads = {VisualHull::kMesh},
                 .submit = [this](BlockPlace) { world_.update(surface().surface(), schedule_.frame()); }});
}

}  // namespace tactus
