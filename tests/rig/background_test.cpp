// Silhouettes before a known room: exact truth composed over a synthetic room and over real frames.
#include "tactus/rig/background/background_model.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <random>

#include "support/allocations.h"
#include "support/data_folder.h"
#include "support/masks.h"
#include "support/message_of.h"
#include "support/synthetic_frame.h"
#include "tactus/geom/image/mask_metrics.h"
#include "tactus/rig/images/undistortion.h"

namespace tactus {
namespace {

constexpr int kWidth = 640, kHeight = 480;

/// A room of soft colours with the noise of a camera.
cv::Mat room(unsigned seed, double light = 1, double sigma = 2) {
  cv::Mat photo(kHeight, kWidth, CV_8UC3);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, sigma);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double b = 90 + 40 * std::sin(0.02 * x), g = 110 + 30 * std::cos(0.03 * y),
                   r = 120 + 20 * std::sin(0.01 * (x + y));
      photo.at<cv::Vec3b>(y, x) = {cv::saturate_cast<std::uint8_t>(light * b + noise(random)),
                                   cv::saturate_cast<std::uint8_t>(light * g + noise(random)),
                                   cv::saturate_cast<std::uint8_t>(light * r + noise(random))};
    }
  }
  return photo;
}

/// Puts the figure into the photo, and a soft shadow of 0.7 beside and below it.
void compose(cv::Mat& photo, const BitMask& figure, cv::Vec3b color, BitMask* shadow = nullptr) {
  cv::Mat shade(photo.size(), CV_32F, cv::Scalar(1));
  for (Index y = 0; y + 40 < figure.height_px; ++y) {
    for (Index x = 0; x + 60 < figure.width_px; ++x) {
      if (figure(x, y)) shade.at<float>(y + 40, x + 60) = 0.7F;
    }
  }
  cv::GaussianBlur(shade, shade, {0, 0}, 4);
  for (int y = 0; y < photo.rows; ++y) {
    for (int x = 0; x < photo.cols; ++x) {
      auto& p = photo.at<cv::Vec3b>(y, x);
      const float s = shade.at<float>(y, x);
      for (int c = 0; c < 3; ++c) p[c] = cv::saturate_cast<std::uint8_t>(s * static_cast<float>(p[c]));
      if (figure(x, y))
        p = color;
      else if (shadow != nullptr && s < 0.85F)
        shadow->set(x, y);
    }
  }
}

BitMask hand() { return test::silhouettes_of("hand-still").frame.silhouettes[0]; }

TEST(Background, FindsTheFigureAndLeavesItsShadow) {
  BackgroundModel model(kWidth, kHeight);
  for (unsigned k = 0; k < 10; ++k) model.learn(room(k).data);
  const BitMask truth = hand();
  for (const cv::Vec3b& color : {cv::Vec3b{40, 60, 200}, {200, 80, 40}, {30, 30, 30}, {60, 200, 60}}) {
    cv::Mat photo = room(99);
    BitMask shadow(kWidth, kHeight), mask;
    compose(photo, truth, color, &shadow);
    model.classify(photo.data, {}, mask);
    EXPECT_GE(iou(mask, truth), 0.95) << color;
    const double taken =
        static_cast<double>(common_area_px(mask, shadow)) / static_cast<double>(shadow.area_px());
    EXPECT_LE(taken, 0.03) << color;
  }
}

