#pragma once
/// One virtual body of a scene: its lattice, its solver, the surface that is seen and the nodes that touch.
#include <string>

#include "tactus/contact/contact.h"
#include "tactus/multi_device/device_replay.h"
#include "tactus/sim/body_shape.h"
#include "tactus/tissue/body_monitors.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/tissue/hybrid/hybrid_slabs.h"

namespace tactus {

class SoftBody {
 public:
  /// Lives on the first device; one that nothing touches is stepped by as many as pay.
  /// @param sample_spacing_m of the real surface: nodes within 1.5 of it below the surface take part in
  /// contact.
  SoftBody(DeviceSet& devices, const BodyDescription& body, const BodyAssets& assets, float sample_spacing_m);

  const std::string& name() const { return description_.name; }
  Index node_count() const { return shape_.lattice.node_count(); }
  Index contact_node_count() const { return contact_nodes_.size(); }
  /// What it says of steps holds for the body; its nodes may be a part of the body's.
  const Hybrid& model() const { return tissue_.model(); }
  /// Substeps for which the body is stable as strained as it was at the end of the last frame.
  int substeps_for(float dt_frame_s) const { return model().substeps_for(dt_frame_s, strain_.speed_ratio); }
  /// Of the moved regions, in the description's order: mean force on the body over the last frame [N].
  /// Synchronizes.
  std::vector<Vec3d> motion_forces_N(double dt_frame_s) { return tissue_.motion_forces_N(dt_frame_s); }
  /// Keeps the state to come back to, should this frame blow up. Asynchronous.
  void begin_frame(ExecContext& ctx);
  /// Reads how strained the elements are and what was noted. A body that blew up goes back to where it was at
  /// the beginning of the frame and rests there from then on. Synchronizes.
  /// @param substeps of the frame
  /// @returns "" or what happened: substep, node, and what acts there.
  std::string end_frame(ExecContext& ctx, int substeps);
  const tled::CubeExtremes& strain() const { return strain_; }
  bool at_rest() const { return at_rest_; }
  /// Fastest over the last frame [m/s]; node -1: nothing moved.
  float fastest_m_s() const;
  Index fastest_node() const { return watched_.fastest_node; }
  /// How fast strain travels through what it is made of, at most [m/s].
  double wave_m_s() const;
  /// What acts on the body next to where it rests at p_m: "'moved[0]' (grip) moves it, at up to 0.3 m/s",
  /// "'fixed' holds it, 0.02 m from there"; "" for nothing. Synchronizes.
  std::string acting_near(ExecContext& ctx, Vec3f p_m) const;
  /// Centre of a cube at rest [m].
  Vec3f cube_center_m(Index cube) const;
  /// @throws Error when the elements are not stable in so many substeps, or shape matching, at its rate,
  /// would be softer than its material; warns, once, when so few make shape matching softer than its
  /// material.
  void check_substeps(float dt_frame_s, int substeps);
  /// "node 17, at rest at (0.1, 0.2, 0.3) m".
  std::string node_text(Index node) const;
  Vec3f rest_m(Index node) const { return shape_.lattice.rest_m(node); }
  /// "cube 17, at rest round (0.1, 0.2, 0.3) m in region 'tumour'".
  std::string cube_text(Index cube) const;
  /// Energies, momentum, volume. Synchronizes.
  BodyMonitors monitors(ExecContext& ctx) const;

  /// Whether the real surface never touches it: it goes a frame at a time.
  bool is_untouched() const { return !description_.contact; }
  /// Devices that step it, and why no more of those there are.
  int device_count() const { return tissue_.slab_count(); }
  std::string devices_text() const;
  /// All substeps of a frame of an untouched body on one device. Asynchronous.
  void step_frame(float dt_s, Vec3f gravity_m_s2, int substeps);
  /// The same on several devices. Asynchronous.
  void step_frame_on_all(float dt_s, Vec3f gravity_m_s2, int substeps);

  /// Substep k of a frame before contact: loads, the solver, and then the nodes that are moved. Asynchronous.
  void step(float dt_s, Vec3f gravity_m_s2, int k);
  /// Contact at its end. Where shape matching goes several substeps at once, the nodes that it alone moves
  /// touch the surface once for all of them, where it will be at their end. Asynchronous.
  void touch(ExecContext& ctx, Contact& contact, const RealSurface& surface, int k);
  /// And then: notes nodes that are no longer where anything could be and, after the last substep, how
  /// strained the elements are. Asynchronous.
  void watch(int k, int substeps);
  /// Where its records of contact begin among those of all bodies.
  void set_first_record(Index first) { first_record_ = first; }
  /// Substeps of a frame are a multiple of this.
  int matching_every() const { return model().flsm() ? description_.matching_every : 1; }
  /// The nodes as contact sees them.
  ContactNodes contact_nodes();
  /// Brings the seen surface to where the nodes are. Asynchronous.
  void update_surface(ExecContext& ctx) { surface_.update(ctx, tissue_.body()); }
  /// The seen surface on the host. Synchronizes.
  TriangleMesh surface(ExecContext& ctx) const { return surface_.to_mesh(ctx); }
  /// Per triangle of the seen surface: 1 where elements deform it. Synchronizes.
  std::vector<std::uint8_t> element_triangles(ExecContext& ctx) const;
  /// Positions of all nodes on the host [m]. Synchronizes.
  std::vector<Vec3f> positions_m(ExecContext& ctx) const {
    return to_host(ctx, tissue_.body().x_m.const_view());
  }
  /// At rest.
  const BodyShape& shape() const { return shape_; }

 private:
  SoftBody(DeviceSet& devices, const BodyDescription& body, BodyShape shape, float sample_spacing_m);

  HybridStep step_of(float dt_s, Vec3f gravity_m_s2) const;
  int watch_every(int substeps) const;
  void choose_contact_nodes(ExecContext& ctx, float sample_spacing_m);
  void warn_of_fast_motion(const NodeMotion& motion) const;

  BodyDescription description_;
  BodyShape shape_;
  TledOptions element_options_;
  DeviceSet& devices_;
  HybridSlabs tissue_;
  bool at_rest_ = false, warned_of_softness_ = false;
  tled::CubeExtremes strain_{1, 0, 1, 0, 0};
  WatchRecord watched_;
  Buffer<Vec3f> frame_begin_x_m_;
  EmbeddedSurface surface_;
  bool full_stiffness_;
  Buffer<float> mass_kg_, rest_gap_m_;
  Buffer<Index> contact_nodes_;
  Index first_record_ = 0;
  Index element_contact_nodes_ = 0;  ///< the first so many; the others only shape matching moves
  Buffer<ContactMemory> memory_;
  DeviceReplay slabs_replay_;
  std::pair<float, int> slabs_plan_{};  ///< of that recording: step, substeps
};

}  // namespace tactus
