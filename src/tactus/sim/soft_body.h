#pragma once
/// One virtual body of a scene: its lattice, its solver, the surface that is seen and the nodes that touch.
#include <string>

#include "tactus/contact/contact.h"
#include "tactus/sim/body_shape.h"
#include "tactus/tissue/body_monitors.h"
#include "tactus/tissue/embedded_surface.h"

namespace tactus {

class SoftBody {
 public:
  /// @param sample_spacing_m of the real surface: nodes within 1.5 of it below the surface take part in
  /// contact.
  SoftBody(ExecContext& ctx, const BodyDescription& body, const BodyAssets& assets, float sample_spacing_m);

  const std::string& name() const { return description_.name; }
  Index node_count() const { return tissue_.node_count(); }
  Index contact_node_count() const { return contact_nodes_.size(); }
  const Hybrid& tissue() const { return tissue_; }
  /// Substeps for which the body is stable as strained as it was at the end of the last frame.
  int substeps_for(float dt_frame_s) const { return tissue_.substeps_for(dt_frame_s, strain_.speed_ratio); }
  /// Of the moved regions, in the description's order: mean force on the body over the last frame [N].
  /// Synchronizes.
  std::vector<Vec3d> motion_forces_N(ExecContext& ctx, double dt_frame_s) const {
    return driven_.mean_forces_N(ctx, dt_frame_s);
  }
  /// Keeps the state to come back to, should this frame blow up. Asynchronous.
  void begin_frame(ExecContext& ctx);
  /// Reads how strained the elements are. A body whose positions are no longer numbers goes back to where it
  /// was at the beginning of the frame and rests there from then on. Synchronizes.
  /// @returns "" or what happened, where and why.
  std::string end_frame(ExecContext& ctx);
  const tled::CubeExtremes& strain() const { return strain_; }
  bool at_rest() const { return at_rest_; }
  /// "cube 17, at rest round (0.1, 0.2, 0.3) m in region 'tumour'".
  std::string cube_text(Index cube) const;
  /// Energies, momentum, volume. Synchronizes.
  BodyMonitors monitors(ExecContext& ctx) const;

  /// One substep without contact: loads, the solver, and then the nodes that are moved. Asynchronous.
  void step(ExecContext& ctx, float dt_s, Vec3f gravity_m_s2);
  /// The nodes as contact sees them.
  ContactNodes contact_nodes();
  /// Brings the seen surface to where the nodes are. Asynchronous.
  void update_surface(ExecContext& ctx) { surface_.update(ctx, state_); }
  /// The seen surface on the host. Synchronizes.
  TriangleMesh surface(ExecContext& ctx) const { return surface_.to_mesh(ctx); }
  /// Per triangle of the seen surface: 1 where elements deform it. Synchronizes.
  std::vector<std::uint8_t> element_triangles(ExecContext& ctx) const;
  /// Positions of all nodes on the host [m]. Synchronizes.
  std::vector<Vec3f> positions_m(ExecContext& ctx) const { return to_host(ctx, state_.x_m.view()); }
  /// The node whose rest position is nearest.
  Index nearest_node(Vec3f rest_m) const;

 private:
  SoftBody(ExecContext& ctx, const BodyDescription& body, BodyShape shape, float sample_spacing_m);

  void warn_of_fast_motion(const NodeMotion& motion) const;

  BodyDescription description_;
  BodyShape shape_;
  TledOptions element_options_;
  Hybrid tissue_;
  bool at_rest_ = false;
  tled::CubeExtremes strain_{1, 0, 1, 0, 0};
  BodyState state_;
  Buffer<Vec3f> frame_begin_x_m_;
  EmbeddedSurface surface_;
  bool full_stiffness_;
  Buffer<float> mass_kg_, rest_gap_m_;
  Buffer<Index> contact_nodes_, fixed_;
  Buffer<ContactMemory> memory_;
  DrivenNodes driven_;
  SurfaceLoads loads_;
};

}  // namespace tactus
