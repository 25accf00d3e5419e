#pragma once
/// What places and cameras may be, so that no sum or product of them leaves single precision.
#include <cmath>

namespace tactus {

/// Of positions of cameras and corners of workspaces [m]; bodies that are farther from the origin count as
/// diverged long before.
inline constexpr double kMostPlace_m = 1e6;
/// Of a workspace's sides [m].
inline constexpr double kLeastSide_m = 1e-5;
/// Of focal lengths, principal points and skews [px]. The longest lens before the smallest pixels has 1e7.
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
/// What a message expects.
inline constexpr const char* kWorkspaceRange =
    "expected corners within 1e6 m of the origin and sides of at least 1e-5 m";

}  // namespace tactus
