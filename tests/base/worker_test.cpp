#include "tactus/base/worker.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

#include "support/allocations.h"
#include "tactus/base/timing.h"

namespace tactus {
namespace {

TEST(Worker, JobsRunInOrderOnAnotherThread) {
  std::vector<int> done;
  std::thread::id ran_on;
  Worker worker(2);
  for (int k = 0; k < 100; ++k) {
    worker.add([&, k] {
      done.push_back(k);
      ran_on = std::this_thread::get_id();
    });
  }
  worker.finish();
  ASSERT_EQ(done.size(), 100U);
  for (int k = 0; k < 100; ++k) EXPECT_EQ(done[static_cast<std::size_t>(k)], k);
  EXPECT_NE(ran_on, std::this_thread::get_id());
}

/// One job runs and two wait: the caller is at most three jobs ahead of what is done.
TEST(Worker, TheCallerIsAFewJobsAheadAtMost) {
  std::atomic<int> done = 0;
  Worker worker(2);
  for (int given = 1; given <= 50; ++given) {
    worker.add([&] { ++done; });
    EXPECT_LE(given - done, 3);
  }
  worker.finish();
  EXPECT_EQ(done, 50);
}

TEST(Worker, WhatAJobThrowsComesBackOnceAndEndsTheJobs) {
  int after = 0;
  Worker worker(3);
  std::string message;
  try {
    worker.add([] { throw std::runtime_error("no paint"); });
    worker.add([&] { ++after; });  // throws, when the first job was that fast
    worker.finish();
  } catch (const std::runtime_error& e) {
    message = e.what();
  }
  EXPECT_EQ(message, "no paint");
  EXPECT_EQ(after, 0);
  worker.finish();
}

TEST(Timing, KeepsTheNewestSamplesAlone) {
  Timings timings(true);
  const auto count = static_cast<int>(Timings::kMostSamples);
  for (int k = 0; k < count; ++k) timings.add("stage", 0, 1);
  EXPECT_EQ(timings.percentile_ms("stage", 0), 1000);
  for (int k = 0; k < count; ++k) timings.add("stage", 0, 2);
  EXPECT_EQ(timings.percentile_ms("stage", 0), 2000);
  EXPECT_EQ(timings.count("stage"), Timings::kMostSamples);
  EXPECT_EQ(timings.count("another"), 0U);
  timings.add("stage", 0, 3);
  EXPECT_EQ(timings.last_ms("stage"), 3000);
}

/// Windows run for hours: a stage has all of its memory from its first time on.
TEST(Timing, TakesNoMemoryAfterTheFirstTimeOfAStage) {
  Timings timings;
  timings.add("stage", 0, 1);
  const test::AllocationCount taken;
  for (int k = 0; k < 1000; ++k) timings.add("stage", 0, 1);
  EXPECT_EQ(taken.so_far(), 0);
}

TEST(Timing, SumsWhatAStageTakesInTheSeveralPartsOfAFrame) {
  Timings timings;
  timings.begin_frame();
  timings.add("bodies", 0, 1);
  timings.add("end", 1, 2);
  timings.add("bodies", 2, 4);
  EXPECT_EQ(timings.count("bodies"), 1U);
  EXPECT_EQ(timings.last_ms("bodies"), 3000);
  timings.begin_frame();
  timings.add("bodies", 4, 5);
  EXPECT_EQ(timings.count("bodies"), 2U);
  EXPECT_EQ(timings.last_ms("bodies"), 1000);
  EXPECT_EQ(timings.last_ms("end"), 1000);
}

}  // namespace
}  // namespace tactus
