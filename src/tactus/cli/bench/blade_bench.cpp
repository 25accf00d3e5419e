#include "tactus/cli/bench/blade_bench.h"

#include <cmath>

#include "bench.h"
#include "tactus/base/timing.h"
#include "tactus/geom/image/rasterize.h"
#include "tactus/geom/maths/rotation.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/rig/synthetic/synthetic_noise.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/track/blade_tracker.h"

namespace tactus::bench {
namespace {

constexpr double kFrame_s = 1.0 / 30;

/// The built-in scalpel in a stroke of 5 cm, as eight cameras see it.
struct Stroke {
  BladeModel model = built_in_scalpel();
  std::vector<Camera> cameras;
  std::vector<std::vector<BitMask>> masks;  ///< of each frame, of each camera

  Stroke(const NoiseOptions& noise, Vec2i size_px, double focal_px, int frames) {
    SyntheticRigOptions options;
    options.depth_cameras = 0;
    options.width_px = size_px.x;
    options.height_px = size_px.y;
    options.focal_px = focal_px;
    const Rig rig = make_synthetic_rig(options);
    for (std::size_t c = 0; c < rig.cameras.size(); ++c)
      cameras.push_back(miscalibrate(rig.cameras[c], noise, static_cast<int>(c)));
    for (int k = 0; k < frames; ++k) {
      check_stop();
      const double a_m = 0.05 * std::sin(2 * M_PI * k * kFrame_s / 6);
      const Rigidd T{rotation_from_vector({0.5, 4 * a_m, 0.3}), {a_m, 0.5, 0.5 * a_m}};
      TriangleMesh posed = model.mesh;
      for (Vec3f& p : posed.positions_m) p = vec_cast<float>(T * vec_cast<double>(p));
      auto& seen = masks.emplace_back();
      for (std::size_t c = 0; c < cameras.size(); ++c) {
        seen.push_back(render_silhouette(posed, rig.cameras[c]));
        disturb_mask(seen.back(), noise, static_cast<int>(c), k);
      }
    }
  }
};

/// Times of the frames in which the blade is known [ms]: the search for it is made once.
std::vector<double> follow_ms(const Stroke& stroke) {
  std::vector<double> ms;
  for (int round = 0; round < 3; ++round) {
    BladeTracker tracker(stroke.model, stroke.cameras, {0, 0.5, 0});
    for (std::size_t k = 0; k < stroke.masks.size(); ++k) {
      check_stop();
      const double begin_s = now_s();
      const TrackedBlade& now = tracker.update(stroke.masks[k], k > 0 ? kFrame_s : 0);
      const double took_ms = (now_s() - begin_s) * 1e3;
      if (now.state == BladeState::known) ms.push_back(took_ms);
    }
  }
  return ms;
}

/// The pose of a tracked blade from one frame's masks, on the processor.
Rows run_blade(const std::string& device_text) {
  return collect([&](Rows& rows) {
    const DeviceSet devices(device_text);
    const auto measure = [&](const char* what, const NoiseOptions& noise, Vec2i size_px, double focal_px) {
      const std::vector<double> ms = follow_ms(Stroke(noise, size_px, focal_px, 40));
      if (ms.empty()) return;
      rows.push_back({{"name", "blade"},
                      {"case", what},
                      {"size", 8},
                      {"devices", devices.name()},
                      {"ms_p50", p(ms, 50)},
                      {"ms_p99", p(ms, 99)}});
    };
    const NoiseOptions noise{.calibration_px = 0.3, .segmentation_px = 1};
    measure("640x480 exact", {}, {640, 480}, 600);
    measure("640x480 noise", noise, {640, 480}, 600);
    measure("1920x1080 exact", {}, {1920, 1080}, 1350);
  });
}

}  // namespace
}  // namespace tactus::bench

namespace tactus {

void add_blade_benchmark() { bench::add_benchmark({"blade", bench::run_blade}); }

}  // namespace tactus
