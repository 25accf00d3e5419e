#include "tactus/rig/wire/clock_fit.h"

#include <algorithm>

namespace tactus {

void ClockFit::add(double sent_s, double arrived_s) {
  const double difference_s = arrived_s - sent_s;
  const bool begins = count_ == 0 || sent_s >= piece_begin_s_ + kPiece_s || sent_s < piece_begin_s_;
  if (begins) {
    piece_begin_s_ = sent_s;
    newest_ = (newest_ + 1) % kComponents;
    count_ = std::min(count_ + 1, kComponents);
  }
  Point& point = points_[newest_];
  if (!begins && difference_s >= point.difference_s) return;
  point = {sent_s, difference_s};
  fit();
}

void ClockFit::fit() {
  double mean_s = 0;
  for (std::size_t i = 0; i < count_; ++i) mean_s += point(i).sent_s / static_cast<double>(count_);
  drift_ = 0;
  if (count_ >= kLeastForDrift) {
    std::array<Point, kComponents> hull;
    std::size_t size = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const Point p = point(i);
      const auto below = [&](const Point& a, const Point& b) {  // b is not below the line from a to p
        return (b.difference_s - a.difference_s) * (p.sent_s - a.sent_s) >=
               (p.difference_s - a.difference_s) * (b.sent_s - a.sent_s);
      };
      while (size >= 2 && below(hull[size - 2], hull[size - 1])) --size;
      hull[size++] = p;
    }
    std::size_t right = 1;
    while (right + 1 < size && hull[right].sent_s < mean_s) ++right;
    const Point a = hull[right - 1], b = hull[right];
    if (b.sent_s > a.sent_s) drift_ = (b.difference_s - a.difference_s) / (b.sent_s - a.sent_s);
    drift_ = std::clamp(drift_, -kMostDrift, kMostDrift);
  }
  // The highest line of that slope below all.
  reference_s_ = mean_s;
  offset_s_ = point(0).difference_s - drift_ * (point(0).sent_s - mean_s);
  for (std::size_t i = 1; i < count_; ++i)
    offset_s_ = std::min(offset_s_, point(i).difference_s - drift_ * (point(i).sent_s - mean_s));
}

}  // namespace tactus
