#include "tactus/rig/live/client_connection.h"

#include <algorithm>
#include <utility>

namespace tactus {
namespace {

/// A receipt that takes so much longer than those before won't come. A packet that isn't late isn't lost.
constexpr double kLostAfterWays = 4, kLeastLost_s = 0.05;
/// A receipt is late after 2 x shortest + 30 ms + 4 x (median - shortest). A network that loses packets
/// leaves the median where it is: TCP sends again after 200 ms at the earliest. A busy computer holds every
/// packet up, so its median rises, and the threshold with it: copies would load it more.
constexpr double kLateAfterWays = 2, kLate_s = 0.03, kLateAfterHoldUps = 4;
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
    ways_s_[way_count_++ % kWays] = way_s;
    late_after_s_ = kLateAfterWays * shortest_s_ + kLate_s + kLateAfterHoldUps * (median_s() - shortest_s_);
    receipt.is_late = receipt.is_late || way_s > late_after_s_;
    receipt.is_copy = sent_.front().is_copy;
    sent_.erase(sent_.begin());
  }
  lost_after_s_ = std::clamp(std::max(kLostAfterWays * way_s_, late_after_s_), kLeastLost_s, kMostLost_s);
  return receipt;
}

double PacketsOnTheWay::median_s() const {
  std::array<double, kWays> ways = ways_s_;
  const auto count = static_cast<std::ptrdiff_t>(std::min(way_count_, kWays));
  std::nth_element(ways.begin(), ways.begin() + count / 2, ways.begin() + count);
  return ways[static_cast<std::size_t>(count / 2)];
}

void CopyRule::late(double now_s) {
  at_s_[next_] = now_s;
  next_ = (next_ + 1) % kEvents;  // the oldest
  if (is_on(now_s) || now_s - at_s_[next_] < kWindow_s) until_s_ = now_s + kWindow_s;
}

}  // namespace tactus
