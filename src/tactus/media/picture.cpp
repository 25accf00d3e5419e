#include "tactus/media/picture.h"

#include <turbojpeg.h>

#include <memory>
#include <string>

#include "tactus/base/error.h"
#include "tactus/media/image_header.h"

namespace tactus {
namespace {

/// The EXIF block of a JPEG's APP1 segment, or "".
std::string_view exif_of_jpeg(std::string_view bytes) {
  constexpr std::string_view kMark("Exif\0\0", 6);
  for (std::size_t at = 2; at + 4 <= bytes.size() && static_cast<std::uint8_t>(bytes[at]) == 0xFF;) {
    const auto kind = static_cast<std::uint8_t>(bytes[at + 1]);
    if (kind == 0xFF) {  // a fill byte
      ++at;
      continue;
    }
    if (kind == 0xDA || kind == 0xD9) break;
    const std::size_t length = static_cast<std::size_t>(static_cast<std::uint8_t>(bytes[at + 2])) * 256 +
                               static_cast<std::uint8_t>(bytes[at + 3]);
    const std::string_view segment = bytes.substr(at + 4, length < 2 ? 0 : length - 2);
    if (kind == 0xE1 && segment.starts_with(kMark)) return segment.substr(kMark.size());
    at += 2 + length;
  }
  return {};
}

struct Decoder {
  tjhandle handle = tjInitDecompress();
  Decoder() = default;
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  ~Decoder() { tjDestroy(handle); }
};

Picture decode_jpeg(std::string_view bytes) {
  const Decoder decoder;
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  int width = 0, height = 0, sampling = 0, space = 0;
  if (tjDecompressHeader3(decoder.handle, data, bytes.size(), &width, &height, &sampling, &space) != 0)
    throw Error(tjGetErrorStr2(decoder.handle));
  Picture picture;
  const bool grey = space == TJCS_GRAY;
  const bool inks = space == TJCS_CMYK || space == TJCS_YCCK;
  if (inks) throw Error("a JPEG of inks (CMYK), expected grey or colours");
  picture.resize(width, height, grey ? 1 : 3, 8);
  const int failed = tjDecompress2(decoder.handle, data, bytes.size(), picture.bytes.data(), width, 0, height,
                                   grey ? TJPF_GRAY : TJPF_RGB, 0);
  // A warning tells of bytes between segments, say; the picture is there.
  if (failed != 0 && tjGetErrorCode(decoder.handle) == TJERR_FATAL)
    throw Error(tjGetErrorStr2(decoder.handle));
  make_upright(picture, exif_orientation(exif_of_jpeg(bytes)));
  return picture;
}

}  // namespace

void Picture::resize(std::int64_t width, std::int64_t height, int channel_count, int bits_each) {
  constexpr std::int64_t kMaxSide = 1 << 20;
  if (width <= 0 || height <= 0 || width > kMaxSide || height > kMaxSide ||
      static_cast<std::uint64_t>(width * height) > kMaxPicturePixels)
    throw Error(std::to_string(width) + "x" + std::to_string(height) +
                " pixels, expected 1 to 256 megapixels");
  width_px = static_cast<int>(width);
  height_px = static_cast<int>(height);
  channels = channel_count;
  bits = bits_each;
  bytes.assign(row_bytes() * static_cast<std::size_t>(height_px), 0);
}

Picture decode_picture(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG")) return decode_png(bytes);
  if (bytes.starts_with("\xFF\xD8")) return decode_jpeg(bytes);
  if (bytes.starts_with("BM")) return decode_bmp(bytes);
  if (bytes.starts_with("II*") || bytes.starts_with(std::string_view("MM\0*", 4))) return decode_tiff(bytes);
  if (bytes.size() > 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '6') return decode_pnm(bytes);
  throw Error("expected PNG, JPEG, BMP, PBM, PGM, PPM or TIFF");
}

}  // namespace tactus
