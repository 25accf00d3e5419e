#include "tactus/cli/viewed_scene.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "tactus/base/error.h"
#include "tactus/cli/run_flags.h"
#include "tactus/io/built_in_meshes.h"
#include "tactus/io/scene_file.h"
#include "tactus/rig/rig_file.h"
#include "tactus/rig/wire/recording_file.h"
#include "tactus/sim/body/body_shape.h"
#include "tactus/sim/held_blades.h"

namespace tactus {
namespace {

/// Rig files have their cameras at the left margin, scenes don't.
bool is_rig_file(const std::string& path) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("cameras:")) return true;
  return false;
}

SourceDescription source_of_rig(const std::string& path) {
  const RigFile rig = read_rig_file(path);
  const auto all = [](const std::vector<std::string>& files) {
    return !files.empty() &&
           std::none_of(files.begin(), files.end(), [](const auto& f) { return f.empty(); });
  };
  SourceDescription source;
  source.path = path;
  source.kind = all(rig.masks) ? SourceKind::masks : all(rig.videos) ? SourceKind::videos : SourceKind::live;
  return source;
}

/// Nobody films these, or a figure is filmed that moves for ever.
void go_on_without_end(SourceDescription& source) {
  if (source.kind == SourceKind::none || source.kind == SourceKind::synthetic)
    source.frames.last = source.frames.first + 1'000'000'000 - 1;  // a year; sources take no more
}

/// In the body's own coordinates.
Box3f bounds_of(const BodyDescription& body, const BodyAssets& assets) {
  const auto half = 0.5F * vec_cast<float>(body.shape.size_m);
  const auto r = static_cast<float>(body.shape.radius_m);
  if (body.shape.kind == ShapeKind::box) return {-half, half};
  if (body.shape.kind == ShapeKind::sphere) return {{-r, -r, -r}, {r, r, r}};
  if (body.shape.kind == ShapeKind::mesh) return bounds(assets.meshes.at(body.name));
  Box3f box = bounds(make_body_shape(body, assets).surface_m);
  for (Vec3f* corner : {&box.min, &box.max})
    *corner = vec_cast<float>(body.placement.to_body(vec_cast<double>(*corner)));
  return {min(box.min, box.max), max(box.min, box.max)};
}