TEST(Background, OneStillPictureIsEnoughAndStoredRoomsAreTheSame) {
  BackgroundModel one(kWidth, kHeight), film(kWidth, kHeight), stored(kWidth, kHeight);
  one.learn(room(1).data);
  for (unsigned k = 0; k < 8; ++k) film.learn(room(k).data);
  const std::string path = (std::filesystem::temp_directory_path() / "tactus_room.png").string();
  film.write(path);
  stored.read(path);
  cv::Mat photo = room(50);
  const BitMask truth = hand();
  compose(photo, truth, {40, 60, 200});
  BitMask by_one, by_film, by_stored;
  one.classify(photo.data, {}, by_one);
  film.classify(photo.data, {}, by_film);
  stored.classify(photo.data, {}, by_stored);
  EXPECT_GE(iou(by_one, truth), 0.95);
  EXPECT_EQ(by_film, by_stored);
  EXPECT_NEAR(film.mean_spread(), 2 * std::sqrt(3.0), 0.5);  // three channels of 2 grey levels
  BackgroundModel other(100, 100);
  EXPECT_NE(test::message_of([&] { other.read(path); }).find("640x960 pixels, expected 100x100"),
            std::string::npos);
  std::filesystem::remove(path);
}

TEST(Background, TheMedianForgetsASubjectThatMoves) {
  BackgroundModel model(kWidth, kHeight);
  const BitMask figure = hand();
  for (int k = 0; k < 31; ++k) {
    cv::Mat photo = room(static_cast<unsigned>(k));
    // Steps of 40 pixels: before any pixel it stands in at most a third of the frames.
    BitMask there(kWidth, kHeight);
    const int shift = 40 * (k % 15 - 7);
    for (Index y = 0; y < kHeight; ++y) {
      for (Index x = std::max(0, -shift); x < std::min(kWidth, kWidth - shift); ++x) {
        if (figure(x, y)) there.set(x + shift, y);
      }
    }
    compose(photo, there, {40, 60, 200});
    model.collect(photo.data);
  }
  model.finish_median();
  cv::Mat photo = room(77);
  compose(photo, figure, {40, 60, 200});
  BitMask mask;
  model.classify(photo.data, {}, mask);
  EXPECT_GE(iou(mask, figure), 0.95);
}

/// A disc whose pixels on the contour mix subject and room in light (the 2.2th power of grey levels) by the
/// share that the disc covers, counted on 16x16 points a pixel.
TEST(Background, AlphaIsTheShareOfAPixelThatTheSubjectCovers) {
  BackgroundModel model(kWidth, kHeight);
  for (unsigned k = 0; k < 5; ++k) model.learn(room(k, 1, 0).data);
  cv::Mat photo = room(9, 1, 0);
  const double radius_px = 90.3, x0 = 311.7, y0 = 236.2;
  const cv::Vec3b subject{40, 60, 230};
  Image<double> covered(kWidth, kHeight);
  for (Index y = 0; y < kHeight; ++y) {
    for (Index x = 0; x < kWidth; ++x) {
      int n = 0;
      for (int s = 0; s < 256; ++s)
        n += std::hypot(x + (s % 16 - 7.5) / 16 - x0, y + (s / 16 - 7.5) / 16 - y0) < radius_px ? 1 : 0;
      const double share = covered(x, y) = n / 256.0;
      auto& p = photo.at<cv::Vec3b>(y, x);
      for (int c = 0; c < 3; ++c) {
        const double light = share * std::pow(subject[c], 2.2) + (1 - share) * std::pow(p[c], 2.2);
        p[c] = cv::saturate_cast<std::uint8_t>(std::pow(light, 1 / 2.2));
      }
    }
  }
  BitMask mask;
  model.classify(photo.data, {}, mask);
  AlphaImage alpha;
  model.alpha(photo.data, {}, mask, alpha);
  double squares = 0, area_px = 0, hard_px = 0;
  Index edge = 0;
  for (Index y = 0; y < kHeight; ++y) {
    for (Index x = 0; x < kWidth; ++x) {
      const double share = covered(x, y), found = alpha(x, y) / 255.0;
      area_px += found;
      hard_px += mask(x, y) ? 1 : 0;
      if (share == 0 || share == 1) continue;
      squares += (found - share) * (found - share);
      ++edge;
    }
  }
  // A grey level is 1/100 of the contrast in light at most; three channels of rounding, the subject's mean
  // exact: 0.01 RMS. The area of a disc by alpha then errs by less than 0.01 of its edge pixels, one sided.
  const double truth_px = std::numbers::pi * radius_px * radius_px;
  EXPECT_GT(edge, 500);
  EXPECT_LE(std::sqrt(squares / edge), 0.01);
  EXPECT_NEAR(area_px, truth_px, 0.01 * edge);
  EXPECT_LE(std::abs(area_px - truth_px), std::abs(hard_px - truth_px) + 0.01 * edge);
  // Before a cloth the room is not known.
  BackgroundOptions cloth;
  cloth.method = BackgroundMethod::key;
  model.alpha(photo.data, cloth, mask, alpha);
  for (Index y = 0; y < kHeight; ++y) {
    for (Index x = 0; x < kWidth; ++x) ASSERT_EQ(alpha(x, y), mask(x, y) ? 255 : 0);
  }
}

