#include "tactus/rig/image_reading.h"

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "tactus/base/error.h"
#include "tactus/rig/numbered_files.h"

namespace tactus {
namespace {

/// OpenCV hands out half-read pictures without a word, or prints words of its own: what a file says of its
/// length is looked at first. PNG and JPEG end with a mark, BMP names its size, PGM and PPM follow from
/// theirs.
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

}  // namespace

cv::Mat read_image(const std::string& file, int flags) {
  if (!std::filesystem::is_regular_file(file)) throw Error(file + ": no such image" + suggest_file(file));
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  if (is_cut_short(bytes)) throw Error(file + ": the image is cut short");
  cv::Mat image;
  if (!bytes.empty()) {
    const cv::Mat row(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data()));
    image = cv::imdecode(row, flags);
  }
  if (image.empty()) throw Error(file + ": not an image that can be read");
  return image;
}

}  // namespace tactus
