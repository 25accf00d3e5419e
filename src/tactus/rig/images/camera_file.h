#pragma once
/// Photos and masks from files.
#include <string>

#include "tactus/geom/image/image.h"

namespace tactus {

/// @throws Error naming the file when it is missing or not a whole image.
ColorImage read_photo(const std::string& file);
/// Foreground: alpha (if there is any transparent pixel), else any channel, at least half bright. Where
/// nothing is that bright, few values are labels of a segmentation: all but 0 is foreground, and `notice`
/// says so.
/// @throws Error as read_photo; also when the size is not the expected one, or when grey values tell neither
/// foreground nor labels.
Image<std::uint8_t> read_mask(const std::string& file, Index width_px, Index height_px,
                              std::string* notice = nullptr);

}  // namespace tactus
