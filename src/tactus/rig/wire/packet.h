#pragma once
/// A camera's packet of one tick. docs/wire.md has the format.
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "tactus/geom/camera/lens.h"
#include "tactus/rig/live.h"
#include "tactus/rig/wire/image_coder.h"

namespace tactus {

struct PacketHead {
  static constexpr std::size_t kBytes = 128;
  static constexpr std::size_t kMostNameBytes = 31;
  enum Contents : std::uint8_t { kMask = 1, kAlpha = 2, kDepth = 4, kPhoto = 8 };

  std::string camera;             ///< at most kMostNameBytes
  std::uint8_t contents = 0;      ///< of Contents
  std::uint64_t calibration = 0;  ///< calibration_hash of the camera and lens of the undistortion
  std::uint64_t boot = 0;         ///< of the sender's start: its numbers and clock begin anew with it
  std::uint64_t sequence = 0;     ///< grows with every packet of a boot
  std::int64_t trigger = kNoTrigger;
  double captured_s = 0, sent_s = 0;  ///< on the sender's clock
  Vec2i size_px;                      ///< of the images
  PixelBox photo_box;
  std::uint8_t copies = 1;     ///< connections that it was sent over; 0 means 1
  std::uint32_t replaced = 0;  ///< images since the boot that were newer before they could be sent
  std::uint32_t payload_bytes = 0;

  static constexpr std::int64_t kNoTrigger = -1;
  /// Times within 300 years and numbers that a double holds: sums of them neither overflow nor lose a tick.
  static constexpr double kMostTime_s = 1e10;
  static constexpr std::int64_t kMostTrigger = std::int64_t{1} << 53;
};

/// The same of images that were undistorted from such a lens.
std::uint64_t calibration_hash(const Camera& pinhole, const Lens& lens);

/// Most bytes of a packet of such a camera.
std::size_t packet_limit(Vec2i size_px);

/// Reads the head. Checks all that needs no knowledge of the rig.
Refusal parse_packet_head(std::string_view packet, PacketHead& head);

/// Packs and unpacks whole packets. Owns scratch memory. One thread calls it.
class PacketCoder {
 public:
  /// Replaces `to`. Sets contents, sizes and box of the head from the images.
  void pack(PacketHead& head, const CameraImages& images, std::string& to);
  /// @param head of that packet @returns false when the payload is not as the head says; `images` then mean
  /// nothing. Memory follows `head.size_px`, which must be the rig's.
  bool unpack(std::string_view packet, const PacketHead& head, CameraImages& images);

 private:
  ImageCoder coder_;
};

}  // namespace tactus
