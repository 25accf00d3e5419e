#include "tactus/frame/frame_on_devices.h"

namespace tactus {

FrameOnDevices::FrameOnDevices(DeviceSet& devices) : devices_(devices), ring_(devices, 1) {
  for (int p = 0; p < devices.count(); ++p) on_device_.emplace_back(devices.device(p), 1);
}

void FrameOnDevices::begin(const FrameParams& params) {
  ring_.next()[0] = params;
  devices_.for_each_part([&](ExecContext& ctx, int p) {
    ctx.upload(ring_.newest(), on_device_[static_cast<std::size_t>(p)].view());
  });
  ring_.sent();
}

void FrameOnDevices::end_block(int substeps) {
  devices_.for_each_part([&](ExecContext& ctx, int p) {
    ctx.parallel_for("frame/end_block", 1,
                     EndBlock{on_device_[static_cast<std::size_t>(p)].view(), substeps});
  });
}

}  // namespace tactus
