#include "tactus/media/image_header.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>

namespace tactus {
namespace {

enum class Order { little, big };

/// `n` bytes at `at` as an unsigned number; nothing beyond the end.
std::optional<std::uint64_t> number_at(std::string_view bytes, std::uint64_t at, std::size_t n, Order order) {
  if (at > bytes.size() || bytes.size() - at < n) return {};
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint64_t byte = static_cast<unsigned char>(bytes[static_cast<std::size_t>(at) + i]);
    value |= byte << 8 * (order == Order::little ? i : n - 1 - i);
  }
  return value;
}

std::optional<HeaderSize> both(std::optional<std::uint64_t> width, std::optional<std::uint64_t> height) {
  if (!width || !height) return {};
  return HeaderSize{*width, *height};
}

std::optional<HeaderSize> png_size(std::string_view bytes) {
  if (bytes.substr(12, 4) != "IHDR") return {};  // the first chunk, always
  return both(number_at(bytes, 16, 4, Order::big), number_at(bytes, 20, 4, Order::big));
}

/// Walks the segments to the frame header (SOF0 to SOF15).
std::optional<HeaderSize> jpeg_size(std::string_view bytes) {
  std::uint64_t at = 2;
  for (;;) {
    const auto mark = number_at(bytes, at, 2, Order::big);
    if (!mark || *mark < 0xFF00) return {};
    const std::uint64_t kind = *mark & 0xFFU;
    if (kind == 0xFF) {  // a fill byte
      ++at;
      continue;
    }
    const bool alone = kind == 0x01 || (kind >= 0xD0 && kind <= 0xD8);
    if (alone) {
      at += 2;
      continue;
    }
    const bool frame = kind >= 0xC0 && kind <= 0xCF && kind != 0xC4 && kind != 0xC8 && kind != 0xCC;
    if (frame) return both(number_at(bytes, at + 7, 2, Order::big), number_at(bytes, at + 5, 2, Order::big));
    const auto length = number_at(bytes, at + 2, 2, Order::big);
    if (!length || *length < 2 || kind == 0xD9 || kind == 0xDA) return {};
    at += 2 + *length;
  }
}

std::optional<HeaderSize> bmp_size(std::string_view bytes) {
  const auto header = number_at(bytes, 14, 4, Order::little);
  if (!header) return {};
  if (*header == 12)
    return both(number_at(bytes, 18, 2, Order::little), number_at(bytes, 20, 2, Order::little));
  auto size = both(number_at(bytes, 18, 4, Order::little), number_at(bytes, 22, 4, Order::little));
  // A negative height says that rows go downwards.
  if (size && size->height_px >= 1ULL << 31) size->height_px = (1ULL << 32) - size->height_px;
  return size;
}

/// "P5 640 480 255": words, and comments from '#' to the end of the line.
std::optional<HeaderSize> pnm_size(std::string_view bytes) {
  std::uint64_t found[2] = {};
  std::size_t at = 2;
  for (std::uint64_t& value : found) {
    for (; at < bytes.size() &&
           (std::string_view(" \t\r\n\v\f").find(bytes[at]) != std::string_view::npos || bytes[at] == '#');
         ++at) {
      if (bytes[at] == '#') at = std::min(bytes.find('\n', at), bytes.size() - 1);
    }
    const auto [end, error] = std::from_chars(bytes.data() + at, bytes.data() + bytes.size(), value);
    if (error != std::errc()) return {};
    at = static_cast<std::size_t>(end - bytes.data());
  }
  return HeaderSize{found[0], found[1]};
}

/// ImageWidth (256) and ImageLength (257) of the first directory.
std::optional<HeaderSize> tiff_size(std::string_view bytes) {
  const Order order = bytes[0] == 'I' ? Order::little : Order::big;
  const auto directory = number_at(bytes, 4, 4, order);
  const auto entries = directory ? number_at(bytes, *directory, 2, order) : std::nullopt;
  std::optional<std::uint64_t> width, height;
  for (std::uint64_t i = 0; entries && i < *entries; ++i) {
    const std::uint64_t at = *directory + 2 + 12 * i;
    const auto tag = number_at(bytes, at, 2, order), type = number_at(bytes, at + 2, 2, order);
    if (!tag || !type) return {};
    const auto value = number_at(bytes, at + 8, *type == 3 ? 2 : 4, order);
    if (*tag == 256) width = value;
    if (*tag == 257) height = value;
  }
  return both(width, height);
}

}  // namespace

std::optional<HeaderSize> size_in_header(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG\r\n\x1a\n")) return bytes.size() < 24 ? std::nullopt : png_size(bytes);
  if (bytes.starts_with("\xFF\xD8")) return jpeg_size(bytes);
  if (bytes.starts_with("BM")) return bmp_size(bytes);
  if (bytes.size() > 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '6') return pnm_size(bytes);
  if (bytes.starts_with(std::string_view("II*\0", 4)) || bytes.starts_with(std::string_view("MM\0*", 4)))
    return tiff_size(bytes);
  return {};
}

}  // namespace tactus
