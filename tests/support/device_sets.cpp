#include "support/device_sets.h"

#include <algorithm>

#include "tactus/compute/device.h"

namespace tactus::test {
namespace {

const std::vector<std::string> kOfGpus{"cuda:0", "cuda:0,0", "cuda:all"};

/// Stands for all cases on GPUs where there is none, so that they are counted once a program and not once a
/// case.
class CasesOnGpus : public ::testing::Test {
 public:
  void TestBody() override {
    const auto& program = *::testing::UnitTest::GetInstance();
    int cases = 0;
    for (int s = 0; s < program.total_test_suite_count(); ++s) {
      const ::testing::TestSuite& suite = *program.GetTestSuite(s);
      if (!std::string(suite.name()).starts_with("Devices/")) continue;
      for (int t = 0; t < suite.total_test_count(); ++t)
        if (std::string(suite.GetTestInfo(t)->name()).ends_with("/cpu"))
          cases += static_cast<int>(kOfGpus.size());
    }
    // tools/run_tests.py adds these numbers up.
    GTEST_SKIP() << "no GPU here (" << cuda_status_text() << "): " << cases << " cases";
  }
};

[[maybe_unused]] const auto* const is_registered = [] {
  if (cuda_device_count() > 0) return static_cast<::testing::TestInfo*>(nullptr);
  return ::testing::RegisterTest("DeviceSets", "CasesOnGpus", nullptr, nullptr, __FILE__, __LINE__,
                                 []() -> ::testing::Test* { return new CasesOnGpus; });
}();

}  // namespace

std::vector<std::string> device_sets() {
  std::vector<std::string> sets{"cpu", "cpu:2", "cpu:3"};
  if (cuda_device_count() > 0) sets.insert(sets.end(), kOfGpus.begin(), kOfGpus.end());
  return sets;
}

std::string why_unavailable(const std::string& devices) {
  if (devices.starts_with("cuda") && cuda_device_count() == 0)
    return devices + " is not here: " + cuda_status_text();
  return "";
}

std::string device_set_name(const ::testing::TestParamInfo<std::string>& info) {
  std::string name = info.param;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == ':' || c == ',' || c == '-'; }, '_');
  return name;
}

}  // namespace tactus::test
