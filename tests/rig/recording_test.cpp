// The file of a recording: what was written comes back, and what is damaged or cut costs only itself.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "support/message_of.h"
#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/rig/sources/data_sources.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/rig/wire/recording_file.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;
using test::message_of;

class Recording : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "tactus-recording-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  /// Odd widths, so that masks have padding; a set with everything, one with less, none, and a bad tick.
  static SyntheticOptions film() {
    SyntheticOptions options;
    options.colors = true;
    options.shape.moving = true;
    options.rig = {.camera_count = 3, .width_px = 70, .height_px = 51, .focal_px = 60};
    options.rig.depth_width_px = options.rig.depth_height_px = 33;
    options.rig.depth_focal_px = 33;
    return options;
  }
  /// Writes `frames` frames of the film. @returns them
  std::vector<FrameSet> write(const std::string& file, int frames) const {
    SyntheticSource source(film());
    RecordingWriter writer(file, source.rig(), source.fps());
    std::vector<FrameSet> sets;
    for (int i = 0; i < frames; ++i) {
      FrameSet frame;
      source.next(frame);
      if (i == 1) frame.silhouettes[2] = {};
      if (i == 2) frame.colors.clear();
      writer.add(NextFrame::success, frame, i == 1 ? "camera 'c' missed" : "");
      sets.push_back(std::move(frame));
    }
    writer.finish();
    return sets;
  }
  fs::path folder_;
};

template <class T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

bool is_same(const FrameSet& a, const FrameSet& b) {
  bool same = a.tick == b.tick && a.time_s == b.time_s && a.truth_volume_m3 == b.truth_volume_m3 &&
              a.silhouettes == b.silhouettes && a.colors.size() == b.colors.size() &&
              a.depths_m.size() == b.depths_m.size();
  for (std::size_t c = 0; same && c < a.colors.size(); ++c) same = a.colors[c].pixels == b.colors[c].pixels;
  for (std::size_t c = 0; same && c < a.depths_m.size(); ++c)
    same = same_bytes(a.depths_m[c].pixels, b.depths_m[c].pixels);
  return same;
}

/// Whoever writes a recording may write any number: kernels would read far beyond their images.
TEST_F(Recording, CamerasAndWorkspacesBeyondReasonAreRefused) {
  const Rig rig = make_synthetic_rig(film().rig);
  int files = 0;
  const auto refusal = [&](const Rig& wrong) {
    const std::string file = path(std::to_string(++files));
    RecordingWriter(file, wrong, 30).finish();
    return message_of([&] { RecordingReader reader(file); });
  };
  EXPECT_EQ(refusal(rig), "");
  for (const double huge : {1e12, 1e38, 1e300}) {
    Rig wrong = rig;
    wrong.depth_cameras[0].fx_px = huge;
    EXPECT_NE(refusal(wrong).find("focal length"), std::string::npos) << refusal(wrong);
    wrong = rig;
    wrong.cameras[1].T_cam_world.t.y = -huge;
    EXPECT_NE(refusal(wrong).find("translation"), std::string::npos) << refusal(wrong);
    wrong = rig;
    wrong.cameras[2].cx_px = huge;
    EXPECT_NE(refusal(wrong).find("principal point"), std::string::npos) << refusal(wrong);
  }
  for (const float huge : {1e7F, 1e38F}) {
    Rig wrong = rig;
    wrong.workspace_m.max.z = huge;
    EXPECT_NE(refusal(wrong).find("workspace"), std::string::npos) << refusal(wrong);
  }
  Rig flat = rig;
  flat.workspace_m.max.x = std::nextafter(flat.workspace_m.min.x, 1e3F);
  EXPECT_NE(refusal(flat).find("workspace"), std::string::npos) << refusal(flat);
}

TEST_F(Recording, GivesTheSetsThatWereWritten) {
  const std::vector<FrameSet> sets = write(path("r"), 4);
  RecordingReader reader(path("r"));
  EXPECT_EQ(reader.damage(), "");
  EXPECT_EQ(reader.fps(), 30);
  ASSERT_EQ(reader.count(), 4);
  const Rig rig = make_synthetic_rig(film().rig);
  ASSERT_EQ(reader.rig().cameras.size(), 3U);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(reader.rig().cameras[c].name, rig.cameras[c].name);
    EXPECT_EQ(reader.rig().cameras[c].center_world(), rig.cameras[c].center_world());
    EXPECT_EQ(reader.rig().cameras[c].fx_px, rig.cameras[c].fx_px);
  }
  FrameSet frame;
  std::string status;
  for (const int i : {0, 1, 2, 3, 1}) {
    ASSERT_EQ(reader.read(i, {}, frame, status), NextFrame::success) << status;
    EXPECT_TRUE(is_same(frame, sets[static_cast<std::size_t>(i)])) << i;
    EXPECT_EQ(status, i == 1 ? "camera 'c' missed" : "");
  }
  reader.read(0, {.colors = false, .depth = false}, frame, status);
  EXPECT_TRUE(frame.colors.empty());
  EXPECT_TRUE(frame.depths_m.empty());
}

