#pragma once
/// Pictures in files: PNG, JPEG, BMP, PBM/PGM/PPM and TIFF, upright as their EXIF orientation says.
#include <cstdint>
#include <string_view>
#include <vector>

namespace tactus {

struct Picture {
  int width_px = 0, height_px = 0;
  int channels = 0;                 ///< 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA
  int bits = 8;                     ///< 8 or 16 each, or 32: floats (TIFF); in the host's byte order
  std::vector<std::uint8_t> bytes;  ///< rows without padding, from the top
  std::size_t pixel_bytes() const { return static_cast<std::size_t>(channels * bits / 8); }
  std::size_t row_bytes() const { return static_cast<std::size_t>(width_px) * pixel_bytes(); }
  /// Takes the memory. @throws Error when the size isn't positive, or above `kMaxPicturePixels`.
  void resize(std::int64_t width, std::int64_t height, int channel_count, int bits_each);
};

/// 16384 x 16384: no camera of a rig has as many, and they take a few hundred megabytes.
constexpr std::uint64_t kMaxPicturePixels = std::uint64_t{1} << 28;

/// @throws Error with the reason: another format, broken, cut short, too large, or samples that are not 1 to
/// 16 bit integers.
Picture decode_picture(std::string_view bytes);

/// @param pixels as in Picture::bytes @param level of zlib, 0 to 9 @throws Error when the picture is empty.
std::vector<std::uint8_t> encode_png(int width_px, int height_px, int channels, int bits, const void* pixels,
                                     int level = 7);

/// Turns and mirrors a picture so that it stands upright.
/// @param orientation of EXIF, 1 (upright) to 8; others change nothing
void make_upright(Picture& picture, int orientation);
/// EXIF's orientation in a block of it ("II*" or "MM*" first), or 1.
int exif_orientation(std::string_view exif);

// One format each; the sizes in headers are checked before memory is taken.
Picture decode_png(std::string_view bytes);
Picture decode_tiff(std::string_view bytes);
/// Which library a build without TIFF lacks, and its package; "": none.
std::string tiff_missing();
Picture decode_bmp(std::string_view bytes);
Picture decode_pnm(std::string_view bytes);

}  // namespace tactus
