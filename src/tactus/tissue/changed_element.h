#pragma once
/// Copies and nodes of a change of topology, as one device counts them.
#include "tactus/tissue/embedding.h"
#include "tactus/tissue/tled/tled_data.h"

namespace tactus::cut {

/// Ids are those of the device's part of the body; places of its virtual elements come behind regular ones.
struct LocalCopy {
  Index copy = 0;    ///< place in the virtual elements
  Index parent = 0;  ///< cube
  embed::CubeNodes nodes;
  tled::Stiffness stiffness;
};
struct LocalNode {
  Index node = 0;
  Index from = -1;  ///< -1: it is not new
  float mass_kg = 0;
  Index fixed = 0;  ///< HeldAxes
};

}  // namespace tactus::cut
