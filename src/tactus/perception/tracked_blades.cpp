#include "tactus/perception/tracked_blades.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/error.h"
#include "tactus/compute/cpu_for.h"

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

/// A quarter of the finest lattice that it may cut: finer than a cut of whole cubes can show.
double two_sigma_m(const BladeDescription& blade, const Scene& scene) {
  if (blade.tracked->two_sigma_m) return *blade.tracked->two_sigma_m;
  double spacing_m = 1;
  for (const BodyDescription& body : scene.bodies)
    if (body.cuttable) spacing_m = std::min(spacing_m, body.spacing_m);
  return spacing_m / 4;
}

/// How many tracked blades of the scene have this one's shape.
int equal_tools(const BladeDescription& blade, const Scene& scene) {
  return static_cast<int>(std::count_if(scene.blades.begin(), scene.blades.end(), [&](const auto& other) {
    return other.tracked && other.tracked->model == blade.tracked->model &&
           other.tracked->path == blade.tracked->path;
  }));
}

/// Error of the places of markers' corners, 1 sigma along each axis: edges of a square meet there, each found
/// to half a pixel over many of them; the rest is rounding and blur.
constexpr double kCorner_px = 0.5;

/// Clockwise from the top left of its pattern.
std::array<Vec3d, 4> corners_m(const BladeMarkerDescription& m, double unit_m) {
  const Vec3d right = (0.5 * m.size * unit_m) * normalized(m.right),
              down = (0.5 * m.size * unit_m) * normalized(m.down), middle_m = unit_m * m.at;
  return {middle_m - right - down, middle_m + right - down, middle_m + right + down, middle_m - right + down};
}

/// Contours of a right tool are off by chance, and not at the same places of it.
std::string misfit_text(const TrackedBlade& now) {
  if (now.edge_covered > 0.5)
    return "masks go on beyond " + number_text(std::round(100 * now.edge_covered)) +
           " % of its outline at the edge";
  return "its outline is off by " + number_text(std::round(now.misfit_px * 10) / 10) +
         " px in all views alike";
}

std::string mm(double m) { return number_text(std::round(m * 1e4) / 10) + " mm"; }

}  // namespace

TrackedBlades::TrackedBlades(const Scene& scene, const BodyAssets& assets, const Rig& rig)
    : depth_cameras_(rig.depth_cameras) {
  for (std::size_t b = 0; b < scene.blades.size(); ++b) {
    const BladeDescription& blade = scene.blades[b];
    if (!blade.tracked) continue;
    Blade& own = blades_.emplace_back();
    own.number = b;
    own.name = blade.name;
    own.two_sigma_m = two_sigma_m(blade, scene);
    own.touches = blade.tracked->touches;
    BladeTrackerSettings settings;
    settings.two_sigma_m = own.two_sigma_m;
    settings.equal_tools = equal_tools(blade, scene);
    own.tracker = std::make_unique<BladeTracker>(model_of(blade, assets), rig.cameras,
                                                 vec_cast<double>(rig.workspace_m.center()), settings);
    for (const BladeMarkerDescription& m : blade.tracked->markers)
      own.corners_m[m.id] = corners_m(m, blade.tracked->unit_m);
    own.center_m = vec_cast<double>(bounds(own.tracker->model().mesh).center());
  }
}

std::vector<ObstacleDescription> TrackedBlades::after(std::vector<ObstacleDescription> obstacles) const {
  for (const Blade& blade : blades_)
    obstacles.push_back({.name = blade.name,
                         .kind = ObstacleKind::mesh,
                         .mesh = blade.tracker->model().mesh,
                         .moves = true,
                         .edge_m = blade.tracker->model().edge_m});
  return obstacles;
}

std::vector<ToolMotion> TrackedBlades::motions() const {
  std::vector<ToolMotion> all;
  for (const Blade& blade : blades_) all.push_back(blade.touches ? blade.motion : ToolMotion{});
  return all;
}

