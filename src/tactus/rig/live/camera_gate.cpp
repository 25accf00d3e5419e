#include "tactus/rig/live/camera_gate.h"

#include <algorithm>
#include <cmath>

namespace tactus {
namespace {

/// Images are sent at once: one that was captured longer before is of a clock that jumped.
constexpr double kOldest_s = 1, kSkew_s = 0.001;
/// Packets a second over the rig's.
constexpr double kMostRate = 4;
/// Hellos a second: a client says one when it connects.
constexpr double kMostSmall_1_s = 20;
/// A clock's estimate is off by the way's jumps at most.
constexpr double kClockWithin_s = 1;

bool agrees(const ClockFit& clock, double sent_s, double now_s) {
  return std::abs(clock.to_ours(sent_s) - now_s) <= kClockWithin_s;
}

}  // namespace

bool RateLimit::take(double amount, double now_s) {
  left_ = std::min(1.5 * per_s_, left_ + (now_s - last_s_) * per_s_);
  last_s_ = now_s;
  if (amount > left_) return false;
  left_ -= amount;
  return true;
}

CameraGate::CameraGate(const LiveCamera& camera, const LiveSettings& settings)
    : camera_(camera),
      period_s_(1 / settings.fps),
      packets_(kMostRate * settings.fps),
      bytes_(settings.bytes_per_s),
      small_(kMostSmall_1_s) {
  status_.name = camera.name;
}

Refusal CameraGate::check_rate(std::size_t bytes, double now_s) {
  if (now_s - second_s_ >= 1) {
    const double seconds = second_s_ > 0 ? now_s - second_s_ : 1;
    status_.packets_per_s = packets_now_ / seconds;
    status_.bytes_per_s = bytes_now_ / seconds;
    second_s_ = now_s;
    packets_now_ = bytes_now_ = 0;
  }
  ++packets_now_;
  bytes_now_ += static_cast<double>(bytes);
  ++status_.packets;
  if (!packets_.take(1, now_s)) return Refusal::too_many;
  return bytes_.take(static_cast<double>(bytes), now_s) ? Refusal::none : Refusal::too_much;
}

Refusal CameraGate::check_boot(const PacketHead& head, double now_s) {
  if (!heard_ || head.boot != boot_.id) {
    const auto end = old_boots_.begin() + static_cast<std::ptrdiff_t>(std::min(old_boot_count_, kOldBoots));
    const auto old = std::find_if(old_boots_.begin(), end, [&](const Boot& b) { return b.id == head.boot; });
    if (old != end && head.sequence <= old->sequence) return Refusal::old_boot;
    if (!is_client(head.boot, now_s)) return Refusal::other_client;
    if (heard_) (old != end ? *old : old_boots_[old_boot_count_++ % kOldBoots]) = boot_;
    heard_ = true;
    boot_ = {head.boot, head.sequence};
    clock_.reset();
  } else {
    if (head.sequence <= boot_.sequence) return Refusal::repeated;
    status_.lost +=
        static_cast<std::int64_t>(std::min<std::uint64_t>(head.sequence - boot_.sequence - 1, 1'000'000));
  }
  boot_.sequence = head.sequence;
  heard_s_ = now_s;
  return Refusal::none;
}

Refusal CameraGate::check_clock(const PacketHead& head, double now_s) {
  if (clock_.is_known() && !agrees(clock_, head.sent_s, now_s)) {
    if (!other_clock_.is_known() || !agrees(other_clock_, head.sent_s, now_s)) {
      other_clock_.reset();
      others_agree_ = 0;
    }
    other_clock_.add(head.sent_s, now_s);
    if (++others_agree_ * period_s_ < kClockWithin_s) return Refusal::clock;
    clock_ = other_clock_;
  } else {
    clock_.add(head.sent_s, now_s);
  }
  other_clock_.reset();
  others_agree_ = 0;
  return Refusal::none;
}

Refusal CameraGate::check(const PacketHead& head, double now_s, double& captured_s) {
  const bool is_depth = head.contents == PacketHead::kDepth;
  if (is_depth != camera_.is_depth || head.size_px.x != camera_.size_px.x ||
      head.size_px.y != camera_.size_px.y)
    return Refusal::head;
  if (head.calibration != camera_.calibration) return Refusal::calibration;
  const double age_s = head.sent_s - head.captured_s;
  if (!(age_s >= -kSkew_s && age_s <= kOldest_s)) return Refusal::head;
  if (const Refusal refusal = check_boot(head, now_s); refusal != Refusal::none) return refusal;
  status_.replaced = head.replaced;
  if (const Refusal refusal = check_clock(head, now_s); refusal != Refusal::none) return refusal;
  captured_s = std::clamp(clock_.to_ours(head.captured_s), now_s - kOldest_s - kClockWithin_s, now_s);
  return Refusal::none;
}

void CameraGate::taken(const CameraImages& images, double captured_s, double set_captured_s) {
  ++status_.in_sets;
  status_.skew_ms = 1e3 * (captured_s - set_captured_s);
  const double pixels = static_cast<double>(camera_.size_px.x) * static_cast<double>(camera_.size_px.y);
  const auto set = camera_.is_depth
                       ? std::count_if(images.depth_m.pixels.begin(), images.depth_m.pixels.end(),
                                       [](float d) { return d > 0; })
                       : images.mask.area_px();
  status_.coverage = static_cast<double>(set) / pixels;
}

LiveCameraStatus CameraGate::status(double now_s) const {
  LiveCameraStatus status = status_;
  status.drift_ppm = -1e6 * clock_.drift();
  if (now_s - second_s_ > 2) status.packets_per_s = status.bytes_per_s = 0;
  return status;
}

}  // namespace tactus
