#include "tactus/rig/images/depth_images.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/error.h"
#include "tactus/rig/images/image_reading.h"

namespace tactus {

struct DepthUndistortion::Map {
  Index width_px = 0, height_px = 0;
  std::vector<std::int32_t> source;    ///< pixel of the distorted image, or -1
  std::vector<float> radial_per_unit;  ///< metres of radial distance per unit of the image
  DepthErrorTable error;
};

DepthUndistortion::DepthUndistortion(const CalibratedCamera& calibrated, const DepthEncoding& encoding)
    : map_(std::make_unique<Map>()) {
  const Camera& c = calibrated.camera;
  const double limit = calibrated.lens.limit();
  if (!encoding.error.empty() && encoding.error.size_px() != Vec2i{c.width_px, c.height_px}) {
    throw Error("the table of distance errors is of images of " + std::to_string(encoding.error.size_px().x) +
                "x" + std::to_string(encoding.error.size_px().y) + " pixels, these have " +
                std::to_string(c.width_px) + "x" + std::to_string(c.height_px));
  }
  map_->error = encoding.error;
  map_->width_px = c.width_px;
  map_->height_px = c.height_px;
  for (Index y = 0; y < c.height_px; ++y) {
    for (Index x = 0; x < c.width_px; ++x) {
      const double ry = (y - c.cy_px) / c.fy_px, rx = (x - c.cx_px - c.skew_px * ry) / c.fx_px;
      const double radius2 = rx * rx + ry * ry;
      const auto at = photo_pixel(calibrated, c, {static_cast<double>(x), static_cast<double>(y)}, limit);
      const bool known = at && (encoding.metric_radius <= 0 || radius2 <= sqr(encoding.metric_radius));
      const long su = known ? std::lround(at->x) : -1, sv = known ? std::lround(at->y) : -1;
      const bool seen = su >= 0 && sv >= 0 && su < c.width_px && sv < c.height_px;
      map_->source.push_back(seen ? static_cast<std::int32_t>(sv * c.width_px + su) : -1);
      map_->radial_per_unit.push_back(
          static_cast<float>(encoding.unit_m * (encoding.is_radial ? 1 : std::sqrt(1 + radius2))));
    }
  }
}
DepthUndistortion::~DepthUndistortion() = default;
DepthUndistortion::DepthUndistortion(DepthUndistortion&&) noexcept = default;

void DepthUndistortion::radial_m(const Image<std::uint16_t>& raw, DepthImage& result) const {
  if (result.width_px != map_->width_px || result.height_px != map_->height_px)
    result = DepthImage(map_->width_px, map_->height_px);
  for (std::size_t i = 0; i < map_->source.size(); ++i) {
    const std::int32_t from = map_->source[i];
    const auto units = from < 0 ? 0.F : static_cast<float>(raw.pixels[static_cast<std::size_t>(from)]);
    result.pixels[i] = units * map_->radial_per_unit[i];
    if (map_->error.empty() || units <= 0) continue;
    const auto measured_m = static_cast<double>(result.pixels[i]);
    const double error_m = map_->error.error_m(from % map_->width_px, from / map_->width_px, measured_m);
    result.pixels[i] = static_cast<float>(std::max(0.0, measured_m - error_m));
  }
}

Image<std::uint16_t> read_depth_png(const std::string& file, Index width_px, Index height_px) {
  const cv::Mat image = read_image(file, ReadAs::as_is);
  if (image.type() != CV_16UC1) throw Error(file + ": expected distances as 16-bit grey");
  if (image.cols != width_px || image.rows != height_px)
    throw Error(file + ": " + std::to_string(image.cols) + "x" + std::to_string(image.rows) +
                " pixels, expected " + std::to_string(width_px) + "x" + std::to_string(height_px));
  Image<std::uint16_t> result(width_px, height_px);
  for (Index y = 0; y < height_px; ++y) {
    const auto* row = image.ptr<std::uint16_t>(y);
    std::copy(row, row + width_px, &result(0, y));
  }
  return result;
}

}  // namespace tactus
