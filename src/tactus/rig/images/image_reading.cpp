#include "tactus/rig/images/image_reading.h"

#include <cstdint>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/media/image_header.h"
#include "tactus/media/picture.h"
#include "tactus/rig/images/numbered_files.h"

namespace tactus {
namespace {

/// 16384 x 16384: more than any camera of a rig has, and a few hundred megabytes.
constexpr std::uint64_t kMaxPixels = std::uint64_t{1} << 28, kMaxSide_px = std::uint64_t{1} << 20;

/// OpenCV hands out half-read pictures without a word, or prints words of its own: the length that a file
/// states is checked first. PNG and JPEG end with a mark, BMP names its size, PGM and PPM follow from theirs.
bool is_cut_short(const std::string& bytes) {
  const std::string tail = bytes.substr(bytes.size() - std::min<std::size_t>(64, bytes.size()));
  if (bytes.starts_with("\x89PNG")) return tail.find("IEND") == std::string::npos;
  if (bytes.starts_with("\xFF\xD8")) return tail.find("\xFF\xD9") == std::string::npos;
  if (bytes.starts_with("BM") && bytes.size() >= 6) {
    std::size_t size = 0;
    for (std::size_t i = 0; i < 4; ++i) size |= std::size_t{static_cast<std::uint8_t>(bytes[2 + i])} << 8 * i;
    return bytes.size() < size;
  }
  std::size_t width = 0, height = 0, brightest = 0;
  int kind = 0, header = 0;
  if (std::sscanf(bytes.c_str(), "P%1d %zu %zu %zu%n", &kind, &width, &height, &brightest, &header) == 4 &&
      (kind == 5 || kind == 6) && std::max(width, height) < 1U << 20) {
    const std::size_t pixel = (kind == 6 ? 3U : 1U) * (brightest > 255 ? 2U : 1U);
    return bytes.size() < static_cast<std::size_t>(header) + 1 + width * height * pixel;
  }
  return false;
}

/// OpenCV's order of colours, and its conversions.
cv::Mat converted(Picture picture, ReadAs as) {
  const cv::Mat from(picture.height_px, picture.width_px,
                     CV_MAKETYPE(picture.bits == 32   ? CV_32F
                                 : picture.bits == 16 ? CV_16U
                                                      : CV_8U,
                                 picture.channels),
                     picture.bytes.data());
  cv::Mat image;
  switch (picture.channels) {
    case 3:
      cv::cvtColor(from, image, cv::COLOR_RGB2BGR);
      break;
    case 4:
      cv::cvtColor(from, image, cv::COLOR_RGBA2BGRA);
      break;
    case 2:  // grey and alpha
      if (as == ReadAs::as_is) {
        std::vector<cv::Mat> parts;
        cv::split(from, parts);
        cv::merge(std::vector<cv::Mat>{parts[0], parts[0], parts[0], parts[1]}, image);
      } else {
        cv::extractChannel(from, image, 0);
      }
      break;
    default:
      image = from.clone();
  }
  if (as == ReadAs::as_is) return image;
  if (image.depth() == CV_16U) image.convertTo(image, CV_8U, 1.0 / 256);
  if (image.depth() == CV_32F) image.convertTo(image, CV_8U, 255);
  const int channels = image.channels();
  if (as == ReadAs::grey && channels > 1)
    cv::cvtColor(image, image, channels == 3 ? cv::COLOR_BGR2GRAY : cv::COLOR_BGRA2GRAY);
  if (as == ReadAs::color && channels != 3)
    cv::cvtColor(image, image, channels == 1 ? cv::COLOR_GRAY2BGR : cv::COLOR_BGRA2BGR);
  return image;
}

}  // namespace

cv::Mat read_image(const std::string& file, ReadAs as) {
  if (!is_file(file)) throw Error(file + ": no such image" + suggest_file(file));
  const std::string bytes = read_file(file, kMaxImageBytes, ReadFrom::regular_file);
  if (is_cut_short(bytes)) throw Error(file + ": the image is cut short");
  const std::optional<HeaderSize> size = size_in_header(bytes);
  if (!size) throw Error(file + ": not an image that can be read, expected PNG, JPEG, BMP, PGM, PPM or TIFF");
  if (size->width_px > kMaxSide_px || size->height_px > kMaxSide_px ||
      size->width_px * size->height_px > kMaxPixels) {
    throw Error(file + ": " + std::to_string(size->width_px) + "x" + std::to_string(size->height_px) +
                " pixels are too many, expected at most " + std::to_string(kMaxPixels >> 20U) +
                " megapixels");
  }
  try {
    return converted(decode_picture(bytes), as);
  } catch (const std::exception& error) {  // Error, std::bad_alloc
    throw Error(file + ": not an image that can be read: " + error.what());
  }
}

}  // namespace tactus