Box3f world_bounds(const Scene& scene) {
  const BodyAssets assets = load_body_assets(scene);
  constexpr float kFar = 1e30F;
  Box3f all{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
  for (const BodyDescription& body : scene.bodies) {
    const Box3f box = bounds_of(body, assets);
    for (int i = 0; i < 8; ++i) {
      const Vec3d corner{i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y,
                         i & 4 ? box.max.z : box.min.z};
      const auto p = vec_cast<float>(body.placement.to_world(corner));
      all = {min(all.min, p), max(all.max, p)};
    }
  }
  return all;
}

/// Beside the bodies: above their near edge, clear of them.
struct ToolPlace {
  Vec3f at_m;
  float size_m = 0;  ///< of the bodies
};
ToolPlace tool_place(const Scene& scene) {
  const Box3f box = world_bounds(scene);
  const float size_m = length(box.extent());
  return {{box.center().x, box.max.y + 0.1F * size_m, box.max.z}, size_m};
}

std::string add_ball(Scene& scene, const ToolPlace& place) {
  ObstacleSetting& ball = scene.obstacles.emplace_back();
  ball.name = "ball of the mouse";
  ball.kind = ObstacleShape::sphere;
  ball.radius_m = static_cast<double>(0.05F * place.size_m);
  ball.held = true;
  ball.placement.position_m = vec_cast<double>(place.at_m);
  return ball.name;
}

/// Its edge is a fifth of the bodies long, from the tip upwards.
std::string add_scalpel(Scene& scene, const ToolPlace& place) {
  BladeDescription& blade = scene.blades.emplace_back();
  blade.name = "scalpel of the mouse";
  blade.held = true;
  blade.from_m = vec_cast<double>(place.at_m + Vec3f{0.15F * place.size_m, 0, 0});
  blade.to_m = blade.from_m + Vec3d{0, static_cast<double>(0.2F * place.size_m), 0};
  return blade.name;
}

/// Its rod reaches from point to point of each body: a thinner one could slip between them.
std::string add_hook(Scene& scene, const ToolPlace& place) {
  double bend_m = static_cast<double>(0.04F * place.size_m);
  for (const BodyDescription& body : scene.bodies)
    bend_m = std::max(bend_m, 0.5 * body.spacing_m / double{kHookRod});
  ObstacleSetting& hook = scene.obstacles.emplace_back();
  hook.name = "hook of the mouse";
  hook.kind = ObstacleShape::mesh;
  hook.path = kHookPath;
  hook.unit_m = bend_m;
  hook.held = true;
  hook.placement.position_m = vec_cast<double>(place.at_m + Vec3f{0.3F * place.size_m, 0, 0});
  return hook.name;
}

/// @throws usage Error where there is none.
void make_cuttable(Scene& scene) {
  bool can_cut = false;
  for (BodyDescription& body : scene.bodies) {
    body.cuttable = body.cuttable || (body.material.model != TissueModel::flsm && body.contact &&
                                      body.shape.fill == MeshFill::closed);
    can_cut = can_cut || body.cuttable;
  }
  if (!can_cut)
    throw usage_error(
        "--tool scalpel: no body of the scene has elements that could be cut ('material.model' tled or "
        "hybrid)");
}

std::vector<std::string> choose_tools(Scene& scene, const std::string& asked, bool adds_hook) {
  if (asked == "none") return {};
  std::vector<std::string> tools = held_names(scene);
  const auto named = std::find(tools.begin(), tools.end(), asked);
  if (named != tools.end()) {
    std::rotate(tools.begin(), named, named + 1);
    return tools;
  }
  if (asked != "auto" && asked != "ball" && asked != "hook" && asked != "scalpel") {
    tools.insert(tools.end(), {"ball", "hook", "scalpel"});
    throw usage_error("--tool '" + asked + "': the scene has nothing of this name with 'held: true'" +
                      suggestion(asked, tools) + "; auto takes the first, or adds a ball");
  }
  if (scene.bodies.empty()) return tools;
  if (asked == "scalpel") make_cuttable(scene);
  const auto any = [&](auto&& is) { return std::any_of(scene.bodies.begin(), scene.bodies.end(), is); };
  const bool touches = any([](const BodyDescription&b) { return b.contact; }),
             is_cuttable = any([](const BodyDescription&b) { return b.cuttable; }),
             has_blade = std::any_of(scene.blades.begin(), scene.blades.end(),
                                     [](const BladeDescription&b) { return b.held; });
  const ToolPlace place = tool_place(scene);
  const bool has_none = tools.empty() && touches;
  if (asked == "ball" || has_none) tools.insert(tools.begin(), add_ball(scene, place));
  if (asked == "scalpel")
    tools.insert(tools.begin(), add_scalpel(scene, place));
  else if (is_cuttable && !has_blade)
    tools.push_back(add_scalpel(scene, place));
  if (asked == "hook")
    tools.insert(tools.begin(), add_hook(scene, place));
  else if (has_none && adds_hook)
    tools.push_back(add_hook(scene, place));
  return tools;
}

}  // namespace

bool is_film(const std::string& path) { return is_recording(path) || is_rig_file(path); }

ViewedScene viewed_scene(const std::string& path, const std::string& source_path, const std::string& tool,
                         bool adds_hook) {
  if (!std::filesystem::exists(path)) throw Error("'" + path + "': no such file");
  ViewedScene viewed;
  Scene& scene = viewed.scene;
  if (is_film(path)) {
    if (!source_path.empty())
      throw usage_error("--source '" + source_path + "' replaces the source of a scene, but '" + path +
                        "' is " + (is_recording(path) ? "a recording" : "a rig file"));
    scene.name = std::filesystem::path(path).stem().string();
    scene.source = is_recording(path) ? source_of_file(path, "") : source_of_rig(path);
  } else {
    scene = read_scene(path);
  }
  if (!source_path.empty())
    scene.source = source_of_file(source_path, "--source ");
  else
    go_on_without_end(scene.source);
  viewed.tools = choose_tools(scene, tool, adds_hook);
  return viewed;
}

}  // namespace tactus
