/// Checkpoints: what is written is read, and nothing else.
#include "tactus/frame/state_archive.h"

#include <gtest/gtest.h>

#include "support/message_of.h"
#include "tactus/base/error.h"

namespace tactus {
namespace {

using test::message_of;

struct Clock {
  double time_s = 0;
  int frames = 0;
  std::vector<float> x;
  void archive(StateArchive& a) {
    a.set_owner("clock");
    a.value("time", time_s);
    a.value("frames", frames);
    a.values("positions", x);
    if (a.reads()) a.finish();
  }
};

std::string written() {
  StateArchive a;
  Clock clock{1.5, 7, {1, 2, 3}};
  clock.archive(a);
  return a.bytes();
}

TEST(StateArchive, IsReadAsItWasWritten) {
  StateArchive a(written(), "f");
  Clock clock{0, 0, std::vector<float>(3)};
  clock.archive(a);
  EXPECT_EQ(clock.time_s, 1.5);
  EXPECT_EQ(clock.frames, 7);
  EXPECT_EQ(clock.x, (std::vector<float>{1, 2, 3}));
}

/// Lists that are longer now keep what they have behind what was written; nothing may be shorter.
TEST(StateArchive, IsReadByWhatHasMoreCapacity) {
  StateArchive a;
  Clock clock{1.5, 7, {1, 2, 3}};
  clock.archive(a);
  Clock larger{0, 0, {9, 9, 9, 4, 5}};
  StateArchive read = StateArchive::for_larger(a);
  larger.archive(read);
  EXPECT_EQ(larger.frames, 7);
  EXPECT_EQ(larger.x, (std::vector<float>{1, 2, 3, 4, 5}));
  StateArchive again = StateArchive::for_larger(a);
  Clock smaller{0, 0, {9, 9}};
  EXPECT_NE(
      message_of([&] { smaller.archive(again); }, ErrorKind::usage).find("'clock: positions' of 12 bytes"),
      std::string::npos);
}

/// Every file that is not what was written has one message, whatever byte was lost or changed.
TEST(StateArchive, WhatIsNotItIsNamed) {
  const std::string good = written();
  const auto read = [](const std::string& bytes) { return message_of([&] { StateArchive(bytes, "f"); }); };
  EXPECT_EQ(read(""), "f: it is no checkpoint of tactus run");
  EXPECT_EQ(read("ply\nformat ascii 1.0\nelement vertex 3\n"), "f: it is no checkpoint of tactus run");
  for (std::size_t n = 0; n < good.size(); ++n)
    EXPECT_NE(read(good.substr(0, n)).find("f: "), std::string::npos) << n;
  for (std::size_t n = 0; n < good.size(); ++n) {
    std::string changed = good;
    changed[n] = static_cast<char>(changed[n] ^ 4);
    EXPECT_NE(read(changed).find("f: "), std::string::npos) << n;
  }
  EXPECT_NE(read(good + "x").find("it was cut short, or something was added"), std::string::npos);
  std::string newer = good;
  newer[8] = StateArchive::kVersion + 1;
  EXPECT_EQ(read(newer), "f: it is a checkpoint of version " + std::to_string(StateArchive::kVersion + 1) +
                             ", expected " + std::to_string(StateArchive::kVersion) +
                             ": make it anew with this program");
}

TEST(StateArchive, BlocksOfAnotherSceneAreNamed) {
  const auto read = [](Clock clock, bool more) {
    return message_of([&] {
      StateArchive a(written(), "f");
      if (more) a.value("bodies", clock.frames);
      clock.archive(a);
    });
  };
  EXPECT_EQ(read({0, 0, std::vector<float>(4)}, false),
            "f: the checkpoint is of another scene: it has 'clock: positions' of 12 bytes where 'clock: "
            "positions' of 16 bytes was expected");
  EXPECT_EQ(read({0, 0, {}}, true),
            "f: the checkpoint is of another scene: it has 'clock: time' of 8 bytes where "
            "'bodies' of 4 bytes was expected");
}

}  // namespace
}  // namespace tactus
