#include "tactus/sim/body/body_steps.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/sim/body/body_places.h"
#include "tactus/sim/body/body_shape.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus {

int BodySteps::substeps_for(float dt_s) const {
  return tissue_.model().substeps_for(dt_s, status_.strain.speed_ratio);
}

int BodySteps::matching_every() const { return tissue_.model().flsm() ? description_.matching_every : 1; }

int BodySteps::check_every(int substeps) const { return nothing_acts() ? substeps : tissue_.check_every(); }

bool BodySteps::nothing_acts() const {
  return !description_.contact && shape_.motions.empty() && shape_.loads.empty();
}

double BodySteps::fastest_near_m_s(double surface_m_s, double from_s, double to_s) const {
  if (status_.is_frozen || nothing_acts()) return 0;
  // A body that touches nothing may step as far as its material allows.
  const double own_m_s = description_.contact ? double{status_.fastest_m_s()}
                                              : std::sqrt(double{status_.node_check.fastest_element2_m2_s2});
  double speed = std::max(own_m_s, description_.contact ? surface_m_s : 0);
  for (const NodeMotion& motion : shape_.motions)
    speed = std::max(speed, fastest_move(shape_.lattice, motion, from_s, to_s).speed_m_s);
  return speed;
}

double BodySteps::wave_m_s() const {
  const MaterialDescription& m = description_.material;
  const double bar = std::sqrt(m.young_modulus_pa / m.density_kg_m3);
  return tissue_.model().has_elements()
             ? std::max(bar, description_.spacing_m / static_cast<double>(tissue_.model().stable_step_s()))
             : bar;
}

void BodySteps::warn_of_many_substeps(float dt_s, int substeps, int most) {
  const int unstrained = tissue_.model().substeps_for(dt_s), needed = substeps_for(dt_s);
  if (warned_of_substeps_ || status_.is_frozen || needed <= most ||
      (unstrained <= most && needed <= substeps))
    return;
  const MaterialDescription& m = description_.material;
  char text[320];
  if (unstrained > most) {
    std::snprintf(
        text, sizeof text,
        "': a frame of %.3g s takes %d substeps, as it is stable up to %.3g s: young_modulus_pa %.3g, "
        "density_kg_m3 %.3g and spacing_m %.3g make waves that fast; a coarser lattice, a softer or "
        "a heavier material takes fewer",
        double{dt_s}, unstrained, double{tissue_.model().stable_step_s()}, m.young_modulus_pa,
        m.density_kg_m3, description_.spacing_m);
  } else {
    std::snprintf(
        text, sizeof text,
        "' is crushed: waves are %.3g times as fast as at rest in %s, which asks for %d substeps; it "
        "gets %d: press it less or slower, or make it stiffer",
        double{status_.strain.speed_ratio}, places_.cube_text(status_.strain.fastest_cube).c_str(), needed,
        substeps);
  }
  log_warning("body '" + description_.name + text);
  warned_of_substeps_ = true;
}

void BodySteps::check(float dt_frame_s, int substeps, int most_of_frame) {
  warn_of_many_substeps(dt_frame_s, substeps, most_of_frame);
  const float dt_s = dt_frame_s / static_cast<float>(substeps);
  char text[256];
  if (tissue_.model().has_elements() && dt_s > 1.0001F * tissue_.model().tled().stable_step_s()) {
    const double stable_s = tissue_.model().tled().stable_step_s();
    throw usage_error("body '" + description_.name + "': 'frame.substeps' is " + std::to_string(substeps) +
                      ", steps of " + number_text(dt_s, stable_s) + " s, but its elements are stable up to " +
                      number_text(stable_s) + " s; expected at least " +
                      std::to_string(tissue_.model().tled().substeps_for(dt_frame_s)) + ", or auto");
  }
  if (matching_every() > 1 && substeps % matching_every() != 0) {
    std::snprintf(text, sizeof text,
                  "': 'frame.substeps' is %d, expected a multiple of its 'matching_every', %d", substeps,
                  matching_every());
    throw usage_error("body '" + description_.name + text);
  }
  if (const int most = tissue_.model().most_matching_every(dt_s); matching_every() > most) {
    std::snprintf(
        text, sizeof text,
        "': 'matching_every' is %d, but after more than %d substeps of %.3g s at once its shape matching "
        "would be softer than its material; expected at most %d",
        matching_every(), most, static_cast<double>(dt_s), most);
    throw usage_error("body '" + description_.name + text);
  }
  if (!tissue_.model().flsm() || description_.material.kappa == Stiffness::paper || warned_of_softness_)
    return;
  const double young_Pa = static_cast<double>(tissue_.model().flsm()->effective_young_Pa(dt_s));
  if (young_Pa > 0.99 * description_.material.young_modulus_pa) return;
  std::snprintf(text, sizeof text,
                "': 'frame.substeps' is %d, so its shape matching is as soft as a young_modulus_pa of %.3g; "
                "expected at least %d, or auto",
                substeps, young_Pa, tissue_.model().flsm()->substeps_for(dt_frame_s));
  log_warning("body '" + description_.name + text);
  warned_of_softness_ = true;
}

}  // namespace tactus
