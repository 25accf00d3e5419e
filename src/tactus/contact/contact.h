#pragma once
/// Contact of bodies with the real surface, with obstacles that stand still and with tools. One-way: nothing
/// moves those; the forces on them are reported.
#include <cstdint>
#include <span>
#include <vector>

#include "tactus/contact/body_points.h"
#include "tactus/contact/contact_report.h"
#include "tactus/contact/obstacles.h"
#include "tactus/contact/response_kernels.h"
#include "tactus/geom/search/near_walls.h"
#include "tactus/geom/search/neighbour_cells.h"

namespace tactus {

struct ContactSettings {
  /// e, 0..1: share of its approach velocity with which a point of a body leaves the surface that it hits.
  /// That is not how high a soft body rebounds: the body stores the energy of the blow and gives it back for
  /// any e, less the loss by `damping`. e = 0 takes the kinetic energy of the nodes at the surface, e = 1
  /// takes nothing; no e adds any.
  float restitution = 0;
  float friction = 0.5F;                              ///< μ >= 0: Coulomb
  ContactResponse response = ContactResponse::exact;  ///< of the real surface; paper leaves e out
};

/// @throws Error naming the setting that is out of range.
ContactSettings checked(const ContactSettings& settings);

/// Order in a frame, all on one context and without a read-back:
///   surface.update(mesh, dt); contact.begin_frame(surface, times); for each body
///   points.begin_frame(contact.frame()), contact.push_out(); for each substep k: integrate;
///   contact.correct(k); for each body points.end_frame(); and where the frame was waited for,
///   contact_report().
class Contact {
 public:
  /// @throws Error naming the setting that is out of range.
  explicit Contact(Device& device, const ContactSettings& settings = {});

  /// Finds where the surface and tools are after each substep. @param tools as Obstacles counts them
  /// @throws Error for more than kMostSubsteps.
  void begin_frame(ExecContext& ctx, const RealSurface& surface, const ContactTimes& times,
                   View<const ToolMotion> tools = {});
  /// Moves points that lie deeper than 2 spacings (up to 8) in the real object to its surface, for each body
  /// once a frame before its first `correct`, as the surface is after the first substep: where it came from
  /// nowhere. Velocities stay.
  void push_out(ExecContext& ctx, const RealSurface& surface, BodyPoints& points, const ContactNodes& nodes);
  /// Points that are inside go back to the surface; an approaching velocity is reflected with e and its
  /// tangential part limited by μ. Points that nothing is near sleep (find_kernels.h).
  /// @param k substep at whose begin the points were corrected last, the device's when the times are
  /// @param later_steps >= 1: points that do not belong to the first part are corrected in substeps 0,
  /// later_steps, .. alone, and meet the surface as it is so many later
  void correct(ExecContext& ctx, const RealSurface& surface, View<const Obstacle> obstacles,
               BodyPoints& points, const ContactNodes& nodes, Index k, Index later_steps = 1);
  /// Adds the real surface and obstacles to the walls within reach of particles, where they are when substep
  /// k is over. @param first_collider walls are of first_collider + collider
  void find_walls(ExecContext& ctx, const RealSurface& surface, View<const Obstacle> obstacles,
                  View<const SearchParticle> particles, Count count, float reach_m, Index first_collider,
                  Index k, const NearWalls& near) const;
  /// Between frames. A recorded frame must be recorded anew. @throws Error as the constructor.
  void set_response(float friction, float restitution);
  /// After 1, 2, .. substeps of this frame.
  View<const SurfacePoses> poses() const { return poses_.const_view().part(first_pose_, kMostSubsteps); }
  /// The frame that began last.
  ContactFrame frame() const { return frame_; }
  /// Something that may be touched came or went: searches of the frame before are void in the next one.
  void invalidate() { is_changed_ = true; }

 private:
  ContactSettings settings_;
  ContactTimes times_;
  ContactFrame frame_;
  bool is_changed_ = true;
  std::int64_t surface_version_ = 0;
  Index first_pose_ = 0;        ///< of this frame
  Buffer<SurfacePoses> poses_;  ///< of this frame and, on a CPU, of the one before
  Buffer<float> sample_m3_;     ///< with the paper's response
};

/// Forces and impulses of a body on all colliders over the frame that ended. @param totals
/// BodyPoints::totals(), on the host @param dt_frame_s time by which impulses are divided @param substeps
/// calls of `correct`
ContactReport contact_report(std::span<const ColliderTotals> totals, float dt_frame_s, int substeps);

}  // namespace tactus
