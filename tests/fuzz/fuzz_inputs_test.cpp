// Seeds and findings of the fuzzers, without a fuzzer: each input is answered, and soon.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>

#include "fuzz/readers.h"
#include "tactus/base/read_file.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;

TEST(FuzzInputs, EveryOneIsAnswered) {
  const fs::path folder = TACTUS_SOURCE_DIR "/tests/fuzz/inputs";
  if (!fs::exists(folder)) GTEST_SKIP() << "the inputs are not here: " << folder;
  for (const char* family :
       {"mesh", "volume", "scene", "calibration", "image", "checkpoint", "recording", "packet", "viewer"}) {
    int count = 0;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder / family)) {
      SCOPED_TRACE(entry.path());
      const auto begin = std::chrono::steady_clock::now();
      EXPECT_NO_THROW(fuzz::read_input(fuzz::family_of(family), read_file(entry.path().string(), 1 << 20)));
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
      EXPECT_LT(took.count(), 10);  // milliseconds; a loop without end took minutes or the memory
      ++count;
    }
    EXPECT_GE(count, 2) << family;
  }
}

}  // namespace
}  // namespace tactus
