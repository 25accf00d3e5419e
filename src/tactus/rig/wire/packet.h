#pragma once
/// A camera's packet of one tick. docs/wire.md has the format.
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "tactus/geom/camera/lens.h"
#include "tactus/rig/wire/image_coder.h"

namespace tactus {

/// A rectangle of pixels; without any: 0.
struct PixelBox {
  Index left_px = 0, top_px = 0, width_px = 0, height_px = 0;
  friend bool operator==(const PixelBox&, const PixelBox&) = default;
};

/// One camera's images of one tick. A depth camera has `depth_m` alone.
struct CameraImages {
  BitMask mask;
  AlphaImage alpha;
  DepthImage depth_m;
  PixelBox photo_box;      ///< of the silhouette
  std::string photo_jpeg;  ///< of that box
};

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

/// Why a packet is refused. `none`: it isn't.
enum class Refusal : std::uint8_t {
  none,
  too_short,       ///< than a head, or than its head says
  too_long,        ///< than its head says, or than images of the camera can be
  not_a_packet,    ///< the first bytes are others
  version,         ///< of another format
  head,            ///< its numbers contradict one another
  no_such_camera,  ///< in this rig
  other_camera,    ///< than the sender's key is for
  calibration,     ///< another one than the rig's
  old_boot,        ///< a number of before the camera's last start
  repeated,        ///< sequence number that was there
  too_many,        ///< packets a second
  too_much,        ///< bytes a second
  late,            ///< its set was released
  ahead,           ///< far beyond the newest set
  payload,         ///< images that can't be unpacked
  clock,           ///< sent more than a second off the estimate of the camera's clock
  other_client,    ///< another client of this camera is heard
  count
};
/// "late", "other camera"
const char* refusal_text(Refusal refusal);
using RefusalCounts = std::array<std::int64_t, static_cast<std::size_t>(Refusal::count)>;

/// Hash of all that decides how images are undistorted: size, camera matrix, lens.
std::uint64_t calibration_hash(const Camera& pinhole, const Lens& lens = {});

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
