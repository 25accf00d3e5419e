// Silhouettes of a camera whose exposure changes, beside OpenCV's mixtures.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/background_segm.hpp>
#include <random>

#include "support/masks.h"
#include "support/synthetic_frame.h"
#include "tactus/geom/image/mask_metrics.h"
#include "tactus/rig/background/background_model.h"

namespace tactus {
namespace {

constexpr int kWidth = 640, kHeight = 480;

/// A room with a bright window and a dark cupboard, in grey levels of an exposure of 1 without noise.
cv::Mat sunny_room() {
  cv::Mat photo(kHeight, kWidth, CV_8UC3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x)
      photo.at<cv::Vec3b>(y, x) = {cv::saturate_cast<std::uint8_t>(90 + 40 * std::sin(0.02 * x)),
                                   cv::saturate_cast<std::uint8_t>(110 + 30 * std::cos(0.03 * y)),
                                   cv::saturate_cast<std::uint8_t>(120 + 20 * std::sin(0.01 * (x + y)))};
  }
  cv::rectangle(photo, {40, 40, 110, 150}, cv::Scalar(236, 232, 228), cv::FILLED);
  cv::rectangle(photo, {500, 250, 100, 200}, cv::Scalar(24, 28, 32), cv::FILLED);
  return photo;
}

/// What a camera of that gain and offset makes of it, with noise of 2 grey levels.
cv::Mat exposed(const cv::Mat& scene, double gain, double offset, unsigned seed) {
  cv::Mat photo = scene.clone();
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 2);
  for (int i = 0; i < kWidth * kHeight * 3; ++i)
    photo.data[i] = cv::saturate_cast<std::uint8_t>(gain * scene.data[i] + offset + noise(random));
  return photo;
}

/// A figure with a red body; its head (the upper third) has the room's colours at 0.45 of their brightness,
/// which an exposure of 1.4 shows as 0.63: a shadow.
cv::Mat with_dark_head(const cv::Mat& scene, const BitMask& figure) {
  Index top = figure.height_px, bottom = 0;
  for (Index y = 0; y < figure.height_px; ++y) {
    for (Index x = 0; x < figure.width_px; ++x) {
      if (!figure(x, y)) continue;
      top = std::min(top, y);
      bottom = std::max(bottom, y);
    }
  }
  cv::Mat photo = scene.clone();
  for (Index y = 0; y < figure.height_px; ++y) {
    for (Index x = 0; x < figure.width_px; ++x) {
      if (!figure(x, y)) continue;
      auto& p = photo.at<cv::Vec3b>(y, x);
      if (3 * (y - top) < bottom - top)
        p = {static_cast<std::uint8_t>(0.45 * p[0]), static_cast<std::uint8_t>(0.45 * p[1]),
             static_cast<std::uint8_t>(0.45 * p[2])};
      else
        p = {50, 60, 170};
    }
  }
  return photo;
}

/// OpenCV's mixtures as people use them: they learn all the time; then an opening and the largest part.
class Mixtures {
 public:
  void learn(const cv::Mat& photo) { subtractor_->apply(photo, mask_); }
  BitMask classify(const cv::Mat& photo) {
    subtractor_->apply(photo, mask_);
    cv::Mat bits = mask_ > 200, labels, stats, centers;
    cv::morphologyEx(bits, bits, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_RECT, {3, 3}));
    const int n = cv::connectedComponentsWithStats(bits, labels, stats, centers, 8);
    int best = 1;
    for (int i = 2; i < n; ++i)
      best = stats.at<int>(i, cv::CC_STAT_AREA) > stats.at<int>(best, cv::CC_STAT_AREA) ? i : best;
    return test::make_mask(photo.cols, photo.rows,
                           [&](Index x, Index y) { return labels.at<int>(y, x) == best; });
  }

 private:
  cv::Ptr<cv::BackgroundSubtractorMOG2> subtractor_ = cv::createBackgroundSubtractorMOG2(500, 16, true);
  cv::Mat mask_;
};

BitMask moved(const BitMask& figure, int shift_px) {
  return test::make_mask(figure.width_px, figure.height_px, [&](Index x, Index y) {
    return x >= shift_px && x - shift_px < figure.width_px && figure(x - shift_px, y);
  });
}

/// A camera whose exposure drifts from 0.7 to 1.4 within 60 s, and whose black level wanders by 6 grey levels
/// about that of the empty room; the figure walks to and fro.
TEST(Background, CamerasWithSun) {
  const cv::Mat scene = sunny_room();
  BackgroundModel model(kWidth, kHeight);
  Mixtures mixtures;
  for (unsigned k = 0; k < 15; ++k) {
    const cv::Mat photo = exposed(scene, 1, 0, k);
    model.learn(photo.data);
    mixtures.learn(photo);
  }
  const BitMask figure = test::silhouettes_of("hand-still").frame.silhouettes[0];
  double worst = 1, sum = 0, of_mixtures = 0;
  BitMask mask;
  constexpr int kFrames = 60;
  for (int k = 0; k < kFrames; ++k) {
    const double t = k / (kFrames - 1.0), gain = 0.7 * std::pow(2, t), offset = 6 * std::sin(9 * t);
    const BitMask truth = moved(figure, static_cast<int>(std::lround(120 * std::sin(12 * t))));
    const cv::Mat photo = exposed(with_dark_head(scene, truth), gain, offset, static_cast<unsigned>(100 + k));
    model.classify(photo.data, {}, mask, 1);
    const double value = iou(mask, truth);
    worst = std::min(worst, value);
    sum += value / kFrames;
    of_mixtures += iou(mixtures.classify(photo), truth) / kFrames;
    EXPECT_GE(value, 0.93) << "gain " << gain << ", offset " << offset;
  }
  std::printf("gain 0.7 to 1.4 over 60 s: IoU %.4f in the mean, %.4f at worst; by MOG2 %.4f\n", sum, worst,
              of_mixtures);
  EXPECT_GE(sum, of_mixtures);
  // And at once: the sun comes out between two photos.
  for (const double gain : {1.4, 0.7, 1.0}) {
    const cv::Mat photo = exposed(with_dark_head(scene, figure), gain, 3, 7);
    model.classify(photo.data, {}, mask, 1);
    EXPECT_GE(iou(mask, figure), 0.93) << gain;
  }
}

}  // namespace
}  // namespace tactus
