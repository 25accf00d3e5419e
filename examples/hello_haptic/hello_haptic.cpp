// A haptic loop: 1,000 times a second a stylus's pose goes in and the force on it comes out, for 10 s.
// Prints how long steps take, and the energy that the hand got: a passive world never gives any.
//   taskset -c 0 hello_haptic scenes/touch.yaml      on one core
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>

#include "tactus/io/scene_file.h"
#include "tactus/world/world.h"

using namespace tactus;
using Clock = std::chrono::steady_clock;

// Where a hand might be: from the slab's skin to 8 mm in it, twice a second. Read an arm here.
double stylus_y_m(double t_s) { return 0.065 - 0.004 * (1 - std::cos(4 * 3.14159265 * t_s)); }

int main(int argc, char** argv) try {
  constexpr int kSteps = 10000;
  constexpr double kStep_s = 1e-3;
  Scene scene = read_scene(argc > 1 ? argv[1] : "scenes/touch.yaml");
  scene.bodies[0].shape.size_m = {0.16, 0.04, 0.16};  // 1,024 cubes
  scene.frame.start = FrameStart::settled;
  ObstacleSetting& stylus = scene.obstacles[0];
  stylus.kind = ObstacleShape::box;
  stylus.size_m = {0.008, 0.05, 0.008};
  stylus.motion.clear();
  stylus.held = true;
  DeviceSet devices("cpu");
  World world(devices, scene, load_body_assets(scene));

  world.step(0);  // the slab settles
  std::vector<double> step_ms;
  double force_N = 0, most_N = 0, energy_J = 0, most_J = 0;
  Clock::time_point due = Clock::now();
  for (int k = 1; k <= kSteps; ++k) {
    const double y_m = stylus_y_m(k * kStep_s), by_m = y_m - stylus_y_m((k - 1) * kStep_s);
    energy_J += force_N * by_m;  // the arm held the last force until now
    most_J = std::max(most_J, energy_J);
    const Clock::time_point begin = Clock::now();
    world.set_pose(stylus.name, {Mat3d::identity(), {0, y_m, 0}});
    const StepReport report = world.step(kStep_s);
    force_N = 0;
    for (const BodyContact& c : report.contacts) force_N += static_cast<double>(c.reaction.force_N.y);
    most_N = std::max(most_N, force_N);
    step_ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
    due = std::max(due + std::chrono::milliseconds(1), Clock::now());
    std::this_thread::sleep_until(due);
  }
  std::printf("%zu steps: p50 %.3f ms, p99 %.3f ms\n", step_ms.size(), percentile(step_ms, 50),
              percentile(step_ms, 99));
  std::printf("at most %.2f N; the hand gave %.4f J and got at most %.2g J\n", most_N, -energy_J, most_J);
  return most_N > 0.1 && most_J <= 0 ? 0 : 1;
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
