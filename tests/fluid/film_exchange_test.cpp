/// Particles that become film, and film that becomes particles: the ledger is exact, and drops end as
/// puddles.
#include "tactus/fluid/film/film_exchange.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "fluid/film_scene.h"
#include "support/device_sets.h"
#include "support/message_of.h"
#include "tactus/fluid/liquid.h"

namespace tactus {
namespace {

using test::Sheet;
using test::SheetFilm;
using test::volume_m3;
using test::wet_pieces;

constexpr float kSpacing_m = 0.0025F, kFrame_s = 1.F / 60;
/// Of the liquid, in a frame: at most 0.4 of a spacing each at 1 m/s.
int steps_for(float spacing_m) { return static_cast<int>(std::ceil(kFrame_s / (0.399F * spacing_m))); }

/// A liquid above a sheet at the bottom of its box, or below one at its top.
class Wetting {
 public:
  Wetting(DeviceSet& devices, const Sheet& sheet, bool hangs = false, float spacing_m = kSpacing_m,
          bool is_still = false)
      : ctx_(devices.context(0)),
        gravity_m_s2_{0, 0, hangs ? 9.81F : -9.81F},
        steps_(steps_for(spacing_m)),
        liquid(devices, settings(spacing_m)),
        film(ctx_, sheet, {}, hangs ? 180.F : 0.F, kFrame_s),
        exchange(ctx_,
                 {.spacing_m = spacing_m, .reach_m = 0.004F, .max_particles = kRoom, .is_still = is_still},
                 film.film),
        normals_(to_device(ctx_, std::vector<Vec3f>(sheet.x_m.size(), Vec3f{0, 0, 1}))) {
    exchange.start(ctx_, film.surface());
  }
  /// In the order of a scene's frame.
  void frame() {
    film.step();
    const FilmSkin skin = exchange.skin(film.surface(), normals_.const_view(), film.frame());
    exchange.find_touching(ctx_, skin, liquid.search(), liquid.arrivals());
    exchange.find_givers(ctx_, film.film, skin, liquid.search(), liquid.arrivals());
    exchange.run(ctx_, film.film, skin, liquid.search(), liquid.arrivals());
    for (int k = 0; k < steps_; ++k)
      liquid.step({.dt_s = kFrame_s / static_cast<float>(steps_), .gravity_m_s2 = gravity_m_s2_});
    liquid.end_frame();
  }
  LiquidReport report() { return to_host(ctx_, liquid.report_view())[0]; }
  FilmLedger ledger() { return to_host(ctx_, exchange.ledger())[0]; }
  std::int64_t film_units() {
    const std::vector<std::int64_t> v = film.volumes();
    EXPECT_TRUE(std::all_of(v.begin(), v.end(), [](std::int64_t u) { return u >= 0; }));
    return std::accumulate(v.begin(), v.end(), std::int64_t{0});
  }
  /// @param before units that the film had at the beginning
  void expect_exact_ledger(std::int64_t before = 0) {
    const LiquidReport r = report();
    const FilmLedger b = ledger();
    EXPECT_EQ(static_cast<std::int64_t>(r.here), std::int64_t{r.placed} + std::int64_t{r.emitted} -
                                                     std::int64_t{r.taken} - std::int64_t{r.replaced});
    EXPECT_EQ(b.taken, r.taken);
    EXPECT_EQ(b.given, r.emitted);
    EXPECT_EQ(film_units() - before,
              exchange.particle_units() * (std::int64_t{b.taken} - std::int64_t{b.given}));
  }

 private:
  static constexpr Index kRoom = 6144;
  static LiquidSettings settings(float spacing_m) {
    return {.solver = LiquidSolver::dfsph,
            .spacing_m = spacing_m,
            .surface_tension_N_m = 0.058F,
            .contact_angle_deg = 40,
            .max_speed_m_s = 1,
            .box_m = {{-0.01F, -0.04F, 0}, {0.07F, 0.04F, 0.1F}},
            .max_particles = kRoom - 256,
            .arrivals = 256,
            .least_particles = kRoom};
  }
  ExecContext& ctx_;
  Vec3f gravity_m_s2_;
  int steps_;

