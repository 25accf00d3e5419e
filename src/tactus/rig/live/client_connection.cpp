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
/// Copies are judged by so many packets of which one copy or both were late; older ones count half.
constexpr int kJudged = 4, kRemembered = 32;

}  // namespace

bool PacketsOnTheWay::has_room(double now_s) {
  while (!sent_.empty() && now_s - sent_.front().at_s > lost_after_s_) {
    if (lost_.count++ == 0) lost_.sent_s = sent_.front().at_s;
    sent_.erase(sent_.begin());
  }
  return sent_.size() < kMost;
}

PacketsOnTheWay::Lost PacketsOnTheWay::take_lost() { return std::exchange(lost_, {}); }

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
    if (receipt.sent_s == 0) receipt.sent_s = sent_.front().at_s;
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

void CopyRule::late(double sent_s, double now_s) {
  if (sent_s <= held_up_s_) return;
  at_s_[next_] = now_s;
  next_ = (next_ + 1) % kEvents;  // the oldest
  if (is_on(now_s) || now_s - at_s_[next_] < kWindow_s) until_s_ = now_s + kWindow_s;
}

void CopyRule::send(std::uint64_t sequence) { copies_[sequence % copies_.size()] = {sequence, Answer::none}; }

bool CopyRule::receive(std::uint64_t sequence, bool is_late, double now_s) {
  Copies& c = copies_[sequence % copies_.size()];
  if (sequence == 0 || c.sequence != sequence) return false;
  if (c.answer == Answer::none) {
    c.answer = is_late ? Answer::late : Answer::in_time;
    if (is_late) ++helpless_;  // the other one is later still
  } else {
    if (c.answer == Answer::in_time && is_late) ++helped_;
    c.answer = Answer::both;
  }
  judge(now_s);
  return true;
}

void CopyRule::judge(double now_s) {
  if (helped_ + helpless_ < kJudged) return;
  if (helpless_ > helped_) {
    not_before_s_ = now_s + rest_s_;
    until_s_ = now_s;
    rest_s_ = std::min(2 * rest_s_, kMostRest_s);
    helped_ = helpless_ = 0;
    return;
  }
  if (helped_ >= 2 * kJudged && helped_ > 2 * helpless_) rest_s_ = kWindow_s;
  if (helped_ + helpless_ < kRemembered) return;
  helped_ /= 2;
  helpless_ /= 2;
}

}  // namespace tactus
