#include "tactus/run/scene_view.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tactus/geom/mesh/mesh_creases.h"
#include "tactus/run/film_look.h"
#include "tactus/run/skin_look.h"
#include "tactus/run/wall_look.h"
#include "tactus/run/wet_patch.h"
#include "tactus/sim/real_film.h"
#include "tactus/sim/still_obstacles.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/track/blade_tracker.h"
#include "tactus/world/world_impl.h"

namespace tactus {
namespace {

/// @param box_m bounds of the scene's contents: they fill the picture unless the scene sets target, distance
/// or eye
ViewCamera view_camera(const ViewDescription& view, const Box3f& box_m) {
  const ViewCameraDescription& d = view.camera;
  const auto rad = [](double deg) { return static_cast<float>(deg * 3.14159265358979323846 / 180); };
  const float aspect = static_cast<float>(view.size_px.x) / static_cast<float>(view.size_px.y);
  ViewCamera camera =
      frame_box(box_m, rad(d.azimuth_deg), rad(d.elevation_deg), aspect, rad(d.field_of_view_deg));
  if (d.target_m) camera.target_m = vec_cast<float>(*d.target_m);
  if (d.distance_m) camera.distance_m = static_cast<float>(*d.distance_m);
  if (!d.eye_m) return camera;
  const Vec3f offset = vec_cast<float>(*d.eye_m) - camera.target_m;
  camera.distance_m = length(offset);
  camera.azimuth_rad = std::atan2(offset.x, offset.z);
  camera.elevation_rad = std::asin(offset.y / camera.distance_m);
  return camera;
}

/// Workspace and bodies at rest; where nobody films, also obstacles and the liquid's box.
Box3f what_there_is(const Rig& rig, const Scene& scene,
                    const std::vector<std::unique_ptr<SoftBody>>& bodies) {
  constexpr float kFar = 1e30F;
  const bool is_filmed = !rig.cameras.empty();
  Box3f box = is_filmed ? rig.workspace_m : Box3f{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
  if (!is_filmed && scene.fluid)
    box = {vec_cast<float>(scene.fluid->box.min_m), vec_cast<float>(scene.fluid->box.max_m)};
  if (const auto& asked = scene.reconstruction.workspace_m)
    box = {vec_cast<float>(asked->min_m), vec_cast<float>(asked->max_m)};
  for (const auto& body : bodies) {
    const Box3f b = bounds(body->shape().surface_m);
    box = {min(box.min, b.min), max(box.max, b.max)};
  }
  if (box.min.x > box.max.x) box = {{-0.5F, 0, -0.5F}, {0.5F, 1, 0.5F}};  // nothing to see
  return box;
}

/// The triangles of a mesh for which `chosen` is `value`, on the same vertices.
TriangleMesh part_of(const TriangleMesh& mesh, const std::vector<std::uint8_t>& chosen, std::uint8_t value) {
  TriangleMesh part{mesh.positions_m, mesh.normals, {}};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (chosen[t] == value) part.triangles.push_back(mesh.triangles[t]);
  }
  return part;
}

Material obstacle_material() { return {.color = {0.62F, 0.65F, 0.69F}}; }

/// How high a place is in the picture, over the distance.
float height_in(const ViewCamera& camera, Vec3f p_m) {
  const Vec3f p = camera.T_cam_world() * p_m;
  return p.y / max(-p.z, 1e-6F);
}

/// A line along a tool, which sticks out at both ends, with its name and state above it: green where it cuts,
/// red where the masks show something else, yellow where it isn't known well enough.
void add_tool_axis(ViewScene& view, const ToolAxis& tool, const ViewCamera& camera) {
  constexpr Vec3f kKnown{0.10F, 0.50F, 0.20F}, kOther{0.75F, 0.12F, 0.10F}, kUnsure{0.72F, 0.50F, 0.05F};
  const bool is_other = tool.state == BladeState::misfit || tool.state == BladeState::twins;
  const Vec3f color = tool.state == BladeState::known ? kKnown : is_other ? kOther : kUnsure;
  const Vec3f beyond = 0.25F * (tool.to_m - tool.from_m);
  const Vec3f from_m = tool.from_m - beyond, to_m = tool.to_m + beyond;
  view.lines.push_back({from_m, to_m, color, 2.F});
  char known[48];
  if (is_other)
    std::snprintf(known, sizeof known, "%s", blade_state_name(tool.state));
  else
    std::snprintf(known, sizeof known, "edge to %.1f mm", 1e3 * tool.two_sigma_m);
  const bool from_is_higher = height_in(camera, from_m) > height_in(camera, to_m);
  view.labels.push_back({from_is_higher ? from_m : to_m, tool.name + ": " + known, color});
}

/// Twice as many reach over a cube of the lattice that carries a surface with half its spacing.
constexpr int kNormalPasses = 6;
constexpr Vec3f kElementColor{0.72F, 0.16F, 0.18F}, kMatchedColor{0.16F, 0.38F, 0.66F};

}  // namespace

SceneView::SceneView(const Scene& scene, const Rig& rig, const BodyAssets& assets, const World& world)
    : scene_(scene),
      box_m_(what_there_is(rig, scene, world.impl().bodies())),
      angles_{scene.view.camera.azimuth_deg, scene.view.camera.elevation_deg,
              scene.view.camera.field_of_view_deg},
      camera_(view_camera(scene.view, box_m_)) {
  for (StillObstacle& o : still_obstacles(scene, assets))
    view_.meshes.push_back({.name = o.name, .mesh = std::move(o.mesh), .material = obstacle_material()});
  if (scene.view.show_frusta) {
    const float depth_m = 0.12F * length(rig.workspace_m.extent());
    for (const Camera& camera : rig.cameras) {
      // A depth camera that gives the silhouette, too, is drawn once.
      const bool measures = std::any_of(rig.depth_cameras.begin(), rig.depth_cameras.end(),
                                        [&](const Camera& d) { return d.name == camera.name; });
      if (!measures) add_camera(view_, camera, depth_m);
    }
    for (const Camera& camera : rig.depth_cameras) add_camera(view_, camera, depth_m, {0.62F, 0.35F, 0.20F});
  }
  if (!rig.cameras.empty()) view_.boxes.push_back({rig.workspace_m});
  if (scene.fluid)
    view_.boxes.push_back(
        {{vec_cast<float>(scene.fluid->box.min_m), vec_cast<float>(scene.fluid->box.max_m)}});
  still_meshes_ = view_.meshes.size();
  still_lines_ = view_.lines.size();
  still_labels_ = view_.labels.size();
  if (scene.view.photographs > 0 && world.perception() != nullptr) {
    photos_ = std::make_shared<ViewPhotos>(
        ViewPhotos{.cameras = rig.cameras,
                   .images = {},
                   .k = std::min(scene.view.photographs, static_cast<int>(rig.cameras.size())),
                   .voxel_size_m = world.perception()->hull().voxel_size_m(),
                   .center_m = rig.workspace_m.center()});
  }
}

void SceneView::show_models(std::vector<std::vector<std::uint8_t>> element_triangles) {
  element_triangles_ = std::move(element_triangles);
}

namespace {

ViewLiquid blood() { return {.absorption_1_m = {360.F, 2400.F, 2200.F}}; }

/// Where it isn't cut.
void smooth_skin_of(TriangleMesh& surface, const FrameSnapshot& snapshot, std::size_t b) {
  if (snapshot.smooth[b] == 0) return;
  std::vector<std::uint8_t> may_move(surface.positions_m.size());
  std::fill(may_move.begin(), may_move.begin() + snapshot.smooth[b], std::uint8_t{1});
  if (b < snapshot.cut_walls.size())
    for (std::size_t t = 0; t < snapshot.cut_walls[b].is_wall.size(); ++t)
      if (snapshot.cut_walls[b].is_wall[t] != 0)
        for (const Index v : surface.triangles[t]) may_move[static_cast<std::size_t>(v)] = 0;
  smooth_skin(surface, may_move);
}

}  // namespace

ViewLiquid SceneView::liquid_look() const {
  return scene_.fluid->looks == LiquidLooks::water ? water() : blood();
}

/// As the liquid is, nowhere yet.
ViewFilm SceneView::dry_film() const {
  const ViewLiquid liquid = liquid_look();
  ViewFilm film;
  film.scattered = liquid.scattered;
  film.absorption_1_m = liquid.absorption_1_m;
  return film;
}

float SceneView::spacing_m() const { return static_cast<float>(scene_.fluid->spacing_m); }

/// A body's surface, and the film on it.
ViewMesh SceneView::body_mesh(FrameSnapshot& snapshot, std::size_t b) const {
  Material material = soft_material();
  material.color = vec_cast<float>(scene_.bodies[b].colour);
  ViewMesh view{scene_.bodies[b].name, std::move(snapshot.bodies[b]), material};
  TriangleMesh& surface = view.mesh;
  std::vector<std::uint8_t> is_crease(surface.positions_m.size());
  std::vector<Index> origins;
  smooth_skin_of(surface, snapshot, b);
  // Skin and walls of cuts share vertices.
  const CutWalls walls = b < snapshot.cut_walls.size() ? std::move(snapshot.cut_walls[b]) : CutWalls{};
  if (scene_.bodies[b].cuttable) origins = split_creases(surface, snapshot.smooth[b]);
  smooth_normals(surface, kNormalPasses);
  if (!walls.is_wall.empty()) view.flesh = part_walls(surface, walls, origins);
  is_crease.resize(surface.positions_m.size(), 1);
  for (const Index v : origins) is_crease[static_cast<std::size_t>(v)] = 1;
  if (!scene_.fluid) return view;
  ViewFilm film = dry_film();
  if (b < snapshot.films.size() && !snapshot.films[b].film_m.empty()) {
    film.film_m = std::move(snapshot.films[b].film_m);
    film.stain_m = std::move(snapshot.films[b].stain_m);
    for (std::vector<float>* m : {&film.film_m, &film.stain_m})
      for (const Index v : origins) m->push_back((*m)[static_cast<std::size_t>(v)]);
  }
  const bool has_film = !film.film_m.empty();
  film.film_m.resize(surface.positions_m.size());
  film.stain_m.resize(surface.positions_m.size());
  if (!wet_under(surface, snapshot.liquid_m, spacing_m(), film.film_m) && !has_film) return view;
  lay_film(surface, is_crease, film, [&](const EdgeRefinement& made) {
    if (view.flesh) follow_refinement(*view.flesh, made);
  });
  view.film = std::move(film);
  return view;
}

/// The real surface, wet where liquid touches it now.
ViewMesh SceneView::real_mesh(FrameSnapshot& snapshot) const {
  ViewMesh view{"real", std::move(snapshot.real), clay_material()};
  TriangleMesh& surface = view.mesh;
  if (!scene_.fluid || surface.normals.size() != surface.positions_m.size()) return view;
  ViewFilm film = dry_film();
  film.film_m.resize(surface.positions_m.size());
  film.stain_m.resize(surface.positions_m.size());
  if (!wet_under(surface, snapshot.liquid_m, spacing_m(), film.film_m)) return view;
  std::vector<std::uint8_t> is_crease(surface.positions_m.size());
  lay_film(surface, is_crease, film, [](const EdgeRefinement&) {});
  view.film = std::move(film);
  return view;
}

void SceneView::turn_to(const ViewAngles& angles) {
  if (angles == angles_) return;
  angles_ = angles;
  ViewDescription view = scene_.view;
  view.camera.azimuth_deg = angles.azimuth_deg;
  view.camera.elevation_deg = angles.elevation_deg;
  view.camera.field_of_view_deg = angles.field_of_view_deg;
  camera_ = view_camera(view, box_m_);
}

/// Above the obstacle itself, or the real surface: photographs have no film, so this wears none.
void SceneView::show_film(WetObstacle wet) {
  const Material below = wet.name == kRealSurfaceName ? clay_material() : obstacle_material();
  ViewMesh view{"film on " + wet.name, std::move(wet.mesh), below};
  ViewFilm& film = view.film.emplace(dry_film());
  film.film_m = std::move(wet.film.film_m);
  film.stain_m = std::move(wet.film.stain_m);
  const std::vector<Index> origins = split_creases(view.mesh);
  std::vector<std::uint8_t> is_crease(view.mesh.positions_m.size());
  std::fill(is_crease.end() - static_cast<std::ptrdiff_t>(origins.size()), is_crease.end(), std::uint8_t{1});
  for (const Index v : origins) {
    is_crease[static_cast<std::size_t>(v)] = 1;
    film.film_m.push_back(film.film_m[static_cast<std::size_t>(v)]);
    film.stain_m.push_back(film.stain_m[static_cast<std::size_t>(v)]);
  }
  lay_film(view.mesh, is_crease, film, [](const EdgeRefinement&) {});
  keep_wet(view.mesh, film);
  if (view.mesh.triangles.empty()) return;
  view.casts_shadow = false;
  view_.meshes.push_back(std::move(view));
}

void SceneView::show(FrameSnapshot snapshot, const std::vector<ColorImage>& photos) {
  turn_to(snapshot.view);
  view_.meshes.resize(still_meshes_);
  view_.lines.resize(still_lines_);
  view_.labels.resize(still_labels_);
  view_.meshes.push_back(real_mesh(snapshot));
  if (photos_ && !photos.empty()) {
    photos_->images = photos;
    view_.meshes.back().photos = photos_;
  }
  for (std::size_t b = 0; b < snapshot.bodies.size(); ++b) {
    Material material = soft_material();
    if (!element_triangles_.empty()) {
      for (const std::uint8_t elements : {std::uint8_t{0}, std::uint8_t{1}}) {
        material.color = elements != 0 ? kElementColor : kMatchedColor;
        view_.meshes.push_back(
            {scene_.bodies[b].name, part_of(snapshot.bodies[b], element_triangles_[b], elements), material});
      }
      continue;
    }
    view_.meshes.push_back(body_mesh(snapshot, b));
  }
  for (TriangleMesh& obstacle : snapshot.obstacles)
    view_.meshes.push_back({"obstacle", std::move(obstacle), obstacle_material()});
  for (WetObstacle& wet : snapshot.wet_obstacles) show_film(std::move(wet));
  for (TriangleMesh& blade : snapshot.blades)
    view_.meshes.push_back({"blade", std::move(blade), steel_material()});
  for (const ToolAxis& tool : snapshot.tools) add_tool_axis(view_, tool, camera_);
  view_.liquids.clear();
  if (scene_.fluid) {
    ViewLiquid& liquid =
        view_.liquids.emplace_back(scene_.fluid->looks == LiquidLooks::water ? water() : blood());
    liquid.positions_m = std::move(snapshot.liquid_m);
    liquid.spacing_m = spacing_m();
  }
}

namespace {

/// Per triangle of the seen surface: 1 where elements deform it. Synchronizes.
std::vector<std::uint8_t> element_triangles(ExecContext& ctx, const SoftBody& body) {
  const std::vector<embed::Anchor> anchors = to_host(ctx, body.surface().anchors());
  const std::vector<Index> corners = to_host(ctx, body.surface().triangles());
  std::vector<std::uint8_t> is_element;
  for (std::size_t t = 0; t < corners.size(); t += 3) {
    const auto cube = static_cast<std::size_t>(anchors[static_cast<std::size_t>(corners[t])].cube);
    is_element.push_back(body.shape().elements[cube]);
  }
  return is_element;
}

}  // namespace

std::vector<std::vector<std::uint8_t>> element_triangles(World& world) {
  std::vector<std::vector<std::uint8_t>> all;
  for (const auto& body : world.impl().bodies())
    all.push_back(element_triangles(world.impl().context(), *body));
  return all;
}

}  // namespace tactus
