#pragma once
/// Soft bodies that meet a real surface and obstacles, for tests of what contact does to them.
#include "contact/contact_scene.h"
#include "tactus/tissue/body_monitors.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/tissue/hybrid/hybrid.h"

namespace tactus::test {

struct SoftMaterial {
  ElasticMaterial elastic{.young_Pa = 10000, .poisson = 0.45F};
  bool matched = false;  ///< shape matching instead of elements
  float damping = 0;
  float points_per_spacing = 2;
};

/// A body, its solver and its points.
struct SoftThing {
  SoftThing(ExecContext& ctx, CubeLattice lattice_in, const TriangleMesh& surface_in,
            const SoftMaterial& material);
  ContactNodes nodes();
  BodyMonitors monitors(ExecContext& ctx) const;
  /// Sets all velocities, and moves all nodes.
  void launch(ExecContext& ctx, Vec3f v_m_s, Vec3f move_m = {});

  CubeLattice lattice;
  TriangleMesh surface;
  SoftMaterial material;
  ElementMask elements;
  Hybrid solver;
  BodyState state;
  Buffer<float> mass_kg;
  Buffer<Index> held;
  BodyPoints points;
};

/// A box of cubes and its surface.
SoftThing soft_box(ExecContext& ctx, Vec3f corner_m, Vec3i cubes, float h, const SoftMaterial& material,
                   const std::function<bool(Vec3f)>& fixed = {});
SoftThing soft_ball(ExecContext& ctx, float radius_m, float h, const SoftMaterial& material,
                    float density = 1000);

/// One body, what it touches, and the substeps.
struct SoftScene {
  SoftScene(ExecContext& context, SoftThing& soft, float sample_spacing_m,
            const ContactSettings& settings = {});
  /// A still surface.
  void show(const TriangleMesh& mesh) { show(mesh, 0); }
  void show(const TriangleMesh& mesh, float dt_s);
  /// n substeps as one frame. `dt_frame_s` > 0: the surface moves through it and ends where it was shown.
  ContactReport run(int substeps, float dt_s, Vec3f gravity_m_s2 = {}, float drag_per_s = 0,
                    bool moving = false);

  ExecContext& ctx;
  SoftThing& body;
  RealSurface surface;
  Obstacles obstacles;
  Contact contact;
};

}  // namespace tactus::test
