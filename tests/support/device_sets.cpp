#include "support/device_sets.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "tactus/compute/device.h"

namespace tactus::test {
namespace {

const std::vector<std::string> kOfGpus{"cuda:0", "cuda:0,0", "cuda:all"};

const bool is_long = std::getenv("TACTUS_LONG_TESTS") != nullptr;

/// Stands for all cases on device sets that a run leaves out, so that they are counted once a program and not
/// once a case.
class CasesElsewhere : public ::testing::Test {
 public:
  CasesElsewhere(std::size_t sets, std::string why) : sets_(sets), why_(std::move(why)) {}
  void TestBody() override {
    const auto& program = *::testing::UnitTest::GetInstance();
    std::size_t cases = 0;
    for (int s = 0; s < program.total_test_suite_count(); ++s) {
      const ::testing::TestSuite& suite = *program.GetTestSuite(s);
      if (!std::string(suite.name()).starts_with("Devices/")) continue;
      for (int t = 0; t < suite.total_test_count(); ++t)
        cases += std::string(suite.GetTestInfo(t)->name()).ends_with("/cpu") ? sets_ : 0;
    }
    // tools/run_tests.py adds these numbers up.
    GTEST_SKIP() << why_ << ": " << cases << " cases";
  }

 private:
  std::size_t sets_;
  std::string why_;
};

void leave_out(const char* name, std::size_t sets, const std::string& why) {
  ::testing::RegisterTest("DeviceSets", name, nullptr, nullptr, __FILE__, __LINE__,
                          [=]() -> ::testing::Test* { return new CasesElsewhere(sets, why); });
}

[[maybe_unused]] const bool is_registered = [] {
  if (!is_long) leave_out("CasesOnTwo", 1, "cpu:2, the ends of cpu:3: set TACTUS_LONG_TESTS=1");
  if (cuda_device_count() == 0)
    leave_out("CasesOnGpus", kOfGpus.size(), "no GPU here (" + cuda_status_text() + ")");
  return true;
}();

}  // namespace

std::vector<std::string> device_sets() {
  std::vector<std::string> sets{"cpu", "cpu:3"};
  if (is_long) sets.insert(sets.begin() + 1, "cpu:2");
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
