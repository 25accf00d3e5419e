#pragma once
/// Where finite elements and shape matching meet: nodes that both move.
#include "tactus/base/vec.h"
#include "tactus/frame/frame_params.h"
#include "tactus/geom/maths/held_axes.h"
#include "tactus/tissue/flsm/flsm_kernels.h"
#include "tactus/tissue/tled/summed_forces.h"

namespace tactus::hybrid {

/// Forces of elements and goals of shape matching in one step [P 7, 13-14]: v+ = v + (m^F/m) kappa (g - x)/dt
/// + dt (f_int + f_ext)/m + dt g, x+ = x + dt v+. m^F is a node's mass from shape-matched cubes alone, so
/// mass that both sides hold is counted once and no coefficient couples them. Goals may be older than this
/// substep.
struct Integrate {
  View<Vec3f> x_m, v_m_s;
  View<const Vec3f> f_ext_N;
  tled::SummedForces f_int;  ///< of elements
  View<const Index> element_cell;
  // shape matching: per node of that part
  View<const Index> matched_node;  ///< per node of the body; -1: in no matched cube
  View<const Index> matched_cell;
  View<const double> goal_sum_m, inverse_weight;
  View<const float> matched_share;  ///< m^F / m times FlsmRegions::held, per node of the body
  View<const float> inverse_mass_per_kg;
  View<const Index> fixed;  ///< HeldAxes
  View<const Index> only_matched;
  Index matched_cells;
  StepTime time;
  flsm::StepParameters step;
  float drag_per_s, elements_damping_time_s;
  bool new_goals;
  float dt_matched_s = 0, kick_matched_s = 0;
  float stiffness_per_s = 0;         ///< kappa / dt_matched
  float damping_time_s = 0;          ///< of shape matching
  float drag = 1, drag_matched = 1;  ///< shares of the velocity that drag leaves
  Vec3f elements_turn_rad{}, matched_turn_rad{};
  TACTUS_HD void load() {
    time.load();
    dt_matched_s = step.dt_s(time);
    kick_matched_s = time.kick_s * static_cast<float>(step.substeps);
    stiffness_per_s = step.kappa(dt_matched_s) / sqr(dt_matched_s) * kick_matched_s;
    damping_time_s = step.damping_time_s(dt_matched_s);
    elements_turn_rad = time.turn_rad(elements_damping_time_s, time.dt_s);
    matched_turn_rad = time.turn_rad(damping_time_s, dt_matched_s);
    drag = 1 / (1 + time.dt_s * drag_per_s);
    drag_matched = 1 / (1 + dt_matched_s * drag_per_s);
  }

  TACTUS_HD Vec3f to_goal(Index matched, Vec3f x, Vec3f v) const {
    const Index d = matched_cell[matched];
    const double n = inverse_weight[matched], t = static_cast<double>(damping_time_s);
    const auto pull = [&](Index a, float xa, float va) {
      return static_cast<float>(goal_sum_m[a * matched_cells + d] * n -
                                (static_cast<double>(xa) + t * static_cast<double>(va)));
    };
    return {pull(0, x.x, v.x), pull(1, x.y, v.y), pull(2, x.z, v.z)};
  }

  TACTUS_HD void operator()(Index i) const {
    const bool alone = only_matched[i] != 0;
    if (alone && !new_goals) return;
    const Vec3f x = x_m[i], v = v_m_s[i];
    const Index d = element_cell[i], matched = matched_node[i];
    const float dt = alone ? dt_matched_s : time.dt_s, kick = alone ? kick_matched_s : time.kick_s;
    const Vec3f f = turned_back(f_int.at(i, d), elements_turn_rad) + f_ext_N[i];
    Vec3f dv = kick * (time.gravity_m_s2 + inverse_mass_per_kg[i] * f);
    if (matched >= 0 && new_goals)
      dv += (matched_share[i] * stiffness_per_s) * turned_back(to_goal(matched, x, v), matched_turn_rad);
    const Vec3f next =
        time.stands_still() ? Vec3f{} : free_part((alone ? drag_matched : drag) * (v + dv), fixed[i]);
    v_m_s[i] = next;
    x_m[i] = x + dt * next;
  }
};

/// Nodes of the virtual elements that a part owns.
struct TakeOwned {
  View<const Index> owner;
  Index part;
  View<const Vec3f> part_x_m, part_v_m_s;
  View<Vec3f> x_m, v_m_s;
  TACTUS_HD void operator()(Index i) const {
    if (owner[i] != part) return;
    x_m[i] = part_x_m[i];
    v_m_s[i] = part_v_m_s[i];
  }
};

}  // namespace tactus::hybrid
