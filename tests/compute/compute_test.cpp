#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <numeric>
#include <random>
#include <thread>

#include "compute/compute_test_kernels.h"
#include "support/device_sets.h"
#include "tactus/base/math.h"
#include "tactus/compute/cuda/cuda_code.h"
#include "tactus/compute/host_kernel.h"
#include "tactus/multi_device/device_set.h"

namespace tactus::test {
namespace {
/// Of a program without nvcc: not listed in compute_test_kernels.cu.
struct Halve {
  View<float> x;
  void operator()(Index i) const { x[i] *= 0.5F; }
};
}  // namespace
}  // namespace tactus::test
TACTUS_HOST_KERNEL(tactus::test::Halve);

namespace tactus {
namespace {

class Compute : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(Compute);

std::vector<float> ramp(Index n) {
  std::vector<float> x(static_cast<std::size_t>(n));
  std::mt19937 random(7);
  for (float& v : x) v = std::uniform_real_distribution<float>(-2, 2)(random);
  return x;
}

TEST_P(Compute, ForKernelGivesTheBitsOfThePlainLoop) {
  DeviceSet devices(GetParam(), 3);
  const std::vector<float> x = ramp(10'007);
  devices.for_each_part([&](ExecContext& ctx, int) {
    const Buffer<float> in = to_device(ctx, x);
    Buffer<float> out(ctx.device(), in.size());
    ctx.parallel_for("affine", in.size(), test::Affine{in.view(), out.view(), 1.7F, -0.3F});
    const std::vector<float> y = to_host(ctx, out.view());
    for (std::size_t i = 0; i < x.size(); ++i) EXPECT_EQ(y[i], fma(1.7F, x[i], -0.3F) / (1.F + x[i] * x[i]));
  });
}

TEST_P(Compute, BlockKernelSharesMemoryBetweenPhases) {
  DeviceSet devices(GetParam(), 3);
  const std::vector<float> x = ramp(64 * 50);
  devices.for_each_part([&](ExecContext& ctx, int) {
    Buffer<float> data = to_device(ctx, x);
    ctx.parallel_for("reverse", 50, test::ReverseRuns{data.view()});
    const std::vector<float> y = to_host(ctx, data.view());
    for (std::size_t i = 0; i < x.size(); ++i) EXPECT_EQ(y[i], x[i / 64 * 64 + 63 - i % 64]);
  });
}

TEST_P(Compute, CountOnTheDeviceLimitsALaunch) {
  DeviceSet devices(GetParam(), 3);
  ExecContext& ctx = devices.context(0);
  const Buffer<Index> count = to_device(ctx, std::vector<Index>{100});
  const Buffer<float> in = to_device(ctx, ramp(5000));
  Buffer<float> out = to_device(ctx, std::vector<float>(5000, -9.F));
  ctx.parallel_for("affine", Count(count.view(), 5000), test::Affine{in.view(), out.view(), 1.F, 0.F});
  const std::vector<float> y = to_host(ctx, out.view());
  EXPECT_NE(y[99], -9.F);
  EXPECT_EQ(y[100], -9.F);
}

TEST_P(Compute, ScanCompactSort) {
  DeviceSet devices(GetParam(), 3);
  ExecContext& ctx = devices.context(0);
  std::mt19937 random(11);
  std::vector<Index> flags(70'001);
  for (Index& f : flags) f = static_cast<Index>(random() % 3 == 0);
  const Buffer<Index> in = to_device(ctx, flags);
  Buffer<Index> scanned(ctx.device(), in.size()), chosen(ctx.device(), in.size()),
      chosen_count(ctx.device(), 1);
  ctx.exclusive_scan("scan", in.view(), scanned.view());
  ctx.compact("compact", in.view(), chosen.view(), chosen_count.view());
  std::vector<Index> expected_scan(flags.size()), expected_chosen;
  std::exclusive_scan(flags.begin(), flags.end(), expected_scan.begin(), 0);
  for (std::size_t i = 0; i < flags.size(); ++i) {
    if (flags[i] != 0) expected_chosen.push_back(static_cast<Index>(i));
  }
  EXPECT_EQ(to_host(ctx, scanned.view()), expected_scan);
  std::vector<std::uint64_t> wide(flags.size()), expected_wide(flags.size());
  for (std::uint64_t& w : wide) w = std::uint64_t{random()} << 32 | random() % 100;  // sums beyond 2^64
  std::exclusive_scan(wide.begin(), wide.end(), expected_wide.begin(), std::uint64_t{0});
  Buffer<std::uint64_t> words = to_device(ctx, wide);
  ctx.exclusive_scan("scan", words.const_view(), words.view());
  EXPECT_EQ(to_host(ctx, words.view()), expected_wide);
  ASSERT_EQ(to_host(ctx, chosen_count.view())[0], static_cast<Index>(expected_chosen.size()));
  EXPECT_EQ(to_host(ctx, chosen.view().part(0, static_cast<Index>(expected_chosen.size()))), expected_chosen);

  std::vector<std::uint32_t> keys(20'000);
  std::vector<Index> values(keys.size());
  for (auto& k : keys) k = static_cast<std::uint32_t>(random() % 5000);
  std::iota(values.begin(), values.end(), 0);
  Buffer<std::uint32_t> k1 = to_device(ctx, keys), k2(ctx.device(), k1.size());
  Buffer<Index> v1 = to_device(ctx, values), v2(ctx.device(), k1.size());
  ctx.sort_pairs("sort", k1.view(), v1.view(), k2.view(), v2.view(), 24);
  std::stable_sort(values.begin(), values.end(), [&](Index a, Index b) {
    return keys[static_cast<std::size_t>(a)] < keys[static_cast<std::size_t>(b)];
  });
  EXPECT_EQ(to_host(ctx, v1.view()), values);
}

TEST_P(Compute, ScanCompactSortOfAsManyAsTheDeviceKnows) {
  DeviceSet devices(GetParam(), 3);
  ExecContext& ctx = devices.context(0);
  constexpr Index kAll = 40'000;
  for (const Index used : {0, 1, 20'001, kAll}) {
    const Buffer<Index> on_device = to_device(ctx, std::vector<Index>{used});
    const Count count(on_device.view(), kAll);
    std::mt19937 random(12);
    std::vector<Index> flags(kAll), chosen, values(kAll);
    for (Index& f : flags) f = static_cast<Index>(random() % 3 == 0);
    std::vector<Index> sums(static_cast<std::size_t>(used));
    std::exclusive_scan(flags.begin(), flags.begin() + used, sums.begin(), 0);
    for (Index i = 0; i < used; ++i) {
      if (flags[static_cast<std::size_t>(i)] != 0) chosen.push_back(i);
    }
    const Buffer<Index> in = to_device(ctx, flags);
    Buffer<Index> out(ctx.device(), kAll), out_count(ctx.device(), 1);
    ctx.exclusive_scan("scan", count, in.view(), out.view());
    EXPECT_EQ(to_host(ctx, out.view().part(0, used)), sums);
    ctx.compact("compact", count, in.view(), out.view(), out_count.view());
    ASSERT_EQ(to_host(ctx, out_count.view())[0], static_cast<Index>(chosen.size()));
    EXPECT_EQ(to_host(ctx, out.view().part(0, static_cast<Index>(chosen.size()))), chosen);

    std::vector<std::uint32_t> keys(kAll, 5000);  // behind the count: the last key
    for (Index i = 0; i < used; ++i) keys[static_cast<std::size_t>(i)] = random() % 5001;
    std::iota(values.begin(), values.end(), 0);
    Buffer<std::uint32_t> k1 = to_device(ctx, keys), k2(ctx.device(), kAll);
    Buffer<Index> v1 = to_device(ctx, values), v2(ctx.device(), kAll);
    ctx.sort_pairs("sort", count, k1.view(), v1.view(), k2.view(), v2.view(), 24);
    values.resize(static_cast<std::size_t>(used));
    std::stable_sort(values.begin(), values.end(), [&](Index a, Index b) {
      return keys[static_cast<std::size_t>(a)] < keys[static_cast<std::size_t>(b)];
    });
    EXPECT_EQ(to_host(ctx, v1.view().part(0, used)), values);
  }
}

TEST_P(Compute, SumIsOneFixedTree) {
  DeviceSet devices(GetParam(), 3);
  ExecContext& ctx = devices.context(0);
  DeviceSet reference("cpu");
  const std::vector<float> x = ramp(100'003);
  const auto sum_on = [&](ExecContext& c) {
    const Buffer<float> in = to_device(c, x);
    Buffer<float> out(c.device(), 1), scratch(c.device(), in.size() / 256 + 8);
    c.sum("sum", in.view(), out.view(), scratch.view());
    return to_host(c, out.view())[0];
  };
  const float sum = sum_on(ctx);
  EXPECT_EQ(sum, sum_on(reference.context(0)));
  // Pairwise summation: error <= log2(n) eps sum|x| = 17 * 6e-8 * 1e5.
  EXPECT_NEAR(sum, std::accumulate(x.begin(), x.end(), 0.0), 0.11);
}

TEST_P(Compute, GraphReplaysOnNewContents) {
  DeviceSet devices(GetParam(), 3);
  ExecContext& ctx = devices.context(0);
  Buffer<float> data = to_device(ctx, ramp(640));
  const auto body = [&] { ctx.parallel_for("reverse", 10, test::ReverseRuns{data.view()}); };
  Graph graph = ctx.capture(body);
  const std::vector<float> before = to_host(ctx, data.view());
  ctx.launch(graph);
  EXPECT_EQ(to_host(ctx, data.view())[0], before[63]);
  ctx.launch(graph);
  EXPECT_EQ(to_host(ctx, data.view()), before);
}

TEST_P(Compute, HostKernelRunsOnTheCpuAndIsNamedOnAGpu) {
  DeviceSet devices(GetParam(), 3);
  ExecContext& ctx = devices.context(0);
  Buffer<float> x = to_device(ctx, ramp(3000));
  const auto halve = [&] { ctx.parallel_for("my/halve", 3000, test::Halve{x.view()}); };
  if (ctx.device().is_cuda()) {
    EXPECT_THROW(halve(), Error);
    return;
  }
  halve();
  std::vector<float> expected = ramp(3000);
  for (float& value : expected) value *= 0.5F;
  EXPECT_EQ(to_host(ctx, x.view()), expected);
}

/// Every index once, in pieces of at most the grain: of loops that come one after another, of threads that
/// run loops at the same time, and of loops within loops, which get no other threads.
TEST(CpuLoops, VisitEveryIndexOnce) {
  struct Visits {
    std::vector<std::atomic<int>> of;
    Index grain;
    bool nests;
    static void visit(void* data, Index first, Index last) {
      auto& v = *static_cast<Visits*>(data);
      EXPECT_TRUE(last - first <= v.grain || (first == 0 && last == static_cast<Index>(v.of.size())));
      for (Index i = first; i < last; ++i) {
        if (v.nests) {
          Visits inner{std::vector<std::atomic<int>>(50), 7, false};
          detail::cpu_for_ranges(50, 7, visit, &inner);
          inner.expect_one_each();
        }
        ++v.of[static_cast<std::size_t>(i)];
      }
    }
    void expect_one_each() const {
      for (const std::atomic<int>& count : of) EXPECT_EQ(count.load(), 1);
    }
  };
  const auto loops = [](unsigned seed) {
    std::mt19937 random(seed);
    for (int k = 0; k < 2000; ++k) {
      const Index count = std::uniform_int_distribution<Index>(0, 300)(random);
      Visits visits{std::vector<std::atomic<int>>(static_cast<std::size_t>(count)),
                    std::uniform_int_distribution<Index>(1, 20)(random), k % 50 == 0};
      detail::cpu_for_ranges(count, visits.grain, Visits::visit, &visits);
      visits.expect_one_each();
      if (k % 500 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // the threads sleep, too
    }
  };
  std::vector<std::thread> callers;
  for (unsigned c = 0; c < 3; ++c) callers.emplace_back(loops, c);
  for (std::thread& caller : callers) caller.join();
}

/// Views of checked builds throw. Whichever thread met it, the caller hears of it, and the next loop is
/// whole.
TEST(CpuLoops, PassOnWhatABodyThrows) {
  for (Index bad = 0; bad < 200; ++bad) {
    const auto fail_at = [](void* data, Index first, Index last) {
      const Index at = *static_cast<Index*>(data);
      if (first <= at && at < last) throw Error("at " + std::to_string(at));
    };
    EXPECT_THROW(detail::cpu_for_ranges(200, 5, fail_at, &bad), Error);
    Index none = -1;
    EXPECT_NO_THROW(detail::cpu_for_ranges(200, 5, fail_at, &none));
  }
}

TEST(HostKernel, RefusalNamesLaunchAndType) {
  try {
    detail::launch_cuda<test::Halve, sizeof(test::Halve), alignof(test::Halve)>(nullptr, "my/halve", 1,
                                                                                test::Halve{});
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("'my/halve' (tactus::test::Halve)"), std::string::npos) << e.what();
  }
}

TEST(VirtualDevices, AMissingWaitIsSeen) {
  // Part 1 copies what part 0 makes. With the event it is always right; without it some order shows stale
  // memory.
  int wrong_without = 0, wrong_with = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const bool with_wait : {false, true}) {
      DeviceSet devices("cpu:2", seed);
      ExecContext& a = devices.context(0);
      ExecContext& b = devices.context(1);
      Buffer<float> made(a.device(), 256), got(b.device(), 256);
      Event done;
      a.fill_bytes(made.view(), 0);
      a.record(done);
      if (with_wait) b.wait(done);
      b.copy(made.const_view(), got.view());
      const bool wrong = !(to_host(b, got.view())[0] == 0.F);
      (with_wait ? wrong_with : wrong_without) += wrong ? 1 : 0;
      devices.synchronize();
    }
  }
  EXPECT_EQ(wrong_with, 0);
  EXPECT_GT(wrong_without, 0);
}

/// NVIDIA's rules: machine code runs within its major capability from its minor one on; PTX runs on all newer
/// GPUs, where the driver is as new as the compiler; a driver of an older major version runs nothing.
TEST(Devices, CodeFitsOrSaysWhyNot) {
  using cuda::CodeOrigin;
  const cuda::BuildCode hopper = cuda::parse_build_code("90-real"),
                        newcomer = cuda::parse_build_code("75-virtual"),
                        package = cuda::parse_build_code("75-real,80-real,90;75-virtual");
  struct Case {
    const cuda::BuildCode& build;
    int capability, driver, runtime;
    CodeOrigin origin;
    const char* says;
  };
  for (const Case& c : std::initializer_list<Case>{
           {hopper, 90, 13000, 13000, CodeOrigin::binary, "9.0"},
           {hopper, 86, 13000, 13000, CodeOrigin::none, "8.6, and this build has code for 9.0"},
           {hopper, 100, 13000, 13000, CodeOrigin::none, "10.0"},  // another major one
           {newcomer, 75, 13000, 13000, CodeOrigin::ptx, "first start"},
           {newcomer, 120, 13010, 13000, CodeOrigin::ptx, "7.5"},
           {newcomer, 86, 12040, 12060, CodeOrigin::none, "update it to 12.6"},
           {newcomer, 61, 13000, 13000, CodeOrigin::none, "a GPU from 7.5 on"},
           {package, 86, 12040, 12060, CodeOrigin::binary, "8.0"},  // within a major version any driver does
           {package, 90, 13000, 13000, CodeOrigin::binary, "9.0"},
           {package, 90, 12080, 13000, CodeOrigin::none, "needs 13.0: update the driver"},
           {package, 120, 13000, 13000, CodeOrigin::ptx, "9.0"},
       }) {
    const cuda::GpuCode got = cuda::code_for(c.build, c.capability, c.driver, c.runtime);
    EXPECT_EQ(got.origin, c.origin) << c.capability << ": " << got.text;
    EXPECT_NE(got.text.find(c.says), std::string::npos) << got.text;
  }
}

TEST(Devices, BadNamesAreExplained) {
  for (const char* bad : {"cpuu", "cpu:0", "cpu:x", "gpu", "cuda:99", ""}) {
    try {
      parse_devices(bad);
      ADD_FAILURE() << bad << " was accepted";
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::usage);
      EXPECT_NE(std::string(e.what()).find("here are: cpu"), std::string::npos) << e.what();
    }
  }
}

}  // namespace
}  // namespace tactus