TEST_F(Recording, RefusesFramesThatNoReaderTakes) {
  SyntheticSource source(film());
  FrameSet frame;
  source.next(frame);
  RecordingWriter writer(path("r"), source.rig(), {});
  const auto message = [&](auto&& edit) {
    FrameSet edited = frame;
    edit(edited);
    return message_of([&] { writer.add(NextFrame::success, edited, ""); });
  };
  const std::string start =
      "can't record to '" + path("r") + "': frame " + std::to_string(frame.tick) + " has ";
  EXPECT_EQ(message([](FrameSet& f) { f.silhouettes.pop_back(); }), start + "2 masks, expected 3");
  EXPECT_EQ(message([](FrameSet& f) { f.silhouettes[1] = BitMask(3, 2); }).substr(0, start.size() + 12),
            start + "masks of 3x2");
  EXPECT_EQ(message([](FrameSet& f) { f.time_s = NAN; }), start + "no finite time");
  EXPECT_EQ(message([](FrameSet&) {}), "");
  writer.finish();
  EXPECT_EQ(RecordingReader(path("r")).count(), 1) << "nothing else was written";
}

TEST_F(Recording, KeepsTicksWithoutImages) {
  SyntheticSource source(film());
  FrameSet frame;
  {
    RecordingWriter writer(path("r"), source.rig(), {});
    source.next(frame);
    writer.add(NextFrame::success, frame, "");
    frame.time_s = 0.125;
    writer.add(NextFrame::nothing_new, frame, "");
    writer.add(NextFrame::bad_frame, frame, "all asleep");
    writer.finish();
  }
  const std::unique_ptr<FrameSource> replay = open_recording(path("r"));
  EXPECT_EQ(replay->fps(), std::nullopt);
  EXPECT_EQ(replay->next(frame), NextFrame::success);
  EXPECT_EQ(replay->next(frame), NextFrame::nothing_new);
  EXPECT_EQ(frame.time_s, 0.125);
  EXPECT_EQ(replay->next(frame), NextFrame::bad_frame);
  EXPECT_EQ(replay->status(), "all asleep");
  EXPECT_EQ(replay->next(frame), NextFrame::no_more_data);
}

/// As a crash leaves it: cut anywhere, what was whole before is read.
TEST_F(Recording, CutAnywhereGivesTheWholeSetsBefore) {
  write(path("r"), 3);
  const std::string bytes = read_file(path("r"), 1 << 20);
  std::vector<std::size_t> ends;  // of the sets
  for (std::size_t at = 0; (at = bytes.find("TCHK", at)) != std::string::npos; ++at) ends.push_back(at);
  ASSERT_EQ(ends.size(), 5U);  // cameras, three sets, end
  fs::copy_file(path("r"), path("cut"));
  for (std::size_t cut = bytes.size(); cut-- > 0;) {
    fs::resize_file(path("cut"), cut);
    const auto whole =
        static_cast<int>(std::count_if(ends.begin() + 2, ends.end(), [&](auto e) { return e <= cut; }));
    if (cut < ends[1]) {
      EXPECT_THROW(RecordingReader(path("cut")), Error);
      continue;
    }
    RecordingReader reader(path("cut"));
    ASSERT_EQ(reader.count(), whole) << cut;
    EXPECT_NE(reader.damage().find(", at byte "), std::string::npos) << reader.damage();
    FrameSet frame;
    std::string status;
    for (int i = 0; i < whole; ++i) EXPECT_EQ(reader.read(i, {}, frame, status), NextFrame::success);
  }
}

TEST_F(Recording, ADamagedSetIsABadFrameAndNoMore) {
  write(path("r"), 3);
  std::string bytes = read_file(path("r"), 1 << 20);
  std::size_t second = 0;
  for (int chunk = 0; chunk < 3; ++chunk) second = bytes.find("TCHK", second + 1);
  bytes[second + 100] ^= 1;
  std::ofstream(path("r"), std::ios::binary) << bytes;
  const std::unique_ptr<FrameSource> replay = open_recording(path("r"));
  FrameSet frame;
  EXPECT_EQ(replay->next(frame), NextFrame::success);
  EXPECT_EQ(replay->next(frame), NextFrame::bad_frame);
  EXPECT_EQ(replay->status(),
            "frame 1 of recording '" + path("r") + "', at byte " + std::to_string(second) + ", is damaged");
  EXPECT_EQ(replay->next(frame), NextFrame::success);
  EXPECT_EQ(replay->next(frame), NextFrame::no_more_data);
}

