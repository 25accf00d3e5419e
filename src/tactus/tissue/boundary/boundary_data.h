#pragma once
/// Values of motions, loads and springs on the device.
#include "tactus/tissue/embedding.h"

namespace tactus::boundary {

struct MotionKey {
  double time_s = 0;
  Vec3d displacement_m;
  double angle_rad = 0;
};

/// Motion of one set of nodes.
struct Motion {
  Index begin = 0, end = 0;  ///< its keyframes
  Vec3f axis{0, 1, 0};       ///< unit, world
  Vec3f pivot_m;             ///< world
  double release_s = 0;      ///< free from then on
};

/// A motion over one substep.
struct MotionStep {
  Vec3f shift_m;                   ///< at the end
  Mat3f turn = Mat3f::identity();  ///< at the end
  Vec3f velocity_m_s;              ///< mean, of the pivot
  Vec3f spin_rad_s;                ///< so that spin x (half_turn arm) is the mean velocity that turning gives
  Mat3f half_turn = Mat3f::identity();  ///< in the middle
  Index released = 0;
};

struct LoadKey {
  double time_s = 0, factor = 1;
};

struct LoadCurve {
  Index begin = 0, end = 0;  ///< its keyframes
};

/// Forces of one load on the part of the surface that sits in one cube.
struct LoadedCube {
  embed::CubeNodes nodes;
  Index load = 0;
  Vec3f force_N;    ///< with factor 1, its direction stays
  Vec3f pressed_N;  ///< pressure times the part's area vector at rest, out of the body, goes with it [N]
};

/// A share that a node takes of a loaded cube's force.
struct LoadShare {
  Index part = 0;  ///< of the loaded cubes
  float weight = 0;
};

/// A spring that pulls on some nodes.
struct Pull {
  Vec3f target_m;           ///< world
  float stiffness_N_m = 0;  ///< of all nodes together
  float max_force_N = 0;    ///< likewise
  Index nodes = 0;          ///< 0: nothing is pulled
};

/// A node's share of the spring: it ends at target + offset.
struct PulledNode {
  Index place = 0;  ///< of the node on this device
  float weight = 0, inverse_mass_per_kg = 0;
  Vec3f offset_m;
};

}  // namespace tactus::boundary
