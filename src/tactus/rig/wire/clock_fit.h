#pragma once
/// Converts times of another computer's clock to ours.
#include <array>
#include <cstddef>

namespace tactus {

/// Learns offset and drift of another clock from packets: each was sent at a time of theirs and arrived at a
/// time of ours. The difference is the offset, which drifts slowly, and the way, which is never negative and
/// jumps. So the offset is the highest line below all differences (Moon, Skelly and Towsley 1999: "Estimation
/// and removal of clock skew from network delay measurements"): it passes through the edge of their lower
/// convex hull that is above the mean time. The shortest way stays in it; for cameras of one network it is
/// the same.
///
/// Looks back 12 s, at the smallest difference of every half second.
class ClockFit {
 public:
  void reset() { *this = {}; }
  void add(double sent_s, double arrived_s);
  bool is_known() const { return count_ > 0; }
  /// @returns theirs on our clock.
  double to_ours(double theirs_s) const { return theirs_s + offset_s_ + drift_ * (theirs_s - reference_s_); }
  /// Seconds that theirs loses a second.
  double drift() const { return drift_; }

 private:
  static constexpr std::size_t kComponents = 24;
  static constexpr double kPiece_s = 0.5;
  /// Fewer tell no drift from jumps of the way.
  static constexpr std::size_t kLeastForDrift = 8;
  /// Quartz is within 100e-6.
  static constexpr double kMostDrift = 500e-6;
  struct Point {
    double sent_s = 0, difference_s = 0;
  };
  const Point& point(std::size_t i) const {
    return points_[(newest_ + kComponents + 1 - count_ + i) % kComponents];
  }
  void fit();

  std::array<Point, kComponents> points_{};  ///< a ring
  std::size_t newest_ = kComponents - 1, count_ = 0;
  double piece_begin_s_ = 0;
  double offset_s_ = 0, drift_ = 0, reference_s_ = 0;
};

}  // namespace tactus
