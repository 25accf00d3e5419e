/// What kernels sum up to, and what walls stand for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "tactus/fluid/flow_kernels.h"
#include "tactus/fluid/liquid.h"

namespace tactus {
namespace {

double w(double q) {
  return double{SmoothingKernel::shape(static_cast<float>(q))} * double{SmoothingKernel{}.scale_1_m3()};
}
/// -dW/dr / r
double slope(double q) {
  const auto f = static_cast<float>(q);
  return double{SmoothingKernel::slope(f, 1.F / f)} * double{SmoothingKernel{}.slope_scale_1_m5()};
}
/// Calls f(distance) for all other nodes of a cubic lattice of spacing 1 within 2 of node 0 and with y >=
/// `lowest`.
template <class F>
void for_lattice(int lowest, F&& f) {
  for (int z = -2; z <= 2; ++z)
    for (int y = lowest; y <= 2; ++y)
      for (int x = -2; x <= 2; ++x)
        if (x != 0 || y != 0 || z != 0) f(std::sqrt(x * x + y * y + z * z), y);
}

/// In boxes so narrow that more faces are near than there is capacity for, too. What is kept is not computed,
/// so it is the same to the bit.
TEST(BoxWalls, AreThoseThatAreAddedOneByOne) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0, 1);
  int full = 0;
  for (int k = 0; k < 300; ++k) {
    const Vec3f size = Vec3f{1, 1, 1} + 2.F * Vec3f{unit(random), unit(random), unit(random)};
    const SearchParticle particle{{size.x * unit(random), size.y * unit(random), size.z * unit(random)}, 0};
    Index counts[2] = {-1, 0};
    NearWall walls[2][kNearWalls];
    const FindBoxWalls find{.particles = View<const SearchParticle>(&particle, 1),
                            .box_m = {{}, size},
                            .open_faces = k % 3 == 0 ? 1 << (k % 6) : 0,
                            .reach_m = 1,
                            .near = {View<Index>(&counts[0], 1), View<NearWall>(walls[0], kNearWalls)}};
    find(0);
    const NearWalls one_by_one{View<Index>(&counts[1], 1), View<NearWall>(walls[1], kNearWalls)};
    int near = 0;
    for (int face = 0; face < FindBoxWalls::kFaces; ++face) {
      Vec3f n{};
      n[face / 2] = face % 2 == 0 ? 1.F : -1.F;
      const float x = particle.x_m[face / 2],
                  distance_m = n[face / 2] * (x - (face % 2 == 0 ? 0.F : size[face / 2]));
      if (!(distance_m < find.reach_m) || (find.open_faces >> face & 1) != 0) continue;
      one_by_one.add(0, {n, distance_m, {}, face, 0.F, {}});
      ++near;
    }
    full += near > kNearWalls ? 1 : 0;
    ASSERT_EQ(counts[0], counts[1]);
    for (Index w = 0; w < counts[0]; ++w) {
      EXPECT_EQ(walls[0][w].collider, walls[1][w].collider);
      EXPECT_EQ(walls[0][w].distance_m, walls[1][w].distance_m);
      EXPECT_EQ(dot(walls[0][w].n, walls[1][w].n), 1.F);
    }
  }
  EXPECT_GT(full, 10);
}

/// A floor bears 0.1 s of the weight of 34 t, in the impulses of 500 particles and 40 steps; and of 1e-9 kg
/// in as many. Each is rounded to 2^-24, and to a unit, 7e-9 m/s of a particle.
TEST(WallSums, HoldLakesAndDrops) {
  for (const float spacing_m : {0.4F, 0.0001F}) {
    LiquidSettings settings;
    settings.spacing_m = spacing_m;
    settings.density_kg_m3 = 1060;
    const LiquidConstants liquid = constants_of(settings);
    WallSums sums;
    const float each_N_s = liquid.mass_kg * 9.81F * 0.1F / 40;
    for (int k = 0; k < 500 * 40; ++k) sums.add_atomically({0, -each_N_s, 0}, liquid.impulse_unit_N_s);
    EXPECT_NEAR(sums.value(liquid.impulse_unit_N_s).y / (-20000 * each_N_s), 1, 1e-6);
  }
}

