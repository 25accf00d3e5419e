#pragma once
/// How a point of one body is to be corrected that is inside of another, or of its own.
#include "tactus/contact/pairs/pair_weights.h"

namespace tactus {

/// What all corrections of a kind have in common.
struct TouchLaw {
  CorrectionTime time;
  float restitution = 0, friction = 0;
};

/// Notes the change that a point wants, of velocity and of position, in its PairContact.
struct PairTouch {
  const PairTable& table;
  const PairState& state;
  const TouchLaw& law;

  /// Returns whether the point is inside with a normal, and it or the touched cube can move. The normal is
  /// that of the distance at rest, taken through the deformation; gap = distance / |its gradient|.
  TACTUS_HD bool touch(Index of, Index i, Index c, Vec3f q, Vec3f x) const {
    PairContact& contact = state.contact[i];
    const RestDistance rest = table.distance(of, i, c, q);
    if (!(rest.distance_m < 0.F)) return false;
    const SolidCube& cube = table.cubes[c];
    const EmbeddedPoint& point = table.points[i];
    const PairBody &body = table.bodies[of], &other = table.bodies[cube.body];
    const CubeMap::Jacobian jacobian = CubeCorners::map(other.nodes, cube).jacobian(q);
    const float steepness = length(rest.gradient_m) / other.spacing_m;  // 1, less where sides are as near
    const Vec3f gradient = jacobian.gradient(rest.gradient_m);
    const float slope = length(gradient);
    if (!(steepness > 0.1F) || !(slope > 0.F) || !(moves(body, point) || moves(other, cube, q))) return false;
    const Vec3f n = (1.F / slope) * gradient;
    const float depth = -rest.distance_m * steepness / slope;

    const Vec3f rel = body.nodes.velocity(point) - CubeCorners::velocity(other.nodes, cube, q);
    const bool same = contact.touching != 0 && table.cubes[contact.anchor_cube].body == cube.body;
    const Vec3f anchor =
        same ? CubeCorners::map(other.nodes, table.cubes[contact.anchor_cube]).at(contact.anchor_q) : x;
    FrictionMemory memory = same ? contact.friction : FrictionMemory::begin(depth);
    memory.press(depth);
    const Vec3f away = x - anchor, slide = away - dot(away, n) * n;
    const float distance = length(slide), most = law.friction * memory.depth_m;
    Vec3f push = depth * n - (distance > most ? most / distance : 1.F) * slide;
    // Where it sticks the anchor stays as it is: each time it is found anew it is off by a rounding.
    if (!same || distance > most) {
      contact.anchor_cube = c;
      contact.anchor_q = q + jacobian.solve(push);
    }
    const float farthest = push_m(contact, same && contact.touching == 1, depth, dot(rel, n)),
                far = length(push);
    if (far > farthest) push *= farthest / far;
    const bool stays = contact.touching == 1 && contact.cube == c;
    if (stays)
      shift_weights(contact, q);
    else if (contact.touching == 1)
      add_weights(i, contact, -1);
    contact.velocity_correction_m_s =
        memory.velocity_correction_m_s(rel, n, contact.touching == 1 ? 0.F : law.restitution, law.friction);
    contact.friction = memory;
    contact.position_correction_m = push;
    contact.x_m = x;
    contact.depth_m = depth;
    contact.touching = 1;
    contact.cube = c;
    contact.q = q;
    if (!stays) add_weights(i, contact, 1);
    return true;
  }

 private:
  /// Time in which depth that was there before goes down to 1/e.
  static constexpr float kPressedApart_s = 0.04F;
  /// By how much a point may be pushed now. What its way since the last correction made deeper is undone at
  /// once: then a body carries any weight, and moved as it would have with the velocity corrected before. The
  /// rest goes slowly: a push at once works on springs, and no kinetic energy has paid for that.
  /// @param velocity_m_s along the normal, of the point
  TACTUS_HD float push_m(const PairContact& before, bool touched, float depth_m, float velocity_m_s) const {
    const float since_s = law.time.since_s(),
                expected_m = touched ? before.depth_m - length(before.position_correction_m)
                                     : depth_m + since_s * min(velocity_m_s, 0.F),
                stayed_m = max(expected_m, 0.F);
    return max(depth_m - stayed_m, 0.F) + min(since_s / kPressedApart_s, 1.F) * stayed_m;
  }

  TACTUS_HD static bool moves(const PairBody& body, const EmbeddedPoint& p) {
    if (body.nodes.has_stopped()) return false;
    TACTUS_ROLLED
    for (int k = 0; k < 8; ++k) {
      if (p.weight[k] != 0.F && !body.nodes.is_held(p.node[k])) return true;
    }
    return false;
  }
  TACTUS_HD static bool moves(const PairBody& body, const SolidCube& cube, Vec3f q) {
    if (body.nodes.has_stopped()) return false;
    TACTUS_ROLLED
    for (int k = 0; k < 8; ++k) {
      if (CubeMap::weight(q, k) != 0.F && !body.nodes.is_held(cube.node[k])) return true;
    }
    return false;
  }
  TACTUS_HD_CALLED void add_weights(Index i, const PairContact& contact, int sign) const {
    add_pair_weights(table, state, i, contact, sign);
  }
  /// A point that touches in the same cube as before hardly moves there, most often.
  TACTUS_HD void shift_weights(const PairContact& contact, Vec3f q) const {
    const SolidCube& cube = table.cubes[contact.cube];
    for (int k = 0; k < 8; ++k)
      add_row_weight(
          state, cube.row[k],
          signed_units(CubeMap::weight(q, k), 1) + signed_units(CubeMap::weight(contact.q, k), -1));
  }
};

}  // namespace tactus
