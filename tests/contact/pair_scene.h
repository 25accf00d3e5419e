#pragma once
/// Soft bodies that meet one another, for tests of what contact does to them.
#include "contact/soft_scene.h"
#include "tactus/contact/pairs/body_pairs.h"

namespace tactus::test {

/// What all bodies of a scene have together.
struct PairSums {
  double energy_J = 0, kinetic_J = 0;
  Vec3d momentum_kg_m_s;
  double size_of_momentum = 0;  ///< sum over bodies of |p|
};

/// Bodies, what stands still, and the substeps.
struct PairScene {
  /// @param touching_itself which bodies do
  PairScene(ExecContext& context, std::vector<SoftThing*> things, const ContactSettings& settings = {},
            bool touching_itself = false);
  /// n substeps as one frame.
  void run(int substeps, float dt_s, Vec3f gravity_m_s2 = {}, float drag_per_s = 0);
  /// Of the last frame.
  std::vector<PairReaction> reactions();
  ContactReport on_obstacles(std::size_t body);
  float deepest_m();
  PairSums sums() const;
  float stable_step_s() const;

  ExecContext& ctx;
  std::vector<SoftThing*> bodies;
  RealSurface surface;
  Obstacles obstacles;
  Contact contact;
  BodyPairs pairs;
  float frame_s = 1;
  int frame_substeps = 1;
};

/// Mean position of a body's nodes.
Vec3d middle_m(ExecContext& ctx, const SoftThing& body);

}  // namespace tactus::test
