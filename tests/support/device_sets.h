#pragma once
/// The device sets that device-parametrised tests run on.
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace tactus::test {
/// {cpu, cpu:3}, with TACTUS_LONG_TESTS cpu:2; with a GPU also {cuda:0, cuda:0,0, cuda:all}. A test that is
/// skipped stands for what is left out.
std::vector<std::string> device_sets();
/// Empty when the set can be opened here, else the reason for GTEST_SKIP.
std::string why_unavailable(const std::string& devices);
/// Test name from a set: "cuda:0,0" -> "cuda_0_0".
std::string device_set_name(const ::testing::TestParamInfo<std::string>& info);
}  // namespace tactus::test

/// First line of a device-parametrised test.
#define TACTUS_SKIP_WITHOUT_DEVICES(devices) \
  if (const std::string why = ::tactus::test::why_unavailable(devices); !why.empty()) GTEST_SKIP() << why

#define TACTUS_INSTANTIATE_DEVICES(Suite)                                                      \
  INSTANTIATE_TEST_SUITE_P(Devices, Suite, ::testing::ValuesIn(::tactus::test::device_sets()), \
                           ::tactus::test::device_set_name)
