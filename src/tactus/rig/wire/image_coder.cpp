#include "tactus/rig/wire/image_coder.h"

#include <limits>
#ifdef TACTUS_WITH_LZ4
#include <lz4.h>
#endif

namespace tactus {
namespace {

enum Coding : std::uint8_t { kRaw = 0, kLz4 = 1 };

/// LZ4 makes at most that many bytes of one: an image that claims more is refused before memory is taken.
constexpr std::uint64_t kMostExpansion = 255;

template <class T>
std::string_view bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// Byte b of pixel i goes to b n + i.
void sort_bytes(const std::vector<float>& values, std::string& sorted) {
  const std::size_t n = values.size();
  sorted.resize(n * sizeof(float));
  std::uint32_t before = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const auto bits = std::bit_cast<std::uint32_t>(values[i]), change = bits ^ before;
    for (std::size_t b = 0; b < sizeof(float); ++b) sorted[b * n + i] = static_cast<char>(change >> (8 * b));
    before = bits;
  }
}

void unsort_bytes(const std::string& sorted, std::vector<float>& values) {
  const std::size_t n = values.size();
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < n; ++i) {
    std::uint32_t change = 0;
    for (std::size_t b = 0; b < sizeof(float); ++b)
      change |= std::uint32_t{static_cast<unsigned char>(sorted[b * n + i])} << (8 * b);
    values[i] = std::bit_cast<float>(bits ^= change);
  }
}

/// Pixels beyond the last of a row are 0: sums over words count on it.
bool padding_is_clear(const BitMask& mask) {
  const Index words = mask.words_per_row(), used = mask.width_px % 32;
  if (used == 0) return true;
  for (Index y = 0; y < mask.height_px; ++y) {
    const auto last = static_cast<std::size_t>(y * words + words - 1);
    if (mask.words[last] >> used != 0) return false;
  }
  return true;
}

}  // namespace

void ImageCoder::put_block(Index width_px, Index height_px, std::string_view bytes, std::string& to) {
  put_bytes(to, static_cast<std::uint32_t>(width_px));
  put_bytes(to, static_cast<std::uint32_t>(height_px));
  Coding coding = kRaw;
#ifdef TACTUS_WITH_LZ4
  // Packed bytes are kept only where they are fewer: their buffer is one byte shorter.
  if (bytes.size() > 16 && bytes.size() <= LZ4_MAX_INPUT_SIZE) {
    packed_.resize(bytes.size() - 1);
    const int packed = LZ4_compress_default(bytes.data(), packed_.data(), static_cast<int>(bytes.size()),
                                            static_cast<int>(packed_.size()));
    if (packed > 0) {
      coding = kLz4;
      bytes = std::string_view(packed_).substr(0, static_cast<std::size_t>(packed));
    }
  }
#endif
  put_bytes(to, static_cast<std::uint8_t>(coding));
  put_bytes(to, static_cast<std::uint32_t>(bytes.size()));
  to += bytes;
}

void ImageCoder::put(const BitMask& mask, std::string& to) {
  put_block(mask.width_px, mask.height_px, bytes_of(mask.words), to);
}
void ImageCoder::put(const AlphaImage& alpha, std::string& to) {
  put_block(alpha.width_px, alpha.height_px, bytes_of(alpha.pixels), to);
}
void ImageCoder::put(const ColorImage& color, std::string& to) {
  static_assert(sizeof(Rgb8) == 3);
  put_block(color.width_px, color.height_px, bytes_of(color.pixels), to);
}
void ImageCoder::put(const DepthImage& depth_m, std::string& to) {
  sort_bytes(depth_m.pixels, sorted_);
  put_block(depth_m.width_px, depth_m.height_px, sorted_, to);
}

ImageCoder::Head ImageCoder::take_head(ByteReader& from) {
  Head head;
  const auto width = from.take<std::uint32_t>(), height = from.take<std::uint32_t>();
  head.coding = from.take<std::uint8_t>();
  head.stored = from.take(from.take<std::uint32_t>());
  constexpr auto kMostPixels = static_cast<std::uint32_t>(std::numeric_limits<Index>::max());
  if (width > kMostPixels || height > kMostPixels) from.fail();
  head.width_px = static_cast<Index>(width);
  head.height_px = static_cast<Index>(height);
  return head;
}

