#include "tactus/frame/schedule.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "frame/schedule_test_kernels.h"
#include "support/device_sets.h"
#include "support/message_of.h"
#include "tactus/frame/readback.h"

namespace tactus {
using test::message_of;
namespace {

/// Notes the names of stages as they are submitted.
struct Log {
  std::vector<std::string> names;
  Stage stage(std::string name, Rate rate = Rate::end, int every = 1) {
    return {
        .name = name, .timed_as = "all", .rate = rate, .every = every, .submit = [this, name](BlockPlace) {
          names.push_back(name);
        }};
  }
};

TEST(Schedule, OrderFollowsWhatStagesReadAndWrite) {
  DeviceSet devices("cpu");
  Schedule schedule(devices);
  Log log;
  Stage reader = log.stage("reader"), second = log.stage("second update"), first = log.stage("first update"),
        writer = log.stage("writer"), before = log.stage("reader of the last"), other = log.stage("other");
  reader.reads = {"x"};
  second.updates = {"x"};
  first.updates = {"x"};
  writer.writes = {"x"};
  before.reads_last = {"x"};
  for (const Stage& s : {reader, first, second, other, writer, before}) schedule.add(s);
  schedule.close();
  schedule.run({}, false);
  EXPECT_EQ(log.names, (std::vector<std::string>{"other", "reader of the last", "writer", "first update",
                                                 "second update", "reader"}));
}

TEST(Schedule, WhatCannotBeOrderedIsNamed) {
  DeviceSet devices("cpu");
  Log log;
  Stage a = log.stage("a"), b = log.stage("b");
  a.writes = b.reads = {"x"};
  b.writes = a.reads = {"y"};
  {
    Schedule schedule(devices);
    schedule.add(a);
    schedule.add(b);
    EXPECT_EQ(message_of([&] { schedule.close(); }), "the stages 'a', 'b' wait for one another");
  }
  {
    Schedule schedule(devices);
    schedule.add(a);
    EXPECT_EQ(message_of([&] { schedule.close(); }), "stage 'a' reads 'y', which no stage writes");
    EXPECT_EQ(message_of([&] { schedule.add(b); }), "stage 'b': the schedule is closed");
  }
  Schedule schedule(devices);
  schedule.add(a);
  EXPECT_EQ(message_of([&] { schedule.add(a); }), "two stages are named 'a'");
}

/// 43 substeps are blocks of 32 + 8 + 2 + 1 units; a stage of every third needs a multiple of three.
TEST(Schedule, AnyNumberOfSubstepsRunsEachStageAtItsRate) {
  DeviceSet devices("cpu");
  for (const int every : {1, 2, 3}) {
    Schedule schedule(devices);
    Log log;
    schedule.add(log.stage("each", Rate::substep));
    schedule.add(log.stage("some", Rate::substep, every));
    schedule.close();
    EXPECT_EQ(schedule.unit(), every);
    for (int units = 0; units < 50; ++units) {
      log.names.clear();
      schedule.run({.gravity_m_s2 = {}, .substeps = units * every}, false);
      EXPECT_EQ(std::count(log.names.begin(), log.names.end(), "each"), units * every);
      EXPECT_EQ(std::count(log.names.begin(), log.names.end(), "some"), units);
    }
    if (every > 1) {
      EXPECT_THROW(schedule.run({.gravity_m_s2 = {}, .substeps = every + 1}, false), Error);
    }
  }
}

TEST(Schedule, WithoutNewImagesNothingIsReconstructed) {
  DeviceSet devices("cpu");
  Schedule schedule(devices);
  Log log;
  schedule.add(log.stage("upload", Rate::upload));
  schedule.add(log.stage("hull", Rate::capture));
  schedule.add(log.stage("bodies", Rate::end));
  schedule.close();
  schedule.run({}, true);
  schedule.run({}, false);
  EXPECT_EQ(log.names, (std::vector<std::string>{"upload", "hull", "bodies", "bodies"}));
}

/// Step k of p comes once (k + 1) n / p of n substeps are done: 2 in 5 after the third and the fifth, 7 in 3
/// after 1, 1, 2, 2, 3, 3 and 3; stages of no other rate need substeps of their own.
TEST(Schedule, PacedStepsAreSpreadOverTheSubsteps) {
  DeviceSet devices("cpu");
  const auto order = [&](int substeps, int paced, bool has_substeps) {
    Schedule schedule(devices);
    Log log;
    if (has_substeps) schedule.add(log.stage("s", Rate::substep));
    schedule.add(log.stage("p", Rate::paced));
    schedule.close();
    schedule.run({.gravity_m_s2 = {}, .substeps = substeps}, false, {.count = paced, .dt_s = 1});
    std::string all;
    for (const std::string& name : log.names) all += name;
    return all;
  };
  EXPECT_EQ(order(5, 2, true), "ssspssp");
  EXPECT_EQ(order(3, 7, true), "sppsppsppp");
  EXPECT_EQ(order(2, 2, true), "spsp");
  EXPECT_EQ(order(3, 0, true), "sss");
  EXPECT_EQ(order(1, 3, false), "ppp");
  EXPECT_EQ(order(0, 0, false), "");
}

/// Before the substeps that lead to a paced step, what that step needs ahead; where no substeps are in
/// between, too.
TEST(Schedule, EachPacedStepHasItsStagesAhead) {
  DeviceSet devices("cpu");
  Schedule schedule(devices);
  Log log;
  for (const auto& [name, rate] : {std::pair{"s", Rate::substep}, {"p", Rate::paced}, {"a", Rate::ahead}})
    schedule.add(log.stage(name, rate));
  schedule.close();
  std::string all;
  for (const auto& [substeps, paced] : {std::pair{5, 2}, {1, 2}, {2, 0}}) {
    log.names.clear();
    schedule.run({.gravity_m_s2 = {}, .substeps = substeps}, false, {.count = paced, .dt_s = 1});
    for (const std::string& name : log.names) all += name;
    all += " ";
  }
  EXPECT_EQ(all, "assspassp aspap ss ");
}

/// Two rows share the substeps, and what they say sums to what the substeps took: no less than what was
/// slept, no more than went by.
TEST(Schedule, DividesTheTimeOfSubstepsAmongTheirRows) {
  DeviceSet devices("cpu");
  Schedule schedule(devices);
  for (const char* name : {"bodies", "liquid"})
    schedule.add({.name = name, .timed_as = name, .rate = Rate::substep, .submit = [](BlockPlace) {
                    std::this_thread::sleep_for(std::chrono::milliseconds(1));
                  }});
  schedule.close();
  Timings timings;
  const double begin_s = now_s();
  schedule.run({.dt_s = 1, .gravity_m_s2 = {}, .substeps = 6}, true);
  schedule.finish(timings);
  const double bodies_ms = timings.last_ms("bodies"), liquid_ms = timings.last_ms("liquid");
  EXPECT_GT(bodies_ms, 0);
  EXPECT_GT(liquid_ms, 0);
  EXPECT_GE(bodies_ms + liquid_ms, 12);
  EXPECT_LE(bodies_ms + liquid_ms, 1e3 * (now_s() - begin_s));
}

class ScheduleOnDevices : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(ScheduleOnDevices);

/// Substeps. The second frame is the first that replays what was recorded: one that only looks.
constexpr int kFrames[] = {3, 0, 1, 8, 37, 2};
constexpr int kPaced[] = {2, 0, 3, 5, 9, 2};

/// Per substep, each device takes over what the first one sums up of all. Beside substeps, the first goes on
/// from the last paced step, and that step adds this to the sum. A missing wait or a stale recording gives
/// another sum.
double played(DeviceSet& devices, int* recordings = nullptr, bool has_images = true) {
  Schedule schedule(devices);
  Parts<Buffer<double>> own;
  Buffer<double> sum = to_device(devices.context(0), std::vector<double>{1});
  devices.for_each_part(
      [&](ExecContext& ctx, int) { own.push_back(to_device(ctx, std::vector<double>{0})); });
  Buffer<double> ahead = to_device(devices.context(0), std::vector<double>{0}),
                 step = to_device(devices.context(0), std::vector<double>{1});
  Readback readback(devices);
  const Readback::Place place = readback.add(std::as_const(sum).view());
  schedule.add({.name = "ahead",
                .timed_as = "steps",
                .rate = Rate::ahead,
                .updates = {"ahead"},
                .submit = [&](BlockPlace) {
                  devices.context(0).parallel_for(
                      "ahead", 1,
                      DoubleAndAdd{step.const_view(),
                                   ahead.view(),
                                   {.gravity_m_s2 = {}, .frame = schedule.paced_frame().view(0)}});
                }});
  schedule.add({.name = "step",
                .timed_as = "steps",
                .rate = Rate::paced,
                .updates = {"sum"},
                .reads = {"ahead"},
                .submit = [&](BlockPlace) {
                  ExecContext& ctx = devices.context(0);
                  const auto read = [](const Buffer<double>& b) { return b.const_view(); };
                  ctx.parallel_for("step", 1,
                                   SumDevices{.of = {read(ahead), read(sum)}, .count = 2, .to = step.view()});
                  ctx.parallel_for("sum", 1, SumDevices{.of = {read(step)}, .count = 1, .to = sum.view()});
                }});
  schedule.add({.name = "spread",
                .timed_as = "substeps",
                .rate = Rate::substep,
                .devices = StageDevices::all,
                .reads_last = {"sum"},
                .writes = {"own"},
                .submit = [&](BlockPlace) {
                  devices.for_each_part([&](ExecContext& ctx, int p) {
                    ctx.parallel_for("spread", 1,
                                     DoubleAndAdd{std::as_const(sum).view(),
                                                  own[static_cast<std::size_t>(p)].view(),
                                                  {.gravity_m_s2 = {}, .frame = schedule.frame().view(p)}});
                  });
                }});
  schedule.add({.name = "gather",
                .timed_as = "substeps",
                .rate = Rate::substep,
                .writes = {"sum"},
                .reads = {"own"},
                .submit = [&](BlockPlace) {
                  SumDevices kernel{.of = {}, .count = devices.count(), .to = sum.view()};
                  for (std::size_t p = 0; p < own.size(); ++p) kernel.of[p] = own[p].const_view();
                  devices.context(0).parallel_for("gather", 1, kernel);
                }});
  schedule.add({.name = "read back",
                .timed_as = "end",
                .rate = Rate::end,
                .devices = StageDevices::all,
                .submit = [&](BlockPlace) { readback.submit(); }});
  schedule.close();
  Timings timings;
  double result = 0;
  for (std::size_t k = 0; k < std::size(kFrames); ++k) {
    schedule.run({.dt_s = 0.25F * static_cast<float>(k), .gravity_m_s2 = {}, .substeps = kFrames[k]},
                 has_images, {.count = kPaced[k], .dt_s = 0.5F});
    schedule.finish(timings);
    result = 1e-3 * result + readback.get<double>(place)[0];
  }
  EXPECT_EQ(schedule.replays(), devices.is_cuda());
  if (recordings != nullptr) *recordings = schedule.recordings();
  return result;
}

/// The same by hand.
double expected(int devices) {
  double sum = 1, ahead = 0, step = 1, result = 0;
  std::vector<double> own(static_cast<std::size_t>(devices));
  for (std::size_t k = 0; k < std::size(kFrames); ++k) {
    int done = 0;
    const auto substeps = [&](int until) {
      for (; done < until; ++done) {
        for (double& x : own) x = 2 * x + sum + 0.25 * static_cast<double>(k);
        sum = 0;
        for (const double x : own) sum += x;
      }
    };
    for (int p = 0; p < kPaced[k]; ++p) {
      ahead = 2 * ahead + step + 0.5;
      substeps(ceil_div((p + 1) * kFrames[k], kPaced[k]));
      sum = step = ahead + sum;
    }
    substeps(kFrames[k]);
    result = 1e-3 * result + sum;
  }
  return result;
}

TEST_P(ScheduleOnDevices, FramesOfAnyLengthAreRecordedOnce) {
  DeviceSet devices(GetParam());
  if (devices.count() > 1 && !devices.reads_peers()) GTEST_SKIP() << "the devices can't read one another";
  int recordings = 0;
  EXPECT_EQ(played(devices, &recordings), expected(devices.count()));
  EXPECT_EQ(recordings, 1);
}

/// A world without cameras never has images.
TEST_P(ScheduleOnDevices, FramesWithoutImagesAreRecordedToo) {
  DeviceSet devices(GetParam());
  if (devices.count() > 1 && !devices.reads_peers()) GTEST_SKIP() << "the devices can't read one another";
  int recordings = 0;
  EXPECT_EQ(played(devices, &recordings, false), expected(devices.count()));
  EXPECT_EQ(recordings, 1);
}

TEST(Schedule, AnyLegalOrderOfTheDevicesGivesTheSameNumbers) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    DeviceSet devices("cpu:3", seed);
    EXPECT_EQ(played(devices), expected(3)) << "seed " << seed;
  }
}

}  // namespace
}  // namespace tactus
