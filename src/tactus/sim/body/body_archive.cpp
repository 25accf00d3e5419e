// State of a body between two frames.
#include "tactus/sim/body/soft_body.h"

namespace tactus {

void SoftBody::archive(StateArchive& a) {
  a.set_owner("body '" + name() + "'");
  tissue_.archive(a);
  points_.archive(a);
  a.value("strain", strain_);
  a.value("node check", node_check_);
  a.value("motion", motion_);
  a.value("whether it blew up", is_frozen_);
  a.value("whether it was inverted", was_inverted_);
  if (!a.reads()) return;
  a.check(strain_.fastest_cube >= 0 && strain_.fastest_cube < shape_.lattice.cube_count() &&
              strain_.smallest_cube >= 0 && strain_.smallest_cube < shape_.lattice.cube_count(),
          "strain");
  a.check(node_check_.fastest_node >= -1 && node_check_.fastest_node < node_count(), "node check");
  tissue_.set_spin(motion_.spin_rad_s);
  if (is_frozen_) tissue_.stop();
}

}  // namespace tactus
