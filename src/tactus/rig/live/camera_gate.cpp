#include "tactus/rig/live/camera_gate.h"

#include <algorithm>
#include <cmath>

namespace tactus {
namespace {

/// Images are sent at once: what was captured longer before is of a clock that jumped.
constexpr double kOldest_s = 1, kSkew_s = 0.001;
/// Packets a second over the rig's.
constexpr double kMostRate = 4;

}  // namespace

bool RateLimit::take(double amount, double now_s) {
  left_ = std::min(1.5 * per_s_, left_ + (now_s - last_s_) * per_s_);
  last_s_ = now_s;
  if (amount > left_) return false;
  left_ -= amount;
  return true;
}

CameraGate::CameraGate(const LiveCamera& camera, const LiveSettings& settings)
    : camera_(camera), packets_(kMostRate * settings.fps), bytes_(settings.bytes_per_s) {
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

Refusal CameraGate::check_boot(const PacketHead& head) {
  if (!heard_ || head.boot != boot_) {
    const auto end = old_boots_.begin() + static_cast<std::ptrdiff_t>(std::min(old_boot_count_, kOldBoots));
    if (std::find(old_boots_.begin(), end, head.boot) != end) return Refusal::old_boot;
    if (heard_) old_boots_[old_boot_count_++ % kOldBoots] = boot_;
    heard_ = true;
    boot_ = head.boot;
    clock_.reset();
  } else {
    if (head.sequence <= sequence_) return Refusal::repeated;
    status_.lost +=
        static_cast<std::int64_t>(std::min<std::uint64_t>(head.sequence - sequence_ - 1, 1'000'000));
  }
  sequence_ = head.sequence;
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
  if (const Refusal refusal = check_boot(head); refusal != Refusal::none) return refusal;
  status_.replaced = head.replaced;
  clock_.add(head.sent_s, now_s);
  captured_s = std::min(clock_.to_ours(head.captured_s), now_s);
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
