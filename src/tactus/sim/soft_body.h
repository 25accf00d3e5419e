#pragma once
/// One virtual body of a scene: its lattice, its solver, the surface that is seen and the nodes that touch.
#include <map>
#include <string>

#include "tactus/contact/contact.h"
#include "tactus/geom/label_volume.h"
#include "tactus/sim/scene.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/tissue/hybrid/hybrid.h"

namespace tactus {

/// What shapes need from files, by the body's name; in the file's own coordinates, metres.
struct BodyAssets {
  std::map<std::string, TriangleMesh> meshes;
  std::map<std::string, LabelVolume> labels;
};

/// A body's shape, placed in the world, and what its cubes are made of.
struct BodyShape {
  TriangleMesh surface_m;             ///< closed, world
  CubeLattice lattice;                ///< with masses and the fixed nodes of the description
  std::vector<float> node_outside_m;  ///< rest signed distance of every node to the surface
  ElementMask elements;
  std::vector<ElasticMaterial> materials;
  std::vector<std::uint8_t> material_of_cube;
};
/// @throws Error naming the body for a shape that cannot become a lattice (open mesh, spacing larger than the
/// body, ...).
BodyShape make_body_shape(const BodyDescription& body, const BodyAssets& assets);

class SoftBody {
 public:
  /// @param sample_spacing_m of the real surface: nodes within 1.5 of it below the surface take part in
  /// contact.
  SoftBody(ExecContext& ctx, const BodyDescription& body, const BodyAssets& assets, float sample_spacing_m);

  const std::string& name() const { return name_; }
  Index node_count() const { return tissue_.node_count(); }
  Index contact_node_count() const { return contact_nodes_.size(); }
  const Hybrid& tissue() const { return tissue_; }
  /// Substeps for which the body is stable as strained as it was at the end of the last frame.
  int substeps_for(float dt_frame_s) const { return tissue_.substeps_for(dt_frame_s, strain_.speed_ratio); }
  /// Reads how strained the elements are. Synchronizes.
  void measure_strain(ExecContext& ctx) { strain_ = tissue_.extremes(ctx); }
  const tled::CubeExtremes& strain() const { return strain_; }

  /// One substep without contact. Asynchronous.
  void step(ExecContext& ctx, float dt_s, Vec3f gravity_m_s2);
  /// The nodes as contact sees them.
  ContactNodes contact_nodes();
  /// Brings the seen surface to where the nodes are. Asynchronous.
  void update_surface(ExecContext& ctx) { surface_.update(ctx, state_); }
  /// The seen surface on the host. Synchronizes.
  TriangleMesh surface(ExecContext& ctx) const { return surface_.to_mesh(ctx); }
  /// Positions of all nodes on the host [m]. Synchronizes.
  std::vector<Vec3f> positions_m(ExecContext& ctx) const { return to_host(ctx, state_.x_m.view()); }
  /// The node whose rest position is nearest.
  Index nearest_node(Vec3f rest_m) const;

 private:
  SoftBody(ExecContext& ctx, const BodyDescription& body, BodyShape shape, float sample_spacing_m);

  std::string name_;
  std::vector<Vec3f> rest_m_;
  Hybrid tissue_;
  tled::CubeExtremes strain_{1, 0, 1, 0, 0};
  BodyState state_;
  EmbeddedSurface surface_;
  bool full_stiffness_;
  Buffer<float> mass_kg_, rest_gap_m_;
  Buffer<Index> contact_nodes_, fixed_;
  Buffer<ContactMemory> memory_;
};

}  // namespace tactus
