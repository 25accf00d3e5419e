#include <cstring>
#include <utility>

#include "tactus/media/picture.h"

namespace tactus {

int exif_orientation(std::string_view exif) {
  if (exif.size() < 8 || (exif.substr(0, 2) != "II" && exif.substr(0, 2) != "MM")) return 1;
  const bool little = exif[0] == 'I';
  const auto number = [&](std::size_t at, std::size_t count) {
    std::size_t value = 0;
    for (std::size_t i = 0; i < count; ++i)
      value |= std::size_t{static_cast<std::uint8_t>(exif[at + i])} << 8 * (little ? i : count - 1 - i);
    return value;
  };
  constexpr std::size_t kOrientation = 0x0112, kEntry = 12;
  const std::size_t directory = number(4, 4);
  if (directory > exif.size() - 2) return 1;
  const std::size_t entries = number(directory, 2);
  for (std::size_t i = 0, at = directory + 2; i < entries && at + kEntry <= exif.size(); ++i, at += kEntry) {
    if (number(at, 2) == kOrientation) return static_cast<int>(number(at + 8, 2));
  }
  return 1;
}

void make_upright(Picture& picture, int orientation) {
  if (orientation < 2 || orientation > 8) return;
  const int width = picture.width_px, height = picture.height_px;
  const bool swaps = orientation >= 5;
  const std::size_t pixel = picture.pixel_bytes();
  Picture turned = picture;
  if (swaps) std::swap(turned.width_px, turned.height_px);
  std::uint8_t* to = turned.bytes.data();
  // EXIF names the side of the upright picture on which row 0 and column 0 lie.
  const bool from_right = orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
  const bool from_below = orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
  for (int y = 0; y < turned.height_px; ++y) {
    for (int x = 0; x < turned.width_px; ++x, to += pixel) {
      const int along = swaps ? y : x, across = swaps ? x : y;
      const int column = from_right ? width - 1 - along : along;
      const int row = from_below ? height - 1 - across : across;
      std::memcpy(to,
                  &picture.bytes[static_cast<std::size_t>(row) * picture.row_bytes() +
                                 static_cast<std::size_t>(column) * pixel],
                  pixel);
    }
  }
  picture = std::move(turned);
}

}  // namespace tactus
