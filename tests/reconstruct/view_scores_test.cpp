#include "tactus/reconstruct/texture/view_scores.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/data_folder.h"
#include "support/device_sets.h"
#include "support/masks.h"
#include "support/synthetic_frame.h"
#include "tactus/base/error.h"
#include "tactus/rig/sources/data_sources.h"

namespace tactus {
namespace {

using test::punch;
using test::silhouettes_of;

class Scores : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(Scores);

TEST_P(Scores, AreTheSameOnEveryDevice) {
  test::SyntheticFrame seen = silhouettes_of("rabbit-still");
  const Rig& rig = seen.rig;
  FrameSet& frame = seen.frame;
  punch(frame.silhouettes[2], 60);
  const auto measure = [&](const std::string& devices) {
    DeviceSet set(devices, 3);
    ViewScores scores(set.context(0), rig.cameras, {.workspace_m = rig.workspace_m});
    scores.measure(set.context(0), frame.silhouettes);
    return scores.measure(set.context(0), frame.silhouettes);
  };
  const std::vector<ViewScore> expected = measure("cpu"), got = measure(GetParam());
  for (std::size_t c = 0; c < expected.size(); ++c) EXPECT_EQ(got[c].carved_alone, expected[c].carved_alone);
  EXPECT_TRUE(got[2].is_suspect);
}

TEST(Scores, GoodMasksSuspectNobodyAndTunnelsAreMeasured) {
  DeviceSet set("cpu");
  test::SyntheticFrame seen = silhouettes_of("sphere-still");
  const Rig& rig = seen.rig;
  FrameSet& frame = seen.frame;
  ViewScores scores(set.context(0), rig.cameras, {.workspace_m = rig.workspace_m, .samples = 96});
  for (const ViewScore& s : scores.measure(set.context(0), frame.silhouettes)) EXPECT_FALSE(s.is_suspect);
  punch(frame.silhouettes[5], 80);
  const std::vector<ViewScore> found = scores.measure(set.context(0), frame.silhouettes);
  EXPECT_EQ(suspect_views_text(rig.cameras, found).find("camera 'cam5' carves "), 0U);
  for (std::size_t c = 0; c < found.size(); ++c) EXPECT_EQ(found[c].is_suspect, c == 5) << c;
  // A cone about the axis of a ball of radius R at distance L = hypot(1.6, 0.7) m, tan a = 40 px / 600 px: a
  // tunnel of radius r = L tan a, of 1 - (1 - r²/R²)^1.5 of the ball's volume. The hull is up to 7 % larger
  // than the ball and has lost the tunnel. A sample (10 mm) at each end of 0.45 m is not counted, 4 %; the
  // cone and the half pixel at the disc's rim add 3 %: within 10 % in all.
  const double r = std::hypot(1.6, 0.7) * 40 / 600, tunnel = 1 - std::pow(1 - r * r / (0.25 * 0.25), 1.5);
  const double expected = 0.98 * tunnel / (1.035 - tunnel);
  EXPECT_NEAR(found[5].carved_alone, expected, 0.1 * expected);
}

TEST(Scores, AHoleInOneMaskOfTheDinoIsNamed) {
  if (data_folder().empty()) GTEST_SKIP() << without_data("middlebury_dino");
  const auto source = open_middlebury(data_folder() + "/middlebury_dino");
  FrameSet frame;
  source->next(frame);
  const Rig& rig = source->rig();
  ASSERT_EQ(rig.cameras.size(), 15U);
  DeviceSet set("cpu");
  ViewScores scores(set.context(0), rig.cameras, {.workspace_m = rig.workspace_m});
  EXPECT_EQ(suspect_views_text(rig.cameras, scores.measure(set.context(0), frame.silhouettes)), "");
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    std::vector<BitMask> masks = frame.silhouettes;
    punch(masks[c], 80);
    const std::vector<ViewScore> found = scores.measure(set.context(0), masks);
    for (std::size_t k = 0; k < found.size(); ++k)
      EXPECT_EQ(found[k].is_suspect, k == c) << "hole in " << rig.cameras[c].name << ": view "
                                             << rig.cameras[k].name << " scores " << found[k].carved_alone;
  }
}

TEST(Scores, AMissingViewCarvesNothingAndBadInputIsRefused) {
  DeviceSet set("cpu");
  test::SyntheticFrame seen = silhouettes_of("hand-still");
  const Rig& rig = seen.rig;
  FrameSet& frame = seen.frame;
  ViewScores scores(set.context(0), rig.cameras, {.workspace_m = rig.workspace_m});
  frame.silhouettes[1] = {};
  EXPECT_EQ(scores.measure(set.context(0), frame.silhouettes)[1].carved_alone, 0);
  frame.silhouettes[4] = BitMask(10, 10);
  EXPECT_THROW(scores.measure(set.context(0), frame.silhouettes), Error);
  frame.silhouettes.pop_back();
  EXPECT_THROW(scores.measure(set.context(0), frame.silhouettes), Error);
  EXPECT_THROW(ViewScores(set.context(0), {}, {.workspace_m = rig.workspace_m}), Error);
  EXPECT_THROW(ViewScores(set.context(0), rig.cameras, {}), Error);
}

}  // namespace
}  // namespace tactus
