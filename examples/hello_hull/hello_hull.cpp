// The smallest whole use of the library: silhouettes of a known sphere in, its visual hull out.
//   cmake -S examples/hello_hull -B build-hello -DCMAKE_PREFIX_PATH=/where/tactus/is && cmake --build
//   build-hello
#include <tactus/reconstruct/visual_hull.h>
#include <tactus/rig/synthetic/synthetic_source.h>

#include <cmath>
#include <cstdio>

int main() {
  tactus::SyntheticOptions options;
  options.figure = "sphere";
  tactus::SyntheticSource source(options);
  tactus::FrameSet frame;
  if (source.next(frame) != tactus::NextFrame::success) return 1;

  tactus::DeviceSet devices("auto");  // a GPU when there is one
  tactus::VisualHull hull(devices, source.rig().cameras,
                          {.workspace_m = source.rig().workspace_m, .resolution = 64});
  hull.upload(frame.silhouettes);
  hull.reconstruct();
  const tactus::TriangleMesh mesh = hull.download();

  const double volume_m3 = tactus::volume_m3(mesh), truth_m3 = frame.truth_volume_m3.value_or(0);
  std::printf("%s: %zu triangles, %.4f m^3 (the sphere has %.4f)\n", devices.name().c_str(),
              mesh.triangles.size(), volume_m3, truth_m3);
  // The hull holds the object and, with 8 cameras, little more.
  return volume_m3 > 0.97 * truth_m3 && volume_m3 < 1.15 * truth_m3 ? 0 : 1;
}
