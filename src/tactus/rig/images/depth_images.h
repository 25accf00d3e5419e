#pragma once
/// Distances as depth cameras write them: 16-bit images, through a lens, radial or along the optical axis.
#include <memory>
#include <string>

#include "tactus/geom/camera/lens.h"
#include "tactus/geom/image/image.h"
#include "tactus/rig/images/depth_error.h"

namespace tactus {

struct DepthEncoding {
  double unit_m = 1e-3;        ///< metres per unit of the image; 0 in the image: no measurement
  bool is_radial = false;      ///< distance from the camera; else z, along its optical axis
  double metric_radius = 0;    ///< |(x/z, y/z)| up to which the lens model holds; 0: everywhere
  DepthErrorTable error = {};  ///< that is taken off the measured distance; empty: none
};

/// Converts measurements through the lens to radial distances [m] in the pure pinhole's pixels. Takes the
/// nearest pixel, so that no two distances are mixed.
class DepthUndistortion {
 public:
  explicit DepthUndistortion(const CalibratedCamera& camera, const DepthEncoding& encoding = {});
  ~DepthUndistortion();
  DepthUndistortion(DepthUndistortion&&) noexcept;
  void radial_m(const Image<std::uint16_t>& raw, DepthImage& result) const;

 private:
  struct Map;
  std::unique_ptr<Map> map_;
};

/// 16-bit PNG. @throws Error naming the file when it is missing, not 16-bit grey or of another size.
Image<std::uint16_t> read_depth_png(const std::string& file, Index width_px, Index height_px);

}  // namespace tactus
