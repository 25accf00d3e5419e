#pragma once
/// The reconstructed surface as contact sees it: evenly spread samples with outward normals and velocities,
/// made afresh from the mesh of every frame, on the device (method: adaptive sampling as Akinci et al. 2013).
/// Triangles that hang together through shared vertices move as one; two hands, or a hand and a tool, each
/// for itself.
#include "tactus/contact/real/fit_kernels.h"
#include "tactus/contact/real/sample_level.h"
#include "tactus/contact/real/surface_report.h"
#include "tactus/contact/surface_triangles.h"
#include "tactus/frame/state_archive.h"
#include "tactus/geom/mesh/mesh_view.h"

namespace tactus {

struct RealSurfaceSettings {
  /// s [m]: no point of the surface is farther than s from a sample; the lattice's spacing or less.
  float sample_spacing_m = 0.005F;
  Index max_vertices = 1 << 17, max_triangles = 1 << 18;  ///< of the meshes that come
  Index max_raw_samples = 1 << 18;  ///< samples before thinning: triangles, each cut to edges <= 1.25 s
  Index max_samples = 1 << 16;      ///< after thinning, about 3 for each s² of surface
  /// A component whose centre is faster is an error of reconstruction, and touches nothing in that frame.
  float max_speed_m_s = 6;
};

class RealSurface {
 public:
  /// @throws Error naming the setting that is out of range.
  RealSurface(Device& device, const RealSurfaceSettings& settings);

  /// Takes over the mesh of a new frame; where it has no normals, its triangles' are used. @param
  /// dt_capture_s time since the last frame's capture [s]: the velocity is the motion divided by it; <= 0:
  /// the first frame, or a break; it stands still.
  /// @throws Error when the mesh's views are larger than the settings' capacities.
  void update(ExecContext& ctx, const MeshView& mesh, float dt_capture_s);
  /// The same where dt_capture_s is on the device (1). After the first frame, it may be recorded.
  void update(ExecContext& ctx, const MeshView& mesh, View<const float> dt_capture_s);

  /// From the next update on, samples are so many of the settings' spacings apart, at least 1. Contacts are
  /// the same to rounding; how components move is found from fewer points.
  void set_coarseness(float spacings);

  /// Samples for contact: cells of 2 s.
  SamplesView samples() const { return fine_.view(); }
  /// Few samples for searches from afar: one for each cube of 4 s and direction; cells of 8 s.
  SamplesView coarse_samples() const { return coarse_.view(); }
  /// Triangles that decide whether a point touches.
  SurfaceTrianglesView triangles() const {
    return {balls_.const_view(),         corners_.const_view(),      triangle_component_.const_view(),
            triangle_face_.const_view(), fine_.input_cells().ranges, fine_.view().near_rows};
  }
  /// The component of each of the last update's first `vertices` vertices; kNoComponent: one that is too
  /// small to have a motion of its own. Synchronizes.
  std::vector<Index> vertex_components(ExecContext& ctx, Index vertices) const;
  /// The same for kernels.
  VertexMotions vertex_motions() const {
    return {parent_.const_view(),     component_number_.const_view(), last_components_.const_view(),
            components_.const_view(), motions_.const_view(),          fit_.const_view()};
  }
  /// There is no surface yet. Asynchronous.
  void clear(ExecContext& ctx);
  /// Archives the state that can't be made from the last frame's mesh: labels and motions of its components.
  /// The surface must have been updated to that mesh. Synchronizes. @throws Error.
  void archive(ExecContext& ctx, StateArchive& a);
  /// (1) The separate components.
  View<const SurfaceComponents> components() const { return components_.const_view(); }
  /// (kComponents) How each component moves from this frame on.
  View<const SurfaceMotion> motions() const { return motions_.const_view(); }
  /// (1) Of the last update.
  View<const RealSurfaceReport> report_view() const { return report_.const_view(); }
  const RealSurfaceSettings& settings() const { return settings_; }
  /// Changes when what there is to touch does. Recorded updates don't count.
  std::int64_t version() const { return version_; }
  /// Synchronises.
  RealSurfaceReport report(ExecContext& ctx) const;

 private:
  void keep_last_frame(ExecContext& ctx);
  void join_vertices(ExecContext& ctx, const MeshView& mesh);
  void make_samples(ExecContext& ctx, const MeshView& mesh);
  void find_components(ExecContext& ctx);
  void fit_motion(ExecContext& ctx, View<const float> dt_capture_s);

  RealSurfaceSettings settings_;
  float spacing_m_;  ///< s, as it is now
  bool has_frame_ = false;
  std::int64_t version_ = 1;
  Buffer<Index> cuts_, first_, raw_count_, raw_overflow_;
  Buffer<Vec3f> x_m_, n_;
  Buffer<float> area_m2_;
  Buffer<Index> root_, triangle_, component_number_, triangle_component_, triangle_face_;
  Buffer<TriangleBall> balls_;
  Buffer<TriangleCorners> corners_;
  Buffer<std::uint32_t> parent_, component_samples_, candidates_, candidate_count_;
  SampleLevel fine_, coarse_;
  Buffer<float> dt_capture_s_;
  Buffer<Vec3f> previous_m_;
  Buffer<FitState> fit_;
  Buffer<FitSums> fit_points_;
  Buffer<ComponentSums> component_parts_;
  Buffer<SurfaceComponents> components_, last_components_;
  Buffer<SurfaceMotion> motions_;
  Buffer<MeasuredMotions> measured_;
  Buffer<RealSurfaceReport> report_;
};

}  // namespace tactus
