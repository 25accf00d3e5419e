#include "tactus/world/hold_check.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "tactus/geom/mesh/mesh.h"
#include "tactus/sim/body/body_point.h"
#include "tactus/world/start_check.h"

namespace tactus {
namespace {

/// A box, seen along the axis that is nearest to gravity.
class Seen {
 public:
  Seen(Vec3d gravity_m_s2, Vec3d min_m, Vec3d max_m) {
    for (int a = 1; a < 3; ++a)
      if (std::abs(gravity_m_s2[a]) > std::abs(gravity_m_s2[axis_])) axis_ = a;
    sign_ = gravity_m_s2[axis_] > 0 ? -1 : 1;
    low_m_ = sign_ > 0 ? min_m[axis_] : -max_m[axis_];
    high_m_ = sign_ > 0 ? max_m[axis_] : -min_m[axis_];
    for (int k = 0; k < 2; ++k) {
      const int a = (axis_ + 1 + k) % 3;
      min_m_[k] = min_m[a];
      max_m_[k] = max_m[a];
    }
  }
  Seen(Vec3d gravity_m_s2, const Box3f& box)
      : Seen(gravity_m_s2, vec_cast<double>(box.min), vec_cast<double>(box.max)) {}

  int axis() const { return axis_; }
  int sign() const { return sign_; }  ///< 1: up is the axis
  double low_m() const { return low_m_; }
  double middle_m() const { return 0.5 * (low_m_ + high_m_); }
  double area_m2() const { return (max_m_[0] - min_m_[0]) * (max_m_[1] - min_m_[1]); }
  double height_m() const { return high_m_ - low_m_; }
  /// Its middle is above the lower side of `under`, and some of it above `under`.
  bool is_over(const Seen& under) const {
    for (int k = 0; k < 2; ++k)
      if (!(std::min(max_m_[k], under.max_m_[k]) > std::max(min_m_[k], under.min_m_[k]))) return false;
    return middle_m() > under.low_m_;
  }

 private:
  int axis_ = 0, sign_ = 1;
  double low_m_ = 0, high_m_ = 0;
  double min_m_[2] = {}, max_m_[2] = {};
};

Seen seen(const Scene& scene, const SoftBody& body) {
  return {scene.gravity_m_s2, bounds(body.shape().surface_m)};
}

bool is_held(const BodyDescription& body) { return !body.fixed.empty() || !body.moved.empty(); }

bool bears(const Scene& scene, const ObstacleDescription& o, const Seen& body, Vec3d center_m) {
  if (const std::optional<Box3f> box = box_of(o)) return body.is_over({scene.gravity_m_s2, *box});
  // A plane that isn't upright catches what is on its outer side.
  const Rigidf T_plane_world = inverse(o.T_world_obstacle);
  return (T_plane_world * vec_cast<float>(center_m)).y > 0 &&
         (T_plane_world.R * vec_cast<float>(normalized(scene.gravity_m_s2))).y < -1e-3F;
}

/// Whether the liquid bears it: it is lighter, and the pool is deeper than its draught. What flows in may
/// fill any pool.
bool floats(const Scene& scene, const SoftBody& body) {
  const LiquidDescription& liquid = *scene.fluid;
  const double mass_kg = body.shape().lattice.mass_kg(),
               volume_m3 = tactus::volume_m3(body.shape().surface_m);
  if (liquid.open == LiquidOpen::all || !(mass_kg < liquid.density_kg_m3 * volume_m3)) return false;
  if (!liquid.emitters.empty()) return true;
  double pool_m3 = 0;
  for (const BlockDescription& block : liquid.blocks) {
    const Vec3d edges_m = block.box.max_m - block.box.min_m;
    pool_m3 += edges_m.x * edges_m.y * edges_m.z;
  }
  const Seen box(scene.gravity_m_s2, liquid.box.min_m, liquid.box.max_m);
  const double displaced_m3 = mass_kg / liquid.density_kg_m3,
               across_m2 = volume_m3 / seen(scene, body).height_m();
  return (pool_m3 + displaced_m3) / box.area_m2() > displaced_m3 / across_m2;
}

/// A box as large as the floor of the liquid's, right under it.
std::string floor_text(const Scene& scene) {
  const BoxRegion& box = scene.fluid->box;
  const Seen faces(scene.gravity_m_s2, box.min_m, box.max_m);
  Vec3d size_m = box.max_m - box.min_m, middle_m = 0.5 * (box.min_m + box.max_m);
  const double thick_m = std::max(0.02, 2 * scene.fluid->spacing_m);
  size_m[faces.axis()] = thick_m;
  middle_m[faces.axis()] = faces.sign() * (faces.low_m() - 0.5 * thick_m);
  return "{name: floor, kind: box, size_m: " + point_text(size_m) +
         ", placement: {position_m: " + point_text(middle_m) + "}}";
}

}  // namespace

bool is_over_liquid(const Scene& scene, const SoftBody& body) {
  if (!scene.fluid || !(length(scene.gravity_m_s2) > 0)) return false;
  return seen(scene, body).is_over({scene.gravity_m_s2, scene.fluid->box.min_m, scene.fluid->box.max_m});
}

std::vector<UnheldBody> bodies_without_floor(const Scene& scene,
                                             std::span<const std::unique_ptr<SoftBody>> bodies,
                                             std::span<const ObstacleDescription> obstacles) {
  std::vector<UnheldBody> found;
  if (!scene.fluid || !(length(scene.gravity_m_s2) > 0) ||
      std::any_of(obstacles.begin(), obstacles.end(), [](const auto& o) { return o.moves; }))
    return found;
  for (const auto& body : bodies) {
    const BodyDescription& of = body->description();
    if (!of.contact || is_held(of) || !is_over_liquid(scene, *body) || floats(scene, *body)) continue;
    const Seen box = seen(scene, *body);
    const Vec3d center_m = vec_cast<double>(bounds(body->shape().surface_m).center());
    const bool on_obstacle = std::any_of(obstacles.begin(), obstacles.end(),
                                         [&](const auto& o) { return bears(scene, o, box, center_m); });
    const bool on_body =
        scene.contact.bodies && std::any_of(bodies.begin(), bodies.end(), [&](const auto& other) {
          const Seen under = seen(scene, *other);
          return other != body && other->description().contact && box.is_over(under) &&
                 under.middle_m() < box.middle_m();
        });
    if (on_obstacle || on_body) continue;
    found.push_back({of.name,
                     {"body.no_floor", Severity::warning,
                      "body '" + of.name +
                          "' is over 'fluid.box', whose faces hold the liquid alone: it will fall through "
                          "the floor",
                      "hold it with 'fixed', or give 'obstacles' a floor: " + floor_text(scene)}});
  }
  return found;
}

}  // namespace tactus
