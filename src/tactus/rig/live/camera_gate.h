#pragma once
/// What a server knows of one camera, and whether it takes a packet of it.
#include <array>
#include <string>

#include "tactus/rig/live/rig_server.h"
#include "tactus/rig/wire/clock_fit.h"
#include "tactus/rig/wire/packet.h"

namespace tactus {

/// As much as comes in a second, and at once half as much again.
class RateLimit {
 public:
  explicit RateLimit(double per_s) : per_s_(per_s), left_(1.5 * per_s) {}
  /// @returns whether so much may come now.
  bool take(double amount, double now_s);

 private:
  double per_s_, left_, last_s_ = 0;
};

/// Checks heads in the order of what costs least: rate, calibration, boot, sequence, clock. Knows no sockets.
class CameraGate {
 public:
  CameraGate(const LiveCamera& camera, const LiveSettings& settings);

  /// Before anything of the packet is looked at.
  Refusal check_rate(std::size_t bytes, double now_s);
  /// @param head as parse_packet_head gave it, of this camera @returns none: `captured_s` is then when the
  /// images were captured, on our clock.
  Refusal check(const PacketHead& head, double now_s, double& captured_s);
  void count(Refusal refusal) { ++status_.refused[static_cast<std::size_t>(refusal)]; }
  /// Its images are in a set whose first capture was then.
  void taken(const CameraImages& images, double captured_s, double set_captured_s);
  const LiveCamera& camera() const { return camera_; }
  LiveCameraStatus status(double now_s) const;

  std::string identity;  ///< of its connection; "" for none

 private:
  static constexpr std::size_t kOldBoots = 16;
  Refusal check_boot(const PacketHead& head);
  LiveCamera camera_;
  RateLimit packets_, bytes_;
  ClockFit clock_;
  bool heard_ = false;
  std::uint64_t boot_ = 0, sequence_ = 0;
  std::array<std::uint64_t, kOldBoots> old_boots_{};
  std::size_t old_boot_count_ = 0;
  LiveCameraStatus status_;
  double second_s_ = 0, packets_now_ = 0, bytes_now_ = 0;  ///< of the second that runs
};

}  // namespace tactus
