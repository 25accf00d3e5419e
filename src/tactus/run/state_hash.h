#pragma once
/// One number for the state of a world.
#include <string>

#include "tactus/world/world.h"

namespace tactus {

/// Hash of the positions and velocities of all bodies' nodes and of the positions of the real surface and the
/// liquid, in hexadecimal: the same on every set of devices. Synchronizes.
std::string state_hash(World& world);

}  // namespace tactus
