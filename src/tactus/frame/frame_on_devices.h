#pragma once
/// The parameters of the frame that runs, in the memory of every device of a set.
#include "tactus/frame/frame_params.h"
#include "tactus/multi_device/upload_ring.h"

namespace tactus {

/// Synchronize the set before this is destroyed.
class FrameOnDevices {
 public:
  explicit FrameOnDevices(DeviceSet& devices);

  /// Sends the parameters of a new frame to all devices. Asynchronous.
  void begin(const FrameParams& params);
  /// A block of so many substeps is over, on all devices. Asynchronous; may be recorded.
  void end_block(int substeps);

  View<const FrameParams> view(int part) const {
    return on_device_[static_cast<std::size_t>(part)].const_view();
  }

 private:
  DeviceSet& devices_;
  UploadRing<FrameParams> ring_;
  Parts<Buffer<FrameParams>> on_device_;
};

}  // namespace tactus