/// Of 40 particles, four are caught at 2.5 times their density: the mean counts 0.2 % of each, so 2e-4 of the
/// 1e-3 that asks for more iterations. All of them 0.3 % too dense make 2e-3. Counts are rounded to 2^-40, a
/// clamped excess to 2^-24 of 1.
TEST(LiquidReport, FewThatAreCaughtAreNoPressedLiquid) {
  DeviceSet devices("cpu");
  ExecContext& ctx = devices.context(0);
  constexpr std::size_t kCount = 40;
  const auto mean_excess = [&](float density_of_four, float density_of_others) {
    std::vector<float> density(kCount, density_of_others);
    std::fill_n(density.begin(), 4, density_of_four);
    const Buffer<Index> count = to_device(ctx, std::vector<Index>{kCount});
    const Buffer<Vec3f> zeros = to_device(ctx, std::vector<Vec3f>(kCount));
    const Buffer<float> rho = to_device(ctx, density), none = to_device(ctx, std::vector<float>(kCount));
    const Buffer<LiquidCounters> counters = to_device(ctx, std::vector<LiquidCounters>(1));
    Buffer<LiquidReport> reports(ctx.device(), ReportLiquid::kReports);
    ctx.parallel_for("fluid/report", ReportLiquid::kReports,
                     ReportLiquid{count.const_view(),
                                  zeros.const_view(),
                                  zeros.const_view(),
                                  rho.const_view(),
                                  none.const_view(),
                                  none.const_view(),
                                  counters.const_view(),
                                  {},
                                  1,
                                  1,
                                  1,
                                  reports.view()});
    LiquidReport all;
    for (const LiquidReport& part : to_host(ctx, reports.const_view())) all.add(part);
    EXPECT_EQ(all.here, Index{kCount});
    EXPECT_EQ(all.densest, density_of_four);
    return static_cast<double>(all.excess) / double{LiquidReport::kExcessUnits} / kCount;
  };
  EXPECT_NEAR(mean_excess(2.5F, 1), 2e-4, 1e-7);
  EXPECT_NEAR(mean_excess(1.003F, 1.003F), 2e-3, 1e-7);
  EXPECT_EQ(mean_excess(0.9F, 0.8F), 0);
}

TEST(SmoothingKernel, IsNormalisedAndEnds) {
  // Midpoint rule with 2000 steps: its error is below (2/2000)^2 / 24 times a second derivative of order 10.
  double integral = 0, viscous = 0, friction = 0;
  const int n = 2000;
  for (int i = 0; i < n; ++i) {
    const double q = (i + 0.5) * 2 / n, r2 = q * q;
    const double G =
        double{SmoothingKernel{}.slope_scale_1_m5()} * double{ViscousKernel::kWeight} * q * (2 - q) * (2 - q);
    integral += 4 * M_PI * q * q * w(q) * 2 / n;
    viscous += 4 * M_PI * r2 * r2 * G * 2 / n;
    friction += double{ViscousKernel::friction(static_cast<float>(q))} * 2 / n;
  }
  EXPECT_NEAR(integral, 1, 1e-4);
  EXPECT_NEAR(viscous, 3, 3e-4);
  EXPECT_NEAR(friction, 1, 1e-4);
  EXPECT_NEAR(ViscousKernel::behind(0), 0.5F, 1e-6F);
  EXPECT_EQ(w(2), 0);
  EXPECT_EQ(slope(2), 0);
  for (const double q :
       {0.3, 0.9, 1.1, 1.7})  // error of a central difference: h^2 / 6 W'''; floats: 1e-7 / h
    EXPECT_NEAR(slope(q) * q, -(w(q + 0.005) - w(q - 0.005)) / 0.01, 1e-4) << q;
}

