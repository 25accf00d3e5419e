#include "tactus/compute/cuda/cuda_code.h"

#include <algorithm>
#include <charconv>

namespace tactus::cuda {

BuildCode parse_build_code(std::string_view architectures) {
  BuildCode build;
  while (!architectures.empty()) {
    const std::string_view item = architectures.substr(0, architectures.find_first_of(";,"));
    architectures.remove_prefix(std::min(architectures.size(), item.size() + 1));
    int capability = 0;
    const auto [end, code] = std::from_chars(item.data(), item.data() + item.size(), capability);
    if (code != std::errc()) continue;
    const std::string_view kind(end, static_cast<std::size_t>(item.data() + item.size() - end));
    if (kind != "-virtual") build.binaries.push_back(capability);
    if (kind != "-real") build.ptx.push_back(capability);
  }
  return build;
}

GpuCode code_for(const BuildCode& build, int capability, int driver, int runtime) {
  if (driver / 1000 < runtime / 1000) {
    return {CodeOrigin::none, "the driver is for CUDA " + version_text(driver) + ", this build needs " +
                                  version_text(runtime / 1000 * 1000) + ": update the driver"};
  }
  int best = -1;
  for (const int c : build.binaries) {
    if (c / 10 == capability / 10 && c <= capability) best = std::max(best, c);
  }
  if (best >= 0) return {CodeOrigin::binary, "code for " + capability_text(best)};
  for (const int c : build.ptx) {
    if (c <= capability) best = std::max(best, c);
  }
  std::string has;
  for (const int c : build.binaries) has += (has.empty() ? "" : ", ") + capability_text(c);
  for (const int c : build.ptx) has += (has.empty() ? "" : ", ") + capability_text(c) + " and newer";
  const std::string lacks = "it has compute capability " + capability_text(capability) +
                            ", and this build has code for " + (has.empty() ? "none" : has);
  if (best < 0)
    return {CodeOrigin::none,
            lacks + (capability < 75 ? ": a GPU from 7.5 on is needed" : ": build Tactus on this machine")};
  if (driver < runtime) {
    return {CodeOrigin::none, lacks + ", which a driver for CUDA " + version_text(driver) +
                                  " can't compile: update it to " + version_text(runtime) +
                                  ", or build Tactus on this machine"};
  }
  return {CodeOrigin::ptx,
          "PTX for " + capability_text(best) + ", which the driver compiles at the first start and keeps"};
}

std::string version_text(int version) {
  return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

std::string capability_text(int capability) {
  return std::to_string(capability / 10) + "." + std::to_string(capability % 10);
}

}  // namespace tactus::cuda
