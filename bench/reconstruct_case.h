#pragma once
/// One built-in figure in front of a synthetic rig, and all that reconstructs it: what the benchmarks of the
/// hull, of the texture and of the paper's tables time.
#include <functional>
#include <optional>
#include <string>

#include "bench.h"
#include "tactus/reconstruct/surface_pipeline.h"
#include "tactus/rig/synthetic/synthetic_source.h"

namespace tactus::bench {

struct CaseOptions {
  std::string figure;  ///< it stands still
  Index resolution = 64;
  bool depth = false;
  std::optional<Index> texture_k{};  ///< photos, normals and colours from so many cameras
  SyntheticRigOptions rig{};         ///< the paper's: 8 cameras 640x480, one depth camera 200x200
};

class ReconstructCase {
 public:
  ReconstructCase(DeviceSet& devices, const CaseOptions& options);

  // All asynchronous.
  void upload();
  void reconstruct();  ///< hull, with depth, and mesh, on all devices
  void upload_photos();
  void shade();  ///< normals and colours of the vertices, on the first device, which has the mesh

  VisualHull& hull() { return surface_.hull(); }
  SurfacePipeline& surface() { return surface_; }
  SurfaceTexture& texture() { return *texture_; }
  const Rig& rig() const { return source_.rig(); }
  const FrameSet& frame() const { return frame_; }
  DeviceSet& devices() { return devices_; }

  /// `body`, and the wait for all devices.
  std::vector<double> timed_ms(const std::function<void()>& body, int least = 30, double seconds = 2);
  /// Milliseconds per run of `body` when several are in flight: the devices' own time, without the wait for
  /// each.
  double batch_ms(const std::function<void()>& body);
  /// Of `body` on one device, several times.
  nlohmann::json kernels_ms(const std::function<void()>& body, int device = 0);
  /// name, case, size, devices, the percentiles of `ms`, and how large mesh and memory are.
  nlohmann::json row(const std::string& name, const std::vector<double>& ms);

 private:
  DeviceSet& devices_;
  CaseOptions options_;
  SyntheticSource source_;
  FrameSet frame_;
  SurfacePipeline surface_;
  std::optional<SurfaceTexture> texture_;
};

}  // namespace tactus::bench