TEST(SmoothingKernel, LatticeHasItsDensity) {
  double density = w(0);
  for_lattice(-2, [&](double r, int) { density += w(r); });
  EXPECT_NEAR(density, 1, 1e-3);
}

/// Half a spacing from a wall, its fill makes up for the layers that are missing, and its slope balances
/// twice the pull of those on the other side: to the digits of the constants.
TEST(SmoothingKernel, WallStandsForTheMissingLayer) {
  double density = w(0), push = 0;
  for_lattice(0, [&](double r, int y) {
    density += w(r);
    push += slope(r) * y;
  });
  const SmoothingKernel kernel;
  EXPECT_NEAR(double{kernel.fill(0.5F)}, 1.0001 - density, 2e-4);
  EXPECT_NEAR(double{kernel.fill_slope_1_m(0.5F)}, 2 * push, 2e-4);
  EXPECT_NEAR(kernel.fill_slope_1_m(0.7F), (kernel.fill(0.69F) - kernel.fill(0.71F)) / 0.02F, 1e-3);
  EXPECT_EQ(kernel.fill(1), 0);
}

/// Sums over what is behind a plane, in spherical shells of 400 radii and 400 polar angles: 1e-3 of the
/// values at the plane, as the midpoint rule jumps at the plane by a cell of 1/400.
TEST(ViscousKernel, KnowsWhatIsBehindAWall) {
  for (const double s : {0.25, 0.5, 1.0, 1.6}) {
    double friction = 0, behind = 0;
    for (int i = 0; i < 400; ++i) {
      const double r = (i + 0.5) / 200, G = 63 / (128 * M_PI) * r * (2 - r) * (2 - r);
      for (int k = 0; k < 400; ++k) {
        const double up = (k + 0.5) / 400, y = up * r;
        if (y < s) continue;
        const double along2 = 0.5 * (1 - up * up), volume = 2 * M_PI * r * r / 200 / 400;
        friction += 10 * G * y * along2 * volume;
        behind += 5 * G * y * y * along2 * volume;
      }
    }
    EXPECT_NEAR(ViscousKernel::friction(static_cast<float>(s)), friction, 2e-3) << s;
    EXPECT_NEAR(ViscousKernel::behind(static_cast<float>(s)), behind, 1e-3) << s;
  }
}

/// A lattice that ends half a spacing from a plane, or from two or three that meet at right angles: what is
/// missing of the sums behind them, and twice its slope, as a wall has no pressure of its own. The bound,
/// 0.01 of a whole plane's 1.02 / d, is not derived; without edges, planes err by 0.15. A box on a floor has
/// no edge there.
TEST(WallFill, EndsAtEdgesAsALatticeDoes) {
  LiquidSettings settings;
  settings.spacing_m = 1;
  const LiquidConstants liquid = constants_of(settings);
  const auto missing = [](auto&& is_solid) {
    double fill = 0, slope = 0;
    for (int a = -2; a <= 2; ++a)
      for (int b = -2; b <= 2; ++b)
        for (int c = -2; c <= 2; ++c) {
          if (!is_solid(a, b, c)) continue;
          const auto q = static_cast<float>(std::sqrt(a * a + b * b + c * c));
          fill += SmoothingKernel::shape(q) / (4 * 3.14159265);
          slope -= 2 * a * 3 * SmoothingKernel::slope(q, 1 / q) / (4 * 3.14159265);
        }
    return std::pair(fill, slope);
  };
  const auto share_of = [&](std::initializer_list<float> distances) {  // from planes across x, y, z
    Index count = 0;
    NearWall walls[kNearWalls];
    for (const float distance : distances) {
      walls[count].n[count] = 1;
      walls[count].distance_m = distance;
      walls[count].side = count == 0 ? 0 : NearWall::kBeside;
      ++count;
    }
    const float fill = WallFill::of({View<Index>(&count, 1), View<NearWall>(walls, kNearWalls)}, 0, liquid);
    return std::pair<double, double>(fill, walls[0].slope_1_m);
  };
  const auto expect_near = [](std::pair<double, double> found, std::pair<double, double> wanted,
                              const char* where) {
    EXPECT_NEAR(found.first, wanted.first, 0.01) << where;
    EXPECT_NEAR(found.second, wanted.second, 0.01) << where;
  };
  expect_near(share_of({0.5F}), missing([](int a, int, int) { return a < 0; }), "in a face");
  expect_near(share_of({0.5F, -0.5F}), missing([](int a, int b, int) { return a < 0 && b <= 0; }),
              "inside an edge");
  expect_near(share_of({0.5F, 0.5F}), missing([](int a, int b, int) { return a < 0 && b < 0; }),
              "beyond an edge");
  expect_near(share_of({0.5F, -0.5F, -0.5F}),
              missing([](int a, int b, int c) { return a < 0 && b <= 0 && c <= 0; }), "inside a corner");

  NearWall on_floor[kNearWalls];
  on_floor[0].n = {1, 0, 0}, on_floor[0].distance_m = 0.5F;
  on_floor[1].n = {0, -1, 0}, on_floor[1].distance_m = -0.5F, on_floor[1].side = NearWall::kBeside;
  on_floor[2].n = {0, 1, 0}, on_floor[2].distance_m = 0.5F, on_floor[2].collider = 2;
  Index three = 3;
  const float fill = WallFill::of({View<Index>(&three, 1), View<NearWall>(on_floor, kNearWalls)}, 0, liquid);
  expect_near({fill, on_floor[0].slope_1_m}, missing([](int a, int b, int) { return a < 0 || b < 0; }),
              "beside a floor");
}

