#include <spng.h>

#include <cstdlib>
#include <memory>
#include <string>

#include "tactus/base/error.h"
#include "tactus/media/picture.h"

namespace tactus {
namespace {

struct FreeContext {
  void operator()(spng_ctx* context) const { spng_ctx_free(context); }
};
using Context = std::unique_ptr<spng_ctx, FreeContext>;

void check(int result) {
  if (result != 0) throw Error(spng_strerror(result));
}

/// The format that keeps all that the file says, and the channels that it has.
int format_of(const spng_ihdr& header, bool has_transparency, int& channels) {
  const bool deep = header.bit_depth == 16;
  switch (header.color_type) {
    case SPNG_COLOR_TYPE_GRAYSCALE:
      channels = 1;
      return deep ? SPNG_FMT_PNG : SPNG_FMT_G8;
    case SPNG_COLOR_TYPE_GRAYSCALE_ALPHA:
      channels = 2;
      return SPNG_FMT_PNG;
    case SPNG_COLOR_TYPE_TRUECOLOR:
      channels = 3;
      return SPNG_FMT_PNG;
    case SPNG_COLOR_TYPE_TRUECOLOR_ALPHA:
      channels = 4;
      return SPNG_FMT_PNG;
    default:  // a palette
      channels = has_transparency ? 4 : 3;
      return has_transparency ? SPNG_FMT_RGBA8 : SPNG_FMT_RGB8;
  }
}

}  // namespace

Picture decode_png(std::string_view bytes) {
  const Context context(spng_ctx_new(0));
  constexpr std::uint32_t kMaxSide = 1U << 20U;
  constexpr std::size_t kMaxChunk = std::size_t{64} << 20U;
  check(spng_set_image_limits(context.get(), kMaxSide, kMaxSide));
  check(spng_set_chunk_limits(context.get(), kMaxChunk, kMaxChunk));
  check(spng_set_png_buffer(context.get(), bytes.data(), bytes.size()));
  spng_ihdr header{};
  check(spng_get_ihdr(context.get(), &header));
  spng_trns transparency{};
  const bool has_transparency = spng_get_trns(context.get(), &transparency) == 0;
  Picture picture;
  int channels = 0;
  const int format = format_of(header, has_transparency, channels);
  picture.resize(header.width, header.height, channels, header.bit_depth == 16 ? 16 : 8);
  std::size_t size = 0;
  check(spng_decoded_image_size(context.get(), format, &size));
  if (size != picture.bytes.size()) throw Error("a PNG whose size contradicts its header");
  check(spng_decode_image(context.get(), picture.bytes.data(), size, format,
                          has_transparency && channels == 4 ? SPNG_DECODE_TRNS : 0));
  spng_exif exif{};
  if (spng_get_exif(context.get(), &exif) == 0)
    make_upright(picture, exif_orientation({exif.data, exif.length}));
  return picture;
}

std::vector<std::uint8_t> encode_png(int width_px, int height_px, int channels, int bits, const void* pixels,
                                     int level) {
  if (width_px <= 0 || height_px <= 0) throw Error("can't encode a PNG: the image is empty");
  const Context context(spng_ctx_new(SPNG_CTX_ENCODER));
  check(spng_set_option(context.get(), SPNG_ENCODE_TO_BUFFER, 1));
  check(spng_set_option(context.get(), SPNG_IMG_COMPRESSION_LEVEL, level));
  constexpr spng_color_type kTypes[] = {SPNG_COLOR_TYPE_GRAYSCALE, SPNG_COLOR_TYPE_GRAYSCALE_ALPHA,
                                        SPNG_COLOR_TYPE_TRUECOLOR, SPNG_COLOR_TYPE_TRUECOLOR_ALPHA};
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(width_px);
  header.height = static_cast<std::uint32_t>(height_px);
  header.bit_depth = static_cast<std::uint8_t>(bits);
  header.color_type = kTypes[channels - 1];
  check(spng_set_ihdr(context.get(), &header));
  const std::size_t size = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) *
                           static_cast<std::size_t>(channels * bits / 8);
  check(spng_encode_image(context.get(), pixels, size, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE));
  std::size_t length = 0;
  int error = 0;
  void* png = spng_get_png_buffer(context.get(), &length, &error);
  check(error);
  std::vector<std::uint8_t> result(static_cast<std::uint8_t*>(png), static_cast<std::uint8_t*>(png) + length);
  std::free(png);
  return result;
}

}  // namespace tactus
