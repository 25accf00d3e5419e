#pragma once
/// Contact of the real surface with the nodes of virtual bodies: velocity-position correction, one-way
/// (nothing moves the real object; its reaction is reported).
#include "tactus/contact/real_surface.h"
#include "tactus/contact/response_kernels.h"

namespace tactus {

struct ContactSettings {
  float restitution = 0;  ///< e, 0..1: share of the approach velocity that comes back
  float friction = 0.5F;  ///< μ >= 0: Coulomb
};

/// Reaction on the real object over one frame, and counters.
struct ContactReport {
  Vec3f force_N;          ///< mean force on the real object
  Vec3f torque_N_m;       ///< mean torque about the centre of gravity of all that is real
  float max_depth_m = 0;  ///< largest correction of a node
  double contacts_per_substep = 0;
  Index rescued = 0;  ///< nodes that were found deep inside
};

/// Order in a frame, all on one context and without a read-back:
///   surface.update(mesh, dt); contact.begin_frame(); contact.rescue(t of the first substep);
///   for each substep: integrate; contact.correct(t); and at the end, where one synchronises:
///   contact.report(dt).
///
/// Times are relative to the capture of the surface: 0 is the measured surface, negative times lie between
/// the last surface and this one. To end each frame on what was measured, pass
/// `-dt + (k + 1) dt / substeps` for substep k (one frame of delay, no guess); to predict, pass `(k + 1) dt /
/// n`.
class Contact {
 public:
  /// @param max_contact_nodes most nodes in one call
  /// @throws Error naming the setting that is out of range.
  Contact(Device& device, Index max_contact_nodes, const ContactSettings& settings = {});

  /// Sets the sums of the report to 0.
  void begin_frame(ExecContext& ctx);
  /// Moves nodes that lie deeper than 2 spacings (up to 8) in the real object to its surface, for each body
  /// once a frame before its first `correct`: where the surface came from nowhere. Velocities stay.
  void rescue(ExecContext& ctx, const RealSurface& surface, const ContactNodes& body, float time_s);
  /// The response of method 6: gap = (x_i - x_k)·n_k - d_i < 0 moves x_i by -gap n_k, along the normal only
  /// and without touching v_i; then an approaching v_i is reflected with e and its tangential part limited by
  /// μ.
  /// @param dt_s time since the last `correct`: only for bodies with memory
  void correct(ExecContext& ctx, const RealSurface& surface, const ContactNodes& body, float time_s,
               float dt_s = 0);

  /// (1) Sums since begin_frame, for those who read them on the device.
  View<const ContactTotals> totals() const { return totals_.const_view(); }
  /// Synchronises. @param dt_frame_s what the impulses are divided by @param substeps calls of `correct`
  ContactReport report(ExecContext& ctx, float dt_frame_s, int substeps) const;

 private:
  void pose(ExecContext& ctx, const RealSurface& surface, const ContactNodes& body, float time_s);
  void add_records(ExecContext& ctx, Index count, bool rescues);

  ContactSettings settings_;
  Buffer<ContactRecord> records_;
  Buffer<ContactTotals> parts_, totals_;
  Buffer<SurfacePoses> poses_;
};

}  // namespace tactus