/// What walls bring to the density is the potential of their forces: its slope along each wall's distance, of
/// up to four walls that stand anyhow, is that of a central difference over 2e-3 d. It errs by 1e-6 / 2e-3 of
/// rounding, and by h^2 / 6 of the third derivative, which is at most 6 x 1.46 / 0.94^3.
TEST(WallFill, HasTheSlopesOfItsFill) {
  LiquidSettings settings;
  settings.spacing_m = 1;
  const LiquidConstants liquid = constants_of(settings);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> any(-1, 1);
  for (int k = 0; k < 300; ++k) {
    Index count = 1 + k % kNearWalls;
    NearWall walls[kNearWalls];
    const NearWalls near{View<Index>(&count, 1), View<NearWall>(walls, kNearWalls)};
    for (Index i = 0; i < count; ++i) {
      walls[i].n = normalized(Vec3f{any(random), any(random), any(random)});
      if (i % 2 == 1) walls[i].n = normalized(0.3F * walls[i].n - walls[i - 1].n);
      walls[i].distance_m = 0.65F + 0.3F * any(random);
      walls[i].inverse_mass_1_kg = 1e-4F * (1 + any(random));
      if (k % 3 == 0 && i > 1) {
        walls[i].side = NearWall::kBeside;
        walls[i].distance_m -= 0.9F;  // in front and behind
      }
    }
    WallFill::of(near, 0, liquid);
    float slope_1_m[kNearWalls];
    for (Index i = 0; i < count; ++i) slope_1_m[i] = walls[i].slope_1_m;
    for (Index i = 0; i < count; ++i) {
      const auto fill_at = [&](float more) {
        walls[i].distance_m += more;
        const float fill = WallFill::of(near, 0, liquid);
        walls[i].distance_m -= more;
        return fill;
      };
      EXPECT_NEAR(slope_1_m[i], (fill_at(-1e-3F) - fill_at(1e-3F)) / 2e-3F, 1e-3F) << k << " " << i;
    }
  }
}

