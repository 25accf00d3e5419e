#pragma once
/// The reconstructed surface as contact sees it: evenly spread samples with outward normals and a velocity,
/// made afresh from the mesh of every frame, on the device (method: adaptive sampling as Akinci et al. 2013).
#include "tactus/contact/motion_kernels.h"
#include "tactus/contact/sample_level.h"

namespace tactus {

struct RealSurfaceSettings {
  /// s [m]: no point of the surface is farther than s from a sample; the lattice's spacing or less.
  float sample_spacing_m = 0.005F;
  Index max_vertices = 1 << 17, max_triangles = 1 << 18;  ///< of the meshes that come
  Index max_pieces = 1 << 18;   ///< samples before thinning: triangles, each cut to edges <= 1.25 s
  Index max_samples = 1 << 16;  ///< after thinning, about 3 for each s² of surface
  float max_speed_m_s =
      5;  ///< a faster centre of gravity is an error of reconstruction, taken as standing still
};

/// A mesh on the device. Counts may be known on the device only; capacities are the views' sizes.
struct SurfaceMeshView {
  View<const Vec3f> vertices_m;
  Count vertex_count = 0;
  View<const Vec3f> normals;    ///< unit, outward, one per vertex; empty: the triangles' are used
  View<const Vec3i> triangles;  ///< counter-clockwise from outside
  Count triangle_count = 0;
};

/// What is reported of a surface, read when the caller synchronises anyway.
struct RealSurfaceReport {
  Index samples = 0;
  Index dropped_pieces = 0, dropped_samples = 0;  ///< > 0: overflow; raise max_pieces or max_samples
  SurfaceMotion motion;
};

class RealSurface {
 public:
  /// @throws Error naming the setting that is out of range.
  RealSurface(Device& device, const RealSurfaceSettings& settings);

  /// Takes over the mesh of a new frame. @param dt_capture_s time since the last frame's capture [s]: the
  /// velocity is the motion divided by it; <= 0: the first frame, or a break; it stands still.
  /// @throws Error when the mesh's views are larger than the settings' capacities.
  void update(ExecContext& ctx, const SurfaceMeshView& mesh, float dt_capture_s);

  /// Samples for contact: cells of 2 s.
  SamplesView samples() const { return fine_.view(); }
  /// Few samples for what is far: one for each cube of 4 s and direction; cells of 8 s.
  SamplesView coarse_samples() const { return coarse_.view(); }
  /// (1) How the surface moves from this frame on.
  View<const SurfaceMotion> motion() const { return motion_.const_view(); }
  const RealSurfaceSettings& settings() const { return settings_; }
  /// Synchronises.
  RealSurfaceReport report(ExecContext& ctx) const;

 private:
  void make_samples(ExecContext& ctx, const SurfaceMeshView& mesh);
  void fit_motion(ExecContext& ctx, float dt_capture_s);

  RealSurfaceSettings settings_;
  bool has_frame_ = false;
  Buffer<Index> pieces_, first_, piece_count_, piece_overflow_;
  Buffer<Vec3f> x_m_, n_;
  Buffer<float> area_m2_;
  SampleLevel fine_, coarse_;
  Buffer<Vec3f> previous_m_;
  Buffer<FitState> fit_;
  Buffer<FitSums> fit_points_, fit_parts_;
  Buffer<SurfaceMotion> motion_;
};

}  // namespace tactus
