#pragma once
/// Photographs on the wire: JPEG of the box around the silhouette.
#include <memory>
#include <string>

#include "tactus/rig/wire/packet.h"

namespace tactus {

/// The smallest box with all set pixels, `margin_px` wider on all sides, in the image; 0x0 for an empty mask.
PixelBox silhouette_box(const BitMask& mask, Index margin_px = 0);

/// Packs and unpacks photographs with libjpeg-turbo. One thread calls it.
class PhotoCoder {
 public:
  PhotoCoder();
  ~PhotoCoder();
  PhotoCoder(PhotoCoder&&) noexcept;
  /// The part of a photograph that its silhouette needs. Colours change by a few grey levels.
  /// @param quality 1..100 @returns false where there is nothing to send, or no libjpeg-turbo
  bool pack(const ColorImage& photo, const BitMask& mask, int quality, CameraImages& images);
  /// @param photo becomes of `size_px`; black outside the box
  /// @returns false when the JPEG is damaged or not of the box's size.
  bool unpack(const CameraImages& images, Vec2i size_px, ColorImage& photo);
  /// "", or the missing library and its effect: "libjpeg-turbo (...): live cameras send no photographs".
  static std::string missing();

 private:
  struct Codec;
  std::unique_ptr<Codec> codec_;
};

}  // namespace tactus
