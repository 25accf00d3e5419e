// Frames that can't be had while a recording plays: which camera misses the tick, and what is said of it.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <opencv2/imgcodecs.hpp>

#include "support/recordings.h"
#include "tactus/base/error.h"
#include "tactus/media/image_header.h"
#include "tactus/rig/client_camera.h"
#include "tactus/rig/images/camera_file.h"
#include "tactus/rig/images/numbered_files.h"
#include "tactus/rig/sources/data_sources.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;
using test::RigCamera;
using test::Scene;
using test::write_picture;
using test::write_video;

class BadFrames : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("tactus_frames_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    test::write_calibration(path("camera.yaml"));
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string rig(const std::vector<RigCamera>& cameras, const std::string& more = "") const {
    test::write_rig(path("rig.yaml"), cameras, more);
    return path("rig.yaml");
  }
  /// Sequences a_0.png.., b_0.png.. of white masks, without those whose names are given.
  std::string mask_sequences(int frames, const std::vector<std::string>& missing) const {
    for (int i = 0; i < frames; ++i) {
      for (const std::string camera : {"a_", "b_"})
        write_picture(path(camera + std::to_string(i) + ".png"), 255);
    }
    for (const std::string& name : missing) fs::remove(path(name));
    return rig({{.name = "a", .mask = "'a_%d.png'"}, {.name = "b", .mask = "'b_%d.png'"}});
  }

 private:
  fs::path folder_;
};

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// Runs `body` for its Error.
struct Refusal {
  std::string message;
  ErrorKind kind;
};
Refusal refusal(const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& e) {
    return {e.what(), e.kind()};
  }
  return {"nothing was refused", ErrorKind::failure};
}

TEST_F(BadFrames, CameraWithoutAFileInASequenceMissesTheTick) {
  const auto source = open_masks(mask_sequences(3, {"b_1.png"}));
  EXPECT_EQ(source->frame_count(), 3);
  FrameSet frame;
  for (int tick = 0; tick < 3; ++tick) {
    ASSERT_EQ(source->next(frame), NextFrame::success);
    EXPECT_EQ(frame.tick, tick);
    EXPECT_EQ(frame.silhouettes[0].width_px, 64);
    EXPECT_EQ(frame.silhouettes[1].width_px, tick == 1 ? 0 : 64);
    EXPECT_EQ(frame.silhouettes[1].words.empty(), tick == 1);
    EXPECT_EQ(has(source->status(), "camera 'b': " + path("b_1.png") + ": no such image"), tick == 1)
        << source->status();
  }
  EXPECT_EQ(source->next(frame), NextFrame::no_more_data);
}

TEST_F(BadFrames, HoleInAllSequencesIsABadFrameAndNotTheEnd) {
  const auto source = open_masks(mask_sequences(4, {"a_2.png", "b_2.png"}));
  FrameSet frame;
  std::vector<NextFrame> results;
  std::string status;
  for (int tick = 0; tick < 5; ++tick) {
    results.push_back(source->next(frame));
    if (results.back() == NextFrame::bad_frame) status = source->status();
  }
  EXPECT_EQ(results, (std::vector{NextFrame::success, NextFrame::success, NextFrame::bad_frame,
                                  NextFrame::success, NextFrame::no_more_data}));
  EXPECT_TRUE(has(status, "frame 2 is missed by all cameras: camera 'a': ")) << status;
  EXPECT_TRUE(has(status, "camera 'b': ")) << status;
}

TEST_F(BadFrames, DamagedPictureInASequenceIsNamed) {
  const std::string rig_file = mask_sequences(3, {});
  test::truncate_file(path("a_0.png"), 0.5);
  write_picture(path("b_1.png"), 255, {32, 16});
  std::ofstream(path("a_2.png")) << "no picture";
  const auto source = open_masks(rig_file);
  FrameSet frame;
  const std::string expected[] = {
      "camera 'a': " + path("a_0.png") + ": the image is cut short",
      "camera 'b': " + path("b_1.png") + ": 32x16 pixels, the rig's image_size_px is 64x64",
      "camera 'a': " + path("a_2.png") + ": not an image that can be read"};
  for (int tick = 0; tick < 3; ++tick) {
    ASSERT_EQ(source->next(frame), NextFrame::success);
    EXPECT_TRUE(has(source->status(), expected[tick])) << source->status();
    EXPECT_TRUE(frame.silhouettes[tick == 1 ? 1 : 0].words.empty());
    EXPECT_FALSE(frame.silhouettes[tick == 1 ? 0 : 1].words.empty());
  }
}

