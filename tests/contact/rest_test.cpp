// What rests on a real surface that is seen anew thirty times a second.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "contact/contact_scene.h"
#include "support/device_sets.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {
namespace {

constexpr float kSpacing = 0.005F;
constexpr float kDt = 1.F / 30;
constexpr int kSubsteps = 5;
constexpr float kSubstep = kDt / kSubsteps;
constexpr ContactTimes kFrame{.dt_s = kSubstep, .substeps = kSubsteps, .dt_frame_s = kDt};

struct Rest {
  float creep_m = 0, chatter_m = 0;  ///< over the run; within its last two seconds
  float deepest_m = 0;               ///< in those
  double contacts = 0;
  std::vector<Vec3f> x_m;
};

/// Nodes on springs (ω 20 rad/s, damped) sag by g/ω² = 25 mm onto a sphere of 6 cm that is tessellated anew,
/// turned at random, 30 times a second. It is still: only the sampling changes.
Rest rest_on_a_sphere(ExecContext& ctx, const ContactSettings& settings, int frames) {
  const float radius = 0.06F;
  test::Nodes nodes(test::block({7, 1, 7}, kSpacing, {0, radius + 0.2F * kSpacing, 0}), 1e-3F);
  const std::vector<Vec3f> rest = nodes.x;
  RealSurface surface(ctx.device(), test::small_surface(kSpacing));
  Contact contact(ctx.device(), settings);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> u(-1, 1);
  std::vector<Vec3f> early(nodes.x.size()), late = early, low(nodes.x.size(), {9, 9, 9}),
                                            high(nodes.x.size(), {-9, -9, -9});
  Rest result;
  for (int f = 0; f < frames; ++f) {
    const Mat3f turn = rotation_matrix(
        axis_angle(normalized(Vec3f{u(random), u(random), u(random)}, {1, 0, 0}), 3 * u(random)));
    const test::DeviceMesh mesh(ctx, test::transformed(test::unit_sphere(26), {turn, {}}, radius));
    surface.update(ctx, mesh.view(), kDt);
    nodes.begin_frame(ctx);
    contact.begin_frame(ctx, surface, kFrame);
    for (int k = 0; k < kSubsteps; ++k) {
      for (std::size_t i = 0; i < nodes.x.size(); ++i) {
        const Vec3f force = 400.F * (rest[i] - nodes.x[i]) - 20.F * nodes.v[i] + Vec3f{0, -9.81F, 0};
        nodes.v[i] += kSubstep * force;
        nodes.x[i] += kSubstep * nodes.v[i];
      }
      nodes.correct(ctx, contact, surface, k);
    }
    if (f == frames - 1) result.contacts = nodes.report(ctx, kDt, kSubsteps).contacts_per_substep;
    for (std::size_t i = 0; i < nodes.x.size(); ++i) {
      if (f >= 150 && f < 210) early[i] += (1.F / 60) * nodes.x[i];
      if (f < frames - 60) continue;
      late[i] += (1.F / 60) * nodes.x[i];
      low[i] = min(low[i], nodes.x[i]);
      high[i] = max(high[i], nodes.x[i]);
      result.deepest_m = std::max(result.deepest_m, radius - length(nodes.x[i]));
    }
  }
  for (std::size_t i = 0; i < nodes.x.size(); ++i) {
    result.creep_m = std::max(result.creep_m, length(late[i] - early[i]));
    result.chatter_m = std::max(result.chatter_m, length(high[i] - low[i]));
  }
  result.x_m = nodes.x;
  return result;
}

constexpr ContactSettings kPaper{.response = ContactResponse::paper};

/// A twentieth of a spacing in the 53 s from the early mean to the late one, or 23 s of a run of 30 s.
TEST(ContactAtRest, NeitherCreepsNorChatters) {
  const bool is_long = std::getenv("TACTUS_LONG_TESTS") != nullptr;
  DeviceSet cpu("cpu");
  const Rest rest = rest_on_a_sphere(cpu.context(0), {}, is_long ? 1800 : 900);
  EXPECT_EQ(rest.contacts, 49);
  RecordProperty("creep_spacings", std::to_string(rest.creep_m / kSpacing));
  RecordProperty("chatter_spacings", std::to_string(rest.chatter_m / kSpacing));
  EXPECT_LT(rest.creep_m, (is_long ? 0.05F : 0.05F * 23 / 53) * kSpacing);
  EXPECT_LT(rest.chatter_m, 0.05F * kSpacing);
}

/// With the paper's forces and corrections: a point that approaches goes to a spacing above the surface,
/// along the mean normal of samples that are never the same, and nothing holds it there. It doesn't sink in,
/// either.
TEST(ContactAtRest, ChattersWithThePapersResponse) {
  DeviceSet cpu("cpu");
  const Rest rest = rest_on_a_sphere(cpu.context(0), kPaper, 600);
  std::printf("chatter %.2f, creep %.2f, deepest %.3f spacings\n", rest.chatter_m / kSpacing,
              rest.creep_m / kSpacing, rest.deepest_m / kSpacing);
  EXPECT_GT(rest.chatter_m, 0.5F * kSpacing);
  EXPECT_GT(rest.creep_m, 0.5F * kSpacing);
  EXPECT_LT(rest.deepest_m, 0.25F * kSpacing);
}

class ContactAtRestOn : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(ContactAtRestOn);

TEST_P(ContactAtRestOn, HasTheSameBitsWithThePapersResponse) {
  DeviceSet cpu("cpu"), devices(GetParam(), 5);
  const std::vector<Vec3f> expected = rest_on_a_sphere(cpu.context(0), kPaper, 20).x_m;
  devices.for_each_part(
      [&](ExecContext& ctx, int) { EXPECT_EQ(rest_on_a_sphere(ctx, kPaper, 20).x_m, expected); });
}

}  // namespace
}  // namespace tactus
