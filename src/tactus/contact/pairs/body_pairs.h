#pragma once
/// Contact of soft bodies with one another and with themselves.
#include <memory>
#include <span>
#include <vector>

#include "tactus/contact/contact.h"
#include "tactus/contact/pairs/pair_model.h"

namespace tactus {

/// Force and impulse of a body on another over one frame.
struct PairReaction {
  Index body = 0, other = 0;  ///< the same two: a body that touches itself
  ColliderReaction reaction;  ///< on `other`
};

/// Owns the contact state of all bodies that touch one another, on one device.
///
///   per frame: begin_frame; per substep, after all bodies moved: correct; end_frame; and where the frame was
///   waited for, pair_reactions().
///
/// The response is that of Contact: a positional push to the surface, a change of velocity with restitution
/// and friction. Both sides take part with the masses of their nodes; nodes that are held don't move.
///
/// A body that is cut goes on with apply(), between frames. The walls of a cut touch each other, however near
/// they are at rest: a point on a wall may touch the material beyond that wall.
class BodyPairs {
 public:
  /// Synchronizes. @param touch_others false: each touches itself alone
  /// @throws Error naming the setting that is out of range.
  BodyPairs(ExecContext& ctx, std::span<const PairedBody> bodies, const ContactSettings& settings = {},
            bool touch_others = true);

  /// Takes a cut of a cuttable body over, between frames; masses of its nodes have changed. Synchronizes.
  /// @throws Error for a body that is not cuttable, an id that is out of range, or where there is no
  /// capacity.
  void apply(ExecContext& ctx, Index body, const SolidChange& change);

  /// As Contact::set_response.
  void set_response(float friction, float restitution);
  void begin_frame(ExecContext& ctx);
  /// @param poses of the real surface: moments are about its centre
  void correct(ExecContext& ctx, View<const SurfacePoses> poses, const CorrectionTime& time);
  void end_frame(ExecContext& ctx);
  /// Archives the state that lasts from frame to frame. Synchronizes. @throws Error.
  void archive(ExecContext& ctx, StateArchive& a);
  Index body_count() const { return bodies_.size(); }
  /// (bodies²) Sums of the frame that ended: at a bodies + b, the effect of points of a on b.
  View<const ColliderTotals> totals() const { return totals_.const_view(); }

 private:
  /// Where the entries of a body begin; those of a body that may be cut end with its capacity.
  struct Places {
    Index point = 0, cube = 0, group = 0, row = 0;
  };
  struct PlaceMove;
  template <class T, class F>
  void archive_entries(ExecContext& ctx, StateArchive& a, const char* name, Buffer<T>& entries,
                       Index Places::*of, const std::vector<Places>& from, F&& take);
  void make_used(ExecContext& ctx);
  void archive_last_nodes(ExecContext& ctx, StateArchive& a);
  void upload_changes(ExecContext& ctx, const SolidChange& change);
  PairTable table() const;
  PairState state();

  ContactSettings settings_;
  bool touch_others_ = true;
  float smallest_mass_kg_ = 0;
  std::vector<Places> first_;         ///< (bodies + 1)
  std::unique_ptr<PairModel> model_;  ///< where a body may be cut
  Buffer<PairBody> bodies_;
  Buffer<CubePatch> patches_;
  Buffer<SolidCube> cubes_;
  Buffer<float> samples_;
  Buffer<PointGroup> groups_;
  Buffer<EmbeddedPoint> points_;
  Buffer<PointRest> rest_;
  Buffer<PairNode> nodes_;
  Buffer<Index> rows_, part_, recorded_;
  IndexLists patch_nodes_, patch_cubes_, incident_points_, incident_cubes_;
  UsedList used_groups_, used_rows_;  ///< where a body may be cut
  Buffer<PatchBox> patch_box_, body_box_, wake_box_;
  Buffer<float> cube_bounds_;
  Buffer<CubePlace> cube_places_;
  Buffer<float> patch_way_;
  Buffer<Vec3f> last_x_;
  Buffer<SelfMotion> self_motion_;
  Buffer<SelfSleep> group_sleep_, point_sleep_;
  Buffer<std::uint32_t> group_active_, row_weight_, cube_list_, next_, used_;
  Buffer<PairContact> contact_;
  Buffer<ContactRecord> records_;
  Buffer<ColliderTotals> totals_;
  Buffer<ReactionSums> moved_on_;
  Buffer<Index> staged_places_;
  Buffer<SolidCube> staged_cubes_;
  Buffer<float> staged_samples_;
  Buffer<PairPointChange> staged_points_;
};

/// Reactions of each pair of bodies that touched, both ways; the second is the first with the other sign.
/// @param totals BodyPairs::totals(), on the host
std::vector<PairReaction> pair_reactions(std::span<const ColliderTotals> totals, Index bodies,
                                         float dt_frame_s);

}  // namespace tactus
