// Films of different and variable rates: which frames go together.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "support/recordings.h"
#include "tactus/media/film_reader.h"
#include "tactus/media/mp4_muxer.h"
#include "tactus/rig/sources/data_sources.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;
using test::RigCamera;
using test::Scene;
using test::write_video;

class FilmTimes : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!films_missing().empty()) GTEST_SKIP() << films_missing();
    folder_ = fs::temp_directory_path() / ("tactus_film_times_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    test::write_calibration(path("camera.yaml"));
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string rig(const std::vector<RigCamera>& cameras) const {
    test::write_rig(path("rig.yaml"), cameras);
    return path("rig.yaml");
  }

 private:
  fs::path folder_;
};

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// A bar of 12x32 pixels on its way: 30 px/s.
cv::Mat bar_at(double time_s) {
  cv::Mat frame(64, 64, CV_8UC3, cv::Scalar(40, 40, 40));
  cv::rectangle(frame, {static_cast<int>(std::lround(6 + 30 * time_s)), 16, 12, 32}, cv::Scalar(60, 220, 240),
                cv::FILLED);
  return frame;
}
double bar_px(double time_s) { return std::lround(6 + 30 * time_s) + 5.5; }

/// Mean column of the mask.
double middle_px(const BitMask& mask) {
  double sum = 0, count = 0;
  for (Index y = 0; y < mask.height_px; ++y) {
    for (Index x = 0; x < mask.width_px; ++x) {
      if (!mask(x, y)) continue;
      sum += x;
      ++count;
    }
  }
  return sum / count;
}

void write_bar_film(const std::string& path, double fps, int frames) {
  cv::VideoWriter film(path, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), fps, {64, 64});
  for (int i = 0; i < frames; ++i) film.write(bar_at(i / fps));
}

std::string big_endian(std::size_t value) {
  std::string text;
  for (int i = 3; i >= 0; --i) text += static_cast<char>(value >> 8 * i & 255U);
  return text;
}

/// An MP4 whose frames stand so long [1/30 s]: the one of a steady 30 frames a second, with a table of
/// lengths that replaces its own, in boxes that grow by it.
void write_uneven_film(const std::string& path, const std::vector<int>& lengths) {
  const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_TRUNC, 0600);
  ASSERT_GE(fd, 0);
  H264Encoder encoder(64, 64, 30);
  Mp4Muxer muxer(fd, 64, 64, 30);
  int at = 0;
  for (const int length : lengths) {
    cv::Mat i420;
    cv::cvtColor(bar_at(at / 30.0), i420, cv::COLOR_BGR2YUV_I420);
    muxer.add(encoder.encode(i420.data, 1000 * at / 30));
    at += length;
  }
  muxer.finish();
  ::close(fd);
  std::ifstream in(path, std::ios::binary);
  std::string film{std::istreambuf_iterator<char>(in), {}};
  std::string table = std::string(4, '\0') + big_endian(lengths.size());
  for (const int length : lengths)
    table += big_endian(1) + big_endian(static_cast<std::size_t>(1000 * length));
  std::size_t moov = film.rfind("moov"), place = moov;
  for (const char* name : {"moov", "trak", "mdia", "minf", "stbl", "stts"}) {
    place = film.find(name, place);
    std::size_t size = 0;
    for (int i = 0; i < 4; ++i)
      size = size << 8U | static_cast<std::uint8_t>(film[place - 4 + static_cast<std::size_t>(i)]);
    film.replace(place - 4, 4, big_endian(size + table.size() - 16));  // 16: of its one entry
  }
  film.replace(place + 4, 16, table);
  // The length of the medium, behind its version, two times and the ticks per second.
  const std::size_t medium = film.find("mdhd", moov) + 4 + 4 + 16 + 4;
  film.replace(medium, 8, big_endian(0) + big_endian(static_cast<std::size_t>(1000 * at)));
  std::ofstream(path, std::ios::binary) << film;
}

/// Sets are of one time, whatever the films' rates: 15 beside 30 a second, and a film whose frames stand for
/// 1/30 and 3/30 s in turn. Blur and morphology move the middle of a bar by less than half a pixel; one frame
/// of 1/30 s would be a pixel, and pairing by number 30 px/s times half the time.
TEST_F(FilmTimes, FilmsOfDifferentRatesArePairedByTheirTimeStamps) {
  write_bar_film(path("a.avi"), 30, 36);
  write_bar_film(path("b.avi"), 15, 18);
  std::vector<int> turns;
  for (int i = 0; i < 18; ++i) turns.push_back(i % 2 == 0 ? 1 : 3);
  write_uneven_film(path("c.mp4"), turns);
  write_video(path("room.avi"), Scene::empty_room, 3);
  const auto of = [&](const std::string& a, const std::string& b) {
    return rig({{.name = "a", .video = a, .empty_room = "room.avi"},
                {.name = "b", .video = b, .empty_room = "room.avi"}});
  };
  for (const std::string other : {"b.avi", "c.mp4"}) {
    const auto source = open_videos(of("a.avi", other));
    ASSERT_NEAR(source->frame_count().value_or(0), 18, 1) << other;
    FrameSet frame;
    double time_s = 0;
    for (int tick = 0; tick < 17; ++tick) {
      ASSERT_EQ(source->next(frame), NextFrame::success) << other << " " << tick << source->status();
      EXPECT_EQ(has(source->status(),
                    "the videos differ in their frames per second: camera 'b' has 15, camera "
                    "'a' 30; frames are paired by their time stamps"),
                tick == 0)
          << source->status();
      EXPECT_NEAR(frame.time_s, time_s, 1e-3) << other << " " << tick;
      for (const BitMask& mask : frame.silhouettes) {
        ASSERT_FALSE(mask.words.empty()) << other << " " << tick << source->status();
        EXPECT_NEAR(middle_px(mask), bar_px(time_s), 0.5) << other << " " << tick;
      }
      time_s += other == "b.avi" ? 1 / 15.0 : turns[static_cast<std::size_t>(tick)] / 30.0;
    }
  }
  // A camera that lost frames for 0.4 s misses the ticks of that time, and no other.
  std::vector<int> gap(30, 1);
  gap[5] = 13;
  write_uneven_film(path("gap.mp4"), gap);
  const auto source = open_videos(of("gap.mp4", "b.avi"));
  FrameSet frame;
  for (int tick = 0; tick < 15; ++tick) {
    ASSERT_EQ(source->next(frame), NextFrame::success) << source->status();
    // Frames 5 (1/6 s) and 6 (0.6 s) are 0.75 of a tick, 0.05 s, near to ticks 2, 3 and 9.
    const bool misses = tick >= 4 && tick <= 8;
    EXPECT_EQ(frame.silhouettes[0].words.empty(), misses) << tick;
    EXPECT_EQ(has(source->status(), "gap.mp4: no frame at "), misses) << source->status();
  }
}

}  // namespace
}  // namespace tactus
