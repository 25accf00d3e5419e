#pragma once
/// Devices chosen at run time: the host's cores, virtual devices that hunt for ordering bugs, CUDA GPUs.
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tactus/base/hd.h"

namespace tactus {

enum class DeviceKind : std::uint8_t {
  cpu,          ///< the host's cores; every call runs at once
  virtual_cpu,  ///< a part of the host that plays a device: own memory, deferred queue in random legal order
  cuda,         ///< an NVIDIA GPU
};

/// Which device, before it is opened.
struct DeviceSpec {
  DeviceKind kind = DeviceKind::cpu;
  int ordinal = 0;  ///< GPU number, or number of the virtual device
  friend bool operator==(const DeviceSpec&, const DeviceSpec&) = default;
};

/// Parses `cpu`, `cpu:4` (four virtual devices), `cuda:0`, `cuda:0-3`, `cuda:0,2`, `cuda:all`, `auto` (the
/// first GPU that can run this build, else the CPU; a warning says why a GPU is passed by). A GPU may be
/// named twice (`cuda:0,0`): two parts on one GPU.
/// @throws Error (usage) naming the text and the devices that exist.
std::vector<DeviceSpec> parse_devices(std::string_view text);

/// Facts that `tactus info` prints about one device.
struct DeviceInfo {
  DeviceSpec spec;
  std::string name;                ///< "AMD EPYC", "NVIDIA H200"
  double memory_bytes = 0;         ///< total
  int multiprocessors = 0;         ///< GPU multiprocessors or CPU threads
  std::vector<int> peer_ordinals;  ///< GPUs whose memory it reads directly
  std::string capability;          ///< of a GPU: "8.6"
  std::string code;  ///< of a GPU: where its code comes from, or why there is none and the remedy
  bool usable = true;
};
/// All devices of this machine; the CPU first.
std::vector<DeviceInfo> list_devices();
/// Number of GPUs that can run this build; 0 without a driver or in a CPU-only build.
int cuda_device_count();
/// Driver and runtime version, e.g. "driver 13.0, runtime 13.0"; why CUDA is unavailable otherwise.
std::string cuda_status_text();

class VirtualScheduler;

/// An opened device: memory lives here. Create through DeviceSet (multi_device/) or `open_device`.
class Device {
 public:
  virtual ~Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  DeviceKind kind() const { return spec_.kind; }
  int ordinal() const { return spec_.ordinal; }
  bool is_cuda() const { return spec_.kind == DeviceKind::cuda; }
  /// "cpu", "cpu:1", "cuda:0"
  std::string name() const;
  /// A GPU's multiprocessors, which share the blocks of a kernel. 1 elsewhere.
  virtual int multiprocessors() const { return 1; }

  /// Memory of this device, 256-byte aligned, filled with NaN (0xFF) on virtual devices.
  /// @throws Error naming the size when there is not enough.
  virtual void* allocate(std::size_t bytes) = 0;
  virtual void deallocate(void* memory) noexcept = 0;
  /// Host memory that the device copies from and to without staging.
  virtual void* allocate_host(std::size_t bytes) = 0;
  virtual void deallocate_host(void* memory) noexcept = 0;
  /// nullptr but on virtual devices.
  virtual VirtualScheduler* scheduler() { return nullptr; }

 protected:
  explicit Device(DeviceSpec spec) : spec_(spec) {}

 private:
  DeviceSpec spec_;
};

/// Lets kernels on `reader` read the memory of `owner`; nothing to do but between GPUs. @returns false when
/// the driver says that they can't.
bool enable_peer_access(const Device& reader, const Device& owner);

/// Opens one device. `scheduler`: the queue order shared by the virtual devices of a set; required for those.
std::unique_ptr<Device> open_device(DeviceSpec spec, std::shared_ptr<VirtualScheduler> scheduler = nullptr);

}  // namespace tactus
