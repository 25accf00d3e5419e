#include "tactus/geom/mesh/hook_surface.h"

#include <cmath>

#include "tactus/base/math.h"

namespace tactus {
namespace {

constexpr float kShaft = 3.5F, kTip = 0.4F;  ///< of the bend
/// Corners of a circle of the rod, circles of the bend and of each round end. Flat sides lie 0.034 of the
/// rod's radius below the rod: 1 - cos(pi / 12).
constexpr int kAround = 12, kBend = 16, kEnd = 3;

/// A circle of corners about a point of the rod's middle.
struct Circle {
  Vec3f middle_m, along;  ///< along: the rod
  float radius_m = 0;
  float forward = 0;  ///< of its normals: they lean towards an end
};

std::vector<Circle> circles(float bend_m, float rod_m) {
  std::vector<Circle> all;
  const auto end = [&](Vec3f at_m, Vec3f along, float side) {
    for (int i = 0; i < kEnd; ++i) {
      const int from_rod = side < 0 ? kEnd - i : i + 1;
      const float lean = 0.5F * kPi * static_cast<float>(from_rod) / (kEnd + 1);
      all.push_back({at_m + (side * rod_m * std::sin(lean)) * along, along, rod_m * std::cos(lean),
                     side * std::sin(lean)});
    }
  };
  const Vec3f down{0, -1, 0};
  end({bend_m, kShaft * bend_m, 0}, down, -1);
  all.push_back({{bend_m, kShaft * bend_m, 0}, down, rod_m});
  for (int i = 0; i <= kBend; ++i) {
    const float turn = kPi * static_cast<float>(i) / kBend, c = std::cos(turn), s = std::sin(turn);
    all.push_back({{bend_m * c, -bend_m * s, 0}, {-s, -c, 0}, rod_m});
  }
  all.push_back({{-bend_m, kTip * bend_m, 0}, {0, 1, 0}, rod_m});
  end({-bend_m, kTip * bend_m, 0}, {0, 1, 0}, 1);
  return all;
}

}  // namespace

TriangleMesh hook_surface(float bend_m, float rod_m) {
  TriangleMesh mesh;
  const std::vector<Circle> all = circles(bend_m, rod_m);
  const Vec3f across{0, 0, 1};
  const auto add = [&](Vec3f at_m, Vec3f normal) {
    mesh.positions_m.push_back(at_m);
    mesh.normals.push_back(normal);
  };
  add({bend_m, kShaft * bend_m + rod_m, 0}, {0, 1, 0});
  for (const Circle& c : all) {
    const Vec3f beside = cross(across, c.along);
    for (int k = 0; k < kAround; ++k) {
      const float turn = 2 * kPi * static_cast<float>(k) / kAround;
      const Vec3f out = std::cos(turn) * beside + std::sin(turn) * across;
      add(c.middle_m + c.radius_m * out, normalized((c.radius_m / rod_m) * out + c.forward * c.along));
    }
  }
  add({-bend_m, kTip * bend_m + rod_m, 0}, {0, 1, 0});
  const auto corner = [](std::size_t circle, int k) {
    return static_cast<Index>(circle) * kAround + k % kAround + 1;
  };
  const auto last = static_cast<Index>(mesh.positions_m.size() - 1);
  for (int k = 0; k < kAround; ++k) {
    mesh.triangles.push_back({0, corner(0, k + 1), corner(0, k)});
    for (std::size_t i = 0; i + 1 < all.size(); ++i) {
      mesh.triangles.push_back({corner(i, k), corner(i, k + 1), corner(i + 1, k + 1)});
      mesh.triangles.push_back({corner(i, k), corner(i + 1, k + 1), corner(i + 1, k)});
    }
    mesh.triangles.push_back({corner(all.size() - 1, k), corner(all.size() - 1, k + 1), last});
  }
  return mesh;
}

}  // namespace tactus
