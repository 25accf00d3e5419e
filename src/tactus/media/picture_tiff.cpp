#include "tactus/base/error.h"
#include "tactus/media/picture.h"

#ifdef TACTUS_WITH_TIFF
#include <tiffio.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string>

namespace tactus {
namespace {

/// The bytes of a file, as libtiff asks for them.
struct Memory {
  std::string_view bytes;
  toff_t at = 0;
};

tsize_t read_some(thandle_t handle, tdata_t to, tsize_t wanted) {
  auto& memory = *static_cast<Memory*>(handle);
  if (memory.at >= memory.bytes.size() || wanted <= 0) return 0;
  const std::size_t count = std::min<std::size_t>(static_cast<std::size_t>(wanted),
                                                  memory.bytes.size() - static_cast<std::size_t>(memory.at));
  std::memcpy(to, memory.bytes.data() + memory.at, count);
  memory.at += count;
  return static_cast<tsize_t>(count);
}
tsize_t write_nothing(thandle_t, tdata_t, tsize_t) { return 0; }
toff_t seek_to(thandle_t handle, toff_t to, int from) {
  auto& memory = *static_cast<Memory*>(handle);
  const toff_t base = from == SEEK_CUR ? memory.at : from == SEEK_END ? memory.bytes.size() : 0;
  return memory.at = base + to;
}
int close_nothing(thandle_t) { return 0; }
toff_t size_of(thandle_t handle) { return static_cast<Memory*>(handle)->bytes.size(); }

struct CloseTiff {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};

std::uint16_t field(TIFF* tiff, std::uint32_t tag, std::uint16_t otherwise) {
  std::uint16_t value = otherwise;
  TIFFGetFieldDefaulted(tiff, tag, &value);
  return value;
}

/// libtiff's own conversion: palettes, YCbCr, planes, tiles, few bits.
void decode_converted(TIFF* tiff, Picture& picture, std::uint32_t width, std::uint32_t height) {
  picture.resize(width, height, 4, 8);
  auto* raster = reinterpret_cast<std::uint32_t*>(picture.bytes.data());
  // Unturned: the picture is made upright like all others.
  if (TIFFReadRGBAImageOriented(tiff, width, height, raster, ORIENTATION_TOPLEFT, 1) != 1)
    throw Error("a TIFF that can't be decoded");
}

}  // namespace

Picture decode_tiff(std::string_view bytes) {
  TIFFSetErrorHandler(nullptr);
  TIFFSetWarningHandler(nullptr);
  Memory memory{bytes};
  const std::unique_ptr<TIFF, CloseTiff> tiff(TIFFClientOpen(
      "picture", "rm", &memory, read_some, write_nothing, seek_to, close_nothing, size_of, nullptr, nullptr));
  if (!tiff) throw Error("a broken TIFF");
  std::uint32_t width = 0, height = 0;
  TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &height);
  const int bits = field(tiff.get(), TIFFTAG_BITSPERSAMPLE, 1);
  const int channels = field(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, 1);
  const int shades = field(tiff.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  const int format = field(tiff.get(), TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
  const bool floats = format == SAMPLEFORMAT_IEEEFP && bits == 32;
  if (!floats && (format != SAMPLEFORMAT_UINT || bits > 16))
    throw Error("a TIFF of " + std::to_string(bits) +
                "-bit numbers, expected 8 or 16 bits without a sign, or floats of 32");
  Picture picture;
  const bool plain = (bits == 8 || bits == 16 || floats) && channels >= 1 && channels <= 4 &&
                     TIFFIsTiled(tiff.get()) == 0 &&
                     field(tiff.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) == PLANARCONFIG_CONTIG &&
                     (shades == PHOTOMETRIC_MINISBLACK || shades == PHOTOMETRIC_RGB);
  if (!plain && floats) throw Error("a TIFF of floats in tiles or planes, expected rows of pixels");
  if (!plain) {
    decode_converted(tiff.get(), picture, width, height);
    return picture;
  }
  picture.resize(width, height, channels, bits);
  if (static_cast<std::size_t>(TIFFScanlineSize(tiff.get())) > picture.row_bytes())
    throw Error("a TIFF whose rows contradict its header");
  for (std::uint32_t y = 0; y < height; ++y) {
    if (TIFFReadScanline(tiff.get(), picture.bytes.data() + y * picture.row_bytes(), y, 0) != 1)
      throw Error("a TIFF that is cut short or broken in row " + std::to_string(y));
  }
  make_upright(picture, field(tiff.get(), TIFFTAG_ORIENTATION, 1));
  return picture;
}

std::string tiff_missing() { return ""; }

}  // namespace tactus

#else

namespace tactus {

Picture decode_tiff(std::string_view) {
  throw Error("a TIFF, which needs " + tiff_missing() + "; install it and build again");
}
std::string tiff_missing() { return "libtiff (libtiff-dev): no TIFF pictures"; }

}  // namespace tactus

#endif
