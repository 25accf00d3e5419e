#include "tactus/multi_device/device_set.h"

#include "tactus/compute/virtual_scheduler.h"

namespace tactus {

DeviceSet::DeviceSet(std::string_view devices, std::uint64_t seed) : name_(devices) {
  const std::vector<DeviceSpec> specs = parse_devices(devices);
  std::shared_ptr<VirtualScheduler> scheduler;
  if (specs.front().kind == DeviceKind::virtual_cpu) scheduler = std::make_shared<VirtualScheduler>(seed);
  for (const DeviceSpec& spec : specs) {
    devices_.push_back(open_device(spec, scheduler));
    contexts_.push_back(std::make_unique<ExecContext>(*devices_.back()));
  }
  for (const auto& reader : devices_) {
    for (const auto& owner : devices_) enable_peer_access(*reader, *owner);
  }
  if (devices == "auto") name_ = devices_.front()->name();
}

void DeviceSet::synchronize() {
  for (const auto& context : contexts_) context->synchronize();
}

std::vector<Slab> split_evenly(Index layers, int parts) {
  std::vector<Slab> slabs;
  Index begin = 0;
  for (int part = 0; part < parts; ++part) {
    const Index size = layers / parts + (part < layers % parts ? 1 : 0);
    slabs.push_back({begin, begin + size});
    begin += size;
  }
  return slabs;
}

}  // namespace tactus
