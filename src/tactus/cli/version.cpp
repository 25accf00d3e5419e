#include "tactus/cli/version.h"

#include "tactus/compute/device.h"

namespace tactus {

std::string commit_text() { return TACTUS_COMMIT; }

std::string version_number() { return TACTUS_VERSION; }

std::string version_text() {
  return "tactus " TACTUS_VERSION " (commit " + commit_text() + "; CUDA: " + cuda_status_text() + ")";
}

std::string machine_text() {
  std::string text;
  for (const DeviceInfo& d : list_devices()) {
    if (!text.empty()) text += " + ";
    text += d.name;
    if (d.spec.kind == DeviceKind::cpu) text += " (" + std::to_string(d.multiprocessors) + " cores)";
  }
  return text;
}

}  // namespace tactus
