#include "tactus/sim/held_blades.h"

#include <algorithm>

#include "tactus/base/error.h"
#include "tactus/sim/blade_mesh.h"

namespace tactus {

std::vector<std::string> held_names(const Scene& scene) {
  std::vector<std::string> names;
  for (const ObstacleSetting& obstacle : scene.obstacles)
    if (obstacle.held) names.push_back(obstacle.name);
  for (const BladeDescription& blade : scene.blades)
    if (blade.held) names.push_back(blade.name);
  return names;
}

HeldBlades::HeldBlades(const Scene& scene) {
  for (const BladeDescription& blade : scene.blades)
    if (blade.held) all_.push_back({.blade = blade, .pose = {}, .before = {}});
}

bool HeldBlades::has(const std::string& name) const {
  return std::any_of(all_.begin(), all_.end(), [&](const Held& h) { return h.blade.name == name; });
}

const HeldBlades::Held& HeldBlades::find(const std::string& name) const {
  const auto found =
      std::find_if(all_.begin(), all_.end(), [&](const Held& h) { return h.blade.name == name; });
  if (found == all_.end()) throw Error("'" + name + "' is no blade with 'held: true'");
  return *found;
}

void HeldBlades::set_pose(const std::string& name, const Rigidd& T_world_blade, bool at_once) {
  Held& h = all_[static_cast<std::size_t>(&find(name) - all_.data())];
  h.pose.set_next("blade '" + name + "'", T_world_blade, at_once);
}

Rigidd HeldBlades::pose(const std::string& name) const { return find(name).pose.T_world; }

void HeldBlades::begin_frame(bool jumps) {
  for (Held& h : all_) {
    h.has_jumped = jumps || !h.pose.is_placed;
    h.before = h.pose.advance();
  }
}

cut::BladeStrip HeldBlades::strip(const std::string& name, int frame) const {
  const Held& h = find(name);
  if (h.has_jumped) return {};
  cut::BladeStrip strip{{}, {}, frame};
  for (const Vec3d end_m : {h.blade.from_m, h.blade.to_m}) {
    strip.begin_m.push_back(vec_cast<float>(h.before * end_m));
    strip.end_m.push_back(vec_cast<float>(h.pose.T_world * end_m));
  }
  return strip;
}

std::vector<TriangleMesh> HeldBlades::meshes() const {
  std::vector<TriangleMesh> all;
  for (const Held& h : all_) {
    TriangleMesh& mesh = all.emplace_back(blade_mesh(h.blade, 0));
    for (Vec3f& p : mesh.positions_m) p = vec_cast<float>(h.pose.T_world * vec_cast<double>(p));
  }
  return all;
}

void HeldBlades::archive(StateArchive& a) {
  for (Held& h : all_) h.pose.archive(a, "blade '" + h.blade.name + "'");
}

}  // namespace tactus
