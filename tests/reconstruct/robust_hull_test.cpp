// Masks that are wrong in one view: their repair, and the hull that tolerates them.
#include <gtest/gtest.h>

#include <cmath>

#include "support/data_folder.h"
#include "support/device_sets.h"
#include "support/masks.h"
#include "support/message_of.h"
#include "support/synthetic_frame.h"
#include "tactus/base/error.h"
#include "tactus/reconstruct/doctor/mask_repair.h"
#include "tactus/reconstruct/visual_hull.h"
#include "tactus/rig/sources/data_sources.h"
#include "tactus/rig/synthetic/synthetic_noise.h"

namespace tactus {
namespace {

using test::message_of;

struct View {
  Rig rig;
  std::vector<BitMask> masks;
};

View view_of(const std::string& figure) {
  const test::SyntheticFrame seen = test::silhouettes_of(figure);
  return {seen.rig, seen.frame.silhouettes};
}

using test::punch;

class Bench {
 public:
  explicit Bench(const View& view, const std::string& devices = "cpu", Index tolerated = 0, Index n = 100)
      : rig_(view.rig),
        set_(devices, 5),
        hull_(set_, rig_.cameras,
              {.workspace_m = rig_.workspace_m,
               .resolution = n,
               .slack_px = rig_.slack_px,
               .tolerated_views = tolerated,
               .max_vertices = 300000}),
        scores_(set_.context(0), rig_.cameras, {.workspace_m = rig_.workspace_m}) {}
  TriangleMesh mesh(const std::vector<BitMask>& masks) {
    hull_.upload(masks);
    hull_.reconstruct();
    EXPECT_FALSE(hull_.report().overflow.has_value());
    return hull_.download();
  }
  double volume(const std::vector<BitMask>& masks) { return volume_m3(mesh(masks)); }
  std::vector<RepairedMask> repair(std::vector<BitMask>& masks) {
    found_ = scores_.measure(set_.context(0), masks);
    return repair_masks(set_.context(0), scores_, found_, masks);
  }
  const std::vector<ViewScore>& found() const { return found_; }

