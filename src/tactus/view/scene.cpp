#include "tactus/view/scene.h"

namespace tactus {

namespace {

/// A prism around the z axis: `corners` of its rings are at radius.x and radius.y times those of a circle.
void add_prism(TriangleMesh& mesh, const Rigidf& T, Index corners, Vec3f radius_m, float from_m, float to_m) {
  const auto first = static_cast<Index>(mesh.positions_m.size());
  for (Index k = 0; k < corners; ++k) {
    const SinCos a = sin_cos(2 * kPi * (static_cast<float>(k) + 0.5F) / static_cast<float>(corners));
    for (const float z : {from_m, to_m})
      mesh.positions_m.push_back(T * Vec3f{radius_m.x * a.cos, radius_m.y * a.sin, z});
  }
  for (Index k = 0; k < corners; ++k) {
    const Index a = first + 2 * k, b = first + 2 * ((k + 1) % corners);
    mesh.triangles.push_back({a, b, a + 1});
    mesh.triangles.push_back({b, b + 1, a + 1});
    if (k < 2) continue;
    mesh.triangles.push_back({first, first + 2 * k, first + 2 * (k - 1)});
    mesh.triangles.push_back({first + 1, first + 2 * k - 1, first + 2 * k + 1});
  }
}

}  // namespace

void add_camera(ViewScene& scene, const Camera& camera, float depth_m, Vec3f color) {
  const Vec3d eye = camera.center_world();
  const double right = camera.width_px - 0.5, bottom = camera.height_px - 0.5;
  const double corners[4][2] = {{-0.5, -0.5}, {right, -0.5}, {right, bottom}, {-0.5, bottom}};
  Vec3f rim[4];
  for (int i = 0; i < 4; ++i) {
    const Vec3d ray = pixel_ray_world(camera, corners[i][0], corners[i][1]);
    rim[i] = vec_cast<float>(eye + (depth_m / dot(ray, camera.axis_world())) * ray);
  }
  const auto eye_m = vec_cast<float>(eye);
  for (int i = 0; i < 4; ++i) {
    constexpr float kBegin = 0.4F;  // before the lens, which they don't cross out
    scene.lines.push_back({eye_m + kBegin * (rim[i] - eye_m), rim[i], color, 1.2F});
    scene.lines.push_back({rim[i], rim[(i + 1) % 4], color, 2.F});
  }
  const Rigidd T_world_cam = inverse(camera.T_cam_world);
  const Rigidf T{mat_cast<float>(T_world_cam.R), vec_cast<float>(T_world_cam.t)};
  const float size_m = 0.26F * depth_m;
  for (const bool is_lens : {false, true}) {
    ViewMesh part{.name = camera.name, .casts_shadow = false};
    part.material = {.color = is_lens ? Vec3f{0.10F, 0.11F, 0.13F} : color,
                     .roughness = is_lens ? 0.25F : 0.6F};
    if (is_lens)
      add_prism(part.mesh, T, 20, 0.62F * size_m * Vec3f{1, 1, 1}, -0.5F * size_m, 0.25F * size_m);
    else
      add_prism(part.mesh, T, 4, size_m * Vec3f{1.6F, 1.1F, 0}, -2.0F * size_m, -0.5F * size_m);
    scene.meshes.push_back(std::move(part));
  }
  if (camera.name.empty()) return;
  Vec3f top = 0.5F * (rim[0] + rim[1]);
  for (int i = 1; i < 4; ++i) {
    const Vec3f middle = 0.5F * (rim[i] + rim[(i + 1) % 4]);
    if (middle.y > top.y) top = middle;
  }
  scene.labels.push_back({top, camera.name, 0.7F * color});
}

void add_far_edges(std::vector<ViewLine>& lines, const ViewBox& box, Vec3f eye_m) {
  const Box3f& b = box.box_m;
  const auto corner = [&](int i) {
    return Vec3f{i & 1 ? b.max.x : b.min.x, i & 2 ? b.max.y : b.min.y, i & 4 ? b.max.z : b.min.z};
  };
  // Whether the eye is on the inner side of the side of `axis`.
  const auto is_far = [&](int axis, bool high) {
    return high ? eye_m[axis] < b.max[axis] : eye_m[axis] > b.min[axis];
  };
  for (int i = 0; i < 8; ++i) {
    for (int along = 0; along < 3; ++along) {
      if ((i >> along & 1) != 0) continue;
      const int u = (along + 1) % 3, v = (along + 2) % 3;
      if (!is_far(u, (i >> u & 1) != 0) && !is_far(v, (i >> v & 1) != 0)) continue;
      lines.push_back({corner(i), corner(i | 1 << along), box.color, box.width_px});
    }
  }
}

}  // namespace tactus
