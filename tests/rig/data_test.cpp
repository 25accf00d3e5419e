#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "support/data_folder.h"
#include "support/masks.h"
#include "support/message_of.h"
#include "tactus/base/error.h"
#include "tactus/geom/image/mask_metrics.h"
#include "tactus/rig/calibration_files/calibration_file.h"
#include "tactus/rig/images/camera_file.h"
#include "tactus/rig/rig_file.h"
#include "tactus/rig/sources/data_sources.h"

namespace tactus {
namespace {

using test::make_mask;
using test::message_of;

std::string rig_path(const std::string& name) { return source_path("rigs/" + name); }

#define SKIP_WITHOUT_DATA() \
  if (data_folder().empty()) GTEST_SKIP() << without_data("middlebury_dino and utrecht_horseman")

std::string rig_error(const std::string& yaml) {
  const std::string path = ::testing::TempDir() + "rig.yaml";
  std::ofstream(path) << yaml;
  return message_of([&] { read_rig_file(path); });
}

TEST(DataSources, VideoSilhouettesBeatAMixtureModel) {
  SKIP_WITHOUT_DATA();
  const auto masks = open_source(SourceKind::masks, rig_path("horseman-masks.yaml"));
  const auto videos = open_source(SourceKind::videos, rig_path("horseman.yaml"));
  FrameSet truth, seen;
  ASSERT_EQ(masks->next(truth), NextFrame::success);
  ASSERT_EQ(videos->next(seen), NextFrame::success);
  // OpenCV's MOG2 (history 200, threshold 40, shadows), trained on the empty room.
  const double mixture[] = {.889, .911, .911, .892};
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const double value = iou(truth.silhouettes[i], seen.silhouettes[i]);
    RecordProperty("iou" + std::to_string(i + 1), std::to_string(value));
    sum += value - mixture[i];
    // The painted masks are uncertain by about a pixel of contour, 0.07 of the IoU.
    EXPECT_GT(value, mixture[i] - 0.01) << "camera " << i + 1;
  }
  EXPECT_GT(sum, 0);
  EXPECT_EQ(masks->next(truth), NextFrame::no_more_data);
  EXPECT_EQ(videos->frame_count(), 426);
}

TEST(DataSources, MiddleburyDeliversTheGoodImages) {
  SKIP_WITHOUT_DATA();
  const auto source = open_source(SourceKind::middlebury, data_folder() + "/middlebury_dino");
  FrameSet frame;
  ASSERT_EQ(source->next(frame), NextFrame::success);
  EXPECT_EQ(frame.silhouettes.size(), 15U);
  EXPECT_EQ(frame.colors.size(), 15U);
  EXPECT_EQ(source->status(), "");
  EXPECT_EQ(source->next(frame), NextFrame::no_more_data);
}

TEST(RigFile, NamesLineAndNearestKey) {
  EXPECT_NE(rig_error("unit_m: 1\nimage_size_xp: [4, 4]\n")
                .find("rig.yaml:2: unknown key 'image_size_xp'; did you mean "
                      "'image_size_px'?"),
            std::string::npos);
  EXPECT_NE(rig_error("unit_m: 1\nunit_m: 2\n").find("rig.yaml:2: key 'unit_m' stands here a second"),
            std::string::npos);
}

TEST(RigFile, RefusesNoCameras) {
  EXPECT_NE(rig_error("image_size_px: [4, 4]\nworkspace_m: {min: [0, 0, 0], max: [1, 1, 1]}\ncameras: []\n")
                .find("no camera"),
            std::string::npos);
}

TEST(Calibration, NamesFileAndNode) {
  const std::string path = ::testing::TempDir() + "bad.yaml";
  const auto message = [&](const std::string& K) {
    std::ofstream(path)
        << "%YAML:1.0\n---\nCameraMatrix: !!opencv-matrix\n  rows: 3\n  cols: 3\n  dt: d\n  data: [" + K +
               "]\n";
    return message_of([&] {
      CalibrationAnswers answers;
      answers.unit_m = 1;
      answers.image_size_px = Vec2i{4, 4};
      camera_of(read_calibration_file(path, answers), "a", path);
    });
  };
  EXPECT_NE(message(".Nan, 0., 2., 0., 1., 2., 0., 0., 1.")
                .find("bad.yaml:7: 'CameraMatrix.data[0]': '.Nan', expected a finite number"),
            std::string::npos);
  EXPECT_NE(message("1., 0., 2., 0., 1., 2., 0., 0., 1.").find("is a lens alone, camera 'bad' has no pose"),
            std::string::npos);
}

TEST(Photos, CutShortOrMissingIsNamed) {
  const std::string path = ::testing::TempDir() + "cut.png";
  std::ofstream(path, std::ios::binary) << "\x89PNG\r\n\x1a\n0000";
  EXPECT_THROW(read_photo(path), Error);
  EXPECT_THROW(read_photo(path + ".absent"), Error);
}

TEST(Photos, MaskOfAnotherSizeIsRefused) {
  SKIP_WITHOUT_DATA();
  const std::string path = data_folder() + "/utrecht_horseman/cam1/customMask.png";
  EXPECT_GT(read_mask(path, 644, 486).pixels.size(), 0U);
  EXPECT_THROW(read_mask(path, 640, 480), Error);
}

TEST(DataSources, UnknownKindAndOddMasks) {
  EXPECT_THROW(open_source(SourceKind::synthetic, "x"), Error);
  EXPECT_NE(message_of([] { source_kind("video"); }).find("did you mean 'videos'"), std::string::npos);
  Rig rig;
  rig.cameras.resize(2);
  rig.cameras[1].name = "b";
  FrameSet frame;
  frame.silhouettes = {make_mask(3, 3, [](Index x, Index) { return x > 0; }), BitMask(3, 3)};
  EXPECT_EQ(odd_masks(rig, frame), "camera 'b': the mask is all black");
}

}  // namespace
}  // namespace tactus