/// The light changes by 15 % within 60 s, and the subject stands still all the time.
TEST(Background, FollowsTheLightAndNeverLearnsTheSubject) {
  BackgroundModel model(kWidth, kHeight);
  for (unsigned k = 0; k < 5; ++k) model.learn(room(k).data);
  BackgroundOptions options;
  options.adapt_s = 10;
  const BitMask truth = hand();
  cv::Mat first = room(20);
  compose(first, truth, {40, 60, 200});
  BitMask mask;
  model.classify(first.data, options, mask);
  const double before = iou(mask, truth);
  for (const double light : {1.15, 0.85}) {
    // Five photos a second would take minutes here; each stands for one and a half.
    for (int k = 1; k <= 40; ++k) {
      cv::Mat photo = room(static_cast<unsigned>(k % 4), 1 + (light - 1) * k / 40.0);
      compose(photo, truth, {40, 60, 200});
      model.classify(photo.data, options, mask, 1.5);
    }
    EXPECT_GE(iou(mask, truth), before - 0.01) << light;
  }
}

TEST(Background, AKeyIsAColour) {
  cv::Mat photo(kHeight, kWidth, CV_8UC3, cv::Scalar(64, 177, 0));
  const BitMask truth = hand();
  compose(photo, truth, {120, 140, 200});  // its shadow darkens the cloth and keeps its colour
  BackgroundOptions options;
  options.method = BackgroundMethod::key;
  BackgroundModel model(kWidth, kHeight);
  BitMask mask;
  model.classify(photo.data, options, mask);
  EXPECT_GE(iou(mask, truth), 0.97);
}

TEST(Background, MethodsHaveNames) {
  EXPECT_EQ(background_method("knn"), BackgroundMethod::knn);
  EXPECT_EQ(test::message_of([] { background_method("mog"); }, ErrorKind::usage),
            "background.method 'mog': expected model, key, mog2 or knn; did you mean 'mog2'?");
}

