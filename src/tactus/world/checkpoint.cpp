// State of a world between two frames.
#include <algorithm>

#include "tactus/base/error.h"
#include "tactus/world/world_impl.h"

namespace tactus {

/// Cuts come before the state of the nodes and cubes that they made: lists and places follow the same cuts.
void World::Impl::archive_cuts(StateArchive& a) {
  if (scene_.blades.empty()) return;
  for (const BladeDescription& blade : scene_.blades)
    if (blade.tracked)
      throw usage_error("blade '" + blade.name +
                        "' is tracked: checkpoints do not hold what is known of it yet");
  a.set_owner("blades");
  a.value("strips", cut_frame_);
  archive_scores(a);
  archive_capacities(a);
  for (std::size_t k = 0; k < bodies_.size(); ++k)
    if (bodies_[k]->cuts() != nullptr) archive_cuts_of(k, a, true);
}

/// Archives the results of the blades' strokes so far.
void World::Impl::archive_scores(StateArchive& a) {
  constexpr Index kMostStrokes = 1 << 20, kMostSteps = 1 << 20;
  auto count = static_cast<Index>(cuts_.size());
  a.value("cuts", count);
  a.check(count >= 0 && count <= kMostStrokes, "cuts");
  cuts_.resize(static_cast<std::size_t>(count));
  for (CutScore& score : cuts_) {
    const auto place = [](const auto& all, auto&& is) {
      return static_cast<Index>(std::find_if(all.begin(), all.end(), is) - all.begin());
    };
    Index blade = place(scene_.blades, [&](const BladeDescription& b) { return b.name == score.blade; });
    Index body = place(bodies_, [&](const auto& b) { return b->name() == score.body; });
    a.value("blade", blade);
    a.value("body", body);
    a.check(blade >= 0 && blade < static_cast<Index>(scene_.blades.size()), "blade");
    a.check(body >= 0 && body < static_cast<Index>(bodies_.size()), "body");
    score.blade = scene_.blades[static_cast<std::size_t>(blade)].name;
    score.body = bodies_[static_cast<std::size_t>(body)]->name();
    a.value("way", score.path_m);
    a.value("depth", score.depth_m);
    a.value("area", score.area_m2);
    a.value("begin", score.begin_s);
    a.value("end", score.end_s);
    a.value("cubes", score.cut_cubes);
    a.value("slivers", score.slivers);
    a.value("way since the last cut", score.pending_m);
    auto steps = static_cast<Index>(score.steps.size());
    a.value("steps", steps);
    a.check(steps >= 0 && steps <= kMostSteps, "steps");
    score.steps.resize(static_cast<std::size_t>(steps));
    a.values("ways and areas", score.steps);
    a.value("due", score.due_m3);
    a.value("bled", score.bled_m3);
    a.value("stroke", score.stroke);
    a.check(score.stroke >= 0 && score.stroke < count, "stroke");
  }
}

void World::Impl::archive(StateArchive& a, const FrameSet* last) {
  if (a.reads()) {
    is_settled_ = true;
    energy_watch_.turn_off();  // its bodies' strain energy isn't known
    if (last != nullptr && perception_ != nullptr) {
      set_surface(perception_->observe(last, 0));
      step(0);
    }
  }
  devices_.synchronize();
  a.set_owner("devices");
  std::uint64_t devices = fnv1a(devices_.name());
  const std::uint64_t own = devices;
  a.value("kind and number", devices);
  if (devices != own)
    throw usage_error(a.path() + ": the checkpoint was made on other devices than " + devices_.name() +
                      ": go on with the same '--devices'");
  a.set_owner("scene");
  for (const auto& [key, own_hash] : fingerprint_) {
    std::uint64_t hash = own_hash;
    a.value(key.c_str(), hash);
    if (hash != own_hash)
      throw usage_error(a.path() + ": the state is of a scene with other '" + key +
                        "', or this one was edited since");
  }
  a.set_owner("frame");
  clock_.archive(a);
  a.value("last substep", last_substep_s_);
  a.value("last frame", last_dt_s_);
  a.value("whether there is a surface", has_surface_);
  a.check(!has_surface_ || perception_ != nullptr, "whether there is a surface");
  a.value("tick", seen_.tick);
  a.value("choice of substeps", substep_choice_);
  std::vector<Reach> speeds = component_speeds_;
  auto count = static_cast<Index>(speeds.size());
  speeds.resize(static_cast<std::size_t>(kComponents));
  a.value("fast components", count);
  a.values("speeds of components", speeds);
  a.check(count >= 0 && count <= kComponents, "fast components");
  speeds.resize(static_cast<std::size_t>(count));
  component_speeds_ = speeds;
  for (int p = 0; p < colliders_.count(); ++p) {
    a.set_owner("real surface");
    colliders_.part(p).surface.archive(devices_.context(p), a);
  }
  moving_obstacles_.archive(a);
  held_blades_.archive(a);
  if (a.reads() && grab_) release_grab();
  archive_cuts(a);
  for (auto& body : bodies_) body->archive(a);
  archive_grab(a);
  a.set_owner("bodies that touch");
  touching_.archive(a);
  if (liquid_) liquid_->archive(a);
  parameters_.archive(a);
  if (a.reads()) a.finish();
  devices_.synchronize();
}

}  // namespace tactus
