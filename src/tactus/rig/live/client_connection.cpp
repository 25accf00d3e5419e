#include "tactus/rig/live/client_connection.h"

#include <algorithm>
#include <utility>

namespace tactus {
namespace {

/// A receipt that takes so much longer than those before won't come.
constexpr double kLostAfterWays = 4, kLeastLost_s = 0.05;
/// A receipt is late from here on: TCP sends again after 0.2 s at the earliest, and a busy computer holds a
/// packet up for some milliseconds.
constexpr double kLateAfterWays = 2, kLate_s = 0.03;
/// The way may have become longer: the shortest is forgotten by a thousandth a packet.
constexpr double kForget = 1.001;

}  // namespace

bool PacketsOnTheWay::has_room(double now_s) {
  while (!sent_.empty() && now_s - sent_.front().at_s > lost_after_s_) {
    sent_.erase(sent_.begin());
    ++lost_;
  }
  return sent_.size() < kMost;
}

int PacketsOnTheWay::take_lost() { return std::exchange(lost_, 0); }

PacketsOnTheWay::Receipt PacketsOnTheWay::receive(std::uint64_t sequence, double now_s) {
  Receipt receipt;
  while (!sent_.empty() && sent_.front().sequence <= sequence) {
    const double way_s = now_s - sent_.front().at_s;
    way_s_ = std::max(way_s, 0.9 * way_s_);
    shortest_s_ = shortest_s_ == 0 ? way_s : std::min(way_s, kForget * shortest_s_);
    receipt.is_late = receipt.is_late || way_s > kLateAfterWays * shortest_s_ + kLate_s;
    receipt.is_copy = sent_.front().is_copy;
    sent_.erase(sent_.begin());
  }
  lost_after_s_ = std::clamp(kLostAfterWays * way_s_, kLeastLost_s, kMostLost_s);
  return receipt;
}

void CopyRule::late(double now_s) {
  at_s_[next_] = now_s;
  next_ = (next_ + 1) % kEvents;  // the oldest
  if (is_on(now_s) || now_s - at_s_[next_] < kWindow_s) until_s_ = now_s + kWindow_s;
}

}  // namespace tactus