/// A chunk's head that is damaged costs that chunk: what follows is found again, and the place is named.
TEST_F(Recording, ADamagedHeadCostsOneFrame) {
  write(path("r"), 4);
  std::string bytes = read_file(path("r"), 1 << 20);
  std::size_t second = 0;
  for (int chunk = 0; chunk < 3; ++chunk) second = bytes.find("TCHK", second + 1);
  for (const std::size_t byte :
       {0U, 5U, 9U, 14U, 20U, 30U}) {  // magic, kind, bytes, hash of the payload, of the head
    std::string damaged = bytes;
    damaged[second + byte] ^= 4;
    std::ofstream(path("damaged"), std::ios::binary) << damaged;
    const std::unique_ptr<FrameSource> replay = open_recording(path("damaged"));
    EXPECT_NE(replay->damage().find("chunk 2 at byte " + std::to_string(second)), std::string::npos)
        << replay->damage();
    FrameSet frame;
    EXPECT_EQ(replay->next(frame), NextFrame::success) << byte;
    EXPECT_EQ(replay->next(frame), NextFrame::bad_frame) << byte;
    EXPECT_EQ(replay->next(frame), NextFrame::success) << byte;
    EXPECT_EQ(replay->next(frame), NextFrame::success) << byte;
    EXPECT_EQ(replay->next(frame), NextFrame::no_more_data) << byte;
  }
}

/// Any one bit of the file: it is said, as an error, as damage or as a bad frame, or the frames are the same.
TEST_F(Recording, EveryFlippedBitIsNoticedOrChangesNothing) {
  write(path("r"), 3);
  const std::string bytes = read_file(path("r"), 1 << 20);
  std::vector<FrameSet> right(3);
  {
    RecordingReader reader(path("r"));
    std::string status;
    for (int i = 0; i < 3; ++i)
      ASSERT_EQ(reader.read(i, {}, right[static_cast<std::size_t>(i)], status), NextFrame::success);
  }
  std::mt19937 random(11);
  std::fstream file(path("r"), std::ios::binary | std::ios::in | std::ios::out);
  const auto flip = [&](std::size_t bit, int mask) {
    file.seekp(static_cast<std::streamoff>(bit / 8)).put(static_cast<char>(bytes[bit / 8] ^ mask)).flush();
  };
  int silent = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const std::size_t bit = random() % (8 * bytes.size());
    flip(bit, 1 << bit % 8);
    try {
      RecordingReader reader(path("r"));
      bool noticed = !reader.damage().empty();
      FrameSet frame;
      std::string status;
      for (int i = 0; i < reader.count() && !noticed; ++i) {
        noticed = reader.read(i, {}, frame, status) == NextFrame::bad_frame;
        if (!noticed && !is_same(frame, right[static_cast<std::size_t>(i)])) ++silent;
      }
      if (!noticed && reader.count() != 3) ++silent;
    } catch (const Error&) {
    }
    flip(bit, 0);
  }
  EXPECT_EQ(silent, 0);
}

/// `cat a.rec b.rec` holds one recording and bytes that nobody reads.
TEST_F(Recording, BytesAfterTheEndAreNoted) {
  write(path("r"), 2);
  const std::uintmax_t size = fs::file_size(path("r"));
  std::ofstream(path("r"), std::ios::binary | std::ios::app) << read_file(path("r"), 1 << 20);
  const RecordingReader reader(path("r"));
  EXPECT_EQ(reader.count(), 2);
  EXPECT_EQ(reader.damage(), std::to_string(size) + " bytes follow its end, at byte " + std::to_string(size));
}

TEST_F(Recording, WhatIsNoneHasOneMessage) {
  write(path("r"), 1);
  EXPECT_EQ(message_of([&] { write(path("r"), 1); }),
            "can't record to '" + path("r") +
                "': it is there already; a recording is not overwritten, give another name");
  std::ofstream(path("text")) << "source: {kind: masks}\n";
  EXPECT_FALSE(is_recording(path("text")));
  EXPECT_TRUE(is_recording(path("r")));
  EXPECT_EQ(
      message_of([&] { open_recording(path("text")); }),
      "can't read recording '" + path("text") + "': it is none; 'tactus run SCENE --record FILE' makes them");
  DataOptions options;
  options.last_frame = 4;
  EXPECT_EQ(message_of([&] { open_recording(path("r"), options); }),
            path("r") +
                ": frames 0-4 are asked for, but the recording holds one frame, number 0; 0- is all "
                "from there");
}

}  // namespace
}  // namespace tactus