TEST_F(BadFrames, SequencesMayStartAnywhereAndRangesBeyondAreRefused) {
  const std::string rig_file = mask_sequences(5, {"a_0.png", "b_0.png", "a_1.png", "b_1.png"});
  FrameSet frame;
  const auto all = open_masks(rig_file);
  ASSERT_EQ(all->next(frame), NextFrame::success);
  EXPECT_EQ(frame.tick, 2);
  EXPECT_EQ(all->frame_count(), 3);
  DataOptions options;
  options.first_frame = 3;
  EXPECT_EQ(open_masks(rig_file, options)->frame_count(), 2);
  options.last_frame = 9;
  const Refusal beyond = refusal([&] { open_masks(rig_file, options); });
  EXPECT_EQ(beyond.kind, ErrorKind::usage);
  EXPECT_TRUE(has(beyond.message, "frames 3-9 are asked for, but the recording holds frames 2-4; 3- is all"))
      << beyond.message;
  options = {};
  options.first_frame = 0;
  EXPECT_TRUE(has(refusal([&] { open_masks(rig_file, options); }).message, "frames 0- are asked for"));
}

/// A rig that is named without a folder, from where it lies, has its files beside it: with a head before the
/// number and without.
TEST_F(BadFrames, SequencesAreFoundBesideARigWithoutAFolder) {
  fs::create_directory(path("b"));
  for (int i = 0; i < 3; ++i) {
    const std::string number = "0000" + std::to_string(i);
    for (const std::string& name : {"a_" + number, "b/" + number, number})
      write_picture(path(name + ".png"), 255);
  }
  rig({{.name = "a", .mask = "'a_%05d.png'"},
       {.name = "b", .mask = "'b/%05d.png'"},
       {.name = "c", .mask = "'%05d.png'"}});
  const fs::path before = fs::current_path();
  fs::current_path(path("."));
  std::string masks;
  try {
    for (const std::string name : {"rig.yaml", "./rig.yaml"}) {
      const auto source = open_masks(name);
      FrameSet frame;
      for (int tick = 0; source->next(frame) == NextFrame::success; ++tick)
        for (const BitMask& mask : frame.silhouettes)
          masks += mask.words.empty() ? "-" : std::to_string(tick);
    }
  } catch (const Error& e) {
    masks = e.what();
  }
  fs::current_path(before);
  EXPECT_EQ(masks, "000111222000111222");
}

TEST_F(BadFrames, SequenceWithoutAFileNamesTheNearest) {
  write_picture(path("a_1.png"), 255);
  const Refusal none = refusal([&] { open_masks(rig({{.name = "a", .mask = "'a_%04d.png'"}})); });
  EXPECT_EQ(none.kind, ErrorKind::failure);
  EXPECT_TRUE(has(none.message, "rig.yaml: camera 'a': " + path("a_%04d.png") +
                                    ": no file has such a name; 'a_1.png' is there"))
      << none.message;
  const Refusal wrong = refusal([&] { open_masks(rig({{.name = "a", .mask = "'a_%s.png'"}})); });
  EXPECT_EQ(wrong.kind, ErrorKind::usage);
  EXPECT_TRUE(has(wrong.message, "expected one %d or %04d")) << wrong.message;
}

/// A file `a_2147483647.png` beside the sequence: two milliards of bad frames, and a count that overflows.
TEST_F(BadFrames, StrayNumbersAreRefusedAndNotWalkedTo) {
  const std::string rig_file = mask_sequences(3, {});
  write_picture(path("a_2147483647.png"), 255);
  const Refusal large = refusal([&] { open_masks(rig_file); });
  EXPECT_TRUE(
      has(large.message, "camera 'a': " + path("a_%d.png") +
                             ": 'a_2147483647.png' is no frame, expected numbers of at most 1000000000"))
      << large.message;
  fs::rename(path("a_2147483647.png"), path("a_20000.png"));
  const Refusal gap = refusal([&] { open_masks(rig_file); });
  EXPECT_EQ(gap.kind, ErrorKind::usage);
  EXPECT_TRUE(has(gap.message,
                  "rig.yaml: no camera has a file between frames 2 and 20000, expected gaps of at "
                  "most 10000; ask for frames on one side, or take the stray file away"))
      << gap.message;
  DataOptions options;
  options.last_frame = 2;
  EXPECT_EQ(open_masks(rig_file, options)->frame_count(), 3);
  fs::rename(path("a_20000.png"), path("a_10002.png"));
  EXPECT_EQ(open_masks(rig_file)->frame_count(), 10003);
}

