// Shape matching in cases that someone else tried: is it as stiff as its material?
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <utility>

#include "tactus/tissue/flsm/flsm.h"
#include "tissue/tled_bodies.h"

namespace tactus {
namespace {

constexpr float kYoung = 20000;

/// A bar of 20 h x 4 h x 4 h about the origin, its length along x turned by an angle about z.
CubeLattice bar(float angle_rad) {
  if (angle_rad == 0) return box({20, 4, 4}, kH, {-10 * kH, -2 * kH, -2 * kH});
  const Mat3f back = rotation_matrix(axis_angle({0, 0, 1}, -angle_rad));
  const auto distance = [&](Vec3f p) {
    const Vec3f q = back * p;
    return max(abs(q.x) - 10 * kH, max(abs(q.y), abs(q.z)) - 2 * kH);
  };
  return lattice_from_sdf(distance, {{-11 * kH, -11 * kH, -3 * kH}, {11 * kH, 11 * kH, 3 * kH}},
                          {.spacing_m = kH});
}

/// Settled under forces per mass of the ends, which are in balance.
template <class F>
std::vector<Vec3f> settled(const CubeLattice& lattice, int w, F&& force_per_kg) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  Flsm flsm(ctx, lattice, {.young_Pa = kYoung, .half_width = w});
  BodyState body = rest_state(ctx, lattice);
  std::vector<Vec3f> f(lattice.nodes.size());
  for (std::size_t i = 0; i < f.size(); ++i)
    f[i] = lattice.node_mass_kg[i] * force_per_kg(lattice.rest_m(static_cast<Index>(i)));
  body.f_ext_N = to_device(ctx, f);
  const float dt = 1 / flsm.omega_per_s();
  // The longest wave (half of it over 0.1 m at 3 m/s) takes 0.07 s: drag of 80/s is near critical.
  for (float t = 0; t < 1; t += dt) flsm.step(ctx, body, {.dt_s = dt, .gravity_m_s2 = {}, .drag_per_s = 80});
  return to_host(ctx, body.x_m.const_view());
}

/// Slope of values over places, both weighed with mass.
struct Slope {
  double m = 0, s = 0, v = 0, ss = 0, sv = 0;
  void add(double mass, double place, double value) {
    m += mass, s += mass * place, v += mass * value, ss += mass * place * place, sv += mass * place * value;
  }
  double of() const { return (sv * m - s * v) / (ss * m - s * s); }
};

/// Pulled by 2 % at the outer tenths: stress over strain of the middle half, over E.
double tension(float angle_rad, int w) {
  const CubeLattice lattice = bar(angle_rad);
  const Vec3f axis{std::cos(angle_rad), std::sin(angle_rad), 0};
  double end_mass = 0, mass = 0;
  const float outer_m = 8 * kH;
  for (Index i = 0; i < lattice.node_count(); ++i) {
    mass += double{lattice.node_mass_kg[at(i)]};
    if (dot(axis, lattice.rest_m(i)) > outer_m) end_mass += double{lattice.node_mass_kg[at(i)]};
  }
  const double area = mass / 1000 / (20 * double{kH}), force = 0.02 * double{kYoung} * area;
  const auto pull = static_cast<float>(force / end_mass);
  const std::vector<Vec3f> x = settled(lattice, w, [&](Vec3f p) {
    const float s = dot(axis, p);
    return std::abs(s) > outer_m ? (s > 0 ? pull : -pull) * axis : Vec3f{};
  });
  Slope strain;
  for (Index i = 0; i < lattice.node_count(); ++i) {
    const float s = dot(axis, lattice.rest_m(i));
    if (std::abs(s) <= 5 * kH)
      strain.add(double{lattice.node_mass_kg[at(i)]}, double{s},
                 double{dot(axis, x[at(i)] - lattice.rest_m(i))});
  }
  return 0.02 / strain.of();
}

/// A plate of 16 x 4 x 16 cubes, its faces pulled apart along themselves: stress over shear of its middle,
/// over G = E / (2 (1 + 0.45)).
double shear(int w) {
  const CubeLattice lattice = box({16, 4, 16}, kH, {-8 * kH, -2 * kH, -8 * kH});
  const float stress_Pa = 100;
  // Half the cubes below a face belong to its nodes. What would turn the plate is held back at the sides.
  const float per_kg = stress_Pa / (1000 * kH / 2);
  const std::vector<Vec3f> x = settled(lattice, w, [&](Vec3f p) {
    Vec3f f{};
    if (abs(p.y) > 1.5F * kH) f.x = p.y > 0 ? per_kg : -per_kg;
    if (abs(p.x) > 7.5F * kH) f.y = p.x > 0 ? per_kg : -per_kg;
    return f;
  });
  Slope along, across;
  for (Index i = 0; i < lattice.node_count(); ++i) {
    const Vec3f p = lattice.rest_m(i), u = x[at(i)] - p;
    if (abs(p.x) > 4 * kH || abs(p.z) > 4 * kH) continue;
    along.add(double{lattice.node_mass_kg[at(i)]}, double{p.y}, double{u.x});
    across.add(double{lattice.node_mass_kg[at(i)]}, double{p.x}, double{u.y});
  }
  return double{stress_Pa} / (along.of() + across.of()) / (double{kYoung} / 2.9);
}

/// The same plate, turned by 45 degrees about z in its lattice. Nodes of the outer half cube, and those
/// outside, share the load by their masses, so the shear is taken between them.
double turned_shear(int w) {
  const Mat3f turn = rotation_matrix(axis_angle({0, 0, 1}, 0.25F * kPi)), back = transpose(turn);
  const auto distance = [&](Vec3f p) {
    const Vec3f q = back * p;
    return max(max(abs(q.x), abs(q.z)) - 8 * kH, abs(q.y) - 2 * kH);
  };
  const float reach = 9 * kH;
  const CubeLattice lattice =
      lattice_from_sdf(distance, {{-reach, -reach, -reach}, {reach, reach, reach}}, {.spacing_m = kH});
  const float stress_Pa = 100;
  const auto is_face = [](Vec3f q) { return abs(q.y) > 1.5F * kH; };
  const auto is_side = [](Vec3f q) { return abs(q.x) > 7.5F * kH; };
  double faces_kg = 0, sides_kg = 0, mass = 0;
  for (Index i = 0; i < lattice.node_count(); ++i) {
    const Vec3f q = back * lattice.rest_m(i);
    const double m = double{lattice.node_mass_kg[at(i)]};
    mass += m, faces_kg += is_face(q) ? m : 0, sides_kg += is_side(q) ? m : 0;
  }
  const double volume = mass / 1000;
  const auto face = static_cast<float>(2 * double{stress_Pa} * volume / (4 * double{kH}) / faces_kg),
             side = static_cast<float>(2 * double{stress_Pa} * volume / (16 * double{kH}) / sides_kg);
  const std::vector<Vec3f> x = settled(lattice, w, [&](Vec3f p) {
    const Vec3f q = back * p;
    Vec3f f{};
    if (is_face(q)) f.x = q.y > 0 ? face : -face;
    if (is_side(q)) f.y = q.x > 0 ? side : -side;
    return turn * f;
  });
  Slope along, across;
  for (Index i = 0; i < lattice.node_count(); ++i) {
    const Vec3f q = back * lattice.rest_m(i), u = back * x[at(i)] - q;
    if (abs(q.x) > 4 * kH || abs(q.z) > 4 * kH || is_face(q)) continue;
    along.add(double{lattice.node_mass_kg[at(i)]}, double{q.y}, double{u.x});
    across.add(double{lattice.node_mass_kg[at(i)]}, double{q.x}, double{u.y});
  }
  return double{stress_Pa} / (along.of() + across.of()) / (double{kYoung} / 2.9);
}

/// Found: +18, +39, +73 % in tension (w = 1, 2, 3), +47 to +87 % turned by 45 degrees, +30 to +113 % in
/// shear.
TEST(OutsiderMatching, IsAsStiffAsItsMaterial) {
  for (const int w : {1, 2, 3}) {
    const double straight = tension(0, w), turned = tension(0.25F * kPi, w), odd = tension(0.3F, w),
                 sheared = shear(w);
    std::printf("w %d: tension %.3f, turned by 45 degrees %.3f, by 17 degrees %.3f; shear %.3f\n", w,
                straight, turned, odd, sheared);
    EXPECT_NEAR(straight, 1, 0.15) << w;
    EXPECT_NEAR(turned, 1, 0.15) << w;
    EXPECT_NEAR(odd, 1, 0.15) << w;
    EXPECT_NEAR(sheared, 1, 0.30) << w;
  }
}

/// The bar is 30 %, which regions of three cubes miss. The docs give whole percents of what is
/// here; a change of 3 % is one to write there.
TEST(OutsiderMatching, TurnedPlatesAreTooStiffInShearWhereRegionsAreWide) {
  for (const auto& [w, expected] : {std::pair{1, 1.02}, {2, 1.19}, {3, 1.45}})
    EXPECT_NEAR(turned_shear(w), expected, 0.03) << w;
}

}  // namespace
}  // namespace tactus