 private:
  Rig rig_;
  DeviceSet set_;
  VisualHull hull_;
  ViewScores scores_;
  std::vector<ViewScore> found_;
};

/// The goal: within 2 % of the hull of the unharmed masks.
constexpr double kGoal = 0.02;

TEST(MaskRepair, AHoleInAnyOneMaskOfTheDino) {
  if (data_folder().empty()) GTEST_SKIP() << without_data("middlebury_dino");
  const auto source = open_middlebury(data_folder() + "/middlebury_dino");
  FrameSet frame;
  ASSERT_EQ(source->next(frame), NextFrame::success);
  Bench bench({source->rig(), frame.silhouettes}, "cpu", 0, 128);
  const double whole = bench.volume(frame.silhouettes);
  double least_plain = -1, worst_plain = 0, worst_repaired = 0;
  for (std::size_t c = 0; c < frame.silhouettes.size(); ++c) {
    std::vector<BitMask> masks = frame.silhouettes;
    punch(masks[c], 80);
    const double plain = bench.volume(masks) / whole - 1;
    least_plain = std::max(least_plain, plain);
    worst_plain = std::min(worst_plain, plain);
    const std::vector<RepairedMask> repairs = bench.repair(masks);
    ASSERT_EQ(repairs.size(), 1U) << c;
    EXPECT_EQ(repairs[0].camera, c);
    const std::string text = repairs_text(source->rig().cameras, repairs);
    EXPECT_NE(text.find("px of the mask of camera '" + source->rig().cameras[c].name + "' were filled"),
              std::string::npos)
        << text;
    worst_repaired = std::max(worst_repaired, std::abs(bench.volume(masks) / whole - 1));
    for (std::size_t k = 0; k < masks.size(); ++k) {
      EXPECT_TRUE(k == c || masks[k] == frame.silhouettes[k]) << k;
    }
  }
  RecordProperty("plain", std::to_string(least_plain) + " " + std::to_string(worst_plain));
  RecordProperty("worst_repaired", std::to_string(worst_repaired));
  EXPECT_LT(worst_plain, -0.09);
  EXPECT_LE(worst_repaired, kGoal);
}

class MaskRepairOn : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(MaskRepairOn);

/// Holes within the contour and, of the hand, across its fingers.
TEST_P(MaskRepairOn, AHoleInOneMaskOfAFigure) {
  double least_plain = -1, most_plain = 0, worst = 0;
  for (const char* figure : {"rabbit-still", "hand-still", "bowl-still"}) {
    const View view = view_of(figure);
    Bench bench(view, GetParam());
    const double whole = bench.volume(view.masks);
    for (std::size_t c = 0; c < view.masks.size(); ++c) {
      for (const double dy : {0.0, -60.0}) {
        std::vector<BitMask> masks = view.masks;
        punch(masks[c], 80, 0, dy);
        const double plain = bench.volume(masks) / whole - 1;
        EXPECT_LT(plain, -0.05) << figure << " " << c;
        least_plain = std::max(least_plain, plain);
        most_plain = std::min(most_plain, plain);
        bench.repair(masks);
        const double repaired = bench.volume(masks) / whole;
        EXPECT_NEAR(repaired, 1, kGoal) << figure << " " << c << " " << dy;
        worst = std::max(worst, std::abs(repaired - 1));
      }
    }
  }
  RecordProperty("plain", std::to_string(least_plain) + " " + std::to_string(most_plain));
  RecordProperty("worst_repaired", std::to_string(worst));
}

TEST_P(MaskRepairOn, GivesTheSameMasksAsOneCpu) {
  const View view = view_of("hand-still");
  const auto repaired = [&](const std::string& devices) {
    std::vector<BitMask> masks = view.masks;
    punch(masks[3], 80);
    Bench(view, devices).repair(masks);
    return masks;
  };
  EXPECT_EQ(repaired(GetParam()), repaired("cpu"));
}

TEST(MaskRepair, GoodMasksStayAsTheyAre) {
  for (const char* figure :
       {"sphere-still", "rabbit-still", "hand-still", "bowl-still", "liver-still", "scalpel-still"}) {
    const View view = view_of(figure);
    std::vector<BitMask> masks = view.masks;
    EXPECT_TRUE(Bench(view).repair(masks).empty()) << figure;
    EXPECT_EQ(masks, view.masks) << figure;
  }
}

/// What 1 px of segmentation and 0.3 px of calibration do is no hole.
TEST(MaskRepair, NoisyMasksStayAsTheyAre) {
  for (const char* figure : {"sphere-still", "rabbit-still", "hand-still", "bowl-still"}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      View view = view_of(figure);
      const NoiseOptions noise{.calibration_px = 0.3, .segmentation_px = 1, .seed = seed};
      for (int c = 0; c < 8; ++c) {
        Camera& camera = view.rig.cameras[static_cast<std::size_t>(c)];
        camera = miscalibrate(camera, noise, c);
        disturb_mask(view.masks[static_cast<std::size_t>(c)], noise, c, 0);
      }
      std::vector<BitMask> masks = view.masks;
      EXPECT_TRUE(Bench(view).repair(masks).empty()) << figure << " " << seed;
      EXPECT_EQ(masks, view.masks) << figure << " " << seed;
    }
  }
}

/// A hole that breaks through the contour is filled as far as the others keep something.
TEST(MaskRepair, ABiteOutOfTheContour) {
  const View view = view_of("rabbit-still");
  Bench bench(view);
  const double whole = bench.volume(view.masks);
  std::vector<BitMask> masks = view.masks;
  punch(masks[4], 90, 70, 0);
  EXPECT_LT(bench.volume(masks), 0.95 * whole);
  const std::vector<RepairedMask> repairs = bench.repair(masks);
  ASSERT_EQ(repairs.size(), 1U);
  EXPECT_NEAR(bench.volume(masks) / whole, 1, kGoal);
}

TEST(MaskRepair, HolesInTwoMasks) {
  const View view = view_of("rabbit-still");
  Bench bench(view);
  const double whole = bench.volume(view.masks);
  std::vector<BitMask> masks = view.masks;
  punch(masks[2], 80);
  punch(masks[5], 60, -20, 10);
  const std::vector<RepairedMask> repairs = bench.repair(masks);
  EXPECT_EQ(repairs.size(), 2U);
  // Where both holes look, neither mask is carved alone, and the other's repair is judged by a harmed one.
  EXPECT_NEAR(bench.volume(masks) / whole, 1, kGoal);
}

/// A camera whose segmentation failed altogether, and one that missed the tick.
TEST(MaskRepair, ABlackMaskBecomesWhatTheOthersKeep) {
  const View view = view_of("rabbit-still");
  Bench bench(view);
  std::vector<BitMask> masks = view.masks, without = view.masks;
  masks[0] = BitMask(masks[0].width_px, masks[0].height_px);
  masks[7] = {};
  without[0] = without[7] = {};
  EXPECT_EQ(bench.volume(masks), 0);
  const std::vector<RepairedMask> repairs = bench.repair(masks);
  ASSERT_EQ(repairs.size(), 1U);
  EXPECT_EQ(repairs[0].camera, 0U);
  EXPECT_TRUE(masks[7].words.empty());
  // Pixel centres decide what is filled: up to half a pixel (1.5 mm) is lost along a silhouette of 0.45 m:
  // its area times 2 * 1.5 mm / 0.2 m (mean half width), and a tip thinner than three samples (60 mm).
  EXPECT_NEAR(bench.volume(masks) / bench.volume(without), 1, kGoal);
}

/// Independent program: every voxel centre counts the cameras that see background there.
TEST(TolerantHull, HasTheVolumeOfThePlainLoop) {
  const View view = view_of("hand-still");
  constexpr int n = 128;
  std::vector<std::int64_t> carved_by(9);
  for (int k = 0; k < n * n * n; ++k) {
    const Vec3d p{(k % n + 0.5) / n - 0.5, (k / n % n + 0.5) / n, (k / n / n + 0.5) / n - 0.5};
    std::size_t carvers = 0;
    for (std::size_t c = 0; c < 8; ++c) {
      const Pixel px = project(view.rig.cameras[c], p);
      const auto u = static_cast<Index>(std::lround(px.u_px)), v = static_cast<Index>(std::lround(px.v_px));
      const bool seen = u >= 0 && v >= 0 && u < 640 && v < 480;
      carvers += seen && !view.masks[c](u, v) ? 1 : 0;
    }
    ++carved_by[carvers];
  }
  double most = 0;
  for (Index m = 0; m < 8; ++m) {
    most += static_cast<double>(carved_by[static_cast<std::size_t>(m)]) / (n * n * n);
    const TriangleMesh mesh = Bench(view, "cpu", m).mesh(view.masks);
    EXPECT_TRUE(topology(mesh).closed_manifold()) << m;
    // Two pixel rules, half a pixel (1.3 mm) apart in places, and chords of 10 mm on fingers of 20 mm.
    EXPECT_NEAR(volume_m3(mesh) / most, 1, 0.02) << m;
  }
}

TEST_P(MaskRepairOn, TolerantHullHasTheSameBitsAsOneCpu) {
  View view = view_of("rabbit-still");
  punch(view.masks[1], 80);
  for (const Index m : {1, 3}) {
    const TriangleMesh expected = Bench(view, "cpu", m, 67).mesh(view.masks),
                       got = Bench(view, GetParam(), m, 67).mesh(view.masks);
    ASSERT_GT(expected.triangles.size(), 1000U);
    EXPECT_EQ(got.positions_m, expected.positions_m);
    EXPECT_EQ(got.triangles, expected.triangles);
  }
}

/// What tolerance costs real masks.
TEST(TolerantHull, OfTheDinoGrows) {
  if (data_folder().empty()) GTEST_SKIP() << without_data("middlebury_dino");
  const auto source = open_middlebury(data_folder() + "/middlebury_dino");
  FrameSet frame;
  ASSERT_EQ(source->next(frame), NextFrame::success);
  const View view{source->rig(), frame.silhouettes};
  const double whole = Bench(view, "cpu", 0, 128).volume(view.masks);
  double before = whole;
  for (const Index m : {1, 2}) {
    const double volume = Bench(view, "cpu", m, 128).volume(view.masks);
    RecordProperty("growth_" + std::to_string(m), std::to_string(volume / whole - 1));
    EXPECT_GT(volume, before);
    EXPECT_LT(volume, 1.5 * whole);
    before = volume;
  }
}

/// The price beside the repair: no tunnel, but the whole hull grows.
TEST(TolerantHull, OneBadMaskCarvesNoTunnelAndTheHullGrows) {
  const View view = view_of("sphere-still");
  std::vector<BitMask> harmed = view.masks;
  punch(harmed[3], 80);
  const double whole = Bench(view).volume(view.masks), tolerant = Bench(view, "cpu", 1).volume(harmed);
  EXPECT_LT(Bench(view).volume(harmed), 0.75 * whole);
  EXPECT_GT(tolerant, whole);
  EXPECT_LT(tolerant, 1.15 * whole);
  for (const Index m : {1, 2})
    RecordProperty("growth_" + std::to_string(m),
                   std::to_string(Bench(view, "cpu", m).volume(view.masks) / whole - 1));
}

TEST(TolerantHull, BadNumbersAreNamed) {
  const View view = view_of("sphere-still");
  DeviceSet set("cpu");
  const auto message = [&](Index tolerated, std::size_t cameras) -> std::string {
    return message_of(
        [&] {
          VisualHull(set, std::span(view.rig.cameras).first(cameras),
                     {.workspace_m = view.rig.workspace_m, .tolerated_views = tolerated});
        },
        ErrorKind::usage);
  };
  EXPECT_EQ(message(-1, 8), "tolerated views -1: expected 0 to 7 with 8 cameras");
  EXPECT_EQ(message(2, 2), "tolerated views 2: expected 0 to 1 with 2 cameras");
  EXPECT_EQ(message(1, 2), "");
}

}  // namespace
}  // namespace tactus
