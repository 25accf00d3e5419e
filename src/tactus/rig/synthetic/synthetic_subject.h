#pragma once
/// The subject of a synthetic data set: a body whose shape, paint and motion are known at any time.
#include <memory>
#include <string>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"
#include "tactus/geom/mesh/mesh.h"

namespace tactus {

class SyntheticSubject {
 public:
  virtual ~SyntheticSubject() = default;
  /// Contains it at all times.
  virtual Box3f bounds_m() const = 0;
  /// The view of one camera: `mask` of its size, and radial distances [m], 0 beside the body.
  virtual void see(const Camera& camera, double time_s, BitMask& mask, DepthImage& distance_m) const = 0;
  /// Closed surface, without normals.
  virtual TriangleMesh surface(double time_s) const = 0;
  /// Velocity of the material at a point of the surface [m/s].
  virtual Vec3f velocity_m_s(Vec3f p_m, double time_s) const = 0;
  virtual double volume_m3(double time_s) const = 0;
  /// Colour of the material there: bands that are fixed to the body (to its root, when it bends).
  Rgb8 paint(Vec3f p_m, double time_s) const;

 protected:
  /// Pose of the frame that the paint is fixed to.
  virtual Rigidf T_world_body(double time_s) const = 0;
};

/// A built-in figure (also "hand-moving", "hand-still"). @throws usage_error for an unknown one.
std::unique_ptr<SyntheticSubject> make_figure_subject(const std::string& name, bool moving);
/// A closed mesh, put in the middle of the unit cube with its longest side `size_m`, that turns about the
/// vertical `turns_per_s` times a second. @throws Error: without triangles, a size that is not positive or
/// above 1 m.
std::unique_ptr<SyntheticSubject> make_mesh_subject(TriangleMesh mesh, double size_m, double turns_per_s);

}  // namespace tactus
