#include "tactus/compute/device.h"

#include <unistd.h>

#include <charconv>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <new>
#include <thread>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/compute/buffer.h"
#include "tactus/compute/cuda/cuda_backend.h"
#include "tactus/compute/virtual_scheduler.h"

namespace tactus {
namespace {

constexpr std::size_t kAlignment = 256;

/// Memory of the host, for the CPU and for virtual devices.
class HostDevice final : public Device {
 public:
  HostDevice(DeviceSpec spec, std::shared_ptr<VirtualScheduler> scheduler)
      : Device(spec), scheduler_(std::move(scheduler)) {}

  void* allocate(std::size_t bytes) override {
    void* memory = std::aligned_alloc(kAlignment, (bytes + kAlignment) / kAlignment * kAlignment);
    if (memory == nullptr)
      throw Error(name() + ": not enough memory for " + bytes_text(static_cast<double>(bytes)));
    if (kind() == DeviceKind::virtual_cpu) std::memset(memory, 0xFF, bytes);
    return memory;
  }
  void deallocate(void* memory) noexcept override { std::free(memory); }
  void* allocate_host(std::size_t bytes) override { return allocate(bytes); }
  void deallocate_host(void* memory) noexcept override { deallocate(memory); }
  VirtualScheduler* scheduler() override { return scheduler_.get(); }

 private:
  std::shared_ptr<VirtualScheduler> scheduler_;
};

std::string cpu_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "CPU";
}

[[noreturn]] void fail_device(std::string_view text, const std::string& why) {
  std::string exist;
  for (const DeviceInfo& d : list_devices()) {
    const bool gpu = d.spec.kind == DeviceKind::cuda;
    exist += (exist.empty() ? "" : ", ") +
             (gpu ? "cuda:" + std::to_string(d.spec.ordinal) : std::string("cpu")) + " (" + d.name + ")";
  }
  throw usage_error("devices '" + std::string(text) + "': " + why + "; here are: " + exist +
                    " (write cpu, cpu:N, cuda:0, cuda:0-3, cuda:all or auto)");
}

int parse_number(std::string_view digits, std::string_view text) {
  int value = -1;
  const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (code != std::errc() || end != digits.data() + digits.size() || value < 0) {
    std::string why = "'";  // (g++ 12 warns of an overflow in "'" + std::string(digits).)
    why.append(digits).append("' is not a number");
    fail_device(text, why);
  }
  return value;
}

/// The first GPU that can run this build, else the CPU.
DeviceSpec choose_device() {
  std::string why;
  for (int i = 0; i < cuda::device_count(); ++i) {
    const std::string unusable = cuda::why_unusable(i);
    if (unusable.empty()) return {DeviceKind::cuda, i};
    if (why.empty()) why = unusable;
  }
  if (!why.empty()) log_warning(why + "; using the CPU");
  return {DeviceKind::cpu, 0};
}

std::vector<DeviceSpec> parse_cuda(std::string_view list, std::string_view text) {
  const int present = cuda::device_count();
  if (present == 0) fail_device(text, cuda_status_text());
  std::vector<DeviceSpec> specs;
  const auto add = [&](int ordinal) {
    if (ordinal >= present) fail_device(text, "there is no GPU " + std::to_string(ordinal));
    if (const std::string why = cuda::why_unusable(ordinal); !why.empty()) fail_device(text, why);
    specs.push_back({DeviceKind::cuda, ordinal});
  };
  if (list == "all") list = {};
  if (list.empty()) {
    for (int i = 0; i < present; ++i) add(i);
    return specs;
  }
  while (!list.empty()) {
    const std::string_view item = list.substr(0, list.find(','));
    list.remove_prefix(std::min(list.size(), item.size() + 1));
    const std::size_t dash = item.find('-');
    const int first = parse_number(item.substr(0, dash), text);
    const int last = dash == std::string_view::npos ? first : parse_number(item.substr(dash + 1), text);
    if (last < first) fail_device(text, "the range runs backwards");
    for (int i = first; i <= last; ++i) add(i);
  }
  return specs;
}

}  // namespace

std::vector<DeviceSpec> parse_devices(std::string_view text) {
  if (text == "cpu") return {{DeviceKind::cpu, 0}};
  if (text == "auto") return {choose_device()};
  if (text.starts_with("cpu:")) {
    const int count = parse_number(text.substr(4), text);
    if (count < 1 || count > 64) fail_device(text, "between 1 and 64 virtual devices are possible");
    std::vector<DeviceSpec> specs;
    for (int i = 0; i < count; ++i) specs.push_back({DeviceKind::virtual_cpu, i});
    return specs;
  }
  if (text == "cuda") return parse_cuda("all", text);
  if (text.starts_with("cuda:")) return parse_cuda(text.substr(5), text);
  static const std::string kWords[] = {"cpu", "cuda", "auto"};
  const std::string near = nearest_spelling(text.substr(0, text.find(':')), kWords);
  fail_device(text, near.empty() ? "unknown device" : "unknown device; did you mean '" + near + "'?");
}

std::vector<DeviceInfo> list_devices() {
  const double memory =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE));
  std::vector<DeviceInfo> devices{{{DeviceKind::cpu, 0},
                                   cpu_name(),
                                   memory,
                                   static_cast<int>(std::thread::hardware_concurrency()),
                                   {},
                                   {},
                                   {},
                                   true}};
  for (DeviceInfo& gpu : cuda::list_devices()) devices.push_back(std::move(gpu));
  return devices;
}

int cuda_device_count() {
  int usable = 0;
  for (int i = 0; i < cuda::device_count(); ++i) usable += cuda::why_unusable(i).empty() ? 1 : 0;
  return usable;
}
std::string cuda_status_text() { return cuda::status_text(); }

std::string Device::name() const {
  switch (kind()) {
    case DeviceKind::cpu:
      return "cpu";
    case DeviceKind::virtual_cpu:
      return "cpu:" + std::to_string(ordinal());
    case DeviceKind::cuda:
      return "cuda:" + std::to_string(ordinal());
  }
  return "?";
}

std::unique_ptr<Device> open_device(DeviceSpec spec, std::shared_ptr<VirtualScheduler> scheduler) {
  if (spec.kind == DeviceKind::cuda) return cuda::open_device(spec);
  return std::make_unique<HostDevice>(spec, std::move(scheduler));
}

bool enable_peer_access(const Device& reader, const Device& owner) {
  if (!reader.is_cuda() || !owner.is_cuda()) return true;
  return cuda::enable_peer_access(reader.ordinal(), owner.ordinal());
}

std::size_t detail::checked_bytes(std::int64_t count, std::size_t element_size) {
  if (count < 0 || count > std::numeric_limits<Index>::max()) {
    throw Error("a buffer of " + std::to_string(count) + " elements cannot be indexed (at most 2147483647)");
  }
  return static_cast<std::size_t>(count) * element_size;
}

void fail_view_check(Index index, Index extent) {
  throw Error("view check failed: index " + std::to_string(index) + ", extent " + std::to_string(extent));
}

}  // namespace tactus
