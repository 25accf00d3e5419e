// A world without cameras: a ball, held by this program, presses a soft slab. Prints its force, writes
// touched.ply.
//   hello_touch scenes/touch.yaml
#include <cmath>
#include <cstdio>

#include "tactus/io/mesh/mesh_file.h"
#include "tactus/io/scene_file.h"
#include "tactus/world/world.h"

using namespace tactus;

int main(int argc, char** argv) try {
  Scene scene = read_scene(argc > 1 ? argv[1] : "scenes/touch.yaml");
  scene.obstacles[0].motion.clear();
  scene.obstacles[0].held = true;  // by set_pose, not by the scene's keyframes
  DeviceSet devices("auto");
  World world(devices, scene, load_body_assets(scene));
  constexpr double kFrame_s = 1.0 / 60;
  double most_N = 0;
  for (int k = 0; k <= 30; ++k) {
    world.set_pose("ball", {Mat3d::identity(), {0, 0.075 - 0.02 * k / 30, 0}});
    const StepReport report = world.step(k > 0 ? kFrame_s : 0);
    for (const BodyContact& c : report.contacts) {
      const Vec3f f = c.reaction.force_N;  // on the ball
      std::printf("frame %2d: %6.3f N up\n", k, static_cast<double>(f.y));
      most_N = std::max(most_N, static_cast<double>(f.y));
    }
  }
  write_ply("touched.ply", world.snapshot().bodies[0]);
  return most_N > 0.1 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
