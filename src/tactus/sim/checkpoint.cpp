// State of a simulation between two frames.
#include <algorithm>

#include "tactus/base/error.h"
#include "tactus/sim/simulation.h"

namespace tactus {

void SoftBody::archive(StateArchive& a) {
  if (is_cuttable())
    throw usage_error("body '" + name() + "' is 'cuttable': checkpoints do not hold what is cut yet");
  a.set_owner("body '" + name() + "'");
  tissue_.archive(a);
  points_.archive(a);
  a.value("strain", strain_);
  a.value("watch", watched_);
  a.value("motion", motion_);
  a.value("whether it blew up", at_rest_);
  a.value("whether it was inverted", was_inverted_);
  if (!a.reads()) return;
  a.check(strain_.fastest_cube >= 0 && strain_.fastest_cube < shape_.lattice.cube_count() &&
              strain_.smallest_cube >= 0 && strain_.smallest_cube < shape_.lattice.cube_count(),
          "strain");
  a.check(watched_.fastest_node >= -1 && watched_.fastest_node < node_count(), "watch");
  tissue_.set_spin(motion_.spin_rad_s);
  if (at_rest_) tissue_.stop();
}

void Simulation::archive(StateArchive& a, const FrameSet* last) {
  if (a.reads()) {
    is_settled_ = true;
    if (last != nullptr) step(last, 0);
  }
  devices_.synchronize();
  a.set_owner("devices");
  std::uint64_t devices = fnv1a(devices_.name());
  const std::uint64_t own = devices;
  a.value("kind and number", devices);
  if (devices != own)
    throw usage_error(a.path() + ": the checkpoint was made on other devices than " + devices_.name() +
                      ": go on with the same '--devices'");
  a.set_owner("frame");
  clock_.archive(a);
  a.value("last substep", last_substep_s_);
  a.value("last frame", last_dt_s_);
  a.value("whether there is a surface", has_surface_);
  a.value("tick", tick_);
  a.value("choice of substeps", substep_choice_);
  std::vector<PieceSpeed> speeds = piece_speeds_;
  auto count = static_cast<Index>(speeds.size());
  speeds.resize(static_cast<std::size_t>(kPieces));
  a.value("fast pieces", count);
  a.values("speeds of pieces", speeds);
  a.check(count >= 0 && count <= kPieces, "fast pieces");
  speeds.resize(static_cast<std::size_t>(count));
  piece_speeds_ = speeds;
  for (int p = 0; p < world_.count(); ++p) {
    a.set_owner("real surface");
    world_.part(p).surface.archive(devices_.context(p), a);
  }
  for (auto& body : bodies_) body->archive(a);
  a.set_owner("bodies that touch");
  touching_.archive(a);
  if (liquid_) liquid_->archive(a);
  if (a.reads()) a.finish();
  devices_.synchronize();
}

}  // namespace tactus