/// 60000 x 60000 pixels in a header of 33 bytes: the decoder's exception ended the run.
TEST_F(BadFrames, ImageThatIsTooLargeCostsOnlyItsCameraTheFrame) {
  const std::string rig_file = mask_sequences(2, {});
  std::string png;
  const std::string file = path("a_1.png");
  {
    std::ifstream in(file, std::ios::binary);
    png.assign(std::istreambuf_iterator<char>(in), {});
  }
  for (const std::size_t at : {16U, 20U}) png.replace(at, 4, std::string("\0\0\xea\x60", 4));
  std::ofstream(file, std::ios::binary) << png;
  const auto source = open_masks(rig_file);
  FrameSet frame;
  ASSERT_EQ(source->next(frame), NextFrame::success);
  ASSERT_EQ(source->next(frame), NextFrame::success);
  EXPECT_TRUE(has(source->status(), "camera 'a': " + file +
                                        ": 60000x60000 pixels are too many, expected at most 256 megapixels"))
      << source->status();
  EXPECT_TRUE(frame.silhouettes[0].words.empty());
  EXPECT_FALSE(frame.silhouettes[1].words.empty());
}

TEST(ImageHeader, SizesOfEveryKindAreReadBeforeTheDecoder) {
  const cv::Mat image(7, 13, CV_8UC1, cv::Scalar(9));
  for (const char* kind : {".png", ".jpg", ".bmp", ".pgm", ".tiff"}) {
    std::vector<std::uint8_t> bytes;
    ASSERT_TRUE(cv::imencode(kind, image, bytes));
    const std::string text(bytes.begin(), bytes.end());
    const auto size = size_in_header(text);
    ASSERT_TRUE(size) << kind;
    EXPECT_EQ(size->width_px, 13U) << kind;
    EXPECT_EQ(size->height_px, 7U) << kind;
    for (std::size_t n = 0; n < text.size(); ++n)
      size_in_header(text.substr(0, n));  // no read beyond the end
  }
  EXPECT_EQ(size_in_header("P5 # a comment\n 640\n480 255\n")->height_px, 480U);
  EXPECT_FALSE(size_in_header("GIF89a"));
  EXPECT_FALSE(size_in_header(""));
}

TEST(NumberedFiles, NumberMayBeInAFoldersName) {
  const fs::path folder = fs::temp_directory_path() / ("tactus_numbers_" + std::to_string(getpid()));
  for (const char* name : {"t003", "t017", "t4"}) fs::create_directories(folder / name);
  for (const char* name : {"t003/m.pgm", "t017/m.pgm", "t4/m.pgm"})
    write_picture((folder / name).string(), 0);
  const NumberedFiles files((folder / "t%03d/m.pgm").string());
  EXPECT_EQ(files.file(17), (folder / "t017/m.pgm").string());
  EXPECT_EQ(files.numbers(), (std::vector<int>{3, 17}));  // t4 is not how %03d writes 4
  fs::remove_all(folder);
}

/// '%' may be part of names; a path that is there as it is written is that file.
TEST(NumberedFiles, PercentMayBeInNames) {
  const fs::path folder = fs::temp_directory_path() / ("tactus_100%d_" + std::to_string(getpid()));
  fs::create_directories(folder / "50% off");
  for (const char* name : {"50% off/m_0007.pgm", "50% off/m_0009.pgm", "%d.pgm"})
    write_picture((folder / name).string(), 0);
  const NumberedFiles files((folder / "50% off/m_%04d.pgm").string());
  EXPECT_EQ(files.numbers(), (std::vector<int>{7, 9}));
  EXPECT_EQ(files.file(9), (folder / "50% off/m_0009.pgm").string());
  EXPECT_FALSE(NumberedFiles((folder / "50% off/m_0007.pgm").string()).is_sequence());
  EXPECT_FALSE(NumberedFiles((folder / "%d.pgm").string()).is_sequence());
  EXPECT_EQ(refusal([&] { NumberedFiles((folder / "50% off/m_%s.pgm").string()).numbers(); }).kind,
            ErrorKind::failure);  // the folder's %d is a number, but nothing has it
  EXPECT_EQ(refusal([] { NumberedFiles("m_%s.pgm"); }).kind, ErrorKind::usage);
  EXPECT_EQ(refusal([] { NumberedFiles("none/m_%d/%d.pgm"); }).kind, ErrorKind::usage);
  fs::remove_all(folder);
}

