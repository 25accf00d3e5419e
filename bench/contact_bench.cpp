/// Substeps of bodies that are touched, beside the rows of those that nobody touches.
#include "bench.h"
#include "tactus/multi_device/device_replay.h"
#include "tactus/sim/body/slab_points.h"
#include "tissue_rows.h"

namespace tactus::bench {
namespace {

constexpr int kSubsteps = 20;
/// Of each point of the surface in every substep: its nodes and weights, where it was when it was looked at,
/// and whether it touches.
constexpr double kBytesPerPoint = sizeof(EmbeddedPoint) + sizeof(PointNeighbours) + 2 * sizeof(Index);

TriangleMesh box_mesh(Vec3f min_m, Vec3f max_m) {
  TriangleMesh mesh;
  for (int q = 0; q < 8; ++q)
    mesh.positions_m.push_back({(q & 1) != 0 ? max_m.x : min_m.x, (q & 2) != 0 ? max_m.y : min_m.y,
                                (q & 4) != 0 ? max_m.z : min_m.z});
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

/// In rings round y.
TriangleMesh ball_mesh(Vec3f center_m, float radius_m) {
  constexpr Index kRings = 40, kAround = 80;  // triangles
  TriangleMesh mesh;
  mesh.positions_m = {center_m - Vec3f{0, radius_m, 0}, center_m + Vec3f{0, radius_m, 0}};
  const auto at = [](Index ring, Index k) { return 2 + (ring - 1) * kAround + k % kAround; };
  for (Index ring = 1; ring < kRings; ++ring) {
    const SinCos up = sin_cos(kPi * static_cast<float>(ring) / kRings);
    for (Index k = 0; k < kAround; ++k) {
      const SinCos round = sin_cos(2 * kPi * static_cast<float>(k) / kAround);
      mesh.positions_m.push_back(center_m +
                                 radius_m * Vec3f{up.sin * round.cos, -up.cos, up.sin * round.sin});
    }
  }
  for (Index k = 0; k < kAround; ++k) {
    mesh.triangles.push_back({0, at(1, k), at(1, k + 1)});
    mesh.triangles.push_back({1, at(kRings - 1, k + 1), at(kRings - 1, k)});
    for (Index ring = 1; ring + 1 < kRings; ++ring) {
      mesh.triangles.push_back({at(ring, k), at(ring + 1, k), at(ring + 1, k + 1)});
      mesh.triangles.push_back({at(ring, k), at(ring + 1, k + 1), at(ring, k + 1)});
    }
  }
  return mesh;
}

/// A body that two balls pinch in the middle; their radius is a fifth of its width.
class Touched {
 public:
  Touched(DeviceSet& devices, const TissueCase& body, const ElasticMaterial& material)
      : devices_(devices),
        tissue_(devices,
                {.lattice = body.lattice,
                 .elements = body.elements,
                 .materials = {&material, 1},
                 .tled = body.options,
                 .flsm = body.matched},
                {.least_elements = 0, .changes = 1}),
        points_(tissue_, body.lattice, body_boundary(body.lattice, surface_of(body.lattice), body.elements)),
        world_(devices, tissue_.slab_count(),
               {.sample_spacing_m = body.lattice.spacing_m,
                .max_vertices = 1 << 13,
                .max_triangles = 1 << 14,
                .max_raw_samples = 1 << 16,
                .max_samples = 1 << 15},
               {}, {}),
        frame_(devices),
        every_(body.matching_every),
        step_{.dt_s = body.step_s > 0 ? body.step_s : tissue_.stable_step_s(),
              .matching_every = body.matching_every} {
    tissue_.follow(frame_);
    frame_.begin({.dt_s = step_.dt_s, .gravity_m_s2 = {}, .substeps = kSubsteps});
    show_balls(body.lattice);
    world_.begin_frame(frame_);
    tissue_.begin_frame();
    tissue_.begin_substeps();
    points_.begin_frame(world_);
    tissue_.end_substeps(0);
    devices_.synchronize();
  }
  ~Touched() { devices_.synchronize(); }
  void run() {
    replay_.run(devices_, [&] {
      tissue_.begin_substeps();
      for (int k = 0; k < kSubsteps; ++k) {
        tissue_.substep(step_, k, kSubsteps);
        points_.correct(world_, k, every_);
      }
      tissue_.end_substeps(kSubsteps);
    });
    devices_.synchronize();
  }
  int slabs() const { return tissue_.slab_count(); }
  Index points() const { return points_.count(); }
  Index touched() const { return static_cast<Index>(points_.touched().size()); }

 private:
  static Vec3f size_m(const CubeLattice& lattice) {
    return lattice.spacing_m * vec_cast<float>(lattice.node_dims - Vec3i{1, 1, 1});
  }
  static TriangleMesh surface_of(const CubeLattice& lattice) {
    return box_mesh(lattice.origin_m, lattice.origin_m + size_m(lattice));
  }
  void show_balls(const CubeLattice& lattice) {
    const Vec3f size = size_m(lattice);
    const float radius = 0.2F * size.x;
    TriangleMesh balls = ball_mesh({0.5F * size.x, size.y + 0.96F * radius, 0.5F * size.z}, radius);
    const TriangleMesh below = ball_mesh({0.5F * size.x, -0.96F * radius, 0.5F * size.z}, radius);
    const auto first = static_cast<Index>(balls.positions_m.size());
    balls.positions_m.insert(balls.positions_m.end(), below.positions_m.begin(), below.positions_m.end());
    for (const auto& t : below.triangles)
      balls.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    std::vector<Vec3i> triangles;
    for (const auto& t : balls.triangles) triangles.push_back({t[0], t[1], t[2]});
    vertices_ = to_device(devices_.context(0), balls.positions_m);
    triangles_ = to_device(devices_.context(0), triangles);
    world_.update({vertices_.const_view(), triangles_.const_view(), vertices_.size(), triangles_.size(), {}},
                  frame_);
  }

  DeviceSet& devices_;
  BodySolver tissue_;
  SlabPoints points_;
  ContactOnDevices world_;
  FrameOnDevices frame_;
  int every_;
  BodyStep step_;
  Buffer<Vec3f> vertices_;
  Buffer<Vec3i> triangles_;
  DeviceReplay replay_;
};

}  // namespace

nlohmann::json touched_row(DeviceSet& devices, const TissueCase& body, double bandwidth_B_s) {
  const ElasticMaterial material{.young_Pa = body.matched.young_Pa};
  Touched touched(devices, body, material);
  const auto ms = time_ms([&] { touched.run(); }, 20, 2);
  const Index size = body.per_cube ? body.lattice.cube_count() : body.lattice.node_count();
  const double bytes = bytes_per_node(body) * body.lattice.node_count() + kBytesPerPoint * touched.points();
  return {{"name", body.name + " touched"},
          {"case", body.form},
          {"size", size},
          {"devices", devices.name()},
          {"slabs", touched.slabs()},
          {"points", touched.points()},
          {"touching", touched.touched()},
          {"substeps", 1},
          {"ms_p50", p(ms, 50) / kSubsteps},
          {"ms_p99", p(ms, 99) / kSubsteps},
          {"ms_p10", p(ms, 10) / kSubsteps},
          {body.per_cube ? "ns_per_cube" : "ns_per_node", p(ms, 50) / kSubsteps * 1e6 / size},
          {"floor_ms", bytes / touched.slabs() / bandwidth_B_s * 1e3}};
}

}  // namespace tactus::bench
