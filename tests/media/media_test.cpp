// Pictures and films against OpenCV's own readers and writers.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "tactus/base/error.h"
#include "tactus/media/film_reader.h"
#include "tactus/media/h264_encoder.h"
#include "tactus/media/mp4_muxer.h"
#include "tactus/media/picture.h"

namespace tactus {
namespace {

std::string encoded(const std::string& kind, const cv::Mat& image) {
  std::vector<std::uint8_t> bytes;
  EXPECT_TRUE(cv::imencode(kind, image, bytes));
  return {bytes.begin(), bytes.end()};
}

cv::Mat noise(int type) {
  cv::Mat image(9, 13, type);
  cv::theRNG().state = 5;
  cv::randu(image, 0, CV_MAT_DEPTH(type) == CV_16U ? 65536 : 256);
  return image;
}

/// In OpenCV's order of colours.
cv::Mat mat_of(Picture& p) {
  const cv::Mat view(p.height_px, p.width_px,
                     CV_MAKETYPE(p.bits == 32   ? CV_32F
                                 : p.bits == 16 ? CV_16U
                                                : CV_8U,
                                 p.channels),
                     p.bytes.data());
  cv::Mat image = view.clone();
  if (p.channels == 3) cv::cvtColor(view, image, cv::COLOR_RGB2BGR);
  if (p.channels == 4) cv::cvtColor(view, image, cv::COLOR_RGBA2BGRA);
  return image;
}

TEST(Pictures, LosslessKindsAreReadToTheBit) {
  const std::vector<std::pair<std::string, int>> kinds{
      {".png", CV_8UC1},  {".png", CV_8UC3},  {".png", CV_8UC4},   {".png", CV_16UC1},  {".png", CV_16UC3},
      {".tiff", CV_8UC1}, {".tiff", CV_8UC3}, {".tiff", CV_16UC1}, {".tiff", CV_32FC1}, {".bmp", CV_8UC1},
      {".bmp", CV_8UC3},  {".pgm", CV_8UC1},  {".pgm", CV_16UC1},  {".ppm", CV_8UC3}};
  for (const auto& [kind, type] : kinds) {
    const cv::Mat image = noise(type);
    Picture picture = decode_picture(encoded(kind, image));
    const cv::Mat back = mat_of(picture);
    ASSERT_EQ(back.type(), type) << kind;
    EXPECT_EQ(cv::norm(back, image, cv::NORM_INF), 0) << kind << ", type " << type;
  }
}

TEST(Pictures, JpegIsWithinItsRounding) {
  const cv::Mat image(40, 60, CV_8UC3, cv::Scalar(30, 120, 200));
  Picture picture = decode_picture(encoded(".jpg", image));
  EXPECT_LE(cv::norm(mat_of(picture), image, cv::NORM_INF), 3);  // a block of one colour: rounding alone
}

TEST(Pictures, PngIsWrittenToTheBit) {
  for (const int type : {CV_8UC1, CV_16UC1}) {
    const cv::Mat image = noise(type);
    const std::vector<std::uint8_t> png =
        encode_png(image.cols, image.rows, 1, type == CV_8UC1 ? 8 : 16, image.data);
    EXPECT_EQ(cv::norm(cv::imdecode(png, cv::IMREAD_UNCHANGED), image, cv::NORM_INF), 0);
  }
}

/// A JPEG whose EXIF block says nothing but the orientation.
std::string with_orientation(const std::string& jpeg, int orientation) {
  std::string exif("Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0", 25);
  exif += static_cast<char>(orientation);
  exif += std::string(6, '\0');
  const auto length = static_cast<char>(exif.size() + 2);
  return jpeg.substr(0, 2) + "\xFF\xE1" + std::string(1, '\0') + length + exif + jpeg.substr(2);
}

/// OpenCV applies the orientation when it reads colours.
TEST(Pictures, PhotosStandUprightAsOpenCvHasThem) {
  cv::Mat image(32, 48, CV_8UC3, cv::Scalar(20, 20, 20));
  image(cv::Rect(0, 0, 16, 16)).setTo(cv::Scalar(200, 200, 200));
  image(cv::Rect(32, 16, 16, 16)).setTo(cv::Scalar(100, 100, 100));
  const std::string jpeg = encoded(".jpg", image);
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const std::string bytes = with_orientation(jpeg, orientation);
    const cv::Mat right = cv::imdecode(std::vector<char>(bytes.begin(), bytes.end()), cv::IMREAD_COLOR);
    Picture picture = decode_picture(bytes);
    ASSERT_EQ(picture.width_px, orientation >= 5 ? 32 : 48) << orientation;
    ASSERT_EQ(picture.width_px, right.cols) << orientation;
    EXPECT_LE(cv::norm(mat_of(picture), right, cv::NORM_INF), 3) << orientation;
  }
}

TEST(Pictures, BrokenOnesAreRefused) {
  for (const char* kind : {".png", ".jpg", ".bmp", ".pgm", ".tiff"}) {
    const std::string bytes = encoded(kind, noise(CV_8UC1));
    for (std::size_t n = 0; n < bytes.size(); ++n) {
      try {
        const Picture picture = decode_picture(bytes.substr(0, n));
        EXPECT_EQ(picture.bytes.size(), picture.row_bytes() * 9) << kind;
      } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()), "");
      }
    }
  }
  EXPECT_THROW(decode_picture("P5 1000000 1000000 255\n"), Error);  // before memory is taken
}

