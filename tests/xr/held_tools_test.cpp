#include "tactus/xr/held_tools.h"

#include <gtest/gtest.h>

namespace tactus {
namespace {

using Tools = std::map<std::string, Rigidd>;

Rigidd at(Vec3d t_m) { return {Mat3d::identity(), t_m}; }
HandPose hand(Vec3d t_m, bool takes) { return {true, takes, at(t_m)}; }

/// A quarter turn about y.
Rigidd turned(Vec3d t_m) { return {Mat3d{{{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}}}, t_m}; }

TEST(HeldTools, TriggerTakesTheToolWithinReachAsItLies) {
  HeldTools held;
  const Tools tools{{"ball", at({0.1, 0, 0})}, {"hook", at({1, 0, 0})}};
  EXPECT_FALSE(held.follow(1, hand({0, 0, 0}, false), tools));
  const auto taken = held.follow(1, hand({0, 0, 0}, true), tools);
  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->tool, "ball");
  EXPECT_EQ(taken->T_world_tool.t, (Vec3d{0.1, 0, 0}));
  // It turns with the hand: x of the hand is now -z of the world.
  HandPose pose{true, true, turned({0, 0.5, 0})};
  const auto moved = held.follow(1, pose, tools);
  ASSERT_TRUE(moved);
  EXPECT_NEAR(length(moved->T_world_tool.t - Vec3d{0, 0.5, -0.1}), 0, 1e-12);
  pose.takes = false;
  EXPECT_FALSE(held.follow(1, pose, tools));
  EXPECT_EQ(held.held(1), "");
}

TEST(HeldTools, OnlyToolComesFromFar) {
  HeldTools held;
  const auto taken = held.follow(0, hand({2, 1, 0}, true), {{"ball", at({0, 0, 0})}});
  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->T_world_tool.t, (Vec3d{2, 1, 0}));
  HeldTools other;
  EXPECT_FALSE(other.follow(0, hand({2, 1, 0}, true), {{"ball", at({0, 0, 0})}, {"hook", at({1, 0, 0})}}));
}

TEST(HeldTools, AToolIsInOneHand) {
  HeldTools held;
  const Tools tools{{"ball", at({0, 0, 0})}};
  EXPECT_TRUE(held.follow(0, hand({0, 0, 0}, true), tools));
  EXPECT_FALSE(held.follow(1, hand({0, 0, 0}, true), tools));
}

TEST(HeldTools, AHandThatIsNotTrackedHoldsOn) {
  HeldTools held;
  const Tools tools{{"ball", at({0, 0, 0})}};
  EXPECT_TRUE(held.follow(0, hand({0, 0, 0}, true), tools));
  EXPECT_FALSE(held.follow(0, HandPose{}, tools));
  EXPECT_EQ(held.held(0), "ball");
  const auto moved = held.follow(0, hand({0.3, 0, 0}, true), tools);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->T_world_tool.t, (Vec3d{0.3, 0, 0}));
}

TEST(PoseWatch, SaysSoWithin100Ms) {
  for (const double period_s : {1. / 120, 1. / 90, 1. / 30, 0.1}) {
    PoseWatch watch;
    EXPECT_EQ(watch.look(false, 0), PoseWatch::News::none);  // never seen: nobody holds it
    double at_s = 1;
    EXPECT_EQ(watch.look(true, at_s), PoseWatch::News::none);
    const double seen_at_s = at_s;
    PoseWatch::News news = PoseWatch::News::none;
    while (news == PoseWatch::News::none && at_s < 2) news = watch.look(false, at_s += period_s);
    EXPECT_EQ(news, PoseWatch::News::lost);
    EXPECT_LE(at_s - seen_at_s, 0.1 + 1e-9) << period_s;
    EXPECT_EQ(watch.look(false, at_s += period_s), PoseWatch::News::none);  // once
    EXPECT_EQ(watch.look(true, at_s += period_s), PoseWatch::News::back);
  }
}

}  // namespace
}  // namespace tactus
