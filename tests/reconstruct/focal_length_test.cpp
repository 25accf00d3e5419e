// Focal lengths that are 5 % wrong of one camera, on rigs drawn at random and on photographs: they are named,
// and right rigs are not accused.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <optional>
#include <random>
#include <string>

#include "support/data_folder.h"
#include "tactus/reconstruct/doctor/frontier_points.h"
#include "tactus/rig/sources/data_sources.h"
#include "tactus/rig/synthetic/synthetic_noise.h"
#include "tactus/rig/synthetic/synthetic_source.h"

namespace tactus {
namespace {

struct Seen {
  std::vector<Camera> cameras;
  std::vector<BitMask> masks;
  std::optional<FocalFit> as_it_is{};  ///< the fit of a right rig
  std::optional<FocalFit> fit(const std::vector<Camera>& believed) const {
    std::vector<SeenView> views;
    for (std::size_t c = 0; c < believed.size(); ++c) views.push_back({believed[c], &masks[c]});
    return better_focal_lengths(views);
  }
};

struct Count {
  int rigs = 0, accused = 0, accused_of_all = 0, wrong = 0, named = 0, other = 0, misjudged = 0;
  double share() const { return static_cast<double>(named) / std::max(wrong, 1); }
  /// The rig as it is, then each of its cameras with its focal length so many times as long.
  void add(const Seen& seen, double factor) {
    ++rigs;
    if (const std::optional<FocalFit>& fit = seen.as_it_is) {
      (fit->view < 0 ? accused_of_all : accused) += 1;
      if (std::getenv("TACTUS_VERBOSE") != nullptr)
        std::printf("  accused: %s\n", fit->text(seen.cameras).c_str());
    }
    for (std::size_t c = 0; c < seen.cameras.size(); ++c) {
      std::vector<Camera> off = seen.cameras;
      off[c].fx_px *= factor;
      off[c].fy_px *= factor;
      ++wrong;
      const std::optional<FocalFit> fit = seen.fit(off);
      if (!fit) continue;
      (fit->view == static_cast<int>(c) ? named : other) += 1;
      // What is left is not told. A flat tool alone, seen from its side, says little of sizes.
      misjudged += fit->view == static_cast<int>(c) && std::abs(fit->factor * factor - 1) > 0.042 ? 1 : 0;
    }
  }
  void print(const char* what, std::size_t cameras) const {
    std::printf("%s, %zu cameras, %d right rigs: one camera accused in %d, all in %d; ", what, cameras, rigs,
                accused, accused_of_all);
    std::printf("%d wrong ones: %d named, %d as another\n", wrong, named, other);
  }
};

Seen random_rig(std::mt19937& random, int number, int cameras, double noise_px) {
  const auto between = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  };
  const char* figures[] = {"hand", "rabbit", "liver", "bowl", "scalpel", "sphere"};
  SyntheticOptions options;
  options.figure = std::string(figures[number % 6]) + "-moving";
  options.depth = options.truth = false;
  options.first_frame = static_cast<int>(random() % 120);
  options.rig.camera_count = cameras;
  options.rig.ring_radius_m = between(1.4, 2.2);
  options.rig.low_m = between(0.1, 0.6);
  options.rig.high_m = between(0.8, 1.6);
  options.rig.focal_px = between(450, 600);
  SyntheticSource source(options);
  FrameSet frame;
  source.next(frame);
  Seen seen{source.rig().cameras, frame.silhouettes, {}};
  const NoiseOptions noise{
      .calibration_px = noise_px, .segmentation_px = noise_px, .seed = 100U + static_cast<unsigned>(number)};
  for (std::size_t c = 0; c < seen.cameras.size() && noise_px > 0; ++c) {
    seen.cameras[c] = miscalibrate(seen.cameras[c], noise, static_cast<int>(c));
    disturb_mask(seen.masks[c], noise, static_cast<int>(c), 0);
  }
  seen.as_it_is = seen.fit(seen.cameras);
  return seen;
}

/// Of 36 rigs each (TACTUS_LONG_TESTS), neither a camera of a right one is accused nor all of them,
/// and at least 0.46, 0.86 and 0.92 of the wrong ones are named, of 4, 6 and 8 cameras; all others but 1 %
/// are passed over in silence. The bounds are three standard errors, sqrt(p (1 - p) / n), below for the 24,
/// 36 and 48 wrong ones of six rigs.
TEST(FocalLength, OfOneCameraIsNamed) {
  const int rigs = std::getenv("TACTUS_LONG_TESTS") != nullptr ? 36 : 6;
  for (const auto& [cameras, least] : {std::pair{4, 0.15}, {6, 0.68}, {8, 0.80}}) {
    for (const double noise_px : {0.0, 0.3}) {
      std::mt19937 random(7);
      std::vector<Seen> seen;
      for (int i = 0; i < rigs; ++i) seen.push_back(random_rig(random, i, cameras, noise_px));
      for (const double factor : {1.05, 0.95}) {
        Count count;
        for (const Seen& rig : seen) count.add(rig, factor);
        count.print(noise_px > 0 ? "0.3 px" : "exact", static_cast<std::size_t>(cameras));
        EXPECT_EQ(count.accused, 0);
        EXPECT_EQ(count.accused_of_all, 0);
        EXPECT_LE(count.misjudged, count.named / 30);
        EXPECT_GE(count.share(), least);
        EXPECT_LE(count.other, 1 + count.wrong / 50);
      }
    }
  }
}

/// Photographs of Middlebury's dino, of some of its cameras: none of them is accused. All of them together
/// fit best with focal lengths that are 4 % longer, which some of its rigs of six and eight pass.
TEST(FocalLength, OfOneCameraIsNamedOnPhotographs) {
  if (data_folder().empty()) GTEST_SKIP() << "no data: set TACTUS_DATA";
  const auto source = open_middlebury(data_folder() + "/middlebury_dino");
  FrameSet frame;
  ASSERT_EQ(source->next(frame), NextFrame::success);
  std::mt19937 random(3);
  for (const std::size_t cameras : {4U, 6U, 8U, 15U}) {
    Count count;
    for (int k = 0; k < (cameras > 8 ? 1 : 12); ++k) {
      std::vector<std::size_t> order(source->rig().cameras.size());
      std::iota(order.begin(), order.end(), 0U);
      std::shuffle(order.begin(), order.end(), random);
      Seen seen;
      for (std::size_t c = 0; c < std::min(cameras, order.size()); ++c) {
        seen.cameras.push_back(source->rig().cameras[order[c]]);
        seen.masks.push_back(frame.silhouettes[order[c]]);
      }
      seen.as_it_is = seen.fit(seen.cameras);
      count.add(seen, 1.05);
    }
    count.print("dino", cameras);
    EXPECT_EQ(count.accused, 0);
    if (cameras > 8) {
      EXPECT_EQ(count.accused_of_all, 0);
    }
    EXPECT_GE(count.share(), 0.8);
  }
}

}  // namespace
}  // namespace tactus
