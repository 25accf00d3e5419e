#pragma once
/// The depth images of a rig file's depth cameras.
#include <string>
#include <vector>

#include "tactus/rig/images/depth_images.h"
#include "tactus/rig/images/numbered_files.h"
#include "tactus/rig/sources/frame_source.h"

namespace tactus {

/// One depth camera of a rig file and its images: one, or a sequence.
struct DepthRecording {
  CalibratedCamera calibrated;
  std::string images;  ///< "": it is live
  std::string device;
  DepthEncoding encoding;
};

class DepthFiles {
 public:
  /// @throws Error naming rig file, camera and image when a sequence has no file or the one image can't be
  /// used.
  DepthFiles(const std::string& rig_file, const std::vector<DepthRecording>& recordings);
  std::vector<Camera> cameras() const;
  /// Reads one image per camera. One that can't be used is empty, and `status` gets a line that says why.
  void read(int tick, std::vector<DepthImage>& depths_m, std::string& status) const;

 private:
  struct Reader {
    Camera camera;
    NumberedFiles files;
    DepthUndistortion undistort;
  };
  static void read(const Reader& reader, int tick, DepthImage& depth_m);
  std::vector<Reader> readers_;
};

}  // namespace tactus