 public:
  Liquid liquid;
  SheetFilm film;
  FilmExchange exchange;

 private:
  Buffer<Vec3f> normals_;
};

/// 64 particles of 2.5 mm are 1 ml.
std::vector<LiquidParticle> millilitre() {
  const float edge_m = 4 * kSpacing_m;
  return fill_box(
      {{0.03F - 0.5F * edge_m, -0.5F * edge_m, 0}, {0.03F + 0.5F * edge_m, 0.5F * edge_m, edge_m}},
      kSpacing_m);
}

/// Gravity that is set is gravity that was there from the beginning, to the bit; none is refused.
TEST(FilmExchange, FollowsGravity) {
  DeviceSet devices("cpu");
  ExecContext& ctx = devices.context(0);
  const Sheet sheet(0.02F, 0.02F, 0.002F);
  const SheetFilm film(ctx, sheet, {}, 0.F, kFrame_s);
  const FilmExchangeSettings weak{
      .spacing_m = 0.001F, .gravity_m_s2 = 1, .reach_m = 0.004F, .max_particles = 64};
  FilmExchangeSettings strong = weak;
  strong.gravity_m_s2 = 9.81F;
  const FilmExchange built(ctx, weak, film.film);
  FilmExchange set(ctx, strong, film.film);
  EXPECT_LT(set.thick_m(), built.thick_m());
  set.set_gravity_m_s2(1, film.film);
  EXPECT_EQ(set.thick_m(), built.thick_m());
  EXPECT_NE(test::message_of([&] { set.set_gravity_m_s2(0, film.film); }).find("gravity_m_s2 is 0"),
            std::string::npos);
}

/// A slab of 20 x 20 x 2.5 mm, laid down, of particles of 2.5 mm, of half and of a quarter of that. Particles
/// alone end in tens of balls over 18 and 10 cm. Young and Laplace's puddle at 40 degrees is 31.3 mm across.
/// 5 %: triangles of 2 mm alone make it 4 % less (film_test.cpp); a slab slumps for a frame at up to
/// (g h)^(1/2) = 0.16 m/s, 2.6 mm on either side, and is then, as film, less wide than the puddle.
TEST(FilmExchange, AMillilitreOfParticlesEndsAsOnePuddle) {
  DeviceSet devices("cpu");
  for (const float spacing_m : {0.0025F, 0.00125F, 0.000625F}) {
    const Sheet sheet(0.06F, 0.06F, 0.002F);
    Wetting wet(devices, sheet, false, spacing_m);
    const std::vector<LiquidParticle> slab =
        fill_box({{0.02F, -0.01F, 0}, {0.04001F, 0.01001F, 0.00251F}}, spacing_m);
    wet.liquid.place(slab);
    for (int k = 0; k < 300; ++k) {
      wet.frame();
      if (k % 20 == 0) wet.expect_exact_ledger();
    }
    const std::vector<double> area = sheet.areas_m2();
    const std::vector<float> h = wet.film.heights_m();
    double wet_m2 = 0;
    for (std::size_t i = 0; i < h.size(); ++i) wet_m2 += h[i] > 0 ? area[i] : 0;
    const double across_m = std::sqrt(4 * wet_m2 / M_PI);
    std::printf("d %.2f mm: of %zu particles %d left, film %.4f ml, %.2f mm across\n",
                double{spacing_m} * 1e3, slab.size(), wet.report().here, volume_m3(wet.film.volumes()) * 1e6,
                across_m * 1e3);
    EXPECT_EQ(wet.report().here, 0);
    EXPECT_NEAR(volume_m3(wet.film.volumes()), 1e-6, 1e-9);
    EXPECT_NEAR(across_m, 31.3e-3, 0.05 * 31.3e-3);
    EXPECT_EQ(wet_pieces(sheet, h), 1);
  }
}

TEST(FilmExchange, AFilmThatHangsDripsAndItsLedgerIsExact) {
  DeviceSet devices("cpu");
  Sheet sheet(0.06F, 0.06F, 0.002F);
  for (Vec3f& x : sheet.x_m) x.z = 0.002F;
  Wetting wet(devices, sheet, true);
  wet.liquid.place({});
  wet.film.fill(sheet,
                [](Vec3f x) { return std::hypot(x.x - 0.03F, x.y) < 0.012F ? 4e-3 - 0.05 * x.x : 0.0; });
  const std::int64_t before = wet.film_units();
  for (int k = 0; k < 60; ++k) {
    wet.frame();
    wet.expect_exact_ledger(before);
  }
  EXPECT_GT(wet.ledger().given, 5U);
  std::printf("dripped %u particles, %.4f ml hang\n", wet.ledger().given,
              volume_m3(wet.film.volumes()) * 1e6);
  float lowest_m = 0;
  for (const LiquidParticle& p : wet.liquid.particles()) lowest_m = std::max(lowest_m, p.x_m.z);
  EXPECT_GT(lowest_m, 0.05F) << "drops fall";
}

/// A particle that rests on the sheet becomes film in one frame; one that runs along it, or hangs above,
/// stays.
TEST(FilmExchange, OnlySlowParticlesThatTouchBecomeFilm) {
  DeviceSet devices("cpu");
  const Sheet sheet(0.06F, 0.06F, 0.002F);
  Wetting wet(devices, sheet);
  const float on_m = 0.5F * kSpacing_m;
  wet.liquid.place(std::vector<LiquidParticle>{{{0.01F, 0, on_m}, {0, 0, 0}, 0},
                                               {{0.02F, 0.02F, on_m}, {0.9F, 0, 0}, 1},
                                               {{0.03F, -0.02F, 0.05F}, {0, 0, 0}, 2}});
  wet.frame();
  const std::vector<LiquidParticle> left = wet.liquid.particles();
  ASSERT_EQ(left.size(), 2U);
  EXPECT_EQ(left[0].id, 1);
  EXPECT_EQ(left[1].id, 2);
  EXPECT_EQ(wet.ledger().taken, 1U);
  EXPECT_EQ(wet.film_units(), wet.exchange.particle_units());
}

/// All that lie on the sheet become film in one frame, side by side and on top of one another, however fine
/// they are beside triangles of 2 mm, while they make the film no thicker than it may be: 1.9 mm. So a layer
/// of 1.25 mm is taken, and two of 0.625 mm.
TEST(FilmExchange, LayersBecomeFilmAtOnce) {
  DeviceSet devices("cpu");
  const Sheet sheet(0.06F, 0.06F, 0.002F);
  for (const auto& [d, layers] : {std::pair{0.00125F, 1U}, {0.000625F, 2U}}) {
    Wetting wet(devices, sheet, false, d);
    EXPECT_LT(1.25e-3, double{wet.exchange.thick_m()});
    const auto n = static_cast<std::uint32_t>(std::lround(0.02F / d));
    wet.liquid.place(
        fill_box({{0.02F, -0.01F, 0}, {0.04001F, 0.01001F, static_cast<float>(layers) * d + 1e-5F}}, d));
    ASSERT_EQ(wet.report().here, static_cast<Index>(layers * n * n));
    wet.frame();
    EXPECT_EQ(wet.ledger().taken, layers * n * n);
    wet.expect_exact_ledger();
  }
}

/// A surface that never moves is sorted once: to the bit the same as one that is sorted in each frame.
TEST(FilmExchange, AStillSurfaceTakesTheSame) {
  DeviceSet devices("cpu");
  const Sheet sheet(0.06F, 0.06F, 0.002F, 0.1F);
  std::vector<std::int64_t> volumes[2];
  for (const bool is_still : {false, true}) {
    Wetting wet(devices, sheet, false, kSpacing_m, is_still);
    wet.liquid.place(millilitre());
    for (int k = 0; k < 8; ++k) wet.frame();
    EXPECT_GT(wet.ledger().taken, 20U);
    volumes[is_still ? 1 : 0] = wet.film.volumes();
  }
  EXPECT_EQ(volumes[0], volumes[1]);
}

TEST(FilmExchange, WhatDriesIsAStainAndNothingIsLost) {
  DeviceSet devices("cpu");
  const Sheet sheet(0.04F, 0.03F, 0.002F);
  SheetFilm film(devices.context(0), sheet, {.drying_m_s = 1e-5F}, 0, kFrame_s);
  film.fill(sheet,
            [](Vec3f x) { return std::abs(x.x - 0.02F) < 0.01F && std::abs(x.y) < 0.01F ? 1e-4 : 0.0; });
  const auto sum = [](const std::vector<std::int64_t>& v) {
    return std::accumulate(v.begin(), v.end(), std::int64_t{0});
  };
  const std::int64_t before = sum(film.volumes());
  const auto stains = [&] { return to_host(devices.context(0), film.film.stains()); };
  for (int k = 0; k < 60; ++k) film.step();
  EXPECT_EQ(sum(film.volumes()) + sum(stains()), before);
  // In a second, 0.01 of 0.1 mm dry; the film's edge is held where it is.
  EXPECT_NEAR(static_cast<double>(sum(stains())), 0.1 * static_cast<double>(before),
              0.002 * static_cast<double>(before));
  for (int k = 0; k < 1200; ++k) film.step();
  EXPECT_EQ(sum(film.volumes()), 0);
  EXPECT_EQ(sum(stains()), before);
  EXPECT_EQ(film.heights_m(), std::vector<float>(sheet.x_m.size(), 0.F));
}

TEST(FilmExchange, SettingsOutOfRangeAreNamed) {
  DeviceSet devices("cpu");
  const auto refusal = [&](const FilmExchangeSettings& s) {
    return test::message_of(
        [&] { FilmExchange(devices.context(0), s, Film(devices.context(0), {}, 8, 8, 24)); });
  };
  EXPECT_NE(refusal({.reach_m = 1, .max_particles = 1}).find("spacing_m"), std::string::npos);
  EXPECT_NE(refusal({.spacing_m = 1, .max_particles = 1}).find("reach_m"), std::string::npos);
  EXPECT_NE(refusal({.spacing_m = 1, .reach_m = 1}).find("max_particles"), std::string::npos);
}

class FilmExchangeOn : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(FilmExchangeOn);

struct State {
  std::vector<std::int64_t> volumes;
  std::vector<Vec3f> x_m;
  FilmLedger ledger;
};

State state_after(const std::string& devices, std::uint64_t seed) {
  DeviceSet set(devices, seed);
  const Sheet sheet(0.06F, 0.06F, 0.0025F, 0.1F);
  Wetting wet(set, sheet);
  wet.liquid.place(millilitre());
  // Some of it too thick, so that particles come, too.
  wet.film.fill(sheet, [](Vec3f x) { return x.x > 0.045F && std::abs(x.y) < 0.01F ? 6e-3 : 0.0; });
  for (int k = 0; k < 20; ++k) wet.frame();
  State state{wet.film.volumes(), {}, wet.ledger()};
  for (const LiquidParticle& p : wet.liquid.particles()) state.x_m.push_back(p.x_m);
  return state;
}

TEST_P(FilmExchangeOn, HasTheSameBitsAsOnTheCpu) {
  const State expected = state_after("cpu", 0);
  EXPECT_GT(expected.ledger.taken, 0U);
  EXPECT_GT(expected.ledger.given, 0U);
  const State state = state_after(GetParam(), 3);
  EXPECT_EQ(state.volumes, expected.volumes);
  EXPECT_EQ(state.x_m, expected.x_m);
  EXPECT_EQ(state.ledger.taken, expected.ledger.taken);
  EXPECT_EQ(state.ledger.given, expected.ledger.given);
}

}  // namespace
}  // namespace tactus
