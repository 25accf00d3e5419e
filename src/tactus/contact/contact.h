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
///   surface.update(mesh, dt); contact.begin_frame(surface, times); for each body contact.rescue(); for each
///   substep k: integrate; contact.correct(k); contact.end_frame(); and where one synchronises,
///   contact.report(dt).
class Contact {
 public:
  /// @param max_contact_nodes of all bodies together: each has its records (ContactNodes::first_record)
  /// @throws Error naming the setting that is out of range.
  Contact(Device& device, Index max_contact_nodes, const ContactSettings& settings = {});

  /// Sets the sums of the report to 0, and finds where the surface is after each substep.
  void begin_frame(ExecContext& ctx, const RealSurface& surface, const ContactTimes& times);
  /// Moves nodes that lie deeper than 2 spacings (up to 8) in the real object to its surface, for each body
  /// once a frame before its first `correct`, as the surface is after the first substep: where it came from
  /// nowhere. Velocities stay.
  void rescue(ExecContext& ctx, const RealSurface& surface, const ContactNodes& body);
  /// The response of method 6: gap = (x_i - x_k)·n_k - d_i < 0 moves x_i by -gap n_k, along the normal only
  /// and without touching v_i; then an approaching v_i is reflected with e and its tangential part limited by
  /// μ. Nodes that no sample is near cost little more than reading where they are.
  /// @param k substep at whose begin the nodes were corrected last @param steps after it, >= 1: where they
  /// meet the surface now; k is the device's when the times are
  void correct(ExecContext& ctx, const RealSurface& surface, const ContactNodes& body, Index k,
               Index steps = 1);
  /// Sums what there is to report.
  void end_frame(ExecContext& ctx);

  /// (1) Sums of the frame that ended.
  View<const ContactRecord> total() const { return total_.const_view(); }
  /// Of the frame that ended. Synchronises. @param dt_frame_s what the impulses are divided by @param
  /// substeps calls of `correct`
  ContactReport report(ExecContext& ctx, float dt_frame_s, int substeps) const;

 private:
  void check(const ContactNodes& body) const;
  View<ContactRecord> records_of(const ContactNodes& body) {
    return records_.view().part(body.first_record, body.nodes.size());
  }

  ContactSettings settings_;
  ContactTimes times_;
  Buffer<ContactRecord> records_, total_;
  Buffer<SurfacePoses> poses_;  ///< after 1, 2, .. substeps of this frame
};

/// What there is to report of a frame. @param dt_frame_s what the impulses are divided by @param substeps
/// calls of `correct`
ContactReport contact_report(const ContactRecord& total, float dt_frame_s, int substeps);

}  // namespace tactus
