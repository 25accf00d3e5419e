#pragma once
/// A spring that pulls on some nodes of a body.
#include "tactus/frame/frame_params.h"
#include "tactus/geom/arrays/vector_fields.h"
#include "tactus/geom/maths/held_axes.h"
#include "tactus/tissue/boundary/boundary_data.h"

namespace tactus::boundary {

/// After a substep, the spring of each node gives it the impulse of the force that the spring has where the
/// node is then (implicit Euler). A node never goes beyond the spring's end by that, whatever the stiffness.
struct PullNodes {
  View<const Pull> pull;
  View<const PulledNode> pulled;
  View<Vec3f> impulse_N_s;  ///< per pulled node, summed
  View<Vec3f> x_m, v_m_s;   ///< per place
  NodeFields fields;        ///< or places are cells, and nodes are here
  View<const Index> held, stopped;
  View<const FrameParams> frame;
  TACTUS_HD void operator()(Index i) const {
    const Pull of = pull[0];
    if (i >= of.nodes || stopped[0] != 0 || frame[0].settles != 0) return;
    const PulledNode at = pulled[i];
    const bool in_cells = fields.cells > 0;
    const Vec3f x = in_cells ? fields.position(at.place) : x_m[at.place];
    const float dt = frame[0].dt_s, k = at.weight * of.stiffness_N_m, inverse = at.inverse_mass_per_kg;
    Vec3f impulse = (dt * k / (1.F + dt * dt * k * inverse)) * (of.target_m + at.offset_m - x);
    const float most = dt * at.weight * of.max_force_N, size = length(impulse);
    if (size > most) impulse *= most / size;
    impulse = free_part(impulse, held[at.place]);
    impulse_N_s[i] += impulse;
    const Vec3f dv = inverse * impulse;
    if (in_cells) return fields.change(at.place, dt * dv, dv);
    v_m_s[at.place] += dv;
    x_m[at.place] += dt * dv;
  }
};

}  // namespace tactus::boundary
