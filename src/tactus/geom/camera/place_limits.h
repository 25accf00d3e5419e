#pragma once
/// Limits of places and cameras, so that no sum or product of them leaves single precision.
#include <cmath>

namespace tactus {

/// Largest coordinate of a camera's translation or a workspace's corner [m]; bodies that are farther from the
/// origin count as diverged long before.
inline constexpr double kMostPlace_m = 1e6;
/// Shortest side of a workspace [m].
inline constexpr double kLeastSide_m = 1e-5;
/// Largest focal length, principal point and skew, and smallest focal length [px]. The longest lens before
/// the smallest pixels has 1e7.
inline constexpr double kMostFocal_px = 1e8, kLeastFocal_px = 1e-3;

/// Whether a box can be a workspace's: NaN can't.
template <class Box>
bool is_workspace(const Box& box) {
  bool ok = true;
  for (int i = 0; i < 3; ++i) {
    const auto low = static_cast<double>(box.min[i]), high = static_cast<double>(box.max[i]);
    ok = ok && std::abs(low) <= kMostPlace_m && std::abs(high) <= kMostPlace_m && high - low >= kLeastSide_m;
  }
  return ok;
}
/// The same limits in the words of messages.
inline constexpr const char* kWorkspaceRange =
    "expected corners within 1e6 m of the origin and sides of at least 1e-5 m";

}  // namespace tactus
