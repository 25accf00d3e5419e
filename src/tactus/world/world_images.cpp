// Images and tools that come into a frame, meshes for pictures, and the reductions made on demand.
#include <algorithm>
#include <utility>

#include "tactus/base/error.h"
#include "tactus/sim/blade_mesh.h"
#include "tactus/sim/body/body_cuts.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/world/world_impl.h"

namespace tactus {

void World::Impl::set_surface(Observation observation) {
  if (perception_ == nullptr)
    throw usage_error("a World without a Perception has no real surface: give it one when it is constructed");
  if (observation.made_by != &perception_->impl())
    throw usage_error("set_surface: the observation is not of this World's Perception");
  if (!observation.is_new) {
    std::move(observation.notices.begin(), observation.notices.end(), std::back_inserter(start_notices_));
    return;
  }
  seen_ = std::move(observation);
  if (seen_.tools != nullptr) tools_ = *seen_.tools;
}

/// Takes over the observation. @returns whether images are new.
bool World::Impl::begin_images(StepReport& report) {
  if (!std::exchange(seen_.is_new, false)) return false;
  begin_quality();
  has_surface_ = true;
  is_shown_ = false;
  for (const HostTime& time : seen_.times) timings_.add(time.stage, time.begin_s, time.end_s);
  std::move(seen_.notices.begin(), seen_.notices.end(), std::back_inserter(report.notices));
  return true;
}

void World::Impl::set_pose(const std::string& tool, const Rigidd& T_world_tool, bool at_once) {
  const std::vector<std::string> held = held_names(scene_);
  if (std::find(held.begin(), held.end(), tool) == held.end())
    throw usage_error("'" + tool + "' is no obstacle or blade with 'held: true'" +
                      (held.empty() ? "; the scene has none" : suggestion(tool, held)));
  if (held_blades_.has(tool))
    held_blades_.set_pose(tool, T_world_tool, at_once);
  else
    moving_obstacles_.set_pose(tool, T_world_tool, at_once);
}

Rigidd World::Impl::pose(const std::string& tool) const {
  return held_blades_.has(tool) ? held_blades_.pose(tool) : moving_obstacles_.pose(tool);
}

void World::Impl::move_tools(const FrameTimes& times, bool has_new_images) {
  held_blades_.begin_frame(!(times.dt_s > 0));
  if (moving_obstacles_.empty() && (tools_.motions.empty() || !has_new_images)) return;
  if (liquid_) liquid_->place_obstacles(moving_obstacles_.poses());
  moving_obstacles_.begin_frame(times.dt_s, clock_.simulated_s(), times.surface_age_s + times.dt_s);
  std::vector<ToolMotion> motions = moving_obstacles_.motions();
  motions.insert(motions.end(), tools_.motions.begin(), tools_.motions.end());
  colliders_.move_tools(motions);
  tool_speeds_.clear();
  for (const Reach& r : moving_obstacles_.reaches()) tool_speeds_.push_back(r);
  for (const Reach& r : tools_.reaches) tool_speeds_.push_back(r);
  if (!has_surface_) component_speeds_.clear();
  component_speeds_.insert(component_speeds_.end(), tool_speeds_.begin(), tool_speeds_.end());
}

namespace {

CutWalls cut_walls(const SoftBody& body) {
  CutWalls walls;
  if (body.cuts() == nullptr || body.cuts()->cutter().surface().wall_area() <= 0) return walls;
  const cut::BodyCutter& cutter = body.cuts()->cutter();
  const CubeLattice& lattice = cutter.lattice().lattice();
  const cut::CutSurface& surface = cutter.surface();
  walls.spacing_m = lattice.spacing_m;
  for (Index t = 0; t < surface.triangle_count(); ++t)
    walls.is_wall.push_back(surface.is_wall(t) ? std::uint8_t{1} : std::uint8_t{0});
  for (Index v = 0; v < surface.vertex_count(); ++v) {
    const embed::Anchor anchor = surface.anchor(cutter.lattice(), v);
    const Vec3f cell = vec_cast<float>(lattice.cubes[static_cast<std::size_t>(anchor.cube)]);
    walls.rest_m.push_back(lattice.origin_m + lattice.spacing_m * (cell + anchor.local));
  }
  return walls;
}

}  // namespace

FrameSnapshot World::Impl::snapshot() {
  FrameSnapshot snapshot;
  snapshot.tick = seen_.tick;
  snapshot.captured_s = seen_.captured_s;
  const ViewCameraDescription& camera = scene_.view.camera;
  snapshot.view = {camera.azimuth_deg, camera.elevation_deg, camera.field_of_view_deg};
  ExecContext& ctx = devices_.context(0);
  if (has_surface_) snapshot.real = perception_->download();
  for (const auto& body : bodies_) {
    snapshot.bodies.push_back(body->surface().to_mesh(ctx));
    snapshot.cut_walls.push_back(cut_walls(*body));
    const BodyShape& shape = body->shape();
    snapshot.smooth.push_back(shape.has_creases ? 0 : static_cast<Index>(shape.surface_m.positions_m.size()));
  }
  snapshot.obstacles = moving_obstacles_.meshes();
  snapshot.blades = held_blades_.meshes();
  if (perception_ != nullptr) {
    for (TriangleMesh& blade : perception_->impl().tracked_blades().meshes())
      snapshot.blades.push_back(std::move(blade));
    snapshot.tools = perception_->impl().tracked_blades().axes();
  }
  for (TriangleMesh& blade : scripted_blades(scene_, clock_.simulated_s()))
    snapshot.blades.push_back(std::move(blade));
  if (liquid_) snapshot.liquid_m = liquid_->positions_m();
  if (const SceneFilm* film = liquid_ ? liquid_->film() : nullptr) {
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      snapshot.films.push_back(film->thickness(*bodies_[b], snapshot.bodies[b]));
    snapshot.wet_obstacles = film->wet_obstacles(moving_obstacles_.poses());
  }
  if (!std::exchange(is_shown_, true)) note_shown();
  return snapshot;
}

std::vector<QualityReduction> World::Impl::quality_reductions() const {
  std::vector<QualityReduction> all;
  if (perception_ == nullptr || !perception_->impl().can_reduce()) return all;
  all.push_back(QualityReduction::hull);
  if (liquid_ && liquid_->can_be_reduced()) all.push_back(QualityReduction::liquid);
  // The paper's response sums over samples, whose volumes belong to their spacing.
  if (scene_.contact.response != ContactResponse::paper) all.push_back(QualityReduction::samples);
  return all;
}

void World::Impl::reduce_quality(std::span<const QualityReduction> quality_reductions) {
  reductions_asked_ = 0;
  for (const QualityReduction s : quality_reductions) {
    const std::vector<QualityReduction> can = this->quality_reductions();
    if (std::find(can.begin(), can.end(), s) != can.end())
      reductions_asked_ |= 1U << static_cast<unsigned>(s);
  }
}

/// Sets up the reductions that the coming frame's stages make.
void World::Impl::begin_quality() {
  if (reductions_made_ == reductions_asked_) return;
  reductions_made_ = reductions_asked_;
  perception_->impl().reduce(is_reduced(QualityReduction::hull));
  colliders_.set_coarseness(is_reduced(QualityReduction::samples) ? 2 : 1);
  if (liquid_) liquid_->reduce_quality(is_reduced(QualityReduction::liquid));
  select_recording();
}

/// The strip that the edge of a tracked blade swept with the last images, until it has cut.
cut::BladeStrip World::Impl::seen_strip(std::size_t blade) const {
  return blade < tools_.strips.size() ? tools_.strips[blade] : cut::BladeStrip{};
}

/// From the capture to the end of the frame; of live images by stages, too.
void World::Impl::note_latency() {
  const double now = now_s();
  timings_.add("latency", seen_.captured_s, now);
  if (!(seen_.released_s > 0)) return;
  timings_.add("capture to set", seen_.captured_s, seen_.released_s);
  timings_.add("set to hull", seen_.released_s, meshed_s_);
  timings_.add("hull to bodies", meshed_s_, now);
}

void World::Impl::note_shown() {
  if (seen_.released_s > 0) timings_.add("capture to snapshot", seen_.captured_s, now_s());
}

/// Adds the stages that make the real surface of new images.
void World::Impl::add_surface_stages(StageDevices touching) {
  if (perception_ == nullptr)  // contact reads a surface that has no component
    return schedule_.add({.name = "surface/none",
                          .timed_as = "surface",
                          .rate = Rate::capture,
                          .writes = {"surface/samples"},
                          .submit = [](BlockPlace) {}});
  perception_->impl().add_stages(schedule_, readback_);
  schedule_.add({.name = "surface/update",
                 .timed_as = "surface",
                 .rate = Rate::capture,
                 .devices = touching,
                 .writes = {"surface/samples"},
                 .reads = {VisualHull::kMesh},
                 .submit = [this](BlockPlace) {
                   colliders_.update(perception_->impl().surface(), schedule_.frame());
                 }});
}

}  // namespace tactus
