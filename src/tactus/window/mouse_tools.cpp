#include "tactus/window/mouse_tools.h"

#include <algorithm>
#include <cmath>

#include "tactus/io/built_in_meshes.h"
#include "tactus/sim/scene.h"

namespace tactus {
namespace {

/// A blade's tip goes this much of its edge into the body under the mouse.
constexpr double kDeep = 0.5;
/// And is put down in front of it by so much.
constexpr double kClear = 0.1;

/// Distance along the ray at which it meets a triangle from either side (Moeller and Trumbore 1997).
std::optional<float> hit(Vec3f from, Vec3f way, Vec3f a, Vec3f b, Vec3f c) {
  const Vec3f ab = b - a, ac = c - a, p = cross(way, ac);
  const float det = dot(ab, p);
  if (std::abs(det) < 1e-20F) return {};
  const Vec3f to = from - a, q = cross(to, ab);
  const float u = dot(to, p) / det, v = dot(way, q) / det, t = dot(ac, q) / det;
  if (u < 0 || v < 0 || u + v > 1 || t <= 0) return {};
  return t;
}

}  // namespace

std::optional<PickedPoint> pick(std::span<const TriangleMesh> bodies, const ViewCamera& camera,
                                PicturePoint at_px, PicturePoint size_px) {
  const Vec3f from = camera.eye_m(), way = normalized(point_under(camera, at_px, size_px, 1) - from);
  std::optional<PickedPoint> picked;
  float nearest_m = INFINITY;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const std::vector<Vec3f>& x_m = bodies[b].positions_m;
    for (const auto& t : bodies[b].triangles) {
      const auto corner = [&](std::size_t k) { return x_m[static_cast<std::size_t>(t[k])]; };
      const std::optional<float> far_m = hit(from, way, corner(0), corner(1), corner(2));
      if (!far_m || !(*far_m < nearest_m)) continue;
      nearest_m = *far_m;
      picked = PickedPoint{b, t[0], from + *far_m * way};
      for (std::size_t k = 1; k < 3; ++k)
        if (length(corner(k) - picked->at_m) <
            length(x_m[static_cast<std::size_t>(picked->vertex)] - picked->at_m))
          picked->vertex = t[k];
    }
  }
  return picked;
}

MouseTools::MouseTools(const Scene& scene, std::span<const std::string> tools, RunControl& control)
    : scene_(scene), control_(control) {
  for (const std::string& name : tools) {
    Tool& tool = tools_.emplace_back(Tool{.name = name, .from_m = {}, .to_m = {}});
    for (const ObstacleSetting& obstacle : scene.obstacles)
      tool.is_hook |= obstacle.name == name && obstacle.path == kHookPath;
    for (const BladeDescription& blade : scene.blades) {
      if (!blade.held || blade.name != name) continue;
      tool.is_blade = true;
      tool.from_m = blade.from_m;
      tool.to_m = blade.to_m;
    }
  }
}

void MouseTools::take_next_tool() {
  if (!tools_.empty()) in_hand_ = (in_hand_ + 1) % tools_.size();
  blade_depth_m_.reset();
}

void MouseTools::release() {
  blade_depth_m_.reset();
  grasp_.reset();
}

void MouseTools::follow(const WindowInput& input, const ViewedFrame& frame, const ViewCamera& camera,
                        PicturePoint size_px) {
  pull(input, frame, camera, size_px);
  if (!grasp_ && !tools_.empty()) hold_tool(input, frame, camera, size_px);
}

/// A blade points away from the eye, so a drag across the picture cuts as deep as its tip is. Others don't
/// turn.
Rigidd MouseTools::pose_of(const Tool& tool, Vec3f at_m, const ViewCamera& camera) const {
  const Vec3d at = vec_cast<double>(at_m);
  if (!tool.is_blade) return {Mat3d::identity(), at};
  const auto frame_of = [](Vec3d z, Vec3d near_y) {
    const Vec3d x = normalized(cross(near_y, z));
    return transpose(Mat3d({x, cross(z, x), z}));
  };
  const Vec3d edge = normalized(tool.to_m - tool.from_m),
              across = std::abs(edge.y) < 0.9 ? Vec3d{0, 1, 0} : Vec3d{0, 0, 1};
  const Vec3d up = vec_cast<double>(camera.T_cam_world().R.row[1]);
  const Mat3d R =
      frame_of(normalized(vec_cast<double>(camera.eye_m()) - at), up) * transpose(frame_of(edge, across));
  return {R, at - R * tool.from_m};
}

