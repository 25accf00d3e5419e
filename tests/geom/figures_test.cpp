#include "tactus/geom/figures/figures.h"

#include <gtest/gtest.h>

#include <random>

#include "support/message_of.h"
#include "tactus/base/error.h"

namespace tactus {
namespace {

using test::message_of;

class EveryFigure : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(, EveryFigure, testing::ValuesIn(figure_names().begin(), figure_names().end()),
                         [](const auto& param) { return param.param; });

Vec3f random_point(std::mt19937& random, const Box3f& box) {
  std::uniform_real_distribution<float> u(0.F, 1.F);
  const Vec3f e = box.extent();
  return box.min + Vec3f{u(random) * e.x, u(random) * e.y, u(random) * e.z};
}

TEST_P(EveryFigure, DistanceChangesNoFasterThanTheWay) {
  const FigureShape shape = make_figure(GetParam(), {.moving = true}).at(0.7);
  std::mt19937 random(1);
  const Box3f box{{-1, -0.5F, -1}, {1, 1.5F, 1}};
  std::uniform_real_distribution<float> log_way(-4.F, 0.F);
  for (int i = 0; i < 20000; ++i) {
    const Vec3f a = random_point(random, box);
    const Vec3f toward = normalized(random_point(random, box) - a, {1, 0, 0});
    const Vec3f b = a + std::pow(10.F, log_way(random)) * toward;
    // Rounding: coordinates of at most 2 m in about 8 operations, 8 * 2 * 6e-8 m.
    ASSERT_LE(abs(shape.distance_m(a) - shape.distance_m(b)), length(a - b) + 1e-6F);
  }
}

TEST_P(EveryFigure, EightPointsHaveTheBitsOfOne) {
  const FigureShape shape = make_figure(GetParam()).at(0);
  std::mt19937 random(2);
  const Box3f box{{-0.5F, 0, -0.5F}, {0.5F, 1, 0.5F}};
  for (int i = 0; i < 2000; ++i) {
    Vec3<Float8> packet;
    std::vector<Vec3f> points;
    for (int lane = 0; lane < 8; ++lane) {
      const Vec3f p = points.emplace_back(random_point(random, box));
      packet.x.set(lane, p.x);
      packet.y.set(lane, p.y);
      packet.z.set(lane, p.z);
    }
    const Float8 f = shape.distance_m(packet);
    for (int lane = 0; lane < 8; ++lane)
      ASSERT_EQ(f[lane], shape.distance_m(points[static_cast<std::size_t>(lane)]));
  }
}

TEST_P(EveryFigure, LeavingOutFarLimbsKeepsTheSign) {
  const FigureShape shape = make_figure(GetParam()).at(0);
  std::mt19937 random(3);
  int left_out = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3f p = random_point(random, shape.bounds_m());
    unsigned near = 0;
    for (std::size_t k = 0; k < shape.limbs().size(); ++k) {
      const FigureShape::Limb& limb = shape.limbs()[k];
      if (length(p - limb.center_m) - limb.radius_m <= shape.seam_m() + 1e-5F) near |= 1U << k;
    }
    left_out += near + 1 != 1U << shape.limbs().size();
    ASSERT_EQ(shape.distance_m(p, near) < 0, shape.distance_m(p) < 0);
  }
  if (shape.limbs().size() > 1) {
    EXPECT_GT(left_out, 1000);
  }
}

TEST_P(EveryFigure, StaysInItsBoundsAtAllTimes) {
  for (const bool moving : {false, true}) {
    const Figure figure = make_figure(GetParam(), {.moving = moving});
    const Box3f box = figure.bounds_m();
    std::mt19937 random(4);
    const Box3f around{box.min - Vec3f{0.2F, 0.2F, 0.2F}, box.max + Vec3f{0.2F, 0.2F, 0.2F}};
    int inside = 0;
    for (int k = 0; k < (moving ? 37 : 1); ++k) {  // 37: not in step with the samples that made the bounds
      const FigureShape shape = figure.at(figure.period_s() * k / 37);
      for (int i = 0; i < 4000; ++i) {
        const Vec3f p = random_point(random, around);
        if (shape.distance_m(p) > 0) continue;
        ++inside;
        ASSERT_TRUE(p.x >= box.min.x && p.y >= box.min.y && p.z >= box.min.z && p.x <= box.max.x &&
                    p.y <= box.max.y && p.z <= box.max.z);
      }
    }
    EXPECT_GT(inside, 0);
  }
}

TEST_P(EveryFigure, MovesPeriodicallyAndScales) {
  const Figure figure = make_figure(GetParam(), {.moving = true});
  const Vec3f p{0.05F, 0.45F, 0.03F};
  // The phase is taken modulo the period in double: 1e-15 of it; poses are float.
  EXPECT_NEAR(figure.distance_m(p, 0.9), figure.distance_m(p, 0.9 + 3 * figure.period_s()), 1e-5F);
  const double one = figure_volume(make_figure(GetParam()).at(0)).volume_m3;
  const double half = figure_volume(make_figure(GetParam(), {.scale = 0.5F}).at(0)).volume_m3;
  EXPECT_NEAR(half, one / 8, 2e-3 * one / 8);  // both within 0.1 %
}

TEST(Figures, HaveTheRightSignAtKnownPoints) {
  const FigureShape sphere = make_figure("sphere").at(0);
  EXPECT_NEAR(sphere.distance_m(Vec3f{0, 0.5F, 0}), -0.25F, 1e-6F);
  EXPECT_NEAR(sphere.distance_m(Vec3f{0, 1.0F, 0}), 0.25F, 1e-6F);
  EXPECT_NEAR(sphere.distance_m(Vec3f{0.3F, 0.5F, 0.4F}), 0.25F, 1e-6F);
  const FigureShape bowl = make_figure("bowl").at(0);
  EXPECT_GT(bowl.distance_m(Vec3f{0, 0.5F, 0}), 0.01F) << "the cavity is empty";
  EXPECT_GT(bowl.distance_m(Vec3f{0, 0.5F, 0.29F}), 0.01F) << "open towards +z";
  EXPECT_NEAR(bowl.distance_m(Vec3f{0, 0.5F, -0.29F}), -0.02F, 1e-6F) << "the middle of the wall";
  const FigureShape hand = make_figure("hand").at(0);
  EXPECT_LT(hand.distance_m(Vec3f{0, 0.43F, 0}), 0.F) << "palm";
  EXPECT_GT(hand.distance_m(Vec3f{-0.35F, 0.5F, 0}), 0.05F) << "beside the little finger";
  for (const char* figure : {"rabbit", "liver", "scalpel"}) {
    const FigureShape shape = make_figure(figure).at(0);
    const Vec3f away = shape.bounds_m().max + Vec3f{0.1F, 0.1F, 0.1F};
    EXPECT_GT(shape.distance_m(away), 0.1F) << figure;
  }
}

/// Two lobes with a notch between them, a thin margin, and a gallbladder that looks out below it.
TEST(Figures, LiverHasItsLandmarks) {
  const FigureShape liver = make_figure("liver").at(0);
  constexpr float kStep_m = 0.002F;
  struct Column {
    float low_m = 1, thickest_m = 0, near_low_m = 0;  ///< thickness along z, and that 1 cm above the margin
  };
  const auto thickness_m = [&](float x, float y) {
    float sum = 0;
    for (float z = -0.1F; z < 0.1F; z += kStep_m) sum += liver.distance_m({x, y, z}) < 0 ? kStep_m : 0;
    return sum;
  };
  const auto column = [&](float x) {
    Column c;
    for (float y = 0.6F; y > 0.38F; y -= kStep_m) {
      const float t = thickness_m(x, y);
      if (t > 0) c.low_m = y;
      c.thickest_m = std::max(c.thickest_m, t);
    }
    c.near_low_m = thickness_m(x, c.low_m + 0.01F);
    return c;
  };
  const Column right = column(-0.08F), fundus = column(-0.028F), notch = column(0.026F),
               left = column(0.044F);
  // The margin rises from right to left; a notch in it is higher than the left lobe's margin beside it.
  EXPECT_GT(notch.low_m, left.low_m + 0.008F);
  EXPECT_GT(left.low_m, right.low_m + 0.02F);
  EXPECT_LT(fundus.low_m, right.low_m - 0.002F);
  // The right lobe is twice as thick as the left one's outer half; both are thin at the margin.
  EXPECT_GT(column(-0.03F).thickest_m, 2 * column(0.084F).thickest_m);
  for (const Column& c : {right, left}) EXPECT_LT(c.near_low_m, 0.6F * c.thickest_m);
  const double m3 = figure_volume(liver).volume_m3;  // of adults: 1.2 to 2 litres
  EXPECT_GT(m3, 1.2e-3);
  EXPECT_LT(m3, 2e-3);
}

/// The edge bounds the blade, which is a wedge there and flat behind; the handle is flat, and thicker.
TEST(Figures, ScalpelHasAFlatHandleAndACurvedEdge) {
  const Figure figure = make_figure("scalpel");
  const FigureShape shape = figure.at(0);
  const Rigidf T = figure.bones(0).front();
  const auto inside = [&](Vec3f p) { return shape.distance_m(T * p) < 0; };
  const std::span<const Vec3f> edge_m = scalpel_edge_m();
  // Coordinates of 0.5 m in float, some operations: 1e-6 m.
  for (const Vec3f& p : edge_m) EXPECT_NEAR(shape.distance_m(T * p), 0, 1e-6F);
  float turned = 0;
  for (std::size_t i = 1; i < edge_m.size(); ++i) {
    const Vec3f along = normalized(edge_m[i] - edge_m[i - 1]), in{-along.y, along.x, 0};
    const Vec3f middle = 0.5F * (edge_m[i] + edge_m[i - 1]);
    EXPECT_FALSE(inside(middle - 1e-4F * in)) << i;
    // The bevel's tangent is 0.35 / sqrt(1 - 0.35^2) = 0.37: at a depth of 2 mm it is 0.75 mm on either side.
    EXPECT_TRUE(inside(middle + 0.002F * in + Vec3f{0, 0, 0.0007F})) << i;
    EXPECT_FALSE(inside(middle + 0.002F * in + Vec3f{0, 0, 0.0008F})) << i;
    if (i > 1) turned += std::acos(dot(along, normalized(edge_m[i - 1] - edge_m[i - 2])));
  }
  EXPECT_GT(turned, 1.F) << "the belly";
  EXPECT_TRUE(inside({0.1F, -0.03F, 0}) && inside({0.1F, 0.015F, 0}) && inside({0.1F, 0, 0.0119F}));
  EXPECT_FALSE(inside({0.1F, 0, 0.0121F})) << "about half as thick as wide";
  EXPECT_FALSE(inside({-0.15F, 0, 0.0015F})) << "the blade is an eighth as thick";
}

TEST(Figures, RoundConeIsTheUnionOfItsSpheres) {
  const Vec3f a{0.1F, 0.2F, -0.1F}, b{-0.2F, 0.4F, 0.3F};
  const RoundCone cone = make_round_cone(a, b, 0.12F, 0.05F);
  std::mt19937 random(5);
  for (int i = 0; i < 500; ++i) {
    const Vec3f p = random_point(random, {{-1, -1, -1}, {1, 1, 1}});
    float nearest = 1e9F;
    for (int k = 0; k <= 2000; ++k) {
      const float s = static_cast<float>(k) / 2000;
      nearest = std::min(nearest, length(p - (a + s * (b - a))) - (0.12F + s * (0.05F - 0.12F)));
    }
    // Outside the nearest of the spheres is the distance; spheres are 0.27 mm apart, and the distance is
    // stationary there: off by at most (0.14 mm)^2 / (2 * 5 cm) + rounding.
    if (nearest > 0) {
      ASSERT_NEAR(cone.distance_m(p), nearest, 2e-6F);
    }
  }
}

TEST(Figures, VolumesAreThoseOfClosedForms) {
  const FigureVolume sphere = figure_volume(make_figure("sphere").at(0));
  const double r = 0.25, pi = 3.14159265358979;
  EXPECT_NEAR(sphere.volume_m3, 4.0 / 3 * pi * r * r * r, 1e-3 * sphere.volume_m3);
  EXPECT_LT(sphere.error_m3, 1e-3 * sphere.volume_m3);
  // A ball's cap cut off at z = h: pi (2 r^3 / 3 + r^2 h - h^3 / 3) lies below; the bowl is the difference of
  // two.
  const auto below = [&](double radius, double h) {
    return pi * (2 * radius * radius * radius / 3 + radius * radius * h - h * h * h / 3);
  };
  const double bowl = below(0.31, 0.02) - below(0.27, 0.02);
  EXPECT_NEAR(figure_volume(make_figure("bowl").at(0)).volume_m3, bowl, 1e-3 * bowl);
}

TEST_P(EveryFigure, VolumeAgreesWithRandomPoints) {
  const FigureShape shape = make_figure(GetParam()).at(0);
  const Box3f box = shape.bounds_m();
  const Vec3f e = box.extent();
  const double box_m3 = static_cast<double>(e.x) * e.y * e.z;
  std::mt19937 random(6);
  constexpr int kPoints = 200000;
  int inside = 0;
  for (int i = 0; i < kPoints; ++i) inside += shape.distance_m(random_point(random, box)) < 0;
  const double share = static_cast<double>(inside) / kPoints;
  // Five standard deviations of a binomial count.
  const double tolerance = 5 * box_m3 * std::sqrt(share * (1 - share) / kPoints);
  EXPECT_NEAR(figure_volume(shape).volume_m3, share * box_m3, tolerance);
}

TEST(Figures, VelocityCarriesTheSurface) {
  int rigid = 0;
  for (const std::string& name : figure_names()) {
    const Figure figure = make_figure(name, {.moving = true});
    if (!figure.rigid()) continue;  // the seams of a jointed figure stretch: it has its own tests
    ++rigid;
    std::mt19937 random(7);
    for (int i = 0; i < 200; ++i) {
      const Vec3f p = random_point(random, figure.bounds_m());
      const double t = 0.1 * (i % 40);
      constexpr float kDt_s = 0.01F;
      const Vec3f moved = p + kDt_s * figure.velocity_m_s(p, t);
      // A material point keeps its distance. Left: (dt^2 / 2) |acceleration|, at most 0.18 m * (2 pi / 3
      // s)^2.
      ASSERT_NEAR(figure.distance_m(moved, t + static_cast<double>(kDt_s)), figure.distance_m(p, t), 8e-5F)
          << name;
    }
  }
  EXPECT_EQ(rigid, 5);
}

TEST(Figures, VelocityOfAFingerIsThatOfItsBone) {
  const Figure hand = make_figure("hand", {.moving = true});
  // The tip of the middle finger (bones 4..6): carried for 10 ms it must stay put in its bone's frame.
  constexpr std::size_t kLastOfMiddle = 6;
  const double t = 1.2;
  constexpr float kDt_s = 0.01F;
  const Vec3f tip = hand.bones(t)[kLastOfMiddle] * Vec3f{0, 0.05F, 0};
  const Vec3f moved = tip + kDt_s * hand.velocity_m_s(tip, t);
  const Vec3f expected = hand.bones(t + static_cast<double>(kDt_s))[kLastOfMiddle] * Vec3f{0, 0.05F, 0};
  // (dt^2 / 2) |acceleration|: 0.5 m * 1 rad of bending * (2 pi / 2 s)^2 at most.
  EXPECT_LT(length(moved - expected), 2.5e-4F);
  EXPECT_GT(length(moved - tip), 5e-4F);
}

TEST(Figures, HandPressesDownToTheNamedHeight) {
  const Figure hand = make_figure("hand", {.moving = true, .scale = 0.45F, .offset_m = {0, 0.1F, 0}});
  float lowest_m = 1e9F, highest_low_m = -1e9F;
  for (int i = 0; i < 40; ++i) {
    const FigureShape shape = hand.at(hand.period_s() * i / 40);
    float low_m = 1e9F;
    for (float x = -0.4F; x < 0.4F; x += 0.02F)
      for (float z = -0.3F; z < 0.3F; z += 0.02F) {
        float y = 0;  // sphere tracing upwards
        for (int k = 0; k < 100 && y < 1; ++k) {
          const float f = shape.distance_m({x, y, z});
          if (f < 1e-4F) {
            low_m = std::min(low_m, y);
            break;
          }
          y += f;
        }
      }
    lowest_m = std::min(lowest_m, low_m);
    highest_low_m = std::max(highest_low_m, low_m);
  }
  // 0.2 m + offset; columns 2 cm apart miss the very lowest point by up to (1.4 cm)^2 / (2 * 1.1 cm).
  EXPECT_GT(lowest_m, 0.299F - 0.001F);
  EXPECT_LT(lowest_m, 0.310F);
  EXPECT_GT(highest_low_m, lowest_m + 0.15F) << "it lifts off";
  const Vec3f down = hand.velocity_m_s({0, 0.5F, 0}, 1.0);
  EXPECT_LT(down.y, -0.1F);
  EXPECT_GT(down.y, -0.4F);
}

/// docs/scene.md says so of boxes and of `scale`. Boxes of 24 moments hold the figure.
TEST_P(EveryFigure, StaysInTheBoxThatItsScaleNames) {
  const Figure whole = make_figure(GetParam(), {.moving = true});
  const Box3f box = whole.bounds_m(), way = figure_displacement_m(GetParam());
  for (const float s : {0.1F, 0.25F, 0.5F, 0.8F}) {
    const Figure figure = make_figure(GetParam(), {.moving = true, .scale = s});
    const Vec3f low = s * box.min + (1 - s) * way.min, high = s * box.max + (1 - s) * way.max;
    for (int i = 0; i < 24; ++i) {
      const Box3f now = figure.at(figure.period_s() * i / 24).bounds_m();
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_GE(now.min[axis], low[axis] - 1e-4F) << s << " " << axis;
        EXPECT_LE(now.max[axis], high[axis] + 1e-4F) << s << " " << axis;
      }
    }
  }
  // Still figures scale about (0, 0.5, 0); bounds are sums of coordinates and radii, all of them scaled.
  const Box3f still = make_figure(GetParam()).bounds_m(),
              quarter = make_figure(GetParam(), {.scale = 0.25F}).bounds_m();
  const Vec3f middle{0, 0.5F, 0};
  EXPECT_LT(length(quarter.min - (middle + 0.25F * (still.min - middle))), 1e-5F);
  EXPECT_LT(length(quarter.max - (middle + 0.25F * (still.max - middle))), 1e-5F);
}

TEST(Figures, RefuseBadRequests) {
  const auto message = [](const std::string& name, const FigureOptions& options) -> std::string {
    return message_of([&] { make_figure(name, options); }, ErrorKind::usage);
  };
  EXPECT_EQ(message("rabit", {}), "unknown figure 'rabit'; did you mean 'rabbit'?");
  EXPECT_NE(message("teapot", {}).find("known: hand, rabbit"), std::string::npos);
  EXPECT_NE(message("hand", {.scale = 0}).find("scale 0"), std::string::npos);
  EXPECT_NE(message("hand", {.scale = NAN}).find("scale"), std::string::npos);
  EXPECT_NE(message("hand", {.offset_m = {0, INFINITY, 0}}).find("offset"), std::string::npos);
}

}  // namespace
}  // namespace tactus
