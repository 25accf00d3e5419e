#include "tactus/rig/images/depth_files.h"

#include "tactus/base/error.h"
#include "tactus/rig/rig_file.h"

namespace tactus {

DepthFiles::DepthFiles(const std::string& rig_file, const std::vector<DepthRecording>& recordings) {
  for (const DepthRecording& r : recordings) {
    const Camera& camera = r.calibrated.camera;
    for_camera(rig_file, camera.name, [&] {
      if (r.images.empty())
        throw usage_error("has no 'depth', the 16-bit PNG of the distances or a pattern of them");
      readers_.push_back({camera, NumberedFiles(r.images), DepthUndistortion(r.calibrated, r.encoding)});
      DepthImage first;
      if (readers_.back().files.is_sequence())
        readers_.back().files.numbers();
      else
        read(readers_.back(), 0, first);
    });
  }
}

std::vector<Camera> DepthFiles::cameras() const {
  std::vector<Camera> cameras;
  for (const Reader& reader : readers_) cameras.push_back(reader.camera);
  return cameras;
}

void DepthFiles::read(const Reader& reader, int tick, DepthImage& depth_m) {
  reader.undistort.radial_m(
      read_depth_png(reader.files.file(tick), reader.camera.width_px, reader.camera.height_px), depth_m);
}

void DepthFiles::read(int tick, std::vector<DepthImage>& depths_m, std::string& status) const {
  depths_m.resize(readers_.size());
  for (std::size_t d = 0; d < readers_.size(); ++d) {
    try {
      read(readers_[d], tick, depths_m[d]);
    } catch (const Error& e) {
      depths_m[d] = {};
      status += (status.empty() ? "camera '" : "; camera '") + readers_[d].camera.name + "': " + e.what();
    }
  }
}

}  // namespace tactus
