#pragma once
/// One number for the state of a simulation.
#include <string>

#include "tactus/sim/simulation.h"

namespace tactus {

/// Of positions and velocities of all bodies' nodes and of the real surface, in hexadecimal: the same on
/// every set of devices. Synchronizes.
std::string state_hash(Simulation& simulation);

}  // namespace tactus
