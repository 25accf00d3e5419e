#pragma once
/// Photos and masks from files.
#include <string>

#include "tactus/geom/image.h"

namespace tactus {

/// @throws Error naming the file when it is missing or not a whole image.
ColorImage read_photo(const std::string& file);
/// Foreground: alpha (if there is any transparent pixel), else any channel, at least half bright.
/// @throws Error as read_photo; also when the size is not the expected one.
Image<std::uint8_t> read_mask(const std::string& file, Index width_px, Index height_px);

}  // namespace tactus
