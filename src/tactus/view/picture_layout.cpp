#include "tactus/view/picture_layout.h"

#include <cmath>
#include <optional>

namespace tactus {
namespace {

/// A surface farther than this many half widths of the picture from its middle hides no light in it, unless
/// it is of a mesh that comes nearer: of that one, parts as far away as the second number count. A close-up
/// would else be lit as if the body ended beside it.
constexpr float kNear = 1.6F, kNearOfSeen = 3.2F;

/// A box that holds the turned one.
Box3f turned(const Box3f& box, const Mat3f& R) {
  const Vec3f center = R * box.center(), half = 0.5F * box.extent();
  Vec3f reach{};
  for (int i = 0; i < 3; ++i)
    reach[i] = std::abs(R(i, 0)) * half.x + std::abs(R(i, 1)) * half.y + std::abs(R(i, 2)) * half.z;
  return {center - reach, center + reach};
}

void unite(std::optional<Box3f>& all, const Box3f& box) {
  all = all ? Box3f{min(all->min, box.min), max(all->max, box.max)} : box;
}

bool is_empty(const Box3f& box) {
  return !(box.min.x <= box.max.x && box.min.y <= box.max.y && box.min.z <= box.max.z);
}

void unite_inside(std::optional<Box3f>& all, const Box3f& box, const Box3f& region) {
  const Box3f inside{max(box.min, region.min), min(box.max, region.max)};
  if (!is_empty(inside)) unite(all, inside);
}

/// Bounds of the meshes that hide light in `region`, as far as they lie in the wider one: triangle by
/// triangle, as parts of one body may be far apart.
std::optional<Box3f> casters(const ViewScene& scene, const Box3f& region, const Box3f& wider) {
  std::optional<Box3f> all;
  for (const ViewMesh& view : scene.meshes) {
    if (!view.casts_shadow) continue;
    std::optional<Box3f> near, of_mesh;
    const auto add = [&](const Box3f& box) {
      unite_inside(near, box, region);
      unite_inside(of_mesh, box, wider);
    };
    if (view.device) {
      add(turned(view.device->box_m, view.R_world_mesh));
    } else {
      const std::vector<Vec3f>& x = view.mesh.positions_m;
      for (const auto& t : view.mesh.triangles) {
        const auto at = [&](std::size_t k) {
          return view.R_world_mesh * x[static_cast<std::size_t>(t.at(k))];
        };
        const Vec3f a = at(0), b = at(1), c = at(2);
        add({min(a, min(b, c)), max(a, max(b, c))});
      }
    }
    if (near) unite(all, *of_mesh);
  }
  return all;
}

/// The part of the ground on which the box may cast a shadow, or hide sky.
Box3f lit_part(const Box3f& box, Vec3f sun, float floor_m, float reach_m) {
  std::optional<Box3f> part;
  const float high_m = max(box.max.y - floor_m, 0.F), low_m = max(box.min.y - floor_m, 0.F);
  unite(part, box);
  for (const float up_m : {low_m, high_m}) {
    // A low sun's shadow ends somewhere: beyond four heights it is left out.
    const float steep = max(sun.y, 0.05F);
    const Vec3f shift{-sun.x / steep, 0, -sun.z / steep};
    const float way = length(shift) > 4 ? 4 / length(shift) : 1.F;
    unite(part, {box.min + way * up_m * shift, box.max + way * up_m * shift});
  }
  const float margin_m = 2 * reach_m + 0.5F * high_m;
  return {part->min - Vec3f{margin_m, 0, margin_m}, part->max + Vec3f{margin_m, 0, margin_m}};
}

LiquidProjection projection_of(const ViewEye& eye) {
  return {to_mat4(inverse(eye.T_world_eye)),
          to_mat4(eye.T_world_eye),
          off_axis(eye.left, eye.right, eye.down, eye.up, eye.near_m, eye.far_m),
          eye.near_m,
          0.5F * (eye.right - eye.left),
          0.5F * (eye.up - eye.down),
          0.5F * (eye.right + eye.left),
          0.5F * (eye.up + eye.down)};
}

}  // namespace

PictureLayout lay_out(const ViewScene& scene, const ViewCamera& camera, float aspect,
                      const ViewEye* seen_by) {
  PictureLayout l;
  l.eye_m = seen_by != nullptr ? seen_by->T_world_eye.t : camera.eye_m();
  const Vec3f eye = l.eye_m;
  const float tangent_y = std::tan(0.5F * camera.fov_rad);
  const float near_m = kNear * camera.distance_m * tangent_y * max(aspect, 1.F);
  l.has_ground = scene.ground && eye.y > scene.ground_height_m;
  const auto region = [&](float half_m) {
    const Vec3f half{half_m, half_m, half_m};
    Box3f box{camera.target_m - half, camera.target_m + half};
    if (l.has_ground) {  // nothing below the ground is seen
      box.min.y = scene.ground_height_m;
      box.max.y = max(box.max.y, scene.ground_height_m + half_m);
    }
    return box;
  };
  const float r = 0.25F * camera.distance_m;
  l.box = casters(scene, region(near_m), region(kNearOfSeen / kNear * near_m))
              .value_or(Box3f{camera.target_m - Vec3f{r, r, r}, camera.target_m + Vec3f{r, r, r}});
  l.sun = normalized(scene.sun, {0, 1, 0});
  const Vec3f center = l.box.center(), half = 0.5F * l.box.extent();
  l.radius_m = max(length(half), 1e-4F);
  l.reach_m = 0.12F * max(2 * max(half.x, half.z), l.radius_m);
  l.floor_m = l.has_ground ? scene.ground_height_m : l.box.min.y;
  l.ground_center = {center.x, scene.ground_height_m, center.z};
  l.ground_radius_m = 3.F * max(l.radius_m, 0.6F * camera.distance_m);
  float far_m = length(eye - center) + 2 * l.ground_radius_m;
  for (const ViewLine& line : scene.lines)
    far_m = max(far_m, 1.01F * max(length(line.from_m - eye), length(line.to_m - eye)));
  for (const ViewBox& box : scene.boxes)
    far_m = max(far_m, 1.01F * (length(box.box_m.center() - eye) + 0.5F * length(box.box_m.extent())));
  l.near_m = 0.02F * camera.distance_m;
  const Rigidf T_cam_world = camera.T_cam_world();
  l.eye = {to_mat4(T_cam_world),
           to_mat4(inverse(T_cam_world)),
           perspective(camera.fov_rad, aspect, l.near_m, far_m),
           l.near_m,
           aspect * tangent_y,
           tangent_y};
  if (seen_by != nullptr) l.eye = projection_of(*seen_by);
  l.near_m = l.eye.near_m;
  l.view_proj = l.eye.clip_eye * l.eye.eye_world;
  const Mat3f R = looking_along(l.sun);
  for (int i = 0; i < 3; ++i)
    l.sun_half_m[i] =
        1.02F * (std::abs(R(i, 0)) * half.x + std::abs(R(i, 1)) * half.y + std::abs(R(i, 2)) * half.z) +
        0.02F * l.radius_m;
  l.sun_clip = orthographic(center, l.sun, l.sun_half_m);
  const float rim_m = 2.5F * l.reach_m;  // the large disc's rim is clear of everything
  l.sky_half_m = {half.x + rim_m, half.z + rim_m, half.y + 0.02F * l.radius_m};
  l.sky_clip = orthographic(center, {0, 1, 0}, l.sky_half_m);
  l.lit_m = lit_part(l.box, l.sun, l.floor_m, l.reach_m);
  return l;
}

}  // namespace tactus
