#include "support/device_sets.h"

#include <algorithm>

#include "tactus/compute/device.h"

namespace tactus::test {

std::vector<std::string> device_sets() { return {"cpu", "cpu:2", "cpu:3", "cuda:0", "cuda:0,0", "cuda:all"}; }

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
