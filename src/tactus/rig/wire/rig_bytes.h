#pragma once
/// A rig as bytes, for recordings and packets. docs/recording.md has the format.
#include "tactus/base/byte_io.h"
#include "tactus/rig/sources/frame_source.h"

namespace tactus {

constexpr std::uint32_t kMostCameras = 256;

void put_rig(const Rig& rig, std::string& to);
/// @throws Error naming the camera, or the value that no rig has.
Rig take_rig(ByteReader& from);

}  // namespace tactus
