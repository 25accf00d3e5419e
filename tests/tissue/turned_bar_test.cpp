// Bars whose faces don't follow the lattice are as stiff as those whose faces do.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tactus/geom/mesh/box_surface.h"
#include "tactus/tissue/tled/tled.h"

namespace tactus {
namespace {

constexpr float kH = 0.01F;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

Mat3d turn(Vec3d axis, double degrees) {
  const double a = degrees * std::numbers::pi / 180, c = std::cos(a), s = std::sin(a);
  const Vec3d n = (1 / length(axis)) * axis;
  Mat3d R{};
  for (int j = 0; j < 3; ++j) {
    Vec3d e{};
    e[j] = 1;
    const Vec3d column = c * e + s * cross(n, e) + (1 - c) * dot(n, e) * n;
    for (int i = 0; i < 3; ++i) R(i, j) = column[i];
  }
  return R;
}

/// A square bar, whose ends are held where a linear (`bends`: a quadratic) displacement takes them.
class Bar {
 public:
  Bar(double cubes_across, double cubes_along, const Mat3d& R, float poisson, bool bends)
      : half_m_(0.5 * double{kH} * Vec3d{cubes_along, cubes_across, cubes_across}),
        R_(R),
        bends_(bends),
        material_{.young_Pa = 10000, .poisson = poisson, .density_kg_m3 = 1000} {
    TriangleMesh mesh = box_surface(vec_cast<float>(half_m_), {4, 1, 1});
    for (Vec3f& p : mesh.positions_m) p = vec_cast<float>(R * vec_cast<double>(p));
    lattice_ = lattice_from_mesh(mesh, {.spacing_m = kH, .density_kg_m3 = 1000});
    lattice_.fix_where([&](Vec3f p) { return std::abs(local(p).x) > half_m_.x - kHeld * double{kH}; });
  }

  /// What pulls or bends it over what a slender bar takes.
  double stiffness_ratio() {
    DeviceSet devices("cpu");
    ExecContext& ctx = devices.context(0);
    Tled tled(ctx, lattice_, {&material_, 1}, {}, {.damping_ratio = 0});
    BodyState state = rest_state(ctx, lattice_);
    const std::vector<Vec3f> rest = lattice_.rest_positions_m();
    std::vector<Vec3f> x = rest;
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += displacement(rest[i]);
    state.x_m = to_device(ctx, x);
    // Waves of the longest mode are damped critically, in some of its periods.
    const double c = std::sqrt(double{material_.young_Pa} / 1000),
                 omega = std::numbers::pi * c / (2 * half_m_.x);
    const double slow = bends_ ? 0.5 : 1;  // bending is slower
    const TledStep step{.dt_s = 0.99F * tled.stable_step_s(),
                        .gravity_m_s2 = {},
                        .drag_per_s = static_cast<float>(2 * slow * omega)};
    tled.step(ctx, state, step, static_cast<int>(14 / (slow * omega) / double{step.dt_s}));
    tled.compute_forces(ctx, state);
    return measure(rest, to_host(ctx, state.x_m.const_view()), tled.forces_N(ctx));
  }

 private:
  static constexpr double kHeld = 2, kStrain = 0.004;
  Vec3d local(Vec3f p) const { return transpose(R_) * vec_cast<double>(p); }
  Vec3f displacement(Vec3f p) const {
    const Vec3d q = local(p);
    const double nu = double{material_.poisson}, k = kStrain / half_m_.y;
    const Vec3d u =
        bends_ ? k * Vec3d{q.x * q.y, -0.5 * (q.x * q.x + nu * (q.y * q.y - q.z * q.z)), -nu * q.y * q.z}
               : kStrain * Vec3d{q.x, -nu * q.y, -nu * q.z};
    return vec_cast<float>(R_ * u);
  }
  /// Strain (curvature) of the middle half by least squares, force (moment) of the right end.
  double measure(const std::vector<Vec3f>& rest, const std::vector<Vec3f>& x,
                 const std::vector<Vec3f>& f_N) const {
    double load = 0, over = 0, under = 0;
    for (Index i = 0; i < lattice_.node_count(); ++i) {
      const Vec3d q = local(rest[at(i)]), u = transpose(R_) * vec_cast<double>(x[at(i)] - rest[at(i)]);
      const double arm = bends_ ? q.y : 1, basis = q.x * arm;
      if (lattice_.fixed[at(i)] != 0 && q.x > 0)
        load -= arm * (transpose(R_) * vec_cast<double>(f_N[at(i)])).x;
      if (std::abs(q.x) > 0.5 * half_m_.x) continue;
      over += basis * u.x;
      under += basis * basis;
    }
    const double area = 4 * half_m_.y * half_m_.z, inertia = area * half_m_.y * half_m_.y / 3;
    return load / (over / under) / (double{material_.young_Pa} * (bends_ ? inertia : area));
  }

  Vec3d half_m_;
  Mat3d R_;
  bool bends_;
  ElasticMaterial material_;
  CubeLattice lattice_;
};

struct Turn {
  Vec3d axis;
  double degrees;
};
constexpr Turn kTurns[] = {{{0, 0, 1}, 15}, {{0, 0, 1}, 30}, {{0, 0, 1}, 45}, {{1, 1, 1}, 40}};

/// 4 % at four cubes across, half of it at eight: the error is of first order in the spacing.
TEST(IndependentStiffness, TurnedBarsInTension) {
  for (const Turn& t : kTurns) {
    for (const float poisson : {0.3F, 0.45F})
      EXPECT_NEAR(Bar(4, 16, turn(t.axis, t.degrees), poisson, false).stiffness_ratio(), 1, 0.04)
          << t.degrees << " " << poisson;
  }
  EXPECT_NEAR(Bar(8, 24, turn({0, 0, 1}, 30), 0.3F, false).stiffness_ratio(), 1, 0.02);
  for (const double across : {4.4, 5.3})
    EXPECT_NEAR(Bar(across, 18.7, turn({1, 2, 3}, 25), 0.3F, false).stiffness_ratio(), 1, 0.04) << across;
  // Faces between lattice planes: strain is uniform, and the sum of fills is the volume.
  for (const double across : {3.3, 4.1, 4.5, 4.9})
    EXPECT_NEAR(Bar(across, 16, turn({0, 0, 1}, 0), 0.3F, false).stiffness_ratio(), 1, 0.005) << across;
}

TEST(IndependentStiffness, TurnedBarsBent) {
  for (const Turn& t : kTurns)
    EXPECT_NEAR(Bar(4, 16, turn(t.axis, t.degrees), 0.3F, true).stiffness_ratio(), 1, 0.04) << t.degrees;
}

}  // namespace
}  // namespace tactus
