#pragma once
/// Reads image files for OpenCV, with one form of error message. For the files of this folder.
#include <opencv2/core/mat.hpp>
#include <string>

namespace tactus {

enum class ReadAs : std::uint8_t {
  as_is,  ///< 8 or 16 bits, 1 to 4 channels; colours as blue, green, red (and alpha)
  grey,   ///< 8 bits
  color   ///< blue, green, red, 8 bits each
};

/// Takes PNG, JPEG, BMP, PGM, PPM and TIFF of at most 256 megapixels, upright: the size in the header is
/// looked at before the decoder takes memory for it.
/// @throws Error naming the file (and the nearest name): missing, cut short, too large or not an image.
cv::Mat read_image(const std::string& file, ReadAs as);

}  // namespace tactus
