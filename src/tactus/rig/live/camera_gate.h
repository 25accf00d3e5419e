#pragma once
/// A server's state of one camera, and whether it takes a packet of it.
#include <algorithm>
#include <array>
#include <string>

#include "tactus/rig/live.h"
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

/// Checks heads, the cheapest check first: rate, calibration, boot, sequence, clock. Knows no sockets.
///
/// A camera has one client at a time. While it is heard, packets of another boot are refused; once it has
/// been silent for silence_s(), the next boot takes its place at once, also one that was here before. A
/// packet that was sent more than a second off the clock's estimate is refused; after a second of packets
/// that agree with one another the clock is learnt anew.
class CameraGate {
 public:
  CameraGate(const LiveCamera& camera, const LiveSettings& settings);

  /// Before anything of the packet is looked at.
  Refusal check_rate(std::size_t bytes, double now_s);
  /// @param head as parse_packet_head gave it, of this camera @returns none: `captured_s` is then when the
  /// images were captured, on our clock.
  Refusal check(const PacketHead& head, double now_s, double& captured_s);
  /// @returns how many of its kind there were.
  std::int64_t count(Refusal refusal) { return ++status_.refused[static_cast<std::size_t>(refusal)]; }
  /// Counts a packet that was sent over two connections and came over the other one first.
  void count_copy() { ++status_.copies; }
  /// Whether the client of that boot has the camera, or may take it now.
  bool is_client(std::uint64_t boot, double now_s) const {
    return !heard_ || boot == boot_.id || now_s - heard_s_ >= silence_s();
  }
  /// Whether a hello or question may cost us work now.
  bool take_small_message(double now_s) { return small_.take(1, now_s); }
  /// Its images are in a set whose first capture was then.
  void taken(const CameraImages& images, double captured_s, double set_captured_s);
  const LiveCamera& camera() const { return camera_; }
  LiveCameraStatus status(double now_s) const;

  std::string identity;  ///< of its connection; "" for none

 private:
  static constexpr std::size_t kOldBoots = 16;
  /// A client's start and the last number that came of it.
  struct Boot {
    std::uint64_t id = 0, sequence = 0;
  };
  double silence_s() const { return std::max(0.25, 4 * period_s_); }
  Refusal check_boot(const PacketHead& head, double now_s);
  Refusal check_clock(const PacketHead& head, double now_s);
  LiveCamera camera_;
  double period_s_;
  RateLimit packets_, bytes_, small_;
  ClockFit clock_;
  ClockFit other_clock_;  ///< of refused packets that agree with one another
  int others_agree_ = 0;
  bool heard_ = false;
  double heard_s_ = 0;
  Boot boot_;
  std::array<Boot, kOldBoots> old_boots_{};
  std::size_t old_boot_count_ = 0;
  LiveCameraStatus status_;
  double second_s_ = 0, packets_now_ = 0, bytes_now_ = 0;  ///< of the second that runs
};

}  // namespace tactus
