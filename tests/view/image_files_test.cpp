#include "tactus/view/image_files.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "tactus/base/error.h"
#include "tactus/base/safe_file.h"
#include "tactus/view/mp4_check.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;

class ImageFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() /
              (std::string("tactus_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::size_t file_count() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  static std::string message(const std::function<void()>& action) {
    try {
      action();
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }
  fs::path folder_;
};

TEST_F(ImageFiles, PngRoundTrip) {
  ColorImage image(30, 20);
  for (Index y = 0; y < 20; ++y) {
    for (Index x = 0; x < 30; ++x)
      image(x, y) = {static_cast<std::uint8_t>(8 * x), static_cast<std::uint8_t>(12 * y), 77};
  }
  write_png(path("a.png"), image);
  const cv::Mat back = cv::imread(path("a.png"));
  ASSERT_EQ(back.cols, 30);
  ASSERT_EQ(back.rows, 20);
  EXPECT_EQ(back.at<cv::Vec3b>(7, 11), cv::Vec3b(77, 84, 88));  // lossless; OpenCV's order is B, G, R
  EXPECT_EQ(file_count(), 1U);
}

TEST_F(ImageFiles, VideoRoundTrip) {
  {
    VideoWriter video(path("a.mp4"), 160, 96, 25);
    for (int i = 0; i < 40; ++i) video.add(ColorImage(160, 96, {static_cast<std::uint8_t>(5 * i), 60, 200}));
    EXPECT_EQ(video.frame_count(), 40);
    EXPECT_FALSE(fs::exists(path("a.mp4")));  // not before it is whole
  }
  EXPECT_EQ(file_count(), 1U);
  cv::VideoCapture capture(path("a.mp4"));
  ASSERT_TRUE(capture.isOpened());
  cv::Mat frame;
  int frames = 0;
  while (capture.read(frame)) {
    ASSERT_EQ(frame.cols, 160);
    ASSERT_EQ(frame.rows, 96);
    // Even colours survive 4:2:0 video to a few levels of quantisation; 20 tells frames 4 apart.
    EXPECT_NEAR(frame.at<cv::Vec3b>(48, 80)[2], 5 * frames, 20);
    ++frames;
  }
  EXPECT_EQ(frames, 40);
}

/// A full disk cuts the file somewhere; OpenCV says nothing of it.
TEST_F(ImageFiles, VideoThatIsCutAnywhereIsKnown) {
  {
    VideoWriter video(path("a.mp4"), 64, 64, 25);
    for (int i = 0; i < 5; ++i) video.add(ColorImage(64, 64, {static_cast<std::uint8_t>(50 * i), 60, 200}));
  }
  const int fd = open(path("a.mp4").c_str(), O_RDWR);
  ASSERT_GE(fd, 0);
  EXPECT_EQ(what_is_wrong_with_mp4(fd, 5), "");
  EXPECT_EQ(what_is_wrong_with_mp4(fd, 6), "the video is cut short: it holds 5 of 6 frames");
  for (auto size = static_cast<off_t>(fs::file_size(path("a.mp4"))) - 1; size >= 0; --size) {
    ASSERT_EQ(ftruncate(fd, size), 0);
    ASSERT_NE(what_is_wrong_with_mp4(fd, 5), "") << size;
  }
  close(fd);
}

TEST_F(ImageFiles, VideoWithoutAFrameLeavesNothing) {
  { const VideoWriter video(path("a.mp4"), 160, 96, 25); }
  EXPECT_EQ(file_count(), 0U);
}

TEST_F(ImageFiles, VideoRefusesWhatItCannotHold) {
  EXPECT_THROW(VideoWriter(path("a.mp4"), 161, 96, 25), Error);
  EXPECT_THROW(VideoWriter(path("a.mp4"), 160, 96, 0), Error);
  EXPECT_THROW(VideoWriter(path("a.avi"), 160, 96, 25), Error);
  VideoWriter video(path("a.mp4"), 160, 96, 25);
  EXPECT_THROW(video.add(ColorImage(100, 96)), Error);
  video.add(ColorImage(160, 96));
  video.finish();
  EXPECT_THROW(video.add(ColorImage(160, 96)), Error);
}

TEST_F(ImageFiles, UnwritablePathsAreNamedWithTheReason) {
  const std::string missing = path("nowhere/a.png");
  EXPECT_NE(message([&] { write_png(missing, ColorImage(4, 4)); }).find(missing), std::string::npos);
  EXPECT_NE(message([&] { write_png(missing, ColorImage(4, 4)); }).find("does not exist"), std::string::npos);
  EXPECT_NE(message([&] { output_is_writable(folder_.string()); }).find("it is a folder"), std::string::npos);
  const std::string video = path("nowhere/a.mp4");
  EXPECT_NE(message([&] { VideoWriter(video, 160, 96, 25); }).find(video), std::string::npos);
  write_png(path("file"), ColorImage(4, 4));
  EXPECT_NE(message([&] { output_is_writable(path("file/a.png")); }).find("not a folder"), std::string::npos);
  EXPECT_THROW(write_png(path("empty.png"), {}), Error);
  EXPECT_EQ(file_count(), 1U);
}

TEST_F(ImageFiles, TextIsDrawn) {
  const ColorImage blank(200, 40, {90, 90, 90});
  ColorImage image = blank;
  draw_text(image, "hull 2.1 ms", 10, 28);
  std::int64_t bright = 0, dark = 0;
  for (const Rgb8 c : image.pixels) bright += c.r > 200 ? 1 : 0, dark += c.r < 60 ? 1 : 0;
  EXPECT_GT(bright, 50);
  EXPECT_GT(dark, 50);
}

/// A line too long for the picture is made smaller: what is drawn ends before the margin, and not far before
/// it.
TEST_F(ImageFiles, LongLinesAreNotClipped) {
  const Rgb8 grey{90, 90, 90};
  const std::string text =
      "frame 12   hull 1.2 ms   mesh 0.7 ms   bodies 12.3 ms (14 substeps)   frame 16.0 ms";
  for (const Index width : {320, 640, 1920}) {
    ColorImage image(width, 240, grey);
    draw_line_of_text(image, text, 16, 18);
    Index last = 0;
    for (Index y = 0; y < image.height_px; ++y) {
      for (Index x = 0; x < width; ++x) {
        if (image(x, y) != grey) last = std::max(last, x);
      }
    }
    // The rim of the letters is up to 2 px wide, and OpenCV rounds each letter's place.
    EXPECT_LE(last, width - 16 + 3);
    if (width <= 640) {
      EXPECT_GE(last, width - 16 - 20);
    }
  }
}

TEST_F(ImageFiles, TextStaysWithinItsColumn) {
  for (const std::string text : {"12.5", "a long name of a blade", "WWWWWWWWWWWWWWWWWWWWWWWW"}) {
    ColorImage image(400, 60, {250, 250, 248});
    draw_text_within(image, text, 20, 40, 16, 86, {40, 44, 52});
    Index last = 0;
    for (Index y = 0; y < image.height_px; ++y) {
      for (Index x = 0; x < image.width_px; ++x)
        if (image(x, y) != Rgb8{250, 250, 248} && image(x, y).r < 128) last = std::max(last, x);
    }
    EXPECT_GT(last, 40) << text;
    EXPECT_LE(last, 20 + 86 + 2) << text << ": two pixels for the strokes' width";
  }
}

TEST(ContactSheet, SizeAndEvenChoice) {
  ContactSheet sheet("Run", 6, 3, 120);
  const int count = 1000;
  for (int i = 0; i < count; ++i) {
    const auto level = static_cast<std::uint8_t>(i / 4);
    sheet.add(ColorImage(240, 160, {level, level, level}), "frame " + std::to_string(i));
  }
  const ColorImage image = sheet.image();
  EXPECT_EQ(image.width_px, 12 + 3 * (120 + 12));       // margins of 12 px
  EXPECT_EQ(image.height_px, 44 + 2 * (80 + 28 + 12));  // title 44, captions 28
  // Six cells of 1000 frames: levels 0, 50, 100, ... 249. Every 2^k-th frame is kept, at least 6 of them: a
  // chosen one is within 1000 / 6 / 2 frames = 21 levels of its place.
  for (Index i = 0; i < 6; ++i) {
    const Index x = 12 + (i % 3) * 132 + 60, y = 44 + (i / 3) * 120 + 40;
    EXPECT_NEAR(image(x, y).r, 249 * i / 5.0, 21) << i;
  }
  EXPECT_EQ(image(12 + 60, 44 + 40).r, 0);
  EXPECT_EQ(image(12 + 2 * 132 + 60, 44 + 120 + 40).r, 249);  // the last frame is always there
}

TEST(ContactSheet, FewFramesAndBadNumbers) {
  ContactSheet sheet("Run", 12, 4, 100);
  EXPECT_THROW(sheet.image(), Error);
  sheet.add(ColorImage(200, 100), "only");
  EXPECT_EQ(sheet.image().width_px, 12 + 112);
  EXPECT_THROW(ContactSheet("Run", 0), Error);
  EXPECT_THROW(sheet.add({}, "empty"), Error);
}

}  // namespace
}  // namespace tactus
