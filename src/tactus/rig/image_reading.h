#pragma once
/// Image files through OpenCV, with one message for what is wrong with them. For the files of this folder.
#include <opencv2/core/mat.hpp>
#include <string>

namespace tactus {

/// `flags` as of cv::imread. @throws Error naming the file (and the nearest name): missing, cut short or not
/// an image.
cv::Mat read_image(const std::string& file, int flags);

}  // namespace tactus
