// The smallest whole use of the library: silhouettes in, the visual hull of a sphere out.
//   cmake -S examples/hello_hull -B build-hello -DCMAKE_PREFIX_PATH=/where/tactus/is && cmake --build
//   build-hello
#include <tactus/geom/mesh/mesh.h>
#include <tactus/reconstruct/visual_hull.h>

#include <cmath>
#include <cstdio>
#include <vector>

using tactus::Vec3d;

constexpr Vec3d kCenter_m{0, 0.5, 0};
constexpr double kRadius_m = 0.3;

// The pixels whose rays meet the sphere. Yours come from photographs, by background subtraction.
tactus::BitMask silhouette(const tactus::Camera& camera) {
  tactus::BitMask mask(camera.width_px, camera.height_px);
  const Vec3d to_center_m = kCenter_m - camera.center_world();
  for (tactus::Index y = 0; y < camera.height_px; ++y)
    for (tactus::Index x = 0; x < camera.width_px; ++x) {
      if (length(cross(pixel_ray_world(camera, x, y), to_center_m)) < kRadius_m) mask.set(x, y);
    }
  return mask;
}

int main() {
  std::vector<tactus::Camera> cameras;
  std::vector<tactus::BitMask> silhouettes;
  for (int k = 0; k < 8; ++k) {
    const double turn_rad = k * 0.785, height_m = k % 2 == 0 ? 0.4 : 1.2;
    cameras.push_back(tactus::look_at({1.6 * std::sin(turn_rad), height_m, 1.6 * std::cos(turn_rad)},
                                      kCenter_m, {0, 1, 0}, 640, 480, 600));
    silhouettes.push_back(silhouette(cameras.back()));
  }

  tactus::DeviceSet devices("auto");  // a GPU when there is one
  tactus::VisualHull hull(devices, cameras,
                          {.workspace_m = {{-0.5F, 0, -0.5F}, {0.5F, 1, 0.5F}}, .resolution = 64});
  hull.upload(silhouettes);
  hull.reconstruct();
  const tactus::TriangleMesh mesh = hull.download();

  const double volume_m3 = tactus::volume_m3(mesh), truth_m3 = 4.18879 * std::pow(kRadius_m, 3);
  std::printf("%s: %zu triangles, %.4f m^3 (the sphere has %.4f)\n", devices.name().c_str(),
              mesh.triangles.size(), volume_m3, truth_m3);
  // The hull holds the object and, with 8 cameras, little more.
  return volume_m3 > 0.97 * truth_m3 && volume_m3 < 1.15 * truth_m3 ? 0 : 1;
}
