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
    double sent_s = 0;     ///< the first that the receipt stands for; 0: none was on the way any more
  };
  /// Whether another may be sent. A packet that has been on the way for too long is lost: the server ended,
  /// the connection broke, or something on the way drops packets.
  bool has_room(double now_s);
  struct Lost {
    int count = 0;
    double sent_s = 0;  ///< the oldest
  };
  /// Packets that were lost since the last question.
  Lost take_lost();
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
  Lost lost_;
};

/// Whether packets are sent over two connections. TCP holds newer packets behind a lost one, so on a lossy
/// way each connection stands still at times of its own; of two copies one comes in time. Three late packets
/// in ten seconds begin it, and ten seconds without end it. A server that says "too much" ends it, too.
///
/// A computer that is busy holds both copies up, and copies load it more. So packets that were on the way
/// while this client itself was held up don't count. Where both copies are late more often than one of them
/// is saved by the other, copies rest for ten seconds, then for twice as long each time, until they help.
/// Knows no sockets and no clock.
class CopyRule {
 public:
  static constexpr double kWindow_s = 10, kMostRest_s = 160;
  /// A thread that starts so much later than it was woken was held up.
  static constexpr double kHeldUp_s = 0.01;
  /// The client's thread ran at `now_s`, and should have at `due_s`.
  void woke(double due_s, double now_s) {
    if (now_s - due_s > kHeldUp_s) held_up_s_ = now_s;
  }
  /// @param sent_s of the packet that is late
  void late(double sent_s, double now_s);
  void refused(double now_s) { not_before_s_ = now_s + kWindow_s; }
  bool is_on(double now_s) const { return now_s < until_s_ && now_s >= not_before_s_; }
  /// A packet went over two connections.
  void send(std::uint64_t sequence);
  /// A receipt of one copy. @returns whether the packet was one of those.
  bool receive(std::uint64_t sequence, bool is_late, double now_s);

 private:
  enum class Answer : std::uint8_t { none, in_time, late, both };
  struct Copies {
    std::uint64_t sequence = 0;
    Answer answer = Answer::none;  ///< of the first
  };
  void judge(double now_s);
  static constexpr std::size_t kEvents = 3;
  std::array<double, kEvents> at_s_{-1e9, -1e9, -1e9};
  std::size_t next_ = 0;
  double until_s_ = 0, not_before_s_ = 0, held_up_s_ = -1e9, rest_s_ = kWindow_s;
  std::array<Copies, 64> copies_{};  ///< of two seconds, by sequence
  int helped_ = 0, helpless_ = 0;
};

}  // namespace tactus
