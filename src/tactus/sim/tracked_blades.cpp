#include "tactus/sim/tracked_blades.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/error.h"

namespace tactus {
namespace {

BladeModel model_of(const BladeDescription& blade, const BodyAssets& assets) {
  BladeModel model = built_in_scalpel();
  if (blade.tracked->model == BladeShape::mesh) {
    model = {blade.name, assets.blade_meshes.at(blade.name), {}};
    for (const Vec3d& p : blade.tracked->edge)
      model.edge_m.push_back(vec_cast<float>(blade.tracked->unit_m * p));
  }
  return model;
}

/// A quarter of the finest lattice that it may cut: finer than what a cut of whole cubes shows.
double two_sigma_m(const BladeDescription& blade, const Scene& scene) {
  if (blade.tracked->two_sigma_m) return *blade.tracked->two_sigma_m;
  double spacing_m = 1;
  for (const BodyDescription& body : scene.bodies)
    if (body.cuttable) spacing_m = std::min(spacing_m, body.spacing_m);
  return spacing_m / 4;
}

std::string mm(double m) { return number_text(std::round(m * 1e4) / 10) + " mm"; }

}  // namespace

TrackedBlades::TrackedBlades(const Scene& scene, const BodyAssets& assets, const Rig& rig) {
  for (std::size_t b = 0; b < scene.blades.size(); ++b) {
    const BladeDescription& blade = scene.blades[b];
    if (!blade.tracked) continue;
    Blade& own = blades_.emplace_back();
    own.number = b;
    own.name = blade.name;
    own.two_sigma_m = two_sigma_m(blade, scene);
    BladeTrackerSettings settings;
    settings.two_sigma_m = own.two_sigma_m;
    own.tracker = std::make_unique<BladeTracker>(model_of(blade, assets), rig.cameras,
                                                 vec_cast<double>(rig.workspace_m.center()), settings);
  }
}

std::span<const BitMask> TrackedBlades::follow(std::span<const BitMask> masks, double dt_s,
                                               std::vector<Notice>& notices) {
  std::vector<BitMask> taken;
  for (Blade& blade : blades_) {
    // What is another's can't be found again as this one.
    taken.clear();
    if (blades_.size() > 1 && blade.tracker->now().state == BladeState::absent) {
      for (const BitMask& mask : masks) taken.emplace_back(mask.width_px, mask.height_px);
      for (const Blade& other : blades_)
        if (&other != &blade) other.tracker->add_to(taken);
    }
    blade.tracker->update(masks, dt_s, taken);
    sweep(blade);
    tell(blade, notices);
  }
  masks_.assign(masks.begin(), masks.end());
  for (const Blade& blade : blades_) blade.tracker->take_from(masks_);
  return masks_;
}

void TrackedBlades::sweep(Blade& blade) {
  const TrackedBlade& now = blade.tracker->now();
  blade.strip = {};
  if (now.state != BladeState::known) {
    blade.from_m.clear();
    ++blade.strips;  // the next is of another stroke
    return;
  }
  if (blade.from_m.empty()) {
    blade.from_m = now.edge_m;
    return;
  }
  float way_m = 0;
  for (std::size_t i = 0; i < now.edge_m.size(); ++i)
    way_m = max(way_m, length(now.edge_m[i] - blade.from_m[i]));
  if (static_cast<double>(way_m) < now.two_sigma_m) return;
  blade.strip = {blade.from_m, now.edge_m, ++blade.strips};
  blade.from_m = now.edge_m;
}

void TrackedBlades::tell(Blade& blade, std::vector<Notice>& notices) const {
  const TrackedBlade& now = blade.tracker->now();
  if (now.state == blade.told) return;
  const bool was_known = blade.told == BladeState::known;
  blade.told = now.state;
  const std::string who = "blade '" + blade.name + "' ";
  if (now.state == BladeState::unsure && now.two_sigma_m > blade.two_sigma_m)
    notices.push_back({"blade.unsure", Severity::warning,
                       who + "does not cut: its edge is known to " + mm(now.two_sigma_m) + " (2 sigma), " +
                           mm(blade.two_sigma_m) + " are asked for",
                       "more or finer cameras, a better calibration, or a larger 'two_sigma_m'"});
  else if (now.state == BladeState::jumped)
    notices.push_back({"blade.jumped", Severity::warning,
                       who + "does not cut: its edge jumped faster than 5 m/s",
                       "check the masks and their times"});
  else if (now.state == BladeState::absent && was_known)
    notices.push_back({"blade.lost", Severity::info, who + "is out of sight", ""});
}

cut::BladeStrip TrackedBlades::strip(std::size_t number) const {
  for (const Blade& blade : blades_)
    if (blade.number == number) return blade.strip;
  return {};
}

void TrackedBlades::forget_strips() {
  for (Blade& blade : blades_) blade.strip = {};
}

const TrackedBlade& TrackedBlades::now(std::size_t number) const {
  for (const Blade& blade : blades_)
    if (blade.number == number) return blade.tracker->now();
  throw Error("blade " + std::to_string(number) + " of the scene is not tracked");
}

std::vector<TriangleMesh> TrackedBlades::meshes() const {
  std::vector<TriangleMesh> all;
  for (const Blade& blade : blades_) {
    const TrackedBlade& now = blade.tracker->now();
    if (!now.is_seen()) continue;
    TriangleMesh& mesh = all.emplace_back(blade.tracker->model().mesh);
    for (Vec3f& p : mesh.positions_m) p = vec_cast<float>(now.T_world_model * vec_cast<double>(p));
  }
  return all;
}

}  // namespace tactus