/// Mean distance of the contours' pixels from the other contour, both ways [pixels].
double contour_distance_px(const BitMask& a, const BitMask& b) {
  const auto contour = [](const BitMask& m) {
    cv::Mat image(m.height_px, m.width_px, CV_8U, cv::Scalar(255));
    for (Index y = 1; y + 1 < m.height_px; ++y) {
      for (Index x = 1; x + 1 < m.width_px; ++x) {
        if (m(x, y) && !(m(x - 1, y) && m(x + 1, y) && m(x, y - 1) && m(x, y + 1)))
          image.at<std::uint8_t>(y, x) = 0;
      }
    }
    return image;
  };
  const auto mean = [](const cv::Mat& from, const cv::Mat& to) {
    cv::Mat distance;
    cv::distanceTransform(to, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    return cv::mean(distance, from == 0)[0];
  };
  const cv::Mat in_a = contour(a), in_b = contour(b);
  return 0.5 * (mean(in_a, in_b) + mean(in_b, in_a));
}

/// The frames of a film, all of them.
std::vector<cv::Mat> frames_of(const std::string& file, std::size_t most = 1000) {
  std::vector<cv::Mat> frames;
  cv::VideoCapture film(file);
  cv::Mat photo;
  while (frames.size() < most && film.read(photo)) frames.push_back(photo.clone());
  return frames;
}
std::string horseman(int cam) { return data_folder() + "/utrecht_horseman/cam" + std::to_string(cam) + "/"; }

/// Figures of four colours with their shadows, over the last real frame of the empty room; learnt from those
/// before. OpenCV's mixtures with an opening and the largest part: IoU 0.906, contours off by 2.0 px, 4.6 to
/// 17 % of the shadow taken.
TEST(Background, FiguresOverRealFramesHaveTrueContours) {
  if (data_folder().empty()) GTEST_SKIP() << "no data: set TACTUS_DATA";
  const BitMask figure = hand();
  double iou_sum = 0, contour_sum = 0, shadow_taken = 0, shadow_all = 0;
  int count = 0;
  for (int cam = 1; cam <= 4; ++cam) {
    std::vector<cv::Mat> frames = frames_of(horseman(cam) + "background.avi");
    ASSERT_GT(frames.size(), 3U);
    const cv::Mat last = frames.back();
    frames.pop_back();
    BackgroundModel model(last.cols, last.rows);
    for (const cv::Mat& photo : frames) model.learn(photo.data);
    const BitMask truth = test::make_mask(last.cols, last.rows, [&](Index x, Index y) {
      return x < figure.width_px && y < figure.height_px && figure(x, y);
    });
    for (const cv::Vec3b& color : {cv::Vec3b{40, 60, 200}, {200, 80, 40}, {30, 30, 30}, {60, 200, 60}}) {
      cv::Mat photo = last.clone();
      BitMask shadow(last.cols, last.rows), mask;
      compose(photo, truth, color, &shadow);
      model.classify(photo.data, {}, mask);
      const double contour = contour_distance_px(mask, truth);
      if (std::getenv("TACTUS_VERBOSE") != nullptr)
        std::printf("cam%d (%d,%d,%d): IoU %.4f, contour %.2f px\n", cam, color[0], color[1], color[2],
                    iou(mask, truth), contour);
      iou_sum += iou(mask, truth);
      contour_sum += contour;
      shadow_taken += static_cast<double>(common_area_px(mask, shadow));
      shadow_all += static_cast<double>(shadow.area_px());
      ++count;
    }
  }
  std::printf("figures over real frames: IoU %.4f, contour %.2f px, shadow taken %.2f %%\n", iou_sum / count,
              contour_sum / count, 100 * shadow_taken / shadow_all);
  EXPECT_GE(iou_sum / count, 0.95);
  EXPECT_LE(contour_sum / count, 0.7);
  EXPECT_LE(shadow_taken / shadow_all, 0.03);
}

/// Hand-painted masks, of about frame 246. They are generous: a pixel of erosion costs them 0.074, so what
/// true contours reach is limited, to 0.914 to 0.916 over all settings tried.
TEST(Background, HorsemanIsSegmentedAsWellAsByMixtures) {
  if (data_folder().empty()) GTEST_SKIP() << "no data: set TACTUS_DATA";
  double sum = 0, mog2 = 0, at_0 = 0;
  for (int cam = 1; cam <= 4; ++cam) {
    const std::vector<cv::Mat> empty = frames_of(horseman(cam) + "background.avi"),
                               film = frames_of(horseman(cam) + "video.avi", 247);
    ASSERT_EQ(film.size(), 247U);
    const cv::Mat& photo = film.back();
    BackgroundModel model(photo.cols, photo.rows);
    for (const cv::Mat& room : empty) model.learn(room.data);
    const cv::Mat painted = cv::imread(horseman(cam) + "customMask.png", cv::IMREAD_GRAYSCALE);
    const BitMask truth = test::make_mask(
        photo.cols, photo.rows, [&](Index x, Index y) { return painted.at<std::uint8_t>(y, x) > 127; });
    BitMask mask;
    BackgroundOptions options;
    model.classify(film.front().data, options, mask);
    at_0 += iou(mask, truth) / 4;
    model.classify(photo.data, options, mask);
    sum += iou(mask, truth) / 4;
    options.method = BackgroundMethod::mog2;
    model.classify(photo.data, options, mask);
    mog2 += iou(mask, truth) / 4;
  }
  std::printf("Horseman, frame 246: IoU %.4f, by MOG2 %.4f; frame 0: %.4f\n", sum, mog2, at_0);
  EXPECT_GE(sum, 0.913);
  EXPECT_GE(sum, mog2 - 0.002);
  EXPECT_GT(sum, at_0);
}

CalibratedCamera camera_with_lens() {
  CalibratedCamera calibrated;
  Camera& c = calibrated.camera;
  c.name = "cam";
  c.width_px = kWidth;
  c.height_px = kHeight;
  c.fx_px = c.fy_px = 500;
  c.cx_px = 322;
  c.cy_px = 235;
  const double k[] = {-0.36, 0.18, 1e-3, -2e-3, -0.05};
  calibrated.lens = make_lens(LensModel::brown, k);
  return calibrated;
}

TEST(Background, NothingIsAllocatedPerPhoto) {
  const Undistortion undistort(camera_with_lens());
  BackgroundModel model(kWidth, kHeight);
  for (unsigned i = 0; i < 3; ++i) model.learn(room(i).data);
  cv::Mat photos[] = {room(3), room(4), room(5)};
  for (cv::Mat& photo : photos) compose(photo, hand(), {40, 60, 200});
  BackgroundOptions options;
  options.adapt_s = 20;
  BitMask bits, packed;
  model.classify(photos[0].data, options, bits, 0.04);
  undistort.mask(bits, packed);
  const test::AllocationCount allocations;
  for (const cv::Mat& photo : photos) {
    model.classify(photo.data, options, bits, 0.04);
    undistort.mask(bits, packed);
  }
  EXPECT_EQ(allocations.so_far(), 0);
  EXPECT_GT(packed.area_px(), 1000);
}

/// Packed undistortion gives the bits of the byte chain, and the chain from photo to mask has its budget.
TEST(Background, PackedUndistortionIsThatOfBytesAndTheChainIsFast) {
  const Undistortion undistort(camera_with_lens());
  cv::Mat photo = room(3);
  compose(photo, hand(), {40, 60, 200});
  BackgroundModel model(kWidth, kHeight);
  for (unsigned i = 0; i < 5; ++i) model.learn(room(i).data);
  BitMask bits, packed, from_bytes;
  double best_ms = 1e9, classify_ms = 1e9;
  const auto since_ms = [](std::chrono::steady_clock::time_point begin) {
    return 1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  cv::setNumThreads(1);  // a core's time
  for (int i = 0; i < 200; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    model.classify(photo.data, {}, bits);
    classify_ms = std::min(classify_ms, since_ms(begin));
    undistort.mask(bits, packed);
    best_ms = std::min(best_ms, since_ms(begin));
  }
  std::vector<std::uint8_t> bytes;
  for (Index y = 0; y < kHeight; ++y) {
    for (Index x = 0; x < kWidth; ++x) bytes.push_back(bits(x, y) ? 255 : 0);
  }
  Image<std::uint8_t> scratch;
  undistort.mask(bytes.data(), scratch, from_bytes);
  // Both are bilinear in steps of 1/32 pixel; OpenCV rounds its weights to 1/32768, so a pixel on the half
  // may differ.
  BitMask differ = packed;
  for (std::size_t w = 0; w < differ.words.size(); ++w) differ.words[w] ^= from_bytes.words[w];
  EXPECT_LE(differ.area_px(), packed.area_px() / 500);
  RecordProperty("best_ms", std::to_string(best_ms));
  std::printf("photo to packed, undistorted mask: %.2f ms, of it undistortion %.2f ms\n", best_ms,
              best_ms - classify_ms);
}

}  // namespace
}  // namespace tactus