/// In the plane through the tool that faces the camera; the wheel moves that plane.
void MouseTools::hold_tool(const WindowInput& input, const ViewedFrame& frame, const ViewCamera& camera,
                           PicturePoint size_px) {
  const Tool& tool = tools_[in_hand_];
  const bool moves = input.moved == Drag::tool || input.begun == Drag::tool;
  const auto seen = std::find_if(frame.tools.begin(), frame.tools.end(),
                                 [&](const ViewedTool& t) { return t.name == tool.name; });
  if (seen == frame.tools.end() || !(moves || input.tool_wheel != 0)) return;
  if (tool.is_blade && input.begun == Drag::tool) put_blade(input, frame, camera, size_px);
  if (tool.is_hook && input.begun == Drag::tool) turn_hook(tool, *seen, frame, camera);
  const Rigidd T = control_.asked_pose(tool.name).value_or(seen->T_world);
  const auto from_m = vec_cast<float>(tool.is_blade ? T * tool.from_m : T.t);
  const float depth = blade_depth_m_.value_or(depth_m(camera, from_m)) * std::pow(1.02F, input.tool_wheel);
  if (blade_depth_m_) blade_depth_m_ = depth;
  const std::optional<PicturePoint> at = project(camera, from_m, size_px);
  if (!at && !moves) return;
  const Vec3f to_m = point_under(camera, moves ? input.mouse_px : *at, size_px, depth);
  Rigidd asked = pose_of(tool, to_m, camera);
  if (!tool.is_blade) asked.R = T.R;
  control_.move_tool(tool.name, asked);
}

/// It is put down in front of the surface there, so it cuts nothing on its way there. Where nothing is seen,
/// it goes on from where it is.
void MouseTools::put_blade(const WindowInput& input, const ViewedFrame& frame, const ViewCamera& camera,
                           PicturePoint size_px) {
  const Tool& tool = tools_[in_hand_];
  const auto picked = pick(frame.snapshot->bodies, camera, input.pressed_px, size_px);
  blade_depth_m_.reset();
  if (!picked) return;
  const Vec3f to_eye = normalized(camera.eye_m() - picked->at_m);
  const double edge_m = length(tool.to_m - tool.from_m);
  control_.put_tool(tool.name,
                    pose_of(tool, picked->at_m + static_cast<float>(kClear * edge_m) * to_eye, camera));
  blade_depth_m_ = depth_m(camera, picked->at_m - static_cast<float>(kDeep * edge_m) * to_eye);
}

/// Its plane faces the eye, its shaft points up on the picture, and its tip to the bodies' middle: so it
/// comes from either side. One that touches something stays as it is.
void MouseTools::turn_hook(const Tool& tool, const ViewedTool& seen, const ViewedFrame& frame,
                           const ViewCamera& camera) {
  if (seen.force_N > 0) return;
  Vec3d right = vec_cast<double>(camera.T_cam_world().R.row[0]);
  const Vec3d up = vec_cast<double>(camera.T_cam_world().R.row[1]);
  Vec3d middle_m{};
  for (const TriangleMesh& body : frame.snapshot->bodies)
    middle_m +=
        (1.0 / static_cast<double>(frame.snapshot->bodies.size())) * vec_cast<double>(bounds(body).center());
  if (dot(middle_m - seen.T_world.t, right) > 0) right = -1 * right;
  control_.put_tool(tool.name, {transpose(Mat3d({right, up, cross(right, up)})), seen.T_world.t});
}

void MouseTools::pull(const WindowInput& input, const ViewedFrame& frame, const ViewCamera& camera,
                      PicturePoint size_px) {
  if (input.begun == Drag::grab && !grasp_) {
    const auto picked = pick(frame.snapshot->bodies, camera, input.pressed_px, size_px);
    if (!picked || !scene_.bodies[picked->body].contact) return;
    grasp_.emplace(Grasp{*picked, {}, depth_m(camera, picked->at_m)});
    grasp_->grab.body = scene_.bodies[picked->body].name;
    grasp_->grab.point_m = vec_cast<double>(picked->at_m);
  }
  if (!grasp_) return;
  if (input.is_released) {
    grasp_.reset();
    return control_.set_grab(std::nullopt);
  }
  grasp_->depth_m *= std::pow(1.02F, input.tool_wheel);
  grasp_->grab.target_m = vec_cast<double>(point_under(camera, input.mouse_px, size_px, grasp_->depth_m));
  control_.set_grab(grasp_->grab);
}

std::optional<MouseTools::Spring> MouseTools::spring(const ViewedFrame& frame) const {
  if (!grasp_) return {};
  const std::vector<Vec3f>& x_m = frame.snapshot->bodies.at(grasp_->point.body).positions_m;
  return Spring{x_m.at(static_cast<std::size_t>(grasp_->point.vertex)),
                vec_cast<float>(grasp_->grab.target_m)};
}

}  // namespace tactus
