#pragma once
/// Contacts of single points, read back when a program asks for them: kernels write nothing for this.
#include <array>
#include <vector>

#include "tactus/contact/body_points.h"
#include "tactus/contact/contact_report.h"

namespace tactus {

/// Contact of a point of a body with a collider over one frame, or over one part of it.
struct ContactPoint {
  Index point = -1;     ///< of the body; -1: the sum over points that went on to another collider
  Index collider = -1;  ///< as ColliderReaction
  Vec3f x_m{};          ///< world: where its last correction put it
  Vec3f n{};            ///< unit normal of the collider there, towards the body; 0 with `response: paper`
  float gap_m = 0;      ///< before the last correction; < 0: inside
  Vec3f impulse_N_s{};  ///< on the body
  TouchState state = TouchState::left;
};

/// Contacts of a device's points over the frame that ended, in their order.
struct ContactPointList {
  std::vector<ContactPoint> points{};
  /// Impulses on colliders that points left for others: exact, so that lists of several devices add up in any
  /// order.
  std::array<ReactionSums, kColliders> moved_on{};
};

/// After BodyPoints::end_frame() and before the next begin_frame(). Synchronizes.
ContactPointList read_contact_points(ExecContext& ctx, BodyPoints& points);

/// Appends an entry without a point for each collider whose sum isn't 0. It has only an impulse.
void append_moved_on(const std::array<ReactionSums, kColliders>& moved_on, std::vector<ContactPoint>& to);

}  // namespace tactus
