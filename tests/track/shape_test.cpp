/// Tools of other shapes than the model: none of them is it.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "track/track_scene.h"

namespace tactus {
namespace {

using test::at_pose;
using test::kFrame_s;
using test::Room;
using test::some_pose;
using test::stroke;

struct Seen {
  int known = 0, misfit = 0, twins = 0, frames = 0;
  double least_px = 1e9, most_px = 0, most_covered = 0;
};

/// @param shape in the model's place
Seen watch(const Room& room, const TriangleMesh& shape, std::uint64_t seed, int frames = 12) {
  std::mt19937 random(seed);
  const Rigidd T0 = some_pose(random);
  BladeTracker tracker(built_in_scalpel(), room.believed, {0, 0.5, 0});
  Seen seen;
  for (int k = 0; k < frames; ++k) {
    const TrackedBlade& now =
        tracker.update(room.see({at_pose(shape, stroke(T0, k * kFrame_s))}, k), k > 0 ? kFrame_s : 0);
    ++seen.frames;
    seen.known += now.state == BladeState::known;
    seen.misfit += now.state == BladeState::misfit;
    seen.twins += now.state == BladeState::twins;
    if (k < 4) continue;

    seen.least_px = std::min(seen.least_px, now.misfit_px);
    seen.most_px = std::max(seen.most_px, now.misfit_px);
    seen.most_covered = std::max(seen.most_covered, now.edge_covered);
  }
  return seen;
}

/// Surface of revolution about x: radii at places along it.
TriangleMesh turned(const std::vector<std::pair<double, double>>& profile_m, int sides = 24) {
  TriangleMesh mesh;
  for (const auto& [x, r] : profile_m) {
    for (int k = 0; k < sides; ++k) {
      const double a = 2 * M_PI * k / sides;
      mesh.positions_m.push_back(vec_cast<float>(Vec3d{x, r * std::cos(a), r * std::sin(a)}));
    }
  }
  for (Index i = 0; i + 1 < std::ssize(profile_m); ++i) {
    for (Index k = 0; k < sides; ++k) {
      const Index p = i * sides + k, q = i * sides + (k + 1) % sides;
      mesh.triangles.push_back({p, q, q + sides});
      mesh.triangles.push_back({p, q + sides, p + sides});
    }
  }
  return mesh;
}

TriangleMesh scaled(TriangleMesh mesh, float by) {
  for (Vec3f& p : mesh.positions_m) p *= by;
  return mesh;
}

TriangleMesh pen() { return turned({{-0.075, 0.0002}, {-0.06, 0.004}, {0.085, 0.004}, {0.0851, 0.0002}}); }
TriangleMesh spoon() {
  return turned({{-0.08, 0.0002},
                 {-0.07, 0.012},
                 {-0.055, 0.016},
                 {-0.04, 0.012},
                 {-0.03, 0.004},
                 {0.08, 0.004},
                 {0.0801, 0.0002}});
}
TriangleMesh sphere() {
  std::vector<std::pair<double, double>> profile;
  for (int i = 0; i <= 16; ++i)
    profile.emplace_back(-0.05 * std::cos(M_PI * i / 16), 0.05 * std::sin(M_PI * i / 16) + 1e-5);
  return turned(profile);
}

/// What it leaves over stays below what is refused: 0.2 px and 0.16 of the residuals, which are 1 px at most.
TEST(Shape, TheRightToolFits) {
  for (const double noise_px : {0.0, 1.0}) {
    const Room room({.calibration_px = 0.3 * noise_px, .segmentation_px = noise_px, .seed = 5});
    const Seen seen = watch(room, built_in_scalpel().mesh, 5);
    EXPECT_GT(seen.known, noise_px > 0 ? 2 : 7);
    EXPECT_EQ(seen.misfit, 0);
    EXPECT_LT(seen.most_px, noise_px > 0 ? 0.36 : 0.1);
  }
}

TEST(Shape, OtherShapesAreNotKnown) {
  const TriangleMesh right = built_in_scalpel().mesh;
  const std::pair<const char*, TriangleMesh> others[] = {{"pen", pen()},
                                                         {"spoon", spoon()},
                                                         {"1.35 times", scaled(right, 1.35F)},
                                                         {"1.15 times", scaled(right, 1.15F)},
                                                         {"0.8 times", scaled(right, 0.8F)},
                                                         {"sphere", sphere()}};
  for (const auto& [name, mesh] : others) {
    const Seen seen = watch(Room(), mesh, 5);
    EXPECT_EQ(seen.known, 0) << name;
    // It is said, whether it fits badly in one way or in several.
    if (std::string(name) != "sphere") {
      EXPECT_GT(seen.misfit, 0) << name;
      EXPECT_EQ(seen.twins, 0) << name;
    }
  }
}

/// Which of two equal tools is the blade isn't known; where the scene has two, each is one of them.
TEST(Shape, OfTwoEqualToolsNoneIsKnown) {
  const Room room;
  const BladeModel model = built_in_scalpel();
  std::mt19937 random(12);
  const Rigidd a = some_pose(random);
  Rigidd b = some_pose(random);
  b.t = a.t + Vec3d{0.02, 0.15, 0.1};
  const auto masks = room.see({at_pose(model.mesh, a), at_pose(model.mesh, b)});
  for (const int equal : {1, 2}) {
    BladeTrackerSettings settings;
    settings.equal_tools = equal;
    BladeTracker tracker(model, room.believed, {0, 0.5, 0}, settings);
    int known = 0, twins = 0;
    for (int k = 0; k < 8; ++k) {
      const BladeState state = tracker.update(masks, k > 0 ? kFrame_s : 0).state;
      known += state == BladeState::known;
      twins += state == BladeState::twins;
    }
    EXPECT_EQ(known > 0, equal == 2);
    EXPECT_EQ(twins > 0, equal == 1);
  }
}

}  // namespace
}  // namespace tactus
