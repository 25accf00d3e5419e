// State of a body between two frames.
#include "tactus/frame/state_archive.h"
#include "tactus/sim/body/body_pull.h"
#include "tactus/sim/body/slab_points.h"
#include "tactus/sim/body/soft_body.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus {

void SoftBody::archive(StateArchive& a) {
  a.set_owner("body '" + name() + "'");
  tissue_->archive(a);
  points_->archive(a);
  pull_->archive(a);
  a.value("strain", status_.strain);
  a.value("node check", status_.node_check);
  a.value("motion", status_.motion);
  a.value("whether it blew up", status_.is_frozen);
  a.value("whether it was inverted", was_inverted_);
  if (!a.reads()) return;
  a.check(status_.strain.fastest_cube >= 0 && status_.strain.fastest_cube < shape_.lattice.cube_count() &&
              status_.strain.smallest_cube >= 0 && status_.strain.smallest_cube < shape_.lattice.cube_count(),
          "strain");
  a.check(
      status_.node_check.fastest_node >= -1 && status_.node_check.fastest_node < shape_.lattice.node_count(),
      "node check");
  tissue_->set_spin(status_.motion.spin_rad_s);
  if (status_.is_frozen) tissue_->stop();
}

}  // namespace tactus
