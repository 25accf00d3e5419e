#include <array>
#include <charconv>
#include <optional>
#include <string>

#include "tactus/base/error.h"
#include "tactus/media/picture.h"

namespace tactus {
namespace {

/// Little-endian numbers of a BMP. @throws Error beyond the end.
std::uint32_t number_at(std::string_view bytes, std::size_t at, std::size_t count) {
  if (at + count > bytes.size()) throw Error("cut short");
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count; ++i)
    value |= static_cast<std::uint32_t>(static_cast<std::uint8_t>(bytes[at + i])) << 8 * i;
  return value;
}

/// Words of a PNM's header, and of its pixels where these are text.
class Words {
 public:
  Words(std::string_view bytes, std::size_t at) : bytes_(bytes), at_(at) {}
  void skip_space() {
    while (at_ < bytes_.size()) {
      if (bytes_[at_] == '#')
        while (at_ < bytes_.size() && bytes_[at_] != '\n') ++at_;
      else if (std::string_view(" \t\r\n\v\f").find(bytes_[at_]) == std::string_view::npos)
        return;
      else
        ++at_;
    }
  }
  std::uint32_t next() {
    skip_space();
    std::uint32_t value = 0;
    const char* end = bytes_.data() + bytes_.size();
    const auto [after, error] = std::from_chars(bytes_.data() + at_, end, value);
    if (error != std::errc()) throw Error("cut short, or no number where one was expected");
    at_ = static_cast<std::size_t>(after - bytes_.data());
    return value;
  }
  /// A digit of a PBM: they may stand side by side.
  bool bit() {
    skip_space();
    if (at_ >= bytes_.size()) throw Error("cut short");
    return bytes_[at_++] == '1';
  }
  std::size_t at() const { return at_; }

 private:
  std::string_view bytes_;
  std::size_t at_;
};

void put(Picture& picture, std::size_t sample, std::uint32_t value, std::uint32_t brightest) {
  const bool deep = picture.bits == 16;
  // Values reach from 0 to `brightest`; where that is a full byte or two they stay as they are.
  const std::uint32_t top = deep ? 65535 : 255;
  if (brightest != top && !deep) value = (value * top + brightest / 2) / brightest;
  if (!deep) {
    picture.bytes[sample] = static_cast<std::uint8_t>(std::min(value, top));
    return;
  }
  const auto word = static_cast<std::uint16_t>(std::min(value, top));
  reinterpret_cast<std::uint16_t*>(picture.bytes.data())[sample] = word;
}

}  // namespace

Picture decode_bmp(std::string_view bytes) {
  const std::uint32_t pixels_at = number_at(bytes, 10, 4), header = number_at(bytes, 14, 4);
  if (header < 40) throw Error("a BMP of OS/2, expected one with a header of 40 bytes or more");
  const auto width = static_cast<std::int32_t>(number_at(bytes, 18, 4));
  const auto rows = static_cast<std::int32_t>(number_at(bytes, 22, 4));
  const std::uint32_t depth = number_at(bytes, 28, 2), packing = number_at(bytes, 30, 4);
  const bool masks = packing == 3 && depth == 32;  // taken as blue, green, red, alpha
  if ((packing != 0 && !masks) || (depth != 1 && depth != 8 && depth != 24 && depth != 32))
    throw Error("a packed BMP of " + std::to_string(depth) + " bits, expected 1, 8, 24 or 32, not packed");
  const std::int64_t height = std::abs(static_cast<std::int64_t>(rows));
  Picture picture;
  const std::size_t stride = (static_cast<std::size_t>(width) * depth + 31) / 32 * 4;
  picture.resize(width, height, 3, 8);
  number_at(bytes, pixels_at + stride * static_cast<std::size_t>(height) - 1, 1);  // all rows are there
  bool grey = depth <= 8;
  for (std::int64_t y = 0; y < height; ++y) {
    const std::size_t row = pixels_at + stride * static_cast<std::size_t>(rows > 0 ? height - 1 - y : y);
    for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x) {
      std::size_t from = row + x * depth / 8;
      if (depth <= 8) {
        const auto byte = static_cast<std::uint8_t>(bytes[from]);
        const std::size_t color = depth == 8 ? byte : byte >> (7 - x % 8) & 1U;
        from = 14 + header + 4 * color;
        number_at(bytes, from, 3);
        grey = grey && bytes[from] == bytes[from + 1] && bytes[from] == bytes[from + 2];
      }
      std::uint8_t* to = &picture.bytes[static_cast<std::size_t>(y) * picture.row_bytes() + 3 * x];
      for (std::size_t c = 0; c < 3; ++c) to[c] = static_cast<std::uint8_t>(bytes[from + 2 - c]);
    }
  }
  if (!grey) return picture;
  for (std::size_t i = 0; 3 * i < picture.bytes.size(); ++i) picture.bytes[i] = picture.bytes[3 * i];
  picture.channels = 1;
  picture.bytes.resize(picture.bytes.size() / 3);
  return picture;
}

Picture decode_pnm(std::string_view bytes) {
  const int kind = bytes[1] - '0';
  Words words(bytes, 2);
  const std::uint32_t width = words.next(), height = words.next();
  const bool is_bits = kind == 1 || kind == 4, is_text = kind <= 3;
  const std::uint32_t brightest = is_bits ? 1 : words.next();
  if (brightest < 1 || brightest > 65535) throw Error("a brightest value that isn't 1 to 65535");
  const bool deep = brightest > 255;
  Picture picture;
  picture.resize(width, height, kind == 3 || kind == 6 ? 3 : 1, deep ? 16 : 8);
  const std::size_t samples = picture.bytes.size() / (deep ? 2 : 1);
  if (is_text) {
    for (std::size_t i = 0; i < samples; ++i)
      put(picture, i, is_bits ? (words.bit() ? 0U : 1U) : words.next(), brightest);
    return picture;
  }
  const std::size_t at = words.at() + 1;
  const std::size_t row = is_bits ? (width + 7) / 8 : 0;
  if (at + (is_bits ? row * height : picture.bytes.size()) > bytes.size()) throw Error("cut short");
  const auto byte = [&](std::size_t i) {
    return static_cast<std::uint32_t>(static_cast<std::uint8_t>(bytes[i]));
  };
  for (std::size_t i = 0; i < samples; ++i) {
    if (is_bits)
      put(picture, i, 1 - (byte(at + i / width * row + i % width / 8) >> (7 - i % width % 8) & 1U), 1);
    else
      put(picture, i, deep ? byte(at + 2 * i) * 256 + byte(at + 2 * i + 1) : byte(at + i), brightest);
  }
  return picture;
}

}  // namespace tactus