TEST_F(BadFrames, CutVideoMissesTheTicksThatItLost) {
  for (const char* name : {"a.avi", "b.avi"}) write_video(path(name), Scene::object, 20);
  write_video(path("room.avi"), Scene::empty_room, 3);
  test::truncate_file(path("b.avi"), 0.75);
  DataOptions options;
  options.colors = true;
  const auto source = open_videos(rig({{.name = "a", .video = "a.avi", .empty_room = "room.avi"},
                                       {.name = "b", .video = "b.avi", .empty_room = "room.avi"}}),
                                  options);
  ASSERT_EQ(source->frame_count(), 20);  // the header still promises them
  FrameSet frame;
  int missed = 0;
  for (int tick = 0; tick < 20; ++tick) {
    ASSERT_EQ(source->next(frame), NextFrame::success) << source->status();
    // The object, 16x16 pixels, less or more a rim of blur and morphology of 2 pixels: 12^2 to 20^2.
    EXPECT_GT(frame.silhouettes[0].area_px(), 144);
    EXPECT_LT(frame.silhouettes[0].area_px(), 400);
    EXPECT_FALSE(frame.colors[0].empty());
    const bool lost = frame.silhouettes[1].words.empty();
    EXPECT_EQ(lost, frame.colors[1].empty());
    EXPECT_EQ(lost, has(source->status(), "camera 'b': " + path("b.avi") + ": frame " + std::to_string(tick) +
                                              " can't be read; the file is cut short or damaged"))
        << source->status();
    EXPECT_FALSE(has(source->status(), "camera 'a'")) << source->status();
    EXPECT_TRUE(lost || missed == 0) << "a frame after the cut";
    missed += lost ? 1 : 0;
  }
  EXPECT_GT(missed, 0);
  EXPECT_LT(missed, 20);  // what stands before the cut is used
  EXPECT_EQ(source->next(frame), NextFrame::no_more_data);
}

/// A client that plays a film sends the silhouettes and soft edges that the film itself gives as a source.
TEST_F(BadFrames, AFilmThatIsSentHasTheSameSoftEdges) {
  write_video(path("a.avi"), Scene::object, 3);
  write_video(path("room.avi"), Scene::empty_room, 3);
  const std::string file = rig({{.name = "a", .video = "a.avi", .empty_room = "room.avi"}});
  DataOptions options;
  options.alphas = true;
  const auto source = open_videos(file, options);
  const RigFile of = read_rig_file(file);
  const auto with = open_client_camera(of, file, "a", {.alpha = true}),
             without = open_client_camera(of, file, "a", {});
  FrameSet frame;
  CameraImages images, plain;
  for (int tick = 0; tick < 3; ++tick) {
    ASSERT_EQ(source->next(frame), NextFrame::success);
    ASSERT_EQ(with->grab(tick, images), "");
    ASSERT_EQ(without->grab(tick, plain), "");
    EXPECT_EQ(images.mask, frame.silhouettes[0]);
    EXPECT_EQ(images.alpha.pixels, frame.alphas[0].pixels);
    EXPECT_TRUE(plain.alpha.empty());
  }
  EXPECT_TRUE(std::any_of(images.alpha.pixels.begin(), images.alpha.pixels.end(),
                          [](int a) { return a > 0 && a < 255; }));
  write_picture(path("m.png"), 255);
  const std::string masks = rig({{.name = "a", .mask = "m.png"}});
  const Refusal refused =
      refusal([&] { open_client_camera(read_rig_file(masks), masks, "a", {.alpha = true}); });
  EXPECT_EQ(refused.kind, ErrorKind::usage);
  EXPECT_TRUE(has(refused.message, "camera 'a'") && has(refused.message, "no soft edges")) << refused.message;
}

/// The scene's rate, else the rig file's, else what the video says of itself (the test's: 25).
TEST_F(BadFrames, TheRateIsTheRecordingsOwnUnlessToldOtherwise) {
  for (const char* name : {"a.avi", "room.avi"}) write_video(path(name), Scene::object, 3);
  const auto second_frame = [&](const std::string& more, std::optional<double> fps) {
    DataOptions options;
    options.fps = fps;
    const auto source =
        open_videos(rig({{.name = "a", .video = "a.avi", .empty_room = "room.avi"}}, more), options);
    FrameSet frame;
    for (int tick = 0; tick < 2; ++tick) EXPECT_EQ(source->next(frame), NextFrame::success);
    EXPECT_DOUBLE_EQ(1 / frame.time_s, source->fps().value_or(0));
    return frame.time_s;
  };
  EXPECT_NEAR(second_frame("", {}), 1 / 25.0, 1e-9);
  EXPECT_NEAR(second_frame("frames_per_s: 10\n", {}), 1 / 10.0, 1e-9);
  EXPECT_NEAR(second_frame("frames_per_s: 10\n", 50), 1 / 50.0, 1e-9);
  DataOptions options;
  options.fps = 12;
  EXPECT_EQ(open_masks(mask_sequences(2, {}), options)->fps(), 12);
  EXPECT_EQ(open_masks(mask_sequences(2, {}))->fps(), 30);
}