class Films : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!films_missing().empty()) GTEST_SKIP() << films_missing();
    folder_ = std::filesystem::temp_directory_path() / ("tactus_films%d_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::filesystem::path folder_;
};

TEST_F(Films, FramesAreThoseOfOpenCv) {
  {
    cv::VideoWriter writer(path("a.avi"), cv::CAP_FFMPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 15,
                           {48, 32});
    for (int i = 0; i < 8; ++i) writer.write(cv::Mat(32, 48, CV_8UC3, cv::Scalar(20 * i, 90, 255 - 20 * i)));
  }
  FilmReader film(path("a.avi"));
  EXPECT_EQ(film.frame_count(), 8);
  EXPECT_NEAR(film.fps(), 15, 1e-6);
  cv::VideoCapture other(path("a.avi"), cv::CAP_FFMPEG);
  FilmFrame frame;
  cv::Mat right;
  int count = 0;
  for (; film.read(frame); ++count) {
    ASSERT_TRUE(other.read(right));
    const cv::Mat ours(frame.height_px, frame.width_px, CV_8UC3, frame.bgr.data());
    EXPECT_EQ(cv::norm(ours, right, cv::NORM_INF), 0) << count;
    EXPECT_NEAR(frame.time_s, count / 15.0, 1e-4);  // stamps are whole ticks of 1/15 s
  }
  EXPECT_EQ(count, 8);
}

TEST_F(Films, WhatIsWrittenIsReadByBoth) {
  const int fd = ::open(path("a.mp4").c_str(), O_RDWR | O_CREAT, 0600);
  ASSERT_GE(fd, 0);
  {
    H264Encoder encoder(64, 48, 12.5);
    Mp4Muxer muxer(fd, 64, 48, 12.5);
    for (int i = 0; i < 30; ++i) {
      // Brightness alone, within 16 to 235 of the standard: level l shows as 255/219 (l - 16).
      std::vector<std::uint8_t> i420(64 * 48 * 3 / 2, 128);
      std::fill_n(i420.begin(), 64 * 48, static_cast<std::uint8_t>(20 + 7 * i));
      muxer.add(encoder.encode(i420.data(), 80 * i));
    }
    muxer.finish();
  }
  ::close(fd);
  FilmReader film(path("a.mp4"));
  EXPECT_EQ(film.frame_count(), 30);
  EXPECT_NEAR(film.fps(), 12.5, 1e-3);
  cv::VideoCapture other(path("a.mp4"), cv::CAP_FFMPEG);
  cv::Mat right;
  FilmFrame frame;
  for (int i = 0; i < 30; ++i) {
    ASSERT_TRUE(film.read(frame)) << i;
    ASSERT_TRUE(other.read(right)) << i;
    EXPECT_NEAR(frame.time_s, 0.08 * i, 1e-6);
    // The quantiser's step at 24 is 10 levels: half of one, and rounding.
    EXPECT_NEAR(frame.bgr[3 * (24 * 64 + 32)], 255.0 / 219 * (4 + 7 * i), 6) << i;
    EXPECT_NEAR(right.at<cv::Vec3b>(24, 32)[0], 255.0 / 219 * (4 + 7 * i), 6) << i;
  }
  EXPECT_FALSE(film.read(frame));
}

TEST_F(Films, NoFilmIsRefused) {
  std::ofstream(path("a.avi")) << "no film";
  EXPECT_THROW(FilmReader(path("a.avi")), Error);
  EXPECT_THROW(FilmReader(path("none.avi")), Error);
}

}  // namespace
}  // namespace tactus