std::vector<Reach> TrackedBlades::reaches() const {
  std::vector<Reach> all;
  for (const Blade& blade : blades_) {
    if (blade.motion.is_there == 0 || !blade.touches) continue;
    const Rigidd T = blade.tracker->now().T_world_model;
    const TriangleMesh& mesh = blade.tracker->model().mesh;
    Reach reach{T * blade.center_m, T * blade.center_m, 0};
    for (const Vec3f p : mesh.positions_m) {
      const Vec3d p_m = T * vec_cast<double>(p);
      reach.low_m = min(reach.low_m, p_m);
      reach.high_m = max(reach.high_m, p_m);
    }
    const float turning = 0.5F * length(bounds(mesh).extent()) * length(blade.motion.spin_rad_s);
    reach.m_s = static_cast<double>(length(blade.motion.velocity_m_s) + turning);
    all.push_back(reach);
  }
  return all;
}

/// @param before its pose with the last images, where it was known then
void TrackedBlades::follow(Blade& blade, const std::optional<Rigidd>& before, double dt_s) {
  const TrackedBlade& now = blade.tracker->now();
  blade.motion = {};
  if (now.state != BladeState::known) return;
  blade.motion.is_there = 1;
  blade.motion.R_world_tool = mat_cast<float>(now.T_world_model.R);
  blade.motion.center_m = vec_cast<float>(now.T_world_model * blade.center_m);
  if (!before || !(dt_s > 0)) return;
  const Twist by = twist_between(*before, now.T_world_model, blade.center_m);
  const auto part = [&](std::size_t k) {
    return vec_cast<float>((1 / dt_s) * Vec3d{by[k], by[k + 1], by[k + 2]});
  };
  blade.motion.spin_rad_s = part(0);
  blade.motion.velocity_m_s = part(3);
}

std::span<const BitMask> TrackedBlades::follow(std::span<const BitMask> masks, double dt_s, const Seen& seen,
                                               std::vector<Notice>& notices) {
  std::vector<BitMask> taken;
  std::vector<SeenPoint> points;
  std::vector<SeenDepth> depths;
  for (std::size_t c = 0; c < seen.depths_m.size(); ++c)
    depths.push_back({&depth_cameras_[c], &seen.depths_m[c]});
  for (Blade& blade : blades_) {
    // Pixels of another tool can't be found again as this one.
    taken.clear();
    if (blades_.size() > 1 && blade.tracker->now().state == BladeState::absent) {
      for (const BitMask& mask : masks) taken.emplace_back(mask.width_px, mask.height_px);
      for (const Blade& other : blades_)
        if (&other != &blade) other.tracker->add_to(taken);
    }
    std::optional<Rigidd> before;
    if (blade.motion.is_there != 0) before = blade.tracker->now().T_world_model;
    points.clear();
    for (const SeenMarker& marker : seen.markers) {
      const auto own = blade.corners_m.find(marker.id);
      for (std::size_t k = 0; k < 4 && own != blade.corners_m.end(); ++k)
        points.push_back({static_cast<std::size_t>(marker.camera), own->second.at(k), marker.corners_px.at(k),
                          kCorner_px});
    }
    blade.tracker->update(masks, dt_s, taken, {points, depths});
    follow(blade, before, dt_s);
    sweep(blade);
    report(blade, notices);
  }
  masks_.resize(masks.size());
  cpu_for(masks.size(), 1, [&](std::size_t c) { masks_[c] = masks[c]; });
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
  float displacement_m = 0;
  for (std::size_t i = 0; i < now.edge_m.size(); ++i)
    displacement_m = max(displacement_m, length(now.edge_m[i] - blade.from_m[i]));
  if (static_cast<double>(displacement_m) < now.two_sigma_m) return;
  blade.strip = {blade.from_m, now.edge_m, ++blade.strips};
  blade.from_m = now.edge_m;
}

