#pragma once
/// Shapes, and nodes that meet them, for the contact tests.
#include <functional>
#include <vector>

#include "tactus/contact/contact.h"
#include "tactus/geom/mesh/mesh.h"

namespace tactus::test {

/// A closed sphere of unit radius from a cube of n x n quads a face.
TriangleMesh unit_sphere(Index n);
/// A closed box centred at 0, n x n quads a face, corners kept sharp (no normals).
TriangleMesh box(Vec3f half_m, Index n);
TriangleMesh transformed(TriangleMesh mesh, const Rigidf& T, float scale = 1);
/// Both, as separate components.
TriangleMesh together(TriangleMesh a, const TriangleMesh& b);

/// A mesh in device memory.
struct DeviceMesh {
  DeviceMesh(ExecContext& ctx, const TriangleMesh& mesh);
  MeshView view() const;
  Buffer<Vec3f> vertices, normals;
  Buffer<Vec3i> triangles;
};

/// Settings with small capacities.
RealSurfaceSettings small_surface(float spacing_m);

/// Points on the host that meet a surface on a device; each is a node of its own.
struct Nodes {
  std::vector<Vec3f> x, v;
  std::vector<float> mass;
  std::vector<Index> fixed;
  explicit Nodes(std::vector<Vec3f> positions, float mass_kg = 1e-3F);
  /// Uploads, corrects at the end of substep k, downloads. What they touch is kept from call to call.
  void correct(ExecContext& ctx, Contact& contact, const RealSurface& surface, Index k, bool push_out = false,
               View<const Obstacle> obstacles = {}, Index later_steps = 1);
  /// Begins the records of a frame.
  void begin_frame(ExecContext& ctx);
  ContactReport report(ExecContext& ctx, float dt_frame_s, int substeps);
  BodyPoints points;

 private:
  void make_points(ExecContext& ctx);
};

/// Block of nodes around a centre.
std::vector<Vec3f> block(Vec3i count, float spacing_m, Vec3f center_m);

}  // namespace tactus::test
