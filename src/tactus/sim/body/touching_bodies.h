#pragma once
/// The bodies of a scene that touch one another or themselves.
#include <memory>
#include <optional>
#include <vector>

#include "tactus/contact/pairs/body_pairs.h"
#include "tactus/frame/readback.h"
#include "tactus/frame/schedule.h"
#include "tactus/frame/state_archive.h"
#include "tactus/sim/body/cut_solid.h"
#include "tactus/sim/body/soft_body.h"

namespace tactus {

/// How far a body reaches into another at rest.
struct BodyOverlap {
  float depth_m = 0;
  Vec3f at_m;  ///< the deepest point
};
/// Overlap of the surfaces, each sampled every `spacing_m`; nothing for bodies that only touch.
std::optional<BodyOverlap> overlap_at_rest(const TriangleMesh& a, MeshFill fill_a, const TriangleMesh& b,
                                           MeshFill fill_b, float spacing_m);

/// Declares their contact in a frame, after all of them moved. Owns nothing when nothing can touch.
class TouchingBodies {
 public:
  /// Warns of bodies that overlap at rest. Synchronizes.
  TouchingBodies(ExecContext& ctx, const std::vector<std::unique_ptr<SoftBody>>& bodies,
                 const ContactDescription& contact, const FrameDescription& frame);
  /// Once bodies were rebuilt: their contact is as it was made, and stages are added anew. Synchronizes.
  void rebuild(const std::vector<std::unique_ptr<SoftBody>>& bodies, const ContactDescription& contact);
  /// After the stages of the bodies. `contact` and this must outlive the schedule's runs.
  void add_stages(Schedule& schedule, Readback& readback, const Contact& contact);
  /// As Contact::set_response.
  void set_response(float friction, float restitution) {
    if (pairs_) pairs_->set_response(friction, restitution);
  }
  /// Takes a cut of a body over, between frames: its walls touch each other and other bodies. Synchronizes.
  /// @param body place in the scene @param points as the body's contact points count them
  void apply(Index body, const cut::BodyCutter& cutter, const TopologyChange& change,
             std::span<const PointChange> points);
  /// State that contact keeps from frame to frame. Synchronizes. @throws Error.
  void archive(StateArchive& a) {
    if (pairs_) pairs_->archive(ctx_, a);
  }
  /// Record that its last stage leaves for the host; none where nothing can touch.
  std::vector<Resource> report_resources() const;
  /// Reactions of bodies on one another over the frame that was waited for, by their places in the scene.
  std::vector<PairReaction> reactions(const Readback& readback, float dt_frame_s) const;

 private:
  ExecContext& ctx_;
  std::vector<Index> body_of_;   ///< in the scene's order
  std::vector<Resource> nodes_;  ///< of those
  std::unique_ptr<BodyPairs> pairs_;
  int every_ = 1;
  std::vector<std::optional<CutSolid>> solid_;  ///< of cuttable ones
  Readback::Place report_;
};

}  // namespace tactus
