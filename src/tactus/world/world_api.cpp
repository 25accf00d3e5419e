// World's functions, which its inside carries out.
#include "tactus/world/world_impl.h"

namespace tactus {

World::World(DeviceSet& devices, const Scene& scene, const BodyAssets& assets, Perception* perception)
    : impl_(std::make_unique<Impl>(devices, scene, assets, perception)) {}
World::~World() = default;

void World::set_surface(Observation observation) { impl_->set_surface(std::move(observation)); }
StepReport World::step(double dt_s) { return impl_->step(dt_s); }
void World::begin_step(double dt_s) { impl_->begin_step(dt_s); }
std::optional<StepReport> World::continue_step() { return impl_->continue_step(); }
void World::set_pose(const std::string& tool, const Rigidd& T_world_tool, bool at_once) {
  impl_->set_pose(tool, T_world_tool, at_once);
}
Rigidd World::pose(const std::string& tool) const { return impl_->pose(tool); }
void World::set_grab(const std::optional<Grab>& grab) { impl_->set_grab(grab); }
SceneParameters& World::parameters() { return impl_->parameters(); }
void World::report_contacts(const std::string& body) { impl_->report_contacts(body); }
const std::vector<BodyPointContact>& World::contacts(const std::string& body) const {
  return impl_->contacts(body);
}
std::vector<QualityReduction> World::quality_reductions() const { return impl_->quality_reductions(); }
void World::reduce_quality(std::span<const QualityReduction> quality_reductions) {
  impl_->reduce_quality(quality_reductions);
}
FrameSnapshot World::snapshot() { return impl_->snapshot(); }
std::vector<ProbeReading> World::probes() { return impl_->probes(); }
BodyNodes World::nodes(const std::string& body) { return impl_->nodes(body); }
std::vector<BodyMonitors> World::monitors() { return impl_->monitors(); }
std::vector<std::vector<MotionForce>> World::motion_forces() { return impl_->motion_forces(); }
const std::vector<CutScore>& World::cuts() const { return impl_->cuts(); }
std::vector<StrokeResult> World::stroke_results() const { return impl_->stroke_results(); }
const Timings& World::timings() const { return impl_->timings(); }
Perception* World::perception() const { return impl_->perception(); }

std::string World::save_state(const FrameSet* last) {
  StateArchive a;
  impl_->archive(a, last);
  return a.bytes();
}

void World::load_state(const std::string& state, const FrameSet* last) {
  StateArchive a(state, "load_state");
  impl_->archive(a, last);
}

}  // namespace tactus
