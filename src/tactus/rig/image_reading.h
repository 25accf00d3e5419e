#pragma once
/// Image files through OpenCV, with one message for what is wrong with them. For the files of this folder.
#include <opencv2/core/mat.hpp>
#include <string>

namespace tactus {

/// `flags` as of cv::imread. Takes PNG, JPEG, BMP, PGM, PPM and TIFF of at most 256 megapixels: the size in
/// the header is looked at before the decoder takes memory for it.
/// @throws Error naming the file (and the nearest name): missing, cut short, too large or not an image.
cv::Mat read_image(const std::string& file, int flags);

}  // namespace tactus
