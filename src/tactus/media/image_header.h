#pragma once
/// The size that an image file's header states, read before a decoder takes memory for the image.
#include <cstdint>
#include <optional>
#include <string_view>

namespace tactus {

struct HeaderSize {
  std::uint64_t width_px, height_px;
};
/// Size in the header of a PNG, JPEG, BMP, PBM/PGM/PPM or TIFF file; nothing for other files and broken
/// headers.
std::optional<HeaderSize> size_in_header(std::string_view bytes);

}  // namespace tactus
