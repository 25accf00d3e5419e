#include "tactus/sim/held_blades.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/error.h"
#include "tactus/sim/blade_mesh.h"

namespace tactus {

bool is_rigid(const Rigidd& T) {
  double off = 0;
  const Mat3d product = transpose(T.R) * T.R;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) off = std::max(off, std::abs(product(i, k) - (i == k ? 1 : 0)));
  return off < 1e-6 && dot(cross(T.R.column(0), T.R.column(1)), T.R.column(2)) > 0 &&
         std::isfinite(dot(T.t, T.t));
}

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
    if (blade.held) all_.push_back({.blade = blade, .before = {}, .T_world = {}, .next = {}});
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
  if (!is_rigid(T_world_blade))
    throw usage_error("pose of blade '" + name + "': expected a finite position and a rotation");
  Held& h = all_[static_cast<std::size_t>(&find(name) - all_.data())];
  h.next = T_world_blade;
  h.is_placed = h.is_placed && !at_once;
}

Rigidd HeldBlades::pose(const std::string& name) const { return find(name).T_world; }

void HeldBlades::begin_frame(bool jumps) {
  for (Held& h : all_) {
    h.has_jumped = jumps || !h.is_placed;
    h.before = h.T_world;
    h.T_world = h.next;
    h.is_placed = true;
  }
}

cut::BladeStrip HeldBlades::strip(const std::string& name, int frame) const {
  const Held& h = find(name);
  if (h.has_jumped) return {};
  cut::BladeStrip strip{{}, {}, frame};
  for (const Vec3d end_m : {h.blade.from_m, h.blade.to_m}) {
    strip.begin_m.push_back(vec_cast<float>(h.before * end_m));
    strip.end_m.push_back(vec_cast<float>(h.T_world * end_m));
  }
  return strip;
}

std::vector<TriangleMesh> HeldBlades::meshes() const {
  std::vector<TriangleMesh> all;
  for (const Held& h : all_) {
    TriangleMesh& mesh = all.emplace_back(blade_mesh(h.blade, 0));
    for (Vec3f& p : mesh.positions_m) p = vec_cast<float>(h.T_world * vec_cast<double>(p));
  }
  return all;
}

void HeldBlades::archive(StateArchive& a) {
  for (Held& h : all_) {
    a.set_owner("blade '" + h.blade.name + "'");
    a.value("pose", h.T_world);
    a.value("next pose", h.next);
    a.value("placed", h.is_placed);
  }
}

}  // namespace tactus
