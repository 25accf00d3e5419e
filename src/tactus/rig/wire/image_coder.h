#pragma once
/// Silhouettes, soft edges, photographs and distances as bytes, for packets and recordings. Nothing is lost.
#include <string>
#include <vector>

#include "tactus/base/byte_io.h"
#include "tactus/geom/image/image.h"

namespace tactus {

/// No image that is read has more pixels: 8192 x 8192. A photograph of that size takes 192 MB.
constexpr std::uint64_t kMostImagePixels = std::uint64_t{1} << 26;

/// Writes and reads images as
///
///   width (u32), height (u32), coding (u8: 0 as they are, 1 LZ4), bytes stored (u32), those bytes
///
/// The bytes are rows from the top: words of 32 pixels of a mask, red green blue of a photograph. Those of
/// distances are first XORed with the pixel before, then sorted: the first byte of every pixel, then the
/// second ...; so bytes that seldom change lie together.
///
/// Owns scratch memory: after some images of a size, it allocates nothing. One thread calls it.
class ImageCoder {
 public:
  void put(const BitMask& mask, std::string& to);
  void put(const AlphaImage& alpha, std::string& to);
  void put(const ColorImage& color, std::string& to);
  void put(const DepthImage& depth_m, std::string& to);

  /// Reads an image that is either empty or of this size; `image` keeps its memory.
  /// @returns whether it was one. Allocates nothing for an image that its bytes can't hold.
  bool take(ByteReader& from, Vec2i size_px, BitMask& mask);
  bool take(ByteReader& from, Vec2i size_px, AlphaImage& alpha);
  bool take(ByteReader& from, Vec2i size_px, ColorImage& color);
  bool take(ByteReader& from, Vec2i size_px, DepthImage& depth_m);
  /// Steps over an image. @returns whether there was one.
  static bool skip(ByteReader& from);

  /// "", or the missing library and its effect: "LZ4 (liblz4-dev): packets and recordings are larger, ...".
  static std::string missing();

 private:
  struct Head {
    Index width_px = 0, height_px = 0;
    std::uint8_t coding = 0;
    std::string_view stored;
  };
  void put_block(Index width_px, Index height_px, std::string_view bytes, std::string& to);
  static Head take_head(ByteReader& from);
  /// @returns whether the head belongs to an image of `bytes` bytes a pixel times its pixels, or to none.
  static bool fits(const Head& head, Vec2i size_px, std::uint64_t bytes);
  static bool unpack(const Head& head, void* to, std::size_t bytes);
  template <class Image>
  bool take_pixels(ByteReader& from, Vec2i size_px, Image& image);
  std::string packed_, sorted_;
};

}  // namespace tactus