/// A piece of a wound, half a spacing in front of which a particle may come: it has the velocity of the wall
/// there, and rate x factor along its normal, volume per time and area. That fades as the rate does.
TEST(Wounds, JetsHaveTheSpeedOfRateOverArea) {
  const float h = 0.02F, d = 0.01F, rate_m_s = 0.8F, dt_s = 0.01F;
  std::vector<Vec3f> x_m, v_m_s(8, {0.1F, 0, 0.2F});
  WoundPiece piece;
  piece.local = {0.5F, 0.5F, 0.5F};
  piece.along = {0, 1, 0};
  piece.across = {0, 0, 1};
  piece.area_m2 = d * d;
  piece.factor = 0.5F;
  for (Index q = 0; q < 8; ++q) {
    x_m.push_back(
        {h * static_cast<float>(q & 1), h * static_cast<float>(q >> 1 & 1), h * static_cast<float>(q >> 2)});
    piece.node[q] = q;
  }
  std::vector<WoundPiece> pieces(2, piece);
  pieces[1].local.x = 9;  // its other side is far
  std::vector<FrameParams> frame{{.dt_s = dt_s, .gravity_m_s2 = {0, -9.81F, 0}, .substeps = 1}};
  std::vector<WoundClock> clock(1);
  std::vector<std::uint32_t> key(2);
  std::vector<WoundState> states(2);
  states[0].lost = 0.25F;
  std::vector<WoundLedger> ledgers(kStrokes);
  std::vector<Vec3f> place_m(2), speed_m_s(2);
  std::vector<Index> is_shut(2);
  const auto view = [](auto& list) { return View(list.data(), static_cast<Index>(list.size())); };
  // 0.8 m/s x 0.5 x 0.01 s is 0.4 of a spacing, so the piece tries in every frame.
  const TryWounds wounds{view(pieces),    view(frame),
                         view(x_m),       view(v_m_s),
                         view(clock),     Pulse{.beats_1_s = 1, .share = 0.5F},
                         rate_m_s,        0,
                         1 / (d * d * d), d,
                         view(states),    view(ledgers),
                         view(place_m),   view(speed_m_s),
                         view(key),       view(is_shut)};
  // So does the pulse: at half a beat, it is as without, but for the sine's slope, which the frame's symmetry
  // takes away.
  clock[0].time_s = 0.5 - 0.5 * static_cast<double>(dt_s);
  wounds(0);
  EXPECT_NEAR(place_m[0].x, 0.5F * h + 0.5F * d, 1e-6F);
  EXPECT_NEAR(speed_m_s[0].x, 0.1F + 0.75F * 0.5F * rate_m_s, 2e-6F);
  EXPECT_NEAR(speed_m_s[0].y, 0, 1e-6F);
  EXPECT_NEAR(speed_m_s[0].z, 0.2F, 1e-6F);
  EXPECT_EQ(is_shut[0], 0);
  clock[0].time_s += 0.25;
  wounds(0);
  EXPECT_NEAR(speed_m_s[0].x, 0.1F + 0.75F * 0.5F * 0.5F * rate_m_s, 1e-4F)
      << "0.5 less at three quarters of a beat";
}

/// Against the integral of 1 + share sin(2 pi beats t) over each time: the sine is right to 4e-6, a phase as
/// a float within a turn to 4e-7 of a turn, and short times divide neither: both sines have the same relative
/// error.
TEST(Wounds, PulsesAsTheIntegralOfASine) {
  const double pi = std::numbers::pi;
  for (const double beats_1_s : {0.5, 1.2, 10.0})
    for (const float dt_s : {1e-4F, 1.0F / 120, 1.0F / 30, 0.1F, 0.26F})
      for (const double from_s : {0.0, 0.013, 0.4, 7.77, 86400.3}) {
        const double w = 2 * pi * beats_1_s, middle = w * (from_s + 0.5 * static_cast<double>(dt_s)),
                     half = 0.5 * w * static_cast<double>(dt_s);
        const double expected = 1 + 0.7 * std::sin(middle) * std::sin(half) / half;
        EXPECT_NEAR((Pulse{beats_1_s, 0.7F}.mean(from_s, dt_s)), expected, 1e-5)
            << beats_1_s << " " << dt_s << " " << from_s;
      }
  EXPECT_EQ(Pulse{}.mean(3, 0.1F), 1.F) << "without one";
}

}  // namespace
}  // namespace tactus
