#include "tactus/web/stream_scene.h"
#include "tactus/track/blade_tracker.h"

#include <algorithm>

#include "tactus/geom/mesh/mesh_creases.h"
#include "tactus/sim/held_blades.h"
#include "tactus/sim/still_obstacles.h"
#include "tactus/web/json_text.h"

namespace tactus {
namespace {

constexpr Vec3f kClay{0.83F, 0.57F, 0.43F}, kSteel{0.72F, 0.74F, 0.77F}, kGrey{0.62F, 0.65F, 0.69F};
constexpr Vec3f kCameraBlue{0.20F, 0.42F, 0.60F}, kDepthBrown{0.62F, 0.35F, 0.20F},
    kEdge{0.55F, 0.58F, 0.62F};
constexpr Vec3f kBlood{0.55F, 0.03F, 0.05F}, kWater{0.35F, 0.60F, 0.75F};
/// Colours of a tool's axis that colour-blind people tell apart (Okabe and Ito).
constexpr Vec3f kKnown{0.00F, 0.45F, 0.70F}, kOther{0.84F, 0.37F, 0.00F}, kUnsure{0.90F, 0.62F, 0.00F};
/// The obstacle below isn't to be seen through its film.
constexpr float kAbove_m = 1e-4F;
/// As in pictures (run_pictures.cpp).
constexpr int kNormalPasses = 6;

Vec3f tool_color(BladeState state) {
  if (state == BladeState::known) return kKnown;
  return state == BladeState::misfit || state == BladeState::twins ? kOther : kUnsure;
}

/// Liquid and its stains; none where all is dry.
std::string film_bytes(const FilmThickness& lies) {
  std::string bytes(lies.film_m.size(), '\0');
  bool is_wet = false;
  for (std::size_t v = 0; v < bytes.size(); ++v) {
    const float stain_m = v < lies.stain_m.size() ? lies.stain_m[v] : 0;
    const float steps = std::max(lies.film_m[v], stain_m) / kFilmStep_m;
    bytes[v] = static_cast<char>(static_cast<std::uint8_t>(steps >= 255 ? 255
                                                           : steps > 0  ? steps + 0.5F
                                                                        : 0));
    is_wet = is_wet || bytes[v] != 0;
  }
  return is_wet ? bytes : "";
}

nlohmann::json vector_json(Vec3d v) { return {v.x, v.y, v.z}; }

void append(std::vector<Vec3f>& to, const std::vector<Vec3f>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

}  // namespace

std::vector<Vec3f> frustum_lines(const Camera& camera, double depth_m) {
  const Vec3d eye = camera.center_world(), axis = camera.axis_world();
  const double w = camera.width_px - 0.5, h = camera.height_px - 0.5;
  std::array<Vec3f, 4> corners;
  const std::array<Vec2d, 4> pixels{Vec2d{-0.5, -0.5}, Vec2d{w, -0.5}, Vec2d{w, h}, Vec2d{-0.5, h}};
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3d ray = pixel_ray_world(camera, pixels[i].x, pixels[i].y);
    corners[i] = vec_cast<float>(eye + (depth_m / dot(ray, axis)) * ray);
  }
  std::vector<Vec3f> lines;
  for (std::size_t i = 0; i < 4; ++i)
    append(lines, {vec_cast<float>(eye), corners[i], corners[i], corners[(i + 1) % 4]});
  return lines;
}

std::vector<Vec3f> box_lines(const Box3f& box_m) {
  std::vector<Vec3f> lines;
  for (int axis = 0; axis < 3; ++axis) {
    for (int corner = 0; corner < 4; ++corner) {
      Vec3f from = box_m.min;
      for (int k = 0; k < 2; ++k) {
        const int other = (axis + 1 + k) % 3;
        if ((corner >> k & 1) != 0) from[other] = box_m.max[other];
      }
      Vec3f to = from;
      to[axis] = box_m.max[axis];
      append(lines, {from, to});
    }
  }
  return lines;
}

void CreaseMemory::split(TriangleMesh& mesh, std::string& film, std::size_t body, Index first) {
  Split& last = splits_[body];
  if (last.whole != mesh.triangles) {
    last.whole = mesh.triangles;
    TriangleMesh parted = mesh;
    split_creases(parted, first);
    last.origin.assign(parted.positions_m.size(), 0);
    for (std::size_t t = 0; t < parted.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        last.origin[static_cast<std::size_t>(parted.triangles[t][k])] = mesh.triangles[t][k];
    last.parted = std::move(parted.triangles);
  }
  TriangleMesh parted;
  parted.positions_m.reserve(last.origin.size());
  for (const Index vertex : last.origin)
    parted.positions_m.push_back(mesh.positions_m[static_cast<std::size_t>(vertex)]);
  if (!film.empty()) {
    std::string parted_film;
    for (const Index vertex : last.origin) parted_film += film[static_cast<std::size_t>(vertex)];
    film = std::move(parted_film);
  }
  parted.triangles = last.parted;
  compute_normals(parted);
  mesh = std::move(parted);
}

StreamScene::StreamScene(const Scene& scene, const Rig& rig, const BodyAssets& assets, RunFacts facts)
    : name_(scene.name), facts_(std::move(facts)), view_(scene.view), liquid_(scene.fluid) {
  for (const BodyDescription& body : scene.bodies) {
    bodies_.push_back({body.name, vec_cast<float>(body.colour), body.cuttable});
    if (body.contact) grabbed_.push_back(body.name);
  }
  held_ = held_names(scene);
  for (const ObstacleSetting& o : scene.obstacles) {
    if (o.moves()) moving_.push_back(o.name);
    film_names_[o.name] = "film on " + o.name;
  }
  film_names_[kLiquidFloorName] = std::string("film on ") + kLiquidFloorName;
  for (const BladeDescription& blade : scene.blades)
    if (blade.held) held_blades_.push_back(blade);
  for (StillObstacle& o : still_obstacles(scene, assets)) {
    still_names_.push_back({o.name, kGrey});
    still_meshes_.push_back(std::move(o.mesh));
  }
  const double depth_m = 0.12 * static_cast<double>(length(rig.workspace_m.extent()));
  for (const Camera& camera : rig.cameras) append(frusta_, frustum_lines(camera, depth_m));
  for (const Camera& camera : rig.depth_cameras) append(depth_frusta_, frustum_lines(camera, depth_m));
  if (!rig.cameras.empty()) append(edges_, box_lines(rig.workspace_m));
  if (scene.fluid)
    append(edges_,
           box_lines({vec_cast<float>(scene.fluid->box.min_m), vec_cast<float>(scene.fluid->box.max_m)}));
}

std::string StreamScene::setting_json(bool control, std::span<const SceneParameter> parameters) const {
  const ViewCameraDescription& camera = view_.camera;
  nlohmann::json json{{"format", "tactus web stream"},
                      {"scene", name_},
                      {"version", facts_.version},
                      {"commit", facts_.commit},
                      {"machine", facts_.machine},
                      {"devices", facts_.devices},
                      {"control", control},
                      {"held", held_},
                      {"grabbed", grabbed_},
                      {"show_cameras", view_.show_frusta}};
  nlohmann::json& shown = json["camera"] = {{"azimuth_deg", camera.azimuth_deg},
                                            {"elevation_deg", camera.elevation_deg},
                                            {"field_of_view_deg", camera.field_of_view_deg}};
  if (camera.target_m) shown["target_m"] = vector_json(*camera.target_m);
  if (camera.eye_m) shown["eye_m"] = vector_json(*camera.eye_m);
  if (camera.distance_m) shown["distance_m"] = *camera.distance_m;
  for (const BladeDescription& blade : held_blades_)
    json["blades"][blade.name] = {{"from_m", vector_json(blade.from_m)}, {"to_m", vector_json(blade.to_m)}};
  if (liquid_) json["liquid_spacing_m"] = liquid_->spacing_m;
  for (const SceneParameter& p : parameters)  // a bound that isn't finite is null
    json["parameters"].push_back({{"name", p.name},
                                  {"unit", p.unit},
                                  {"meaning", p.meaning},
                                  {"value", p.value},
                                  {"least", p.least},
                                  {"most", p.most}});
  return json_text(json);
}

std::string StreamScene::setting(bool control, std::span<const SceneParameter> parameters) const {
  StreamMessage message(StreamKind::setting, 0, 0, 0);
  message.add_json({BlockRole::setting, "setting"}, setting_json(control, parameters));
  for (std::size_t i = 0; i < still_meshes_.size(); ++i)
    message.add_surface({BlockRole::obstacle, still_names_[i].name, kGrey}, still_meshes_[i]);
  if (!frusta_.empty()) message.add_lines({BlockRole::camera, "cameras", kCameraBlue}, frusta_);
  if (!depth_frusta_.empty())
    message.add_lines({BlockRole::camera, "depth cameras", kDepthBrown}, depth_frusta_);
  if (!edges_.empty()) message.add_lines({BlockRole::box, "edges", kEdge}, edges_);
  return message.take();
}

std::vector<StreamScene::Surface> StreamScene::surfaces(const FrameSnapshot& snapshot, CreaseMemory& creases,
                                                        bool lifts_sheets) const {
  std::vector<Surface> all;
  if (!snapshot.real.triangles.empty()) all.push_back({{BlockRole::real, "real", kClay}, snapshot.real, {}});
  for (std::size_t b = 0; b < snapshot.bodies.size(); ++b) {
    Surface& body = all.emplace_back(
        Surface{{BlockRole::body, bodies_[b].name, bodies_[b].color}, snapshot.bodies[b], {}});
    if (b < snapshot.films.size() && snapshot.films[b].film_m.size() == body.mesh.positions_m.size())
      body.film = film_bytes(snapshot.films[b]);
    if (bodies_[b].is_cuttable) creases.split(body.mesh, body.film, b, snapshot.smooth[b]);
    smooth_normals(body.mesh, kNormalPasses);
  }
  for (std::size_t o = 0; o < snapshot.obstacles.size(); ++o)
    all.push_back({{BlockRole::obstacle, moving_[o], kGrey}, snapshot.obstacles[o], {}});
  for (const WetObstacle& wet : snapshot.wet_obstacles) {
    const auto name = film_names_.find(wet.name);
    std::string bytes = film_bytes(wet.film);
    if (name == film_names_.end() || bytes.empty()) continue;
    Surface& film =
        all.emplace_back(Surface{{BlockRole::obstacle, name->second, kGrey, 0}, wet.mesh, std::move(bytes)});
    film.is_sheet = std::find(moving_.begin(), moving_.end(), wet.name) == moving_.end();
    const bool is_lifted = lifts_sheets || !film.is_sheet;
    for (std::size_t v = 0; v < wet.mesh.positions_m.size(); ++v)
      film.mesh.positions_m[v] += (kAbove_m + (is_lifted ? wet.film.film_m[v] : 0)) * wet.mesh.normals[v];
  }
  for (std::size_t b = 0; b < snapshot.blades.size(); ++b) {
    // As a view: the conditional operator would copy the name, and the style would view the dead copy.
    const std::string_view name = b < held_blades_.size() ? std::string_view(held_blades_[b].name) : "blade";
    all.push_back({{BlockRole::blade, name, kSteel}, snapshot.blades[b], {}});
  }
  return all;
}

std::vector<StreamScene::Points> StreamScene::points(const FrameSnapshot& snapshot) const {
  std::vector<Points> all;
  for (const ToolAxis& tool : snapshot.tools)
    all.push_back(
        {BlockKind::lines, {BlockRole::tool, tool.name, tool_color(tool.state)}, {tool.from_m, tool.to_m}});
  if (!liquid_) return all;
  const bool is_water = liquid_->looks == LiquidLooks::water;
  all.push_back({BlockKind::particles,
                 {BlockRole::liquid, is_water ? "water" : "blood", is_water ? kWater : kBlood},
                 snapshot.liquid_m});
  return all;
}

std::string StreamScene::frame(const StreamFrame& frame, CreaseMemory& creases) const {
  StreamMessage message(StreamKind::frame, static_cast<std::uint32_t>(frame.number), frame.time_s,
                        frame.captured_unix_s);
  for (const Surface& s : surfaces(*frame.snapshot, creases)) message.add_surface(s.style, s.mesh, s.film);
  for (const Points& p : points(*frame.snapshot))
    p.kind == BlockKind::lines ? message.add_lines(p.style, p.positions_m)
                               : message.add_particles(p.style, p.positions_m);
  if (frame.status) message.add_json({BlockRole::status, "status"}, *frame.status);
  return message.take();
}

}  // namespace tactus
