/// Films against closed forms, and what must hold to the bit.
#include <gtest/gtest.h>

#include <algorithm>

#include "fluid/film_scene.h"
#include "support/device_sets.h"
#include "support/message_of.h"

namespace tactus {
namespace {

using test::Sheet;
using test::SheetFilm;
using test::volume_m3;
using test::wet_pieces;

constexpr double kDensity = 1060, kViscosity = 0.0035, kTension = 0.058, kGravity = 9.81;
constexpr float kFrame_s = 1.F / 60;

class FilmOnCpu : public ::testing::Test {
 protected:
  ExecContext& ctx() { return set_.context(0); }

 private:
  DeviceSet set_{"cpu"};
};

/// Nusselt 1916: a film that flows steadily down a slope is (3 mu q / (rho g sin))^(1/3) thick. Liquid comes
/// at the upper end and is taken away at the lower one. Irregular triangles change nothing of that: where all
/// heights are equal, what flows into a cell flows out. 3 %: what comes in does so in pulses, every frame.
TEST_F(FilmOnCpu, SteadyFlowDownASlopeHasNusseltsThickness) {
  const double q_m2_s = 5e-5, width_m = 0.012;
  for (const float slope_deg : {30.F, 90.F}) {
    const Sheet sheet(0.06F, static_cast<float>(width_m), 0.002F, 0.1F);
    const float dt_s = 1.F / 240;
    SheetFilm film(ctx(), sheet, {.contact_angle_deg = 0, .most_passes = 64}, slope_deg, dt_s);
    const std::vector<double> area = sheet.areas_m2();
    double source_m2 = 0;
    for (std::size_t i = 0; i < area.size(); ++i) source_m2 += sheet.x_m[i].x < 0.005F ? area[i] : 0;
    const double sheet_width_m = std::accumulate(area.begin(), area.end(), 0.0) / 0.06;
    for (int k = 0; k < 480; ++k) {
      std::vector<std::int64_t> v = film.volumes();
      for (std::size_t i = 0; i < v.size(); ++i) {
        if (sheet.x_m[i].x < 0.005F)
          v[i] += std::llround(q_m2_s * sheet_width_m * double{dt_s} * area[i] / source_m2 *
                               double{kFilmUnits_1_m3});
        if (sheet.x_m[i].x > 0.057F) v[i] = 0;
      }
      film.set_volumes(v);
      film.step();
    }
    EXPECT_LT(film.passes().passes, 64) << "nothing is slowed";
    double volume = 0, m2 = 0;
    const std::vector<float> h = film.heights_m();
    for (std::size_t i = 0; i < h.size(); ++i) {
      if (sheet.x_m[i].x < 0.02F || sheet.x_m[i].x > 0.045F) continue;
      volume += double{h[i]} * area[i];
      m2 += area[i];
    }
    const double expected =
        std::cbrt(3 * kViscosity * q_m2_s / (kDensity * kGravity * std::sin(double{slope_deg} * M_PI / 180)));
    std::printf("slope %.0f: %.4f mm, Nusselt %.4f mm\n", double{slope_deg}, volume / m2 * 1e3,
                expected * 1e3);
    EXPECT_NEAR(volume / m2, expected, 0.03 * expected);
  }
}

/// Huppert 1982 (Nature 300, 427): of a volume A per width, the front is at x = (9 A^2 g sin t / (4
/// nu))^(1/3). That follows from h = (nu x / (g sin t))^(1/2) behind the front, which lies at the integral of
/// h = A. 5 %: half of it are the three cells over which the scheme smears the front, the rest its rounding
/// by g cos and the first frames, in which passes are too few.
TEST_F(FilmOnCpu, AVolumeRunsDownASlopeAsHuppertsFront) {
  const double a_m2 = 2e-5, slope = M_PI / 6, top_m = 0.01;
  const Sheet sheet(0.25F, 0.012F, 0.002F);
  SheetFilm film(ctx(), sheet, {.surface_tension_N_m = 0, .contact_angle_deg = 0, .most_passes = 64}, 30,
                 kFrame_s);
  film.fill(sheet, [&](Vec3f x) { return x.x > 0.009F && x.x < 0.021F ? a_m2 / 0.012 : 0.0; });
  for (int k = 1; k <= 360; ++k) {
    film.step();
    if (k % 120 != 0) continue;
    const double t_s = k * double{kFrame_s};
    const double expected =
        std::cbrt(9 * a_m2 * a_m2 * kGravity * std::sin(slope) * t_s / (4 * kViscosity / kDensity));
    const std::vector<float> h = film.heights_m();
    double front_m = 0;
    for (std::size_t i = 0; i < h.size(); ++i)
      if (double{h[i]} > 0.5 * 1.5 * a_m2 / expected) front_m = std::max(front_m, double{sheet.x_m[i].x});
    std::printf("%.0f s: front %.1f mm, Huppert %.1f mm\n", t_s, (front_m - top_m) * 1e3, expected * 1e3);
    EXPECT_NEAR(front_m - top_m, expected, 0.05 * expected) << t_s << " s";
  }
}

/// Diameter of a sessile drop: Young and Laplace's equation, integrated from the apex to the contact angle,
/// for the curvature at the apex that gives the volume.
double young_laplace_diameter_m(double volume_m3, double angle) {
  double low = 1e-6, high = 2000, r = 0;
  for (int n = 0; n < 80; ++n) {
    const double apex = std::sqrt(low * high), ds = 1e-5;
    double z = 0, phi = 0, volume = 0;
    r = 1e-9;
    while (phi < angle && r < 0.05) {
      const double bend =
          2 * apex + kDensity * kGravity * z / kTension - (r > 1e-8 ? std::sin(phi) / r : apex);
      r += ds * std::cos(phi);
      z += ds * std::sin(phi);
      phi += ds * bend;
      volume += M_PI * r * r * ds * std::sin(phi);
    }
    (volume > volume_m3 ? low : high) = apex;
  }
  return 2 * r;
}

/// 1 ml at 40 degrees, poured on a spot of 12 mm: a puddle 31.3 mm across. (Without weight it would be a cap
/// of 23.8 mm, without curvature a disc of 28 mm.) 6 %: the edge lies between two rows of vertices, at most
/// half of a cell from where it should, on either side.
TEST_F(FilmOnCpu, AMillilitreOnAFloorIsOnePuddleOfYoungAndLaplace) {
  const double expected = young_laplace_diameter_m(1e-6, 40 * M_PI / 180);
  EXPECT_NEAR(expected, 31.3e-3, 0.1e-3);
  for (const float spacing_m : {0.001F, 0.002F}) {
    const Sheet sheet(0.05F, 0.05F, spacing_m, 0.05F);
    SheetFilm film(ctx(), sheet, {.most_passes = 64}, 0, kFrame_s);
    const std::vector<double> area = sheet.areas_m2();
    const auto spot = [&](Vec3f x) { return std::hypot(x.x - 0.025F, x.y) < 0.006F; };
    double spot_m2 = 0;
    for (std::size_t i = 0; i < area.size(); ++i) spot_m2 += spot(sheet.x_m[i]) ? area[i] : 0;
    film.fill(sheet, [&](Vec3f x) { return spot(x) ? 1e-6 / spot_m2 : 0.0; });
    for (int k = 0; k < 360; ++k) film.step();
    const std::vector<float> h = film.heights_m();
    double wet_m2 = 0;
    for (std::size_t i = 0; i < h.size(); ++i) wet_m2 += h[i] > 0 ? area[i] : 0;
    const double across_m = std::sqrt(4 * wet_m2 / M_PI);
    std::printf("triangles of %.0f mm: %.2f mm across, Young and Laplace %.2f mm\n", double{spacing_m} * 1e3,
                across_m * 1e3, expected * 1e3);
    EXPECT_NEAR(across_m, expected, 0.06 * expected) << spacing_m;
    EXPECT_EQ(wet_pieces(sheet, h), 1);
    EXPECT_NEAR(volume_m3(film.volumes()), 1e-6, 1e-12);
  }
}

/// Lower end of a drop on a slope after 1 and after 2 s.
struct Fronts {
  double after_1_s, after_2_s;
};
Fronts fronts_of_drop(ExecContext& ctx, double volume_m3, float slope_deg) {
  const Sheet sheet(0.05F, 0.014F, 0.0005F);
  SheetFilm film(ctx, sheet, {.resolved_m = 0.0004F, .most_passes = 512}, slope_deg, kFrame_s);
  // The volume of a cap of radius r at 40 degrees is 0.597 r^3.
  const double r_m = std::cbrt(volume_m3 / 0.597), angle = 40 * M_PI / 180, sphere_m = r_m / std::sin(angle);
  film.fill(sheet, [&](Vec3f x) {
    const double from_m = std::hypot(double{x.x} - 0.01, double{x.y});
    return from_m < r_m ? std::sqrt(sphere_m * sphere_m - from_m * from_m) - sphere_m * std::cos(angle) : 0.0;
  });
  Fronts fronts{};
  for (int k = 1; k <= 120; ++k) {
    film.step();
    if (k != 60 && k != 120) continue;
    const std::vector<float> h = film.heights_m();
    double& front = k == 60 ? fronts.after_1_s : fronts.after_2_s;
    for (std::size_t i = 0; i < h.size(); ++i)
      if (h[i] > 0) front = std::max(front, double{sheet.x_m[i].x});
  }
  return fronts;
}

/// Furmidge 1962: a drop of width w slides where rho V g sin(slope) > w sigma (cos(receding) -
/// cos(advancing)), here with 0 and 40 degrees. A ball of 2.5 mm makes a drop 4.8 mm across that holds up to
/// 50 degrees, one of 3.5 mm a drop 6.7 mm across that holds up to 23.
TEST_F(FilmOnCpu, DropsStickOnASlopeUpToFurmidgesAngle) {
  const auto volume_of_ball_m3 = [](double d_m) { return M_PI / 6 * d_m * d_m * d_m; };
  for (const auto& [ball_m, slope_deg, slides] :
       {std::tuple{2.5e-3, 30.F, false}, {2.5e-3, 70.F, true}, {3.5e-3, 15.F, false}, {3.5e-3, 35.F, true}}) {
    const double volume = volume_of_ball_m3(ball_m), width_m = 2 * std::cbrt(volume / 0.597);
    const double critical =
        std::asin(width_m * kTension * (1 - std::cos(40 * M_PI / 180)) / (kDensity * volume * kGravity)) *
        180 / M_PI;
    const Fronts fronts = fronts_of_drop(ctx(), volume, slope_deg);
    std::printf("ball of %.1f mm, critical angle %.0f, on %.0f degrees: front %.2f mm, then %.2f mm\n",
                ball_m * 1e3, critical, double{slope_deg}, fronts.after_1_s * 1e3, fronts.after_2_s * 1e3);
    EXPECT_EQ(double{slope_deg} > critical, slides);
    if (slides)
      EXPECT_GT(fronts.after_2_s, fronts.after_1_s + 0.002);
    else
      EXPECT_EQ(fronts.after_2_s, fronts.after_1_s);
  }
}

TEST_F(FilmOnCpu, ASurfaceThatStretchesKeepsTheVolumeToTheUnit) {
  Sheet sheet(0.04F, 0.03F, 0.002F, 0.2F);
  SheetFilm film(ctx(), sheet, {}, 0, kFrame_s);
  film.fill(sheet,
            [](Vec3f x) { return std::abs(x.x - 0.02F) < 0.01F && std::abs(x.y) < 0.01F ? 1e-3 : 0.0; });
  const auto sum = [&] {
    const std::vector<std::int64_t> v = film.volumes();
    EXPECT_TRUE(std::all_of(v.begin(), v.end(), [](std::int64_t u) { return u >= 0; }));
    return std::accumulate(v.begin(), v.end(), std::int64_t{0});
  };
  const std::int64_t before = sum();
  const auto mean_height_m = [&] {
    double wet_m2 = 0;
    const std::vector<double> area = sheet.areas_m2();
    const std::vector<float> h = film.heights_m();
    for (std::size_t i = 0; i < h.size(); ++i) wet_m2 += h[i] > 0 ? area[i] : 0;
    return volume_m3(film.volumes()) / wet_m2;
  };
  film.tilt(5);
  for (int k = 0; k < 60; ++k) {
    film.step();
    ASSERT_EQ(sum(), before);
  }
  // Heights are those of the new areas at once.
  const double height_m = mean_height_m();
  for (Vec3f& x : sheet.x_m) x = {1.25F * x.x, 1.25F * x.y, 0};
  film.move(sheet.x_m);
  film.step();
  EXPECT_EQ(sum(), before);
  EXPECT_LT(mean_height_m(), height_m / (1.25 * 1.25) * 1.001);
}

/// Two sheets side by side that share places, but no vertices: as the walls of a cut.
TEST_F(FilmOnCpu, NothingFlowsFromOneLipOfACutToTheOther) {
  const Sheet lip(0.03F, 0.02F, 0.002F);
  Sheet both = lip;
  const auto n = static_cast<Index>(lip.x_m.size());
  float right_m = 0;
  for (const Vec3f& x : lip.x_m) right_m = std::max(right_m, x.x);
  for (const Vec3f& x : lip.x_m) both.x_m.push_back({2 * right_m - x.x, x.y, 0});
  for (std::size_t k = 0; k < lip.corners.size(); k += 3)
    for (const std::size_t corner : {0U, 2U, 1U}) both.corners.push_back(lip.corners[k + corner] + n);
  both.link();
  SheetFilm film(ctx(), both, {.contact_angle_deg = 0}, 20, kFrame_s);
  film.fill(both, [&](Vec3f x) { return x.x < 0.015F ? 1e-3 : 0.0; });
  for (int k = 0; k < 120; ++k) film.step();
  const std::vector<std::int64_t> v = film.volumes();
  EXPECT_GT(*std::max_element(v.begin(), v.begin() + n), 0);
  EXPECT_EQ(std::accumulate(v.begin() + n, v.end(), std::int64_t{0}), 0);
}

TEST_F(FilmOnCpu, WhereAllIsDryNothingRuns) {
  const Sheet sheet(0.04F, 0.03F, 0.002F);
  SheetFilm film(ctx(), sheet, {}, 30, kFrame_s);
  film.step();
  EXPECT_EQ(film.passes().passes, 0);
  EXPECT_EQ(film.heights_m(), std::vector<float>(sheet.x_m.size(), 0.F));
}

/// One wet vertex of a triangular lattice has 6, 12 and 18 others in its three rings, and the triangles round
/// those are a hexagon of 4 edges a side: 6 times 16. Vertices that are dry again are looked at no longer.
TEST_F(FilmOnCpu, OnlyWhatIsWetAndThreeRingsAreLookedAt) {
  const Sheet sheet(0.06F, 0.06F, 0.002F);
  SheetFilm film(ctx(), sheet, {}, 0, kFrame_s);
  std::vector<std::int64_t> v = film.volumes();
  const auto looked_at = [&](std::size_t wet, std::int64_t units) {
    v.assign(v.size(), 0);
    v[wet] = units;
    film.set_volumes(v);
    film.step();
    const auto count = [&](const Count& of) {
      return to_host(ctx(), View<const Index>(of.device_count, 1))[0];
    };
    return std::pair{count(film.film.region().vertices), count(film.film.region().triangles)};
  };
  const std::size_t middle = v.size() / 2 + 15;
  EXPECT_EQ(looked_at(middle, 1000), std::pair(37, 96));
  EXPECT_EQ(looked_at(middle - 5, 1000), std::pair(37, 96));
  EXPECT_EQ(looked_at(middle, 0), std::pair(0, 0));
}

/// A puddle at rest takes one pass a frame; a drop on it wakes it in the frame after.
TEST_F(FilmOnCpu, APuddleAtRestTakesOnePassAFrame) {
  const Sheet sheet(0.05F, 0.05F, 0.002F, 0.05F);
  SheetFilm film(ctx(), sheet, {}, 0, kFrame_s);
  film.fill(sheet, [](Vec3f x) { return std::hypot(x.x - 0.025F, x.y) < 0.01F ? 1e-6 / 3.14e-4 : 0.0; });
  film.step();
  film.step();
  EXPECT_EQ(film.passes().passes, 16);
  int frames = 2;
  for (; frames < 900 && film.passes().passes > 1; ++frames) film.step();
  std::printf("at rest after %.2f s\n", frames * double{kFrame_s});
  EXPECT_EQ(film.passes().passes, 1);
  std::vector<std::int64_t> v = film.volumes();
  *std::max_element(v.begin(), v.end()) += std::llround(2e-8 * double{kFilmUnits_1_m3});
  film.set_volumes(v);
  film.step();
  film.step();
  EXPECT_EQ(film.passes().passes, 16);
}

TEST_F(FilmOnCpu, SettingsOutOfRangeAreNamed) {
  const auto refusal = [&](const FilmSettings& s) {
    return test::message_of([&] { Film(ctx(), s, 8, 8, 24); });
  };
  EXPECT_NE(refusal({.viscosity_Pa_s = 0}).find("viscosity_Pa_s"), std::string::npos);
  EXPECT_NE(refusal({.contact_angle_deg = 200}).find("contact_angle_deg"), std::string::npos);
  EXPECT_NE(refusal({.most_passes = 0}).find("most_passes"), std::string::npos);
  EXPECT_NE(refusal({.rings = 0}).find("rings"), std::string::npos);
}

class FilmOn : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(FilmOn);

struct State {
  std::vector<std::int64_t> volumes;
  std::vector<float> heights_m;
  bool operator==(const State&) const = default;
};

State state_after(ExecContext& ctx) {
  Sheet sheet(0.06F, 0.04F, 0.0025F, 0.25F);
  for (Vec3f& x : sheet.x_m) x.z = 0.004F * std::sin(150 * x.x) * std::cos(120 * x.y);
  SheetFilm film(ctx, sheet, {}, 35, kFrame_s);
  film.fill(sheet,
            [](Vec3f x) { return x.x < 0.03F && x.y > -0.01F ? 1e-3 * (1 + std::sin(700 * x.x)) : 0.0; });
  for (int k = 0; k < 40; ++k) film.step();
  return {film.volumes(), film.heights_m()};
}

TEST_P(FilmOn, HasTheSameBitsAsOnTheCpu) {
  DeviceSet cpu("cpu");
  const State expected = state_after(cpu.context(0));
  EXPECT_GT(volume_m3(expected.volumes), 0);
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    DeviceSet set(GetParam(), seed);
    for (int part = 0; part < set.count(); ++part) EXPECT_EQ(state_after(set.context(part)), expected);
  }
}

}  // namespace
}  // namespace tactus
