#include "tactus/view/scene.h"

namespace tactus {

void add_frustum(ViewScene& scene, const Camera& camera, float depth_m, Vec3f color) {
  const Vec3d eye = camera.center_world();
  const double right = camera.width_px - 0.5, bottom = camera.height_px - 0.5;
  const double corners[4][2] = {{-0.5, -0.5}, {right, -0.5}, {right, bottom}, {-0.5, bottom}};
  Vec3f rim[4];
  for (int i = 0; i < 4; ++i) {
    const Vec3d ray = pixel_ray_world(camera, corners[i][0], corners[i][1]);
    rim[i] = vec_cast<float>(eye + (depth_m / dot(ray, camera.axis_world())) * ray);
  }
  for (int i = 0; i < 4; ++i) {
    scene.lines.push_back({vec_cast<float>(eye), rim[i], color, 1.2F});
    scene.lines.push_back({rim[i], rim[(i + 1) % 4], color, 2.F});
  }
}

void add_box(ViewScene& scene, const Box3f& box_m, Vec3f color) {
  const auto corner = [&](int i) {
    return Vec3f{i & 1 ? box_m.max.x : box_m.min.x, i & 2 ? box_m.max.y : box_m.min.y,
                 i & 4 ? box_m.max.z : box_m.min.z};
  };
  for (int i = 0; i < 8; ++i) {
    for (const int bit : {1, 2, 4}) {
      if ((i & bit) == 0) scene.lines.push_back({corner(i), corner(i | bit), color, 1.2F});
    }
  }
}

}  // namespace tactus
