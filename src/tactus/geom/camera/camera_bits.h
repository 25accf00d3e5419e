#pragma once
/// Sets of a rig's cameras, as kernels keep them.
#include <cstdint>

#include "tactus/base/hd.h"

namespace tactus {

inline constexpr int kMaxCameras = 64;
using CameraBits = std::uint64_t;  ///< bit c: camera c
TACTUS_HD inline CameraBits camera_bit(int camera) { return CameraBits{1} << camera; }

}  // namespace tactus