void TrackedBlades::report(Blade& blade, std::vector<Notice>& notices) const {
  const TrackedBlade& now = blade.tracker->now();
  blade.was_known |= now.state == BladeState::known;
  if (now.state == blade.reported) return;
  const bool was_known = blade.reported == BladeState::known;
  blade.reported = now.state;
  // It may leave a state and come back to it: told once, until it was known again.
  if (now.state == BladeState::known) blade.warned.clear();
  if (std::find(blade.warned.begin(), blade.warned.end(), now.state) != blade.warned.end()) return;
  if (now.state > BladeState::ambiguous && now.state < BladeState::jumped) blade.warned.push_back(now.state);
  const std::string who = "blade '" + blade.name + "' ";
  if (now.state == BladeState::unsure && now.two_sigma_m > blade.two_sigma_m)
    notices.push_back({"blade.unsure", Severity::warning,
                       who + "does not cut: its edge is known to " + mm(now.two_sigma_m) + " (2 sigma), " +
                           mm(blade.two_sigma_m) + " are asked for",
                       "more or finer cameras, a better calibration, or a larger 'two_sigma_m'"});
  else if (now.state == BladeState::misfit)
    notices.push_back({"blade.misfit", Severity::warning,
                       who + "does not cut: the tool seen there is not the one modelled, " + misfit_text(now),
                       "check 'path' and 'unit_m' of its model, or the masks"});
  else if (now.state == BladeState::twins)
    notices.push_back({"blade.twins", Severity::warning,
                       who + "does not cut: more tools of its shape are seen than the scene has",
                       "take the others out of sight, give them blades of their own, or put markers on it"});
  else if (now.state == BladeState::jumped)
    notices.push_back({"blade.jumped", Severity::warning,
                       who + "does not cut: its edge jumped faster than 5 m/s",
                       "check the masks and their times"});
  else if (now.state == BladeState::absent && was_known)
    notices.push_back({"blade.lost", Severity::info, who + "is out of sight", ""});
}

std::vector<Notice> TrackedBlades::last_notices() const {
  std::vector<Notice> notices;
  for (const Blade& blade : blades_) {
    if (blade.was_known || blade.reported == BladeState::misfit || blade.reported == BladeState::twins)
      continue;
    if (blade.tracker->unexplained_frames() > 0)
      notices.push_back({"blade.not_found", Severity::warning,
                         "blade '" + blade.name +
                             "' was never known and cut nothing: the masks show something thin, but not the "
                             "tool modelled",
                         "check 'path' and 'unit_m' of its model, or the masks"});
    else
      // It may just not have come yet.
      notices.push_back({"blade.not_found", Severity::info,
                         "blade '" + blade.name + "' was never known and cut nothing",
                         "three cameras must see it, in more than a few pixels"});
  }
  return notices;
}

std::vector<TrackedBlade> TrackedBlades::now() const {
  std::vector<TrackedBlade> all;
  for (const Blade& blade : blades_) all.push_back(blade.tracker->now());
  return all;
}

cut::BladeStrip TrackedBlades::strip(std::size_t number) const {
  for (const Blade& blade : blades_)
    if (blade.number == number) return blade.strip;
  return {};
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
    const BladeModel& model = blade.tracker->model();
    TriangleMesh& mesh = all.emplace_back(model.drawn.triangles.empty() ? model.mesh : model.drawn);
    for (Vec3f& p : mesh.positions_m) p = vec_cast<float>(now.T_world_model * vec_cast<double>(p));
  }
  return all;
}

std::vector<ToolAxis> TrackedBlades::axes() const {
  std::vector<ToolAxis> all;
  for (const Blade& blade : blades_) {
    const TrackedBlade& now = blade.tracker->now();
    if (now.state <= BladeState::ambiguous) continue;
    const auto [from_m, to_m] = blade.tracker->axis_m();
    all.push_back({blade.name, now.state, now.two_sigma_m, vec_cast<float>(now.T_world_model * from_m),
                   vec_cast<float>(now.T_world_model * to_m)});
  }
  return all;
}

}  // namespace tactus