bool ImageCoder::fits(const Head& head, Vec2i size_px, std::uint64_t bytes) {
  const bool is_empty = head.width_px == 0 && head.height_px == 0 && head.stored.empty();
  if (is_empty) return true;
  if (head.width_px != size_px.x || head.height_px != size_px.y) return false;
  if (static_cast<std::uint64_t>(size_px.x) * static_cast<std::uint64_t>(size_px.y) > kMostImagePixels)
    return false;
  if (head.coding == kRaw) return head.stored.size() == bytes;
  return head.coding == kLz4 && head.stored.size() * kMostExpansion >= bytes;
}

bool ImageCoder::unpack(const Head& head, void* to, std::size_t bytes) {
  if (head.coding == kRaw) {
    if (bytes > 0) std::memcpy(to, head.stored.data(), bytes);
    return true;
  }
#ifdef TACTUS_WITH_LZ4
  return LZ4_decompress_safe(head.stored.data(), static_cast<char*>(to), static_cast<int>(head.stored.size()),
                             static_cast<int>(bytes)) == static_cast<int>(bytes);
#else
  return false;
#endif
}

bool ImageCoder::take(ByteReader& from, Vec2i size_px, BitMask& mask) {
  const Head head = take_head(from);
  const std::uint64_t words = (static_cast<std::uint64_t>(size_px.x) + 31) / 32;
  if (from.failed() || !fits(head, size_px, words * static_cast<std::uint64_t>(size_px.y) * 4)) return false;
  mask.width_px = head.width_px;
  mask.height_px = head.height_px;
  mask.words.resize(static_cast<std::size_t>(mask.words_per_row()) *
                    static_cast<std::size_t>(mask.height_px));
  return unpack(head, mask.words.data(), mask.words.size() * sizeof(std::uint32_t)) && padding_is_clear(mask);
}

/// The pixels of an image whose bytes are in order.
template <class Image>
bool ImageCoder::take_pixels(ByteReader& from, Vec2i size_px, Image& image) {
  using Pixel = std::remove_reference_t<decltype(image.pixels[0])>;
  const Head head = take_head(from);
  const std::uint64_t pixels = static_cast<std::uint64_t>(size_px.x) * static_cast<std::uint64_t>(size_px.y);
  if (from.failed() || !fits(head, size_px, pixels * sizeof(Pixel))) return false;
  image.width_px = head.width_px;
  image.height_px = head.height_px;
  image.pixels.resize(static_cast<std::size_t>(head.width_px) * static_cast<std::size_t>(head.height_px));
  if constexpr (std::is_same_v<Pixel, float>) {
    sorted_.resize(image.pixels.size() * sizeof(Pixel));
    if (!unpack(head, sorted_.data(), sorted_.size())) return false;
    unsort_bytes(sorted_, image.pixels);
    return true;
  } else {
    return unpack(head, image.pixels.data(), image.pixels.size() * sizeof(Pixel));
  }
}

bool ImageCoder::take(ByteReader& from, Vec2i size_px, AlphaImage& alpha) {
  return take_pixels(from, size_px, alpha);
}
bool ImageCoder::take(ByteReader& from, Vec2i size_px, ColorImage& color) {
  return take_pixels(from, size_px, color);
}
bool ImageCoder::take(ByteReader& from, Vec2i size_px, DepthImage& depth_m) {
  return take_pixels(from, size_px, depth_m);
}

bool ImageCoder::skip(ByteReader& from) {
  take_head(from);
  return !from.failed();
}

std::string ImageCoder::missing() {
#ifdef TACTUS_WITH_LZ4
  return "";
#else
  return "LZ4 (liblz4-dev): packets and recordings are larger, and packed ones can't be read";
#endif
}

}  // namespace tactus
