#include "tactus/rig/wire/photo_coder.h"

#include <algorithm>
#ifdef TACTUS_WITH_TURBOJPEG
#include <turbojpeg.h>
#endif

namespace tactus {
namespace {

/// Colours beside the contour are looked at when textures are blended.
constexpr Index kMargin_px = 2;

}  // namespace

PixelBox silhouette_box(const BitMask& mask, Index margin_px) {
  Index left = mask.width_px, right = -1, top = mask.height_px, bottom = -1;
  const Index words = mask.words_per_row();
  for (Index y = 0; y < mask.height_px; ++y) {
    for (Index w = 0; w < words; ++w) {
      const std::uint32_t word = mask.words[static_cast<std::size_t>(y * words + w)];
      if (word == 0) continue;
      left = std::min(left, w * 32 + __builtin_ctz(word));
      right = std::max(right, w * 32 + 31 - __builtin_clz(word));
      top = std::min(top, y);
      bottom = y;
    }
  }
  if (right < 0) return {};
  left = std::max(left - margin_px, 0);
  top = std::max(top - margin_px, 0);
  right = std::min(right + margin_px, mask.width_px - 1);
  bottom = std::min(bottom + margin_px, mask.height_px - 1);
  return {left, top, right - left + 1, bottom - top + 1};
}

#ifdef TACTUS_WITH_TURBOJPEG

struct PhotoCoder::Codec {
  tjhandle packs = tjInitCompress(), unpacks = tjInitDecompress();
  std::vector<unsigned char> room;
  ~Codec() {
    if (packs != nullptr) tjDestroy(packs);
    if (unpacks != nullptr) tjDestroy(unpacks);
  }
  Codec() = default;
  Codec(const Codec&) = delete;
  Codec& operator=(const Codec&) = delete;
};

bool PhotoCoder::pack(const ColorImage& photo, const BitMask& mask, int quality, CameraImages& images) {
  images.photo_jpeg.clear();
  images.photo_box = silhouette_box(mask, kMargin_px);
  const PixelBox& box = images.photo_box;
  if (box.width_px == 0 || photo.width_px != mask.width_px || photo.height_px != mask.height_px) return false;
  codec_->room.resize(tjBufSize(box.width_px, box.height_px, TJSAMP_420));
  unsigned char* to = codec_->room.data();
  unsigned long bytes = codec_->room.size();
  const auto* from = reinterpret_cast<const unsigned char*>(&photo(box.left_px, box.top_px));
  if (tjCompress2(codec_->packs, from, box.width_px, photo.width_px * 3, box.height_px, TJPF_RGB, &to, &bytes,
                  TJSAMP_420, quality, TJFLAG_NOREALLOC) != 0)
    return false;
  images.photo_jpeg.assign(reinterpret_cast<const char*>(to), bytes);
  return true;
}

bool PhotoCoder::unpack(const CameraImages& images, Vec2i size_px, ColorImage& photo) {
  const PixelBox& box = images.photo_box;
  const auto* from = reinterpret_cast<const unsigned char*>(images.photo_jpeg.data());
  const auto bytes = static_cast<unsigned long>(images.photo_jpeg.size());
  int width = 0, height = 0, sampling = 0, colours = 0;
  if (tjDecompressHeader3(codec_->unpacks, from, bytes, &width, &height, &sampling, &colours) != 0)
    return false;
  if (width != box.width_px || height != box.height_px) return false;
  photo.width_px = size_px.x;
  photo.height_px = size_px.y;
  photo.pixels.assign(static_cast<std::size_t>(size_px.x) * static_cast<std::size_t>(size_px.y), {});
  auto* to = reinterpret_cast<unsigned char*>(&photo(box.left_px, box.top_px));
  return tjDecompress2(codec_->unpacks, from, bytes, to, width, size_px.x * 3, height, TJPF_RGB, 0) == 0;
}

std::string PhotoCoder::missing() { return ""; }

#else

struct PhotoCoder::Codec {};
bool PhotoCoder::pack(const ColorImage&, const BitMask&, int, CameraImages&) { return false; }
bool PhotoCoder::unpack(const CameraImages&, Vec2i, ColorImage&) { return false; }
std::string PhotoCoder::missing() {
  return "libjpeg-turbo (libturbojpeg0-dev): live cameras send no photographs";
}

#endif

PhotoCoder::PhotoCoder() : codec_(std::make_unique<Codec>()) {}
PhotoCoder::~PhotoCoder() = default;
PhotoCoder::PhotoCoder(PhotoCoder&&) noexcept = default;

}  // namespace tactus