TEST_F(BadFrames, VideosOfDifferentLengthsEndWithTheShortestAndSaySo) {
  write_video(path("a.avi"), Scene::object, 6);
  write_video(path("b.avi"), Scene::object, 4);
  write_video(path("room.avi"), Scene::empty_room, 3);
  const auto rig_with = [&](const std::string& more) {
    return rig({{.name = "a", .video = "a.avi", .empty_room = "room.avi"},
                {.name = "b", .video = "b.avi", .empty_room = "room.avi"}},
               more);
  };
  const auto source = open_videos(rig_with(""));
  EXPECT_EQ(source->frame_count(), 4);
  FrameSet frame;
  ASSERT_EQ(source->next(frame), NextFrame::success);
  EXPECT_EQ(source->status(), "the videos differ in length: camera 'b' has 4 frames, camera 'a' has 6");
  ASSERT_EQ(source->next(frame), NextFrame::success);
  EXPECT_EQ(source->status(), "");  // once is enough
  const Refusal beyond = refusal([&] { open_videos(rig_with("frames: [1, 5]\n")); });
  EXPECT_EQ(beyond.kind, ErrorKind::usage);
  EXPECT_TRUE(has(beyond.message,
                  "frames 1-5 are asked for, but the recording holds frames 0-3 (the videos differ in "
                  "length: camera 'b' has 4"))
      << beyond.message;
}

TEST_F(BadFrames, CutPicturesOfEveryKindAreRefused) {
  for (const char* name : {"m.png", "m.jpg", "m.bmp", "m.pgm", "m.tiff"}) {
    cv::Mat noise(64, 64, CV_8UC1);
    cv::randu(noise, 0, 255);
    ASSERT_TRUE(test::write_image(path(name), noise));
    EXPECT_EQ(read_mask(path(name), 64, 64).pixels.size(), 4096U) << name;
    test::truncate_file(path(name), 0.6);
    const Refusal cut = refusal([&] { read_mask(path(name), 64, 64); });
    EXPECT_TRUE(has(cut.message, path(name) + ": ")) << cut.message;
    EXPECT_TRUE(has(cut.message, "cut short") || has(cut.message, "not an image that can be read"))
        << cut.message;
  }
}

/// masks_of_0_and_1: as segmentation programs write them, in 8 and 16 bits.
TEST_F(BadFrames, MasksOfLabelsAreForeground) {
  const auto set = [&](const cv::Mat& mask, std::string& notice) {
    EXPECT_TRUE(test::write_image(path("labels.png"), mask));
    const Image<std::uint8_t> read = read_mask(path("labels.png"), mask.cols, mask.rows, &notice);
    return std::count(read.pixels.begin(), read.pixels.end(), 255);
  };
  for (const int type : {CV_8U, CV_16U}) {
    for (const int label : {1, 38}) {
      cv::Mat mask(10, 20, type, cv::Scalar(0));
      mask(cv::Rect(2, 2, 5, 5)).setTo(label);
      std::string notice;
      EXPECT_EQ(set(mask, notice), 25);
      EXPECT_EQ(notice, "the mask has values 0 and " + std::to_string(label) + "; white is " +
                            (type == CV_8U ? "255" : "65535") + ": all but 0 is taken as foreground");
      // Beside white, dark grey is the edge of something white.
      mask(cv::Rect(9, 2, 2, 2)).setTo(type == CV_8U ? 255 : 65535);
      EXPECT_EQ(set(mask, notice = ""), 4);
      EXPECT_EQ(notice, "");
    }
  }
  cv::Mat noise(10, 20, CV_8U);
  cv::randu(noise, 0, 100);
  std::string notice;
  const Refusal refused = refusal([&] { set(noise, notice); });
  EXPECT_TRUE(has(refused.message, "tell no foreground from background; white is 255")) << refused.message;
}

}  // namespace
}  // namespace tactus
