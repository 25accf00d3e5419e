#pragma once
/// A client's state of its connections: the packets that are on the way, and whether they are late.
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace tactus {

/// Packets of one connection that have no receipt yet, oldest first. Knows no sockets and no clock.
class PacketsOnTheWay {
 public:
  static constexpr std::size_t kMost = 2;
  struct Receipt {
    bool is_late = false;  ///< it took much longer than others
    bool is_copy = false;  ///< the packet went over another connection, too
  };
  /// Whether another may be sent. A packet that has been on the way for too long is lost: the server ended,
  /// the connection broke, or something on the way drops packets.
  bool has_room(double now_s);
  /// How many were lost since the last question.
  int take_lost();
  void send(std::uint64_t sequence, bool is_copy, double now_s) {
    sent_.push_back({sequence, is_copy, now_s});
  }
  /// Those before it are lost, or theirs are.
  Receipt receive(std::uint64_t sequence, double now_s);
  /// How long the oldest has been on the way; 0 for none.
  double age_s(double now_s) const { return sent_.empty() ? 0 : now_s - sent_.front().at_s; }
  void clear() { sent_.clear(); }

 private:
  struct Sent {
    std::uint64_t sequence;
    bool is_copy;
    double at_s;
  };
  double median_s() const;
  static constexpr double kMostLost_s = 1;
  static constexpr std::size_t kWays = 31;  ///< a second
  std::vector<Sent> sent_;
  double way_s_ = 0;                    ///< there and back, the longest of late
  double shortest_s_ = 0;               ///< likewise, the shortest of late; 0: not known yet
  std::array<double, kWays> ways_s_{};  ///< of the last packets
  std::size_t way_count_ = 0;
  double late_after_s_ = kMostLost_s, lost_after_s_ = kMostLost_s;
  int lost_ = 0;
};

/// Whether packets are sent over two connections. TCP holds newer packets behind a lost one, so on a lossy
/// way each connection stands still at times of its own; of two copies one comes in time. Three late packets
/// in ten seconds begin it, and ten seconds without end it. A server that says "too much" ends it, too.
class CopyRule {
 public:
  void late(double now_s);
  void refused(double now_s) { not_before_s_ = now_s + kWindow_s; }
  bool is_on(double now_s) const { return now_s < until_s_ && now_s >= not_before_s_; }

 private:
  static constexpr double kWindow_s = 10;
  static constexpr std::size_t kEvents = 3;
  std::array<double, kEvents> at_s_{-1e9, -1e9, -1e9};
  std::size_t next_ = 0;
  double until_s_ = 0, not_before_s_ = 0;
};

}  // namespace tactus
