#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "support/data_folder.h"
#include "support/device_sets.h"
#include "support/message_of.h"
#include "tactus/geom/lattice/cube_lattice.h"
#include "tactus/geom/mesh/mesh_defects.h"
#include "tactus/geom/mesh/point_in_mesh.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/tissue/surface_nets.h"

namespace tactus {
namespace {

using test::message_of;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

float sphere(Vec3f p) { return length(p) - 0.03F; }
const Box3f kSphereBox{{-0.03F, -0.03F, -0.03F}, {0.03F, 0.03F, 0.03F}};

TriangleMesh box_mesh(Vec3f a, Vec3f b) {
  TriangleMesh mesh;
  for (int q = 0; q < 8; ++q)
    mesh.positions_m.push_back(
        {(q & 1) != 0 ? b.x : a.x, (q & 2) != 0 ? b.y : a.y, (q & 4) != 0 ? b.z : a.z});
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

TEST(PointInMesh, RaysThroughVerticesAndEdgesDoNotLeak) {
  const TriangleMesh mesh = box_mesh({-1, -1, -1}, {1, 1, 1});
  ASSERT_NEAR(volume_m3(mesh), 8, 1e-9);
  const PointInMesh query(mesh);
  // The ray along +x meets the diagonal of the far face (y = z) or an edge of it for many of these points.
  for (int z = -3; z <= 3; ++z)
    for (int y = -3; y <= 3; ++y) {
      const Vec3f p{-0.25F, 0.25F * static_cast<float>(y), 0.25F * static_cast<float>(z)};
      EXPECT_EQ(query.winding(p), 1) << y << ' ' << z;
      EXPECT_EQ(query.winding(p - Vec3f{1, 0, 0}), 0);
      EXPECT_EQ(query.winding(p + Vec3f{1.5F, 0, 0}), 0);
    }
  EXPECT_FLOAT_EQ(query.signed_distance_m({0, 0, 0.5F}), -0.5F);
  EXPECT_FLOAT_EQ(query.signed_distance_m({2, 2, 1}), std::sqrt(2.F));
}

TEST(PointInMesh, AgreesWithTheFunctionOfASphere) {
  const TriangleMesh mesh = surface_nets(sphere, kSphereBox, 0.003F);
  const PointInMesh query(mesh);
  std::mt19937 random(4);
  std::uniform_real_distribution<float> u(-0.04F, 0.04F);
  for (int k = 0; k < 3000; ++k) {
    const Vec3f p{u(random), u(random), u(random)};
    // The net of 3 mm cells stays within h^2 / (2 r) + the mean of crossings' offset: 3e-4 m.
    EXPECT_NEAR(query.signed_distance_m(p), sphere(p), 3e-4F);
  }
}

/// Two balls that overlap: crossings lie on their common circle, and don't depend on how the axes are named,
/// which changes how they are searched for. Apart, there is none.
TEST(SelfCrossings, AreFoundWhateverTheAxes) {
  const TriangleMesh one = surface_nets(sphere, kSphereBox, 0.003F);
  const auto both = [&](Vec3f shift, int turns) {
    TriangleMesh mesh = one;
    const auto count = static_cast<Index>(one.positions_m.size());
    for (const Vec3f p : one.positions_m) mesh.positions_m.push_back(p + shift);
    for (const auto& t : one.triangles) mesh.triangles.push_back({t[0] + count, t[1] + count, t[2] + count});
    for (Vec3f& p : mesh.positions_m)
      for (int k = 0; k < turns; ++k) p = {p.y, p.z, p.x};
    return find_self_crossings(mesh);
  };
  const Vec3f shift{0.0301F, 0.0123F, 0.0207F};
  const SelfCrossings found = both(shift, 0);
  // The circle is 0.14 m round, crossed by some edges of 3 mm from both sides.
  EXPECT_GT(found.pairs, 40);
  EXPECT_LT(found.pairs, 400);
  EXPECT_NEAR(length(found.first_m), 0.03F, 5e-4F);
  EXPECT_NEAR(length(found.first_m - shift), 0.03F, 5e-4F);
  EXPECT_EQ(both(shift, 1).pairs, found.pairs);
  EXPECT_EQ(both(shift, 2).pairs, found.pairs);
  EXPECT_EQ(both({0.061F, 0, 0}, 0).pairs, 0);
}

/// Of a closed mesh it is the number of turns, up to the dipoles' 1e-2; without half of the sphere, what the
/// rest fills of the solid angle.
TEST(PointInMesh, GeneralizedWindingNumber) {
  TriangleMesh mesh = surface_nets(sphere, kSphereBox, 0.002F);
  const PointInMesh whole(mesh, MeshFill::winding);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> u(-0.05F, 0.05F);
  for (int k = 0; k < 2000; ++k) {
    const Vec3f p{u(random), u(random), u(random)};
    if (std::abs(sphere(p)) < 5e-4F) continue;  // the net is not the sphere
    EXPECT_NEAR(whole.generalized_winding(p), sphere(p) < 0 ? 1 : 0, 0.02);
    EXPECT_EQ(whole.inside(p), sphere(p) < 0);
  }
  std::erase_if(mesh.triangles,
                [&](const std::array<Index, 3>& t) { return mesh.positions_m[at(t[0])].z > 0; });
  const PointInMesh half(mesh, MeshFill::winding);
  // From (0, 0, -d) the open disc of radius r fills (1 - d / sqrt(d^2 + r^2)) / 2 of all directions; its rim
  // is a jag of up to 2 mm above it, which takes 0.5 * 1 mm / 30 mm from that on average.
  for (const float d : {0.005F, 0.01F, 0.02F}) {
    const double disc = 0.5 * (1 - static_cast<double>(d) / std::hypot(static_cast<double>(d), 0.03));
    EXPECT_NEAR(half.generalized_winding({0, 0, -d}), 1 - disc + 0.017, 0.03) << d;
  }
}

TEST(SurfaceNets, SmoothBodyGivesClosedManifold) {
  const TriangleMesh mesh = surface_nets(sphere, kSphereBox, 0.003F);
  const MeshTopology t = topology(mesh);
  EXPECT_TRUE(t.closed_manifold());
  EXPECT_EQ(t.euler, 2);
  // Inscribed facets of 3 mm on a radius of 30 mm take about (h/r)^2 = 1 % of the volume, at most 2 %.
  EXPECT_NEAR(volume_m3(mesh), 4.0 / 3 * 3.14159265 * 2.7e-5, 0.02 * 1.13e-4);
}

TEST(CubeLattice, MeshFunctionAndLabelsGiveTheSameBody) {
  const LatticeOptions options{.spacing_m = 0.004F, .density_kg_m3 = 900};
  const CubeLattice from_sdf = lattice_from_sdf(sphere, kSphereBox, options);
  const TriangleMesh mesh = surface_nets(sphere, kSphereBox, 0.001F);
  const CubeLattice from_mesh = lattice_from_mesh(mesh, options);
  LabelVolume volume{{}, {60, 60, 60}, {0.001F, 0.001F, 0.001F}, {-0.03F, -0.03F, -0.03F}};
  for (int z = 0; z < 60; ++z)
    for (int y = 0; y < 60; ++y)
      for (int x = 0; x < 60; ++x) {
        const auto c = [](int i) { return (static_cast<float>(i) + 0.5F) * 0.001F - 0.03F; };
        volume.labels.push_back(sphere({c(x), c(y), c(z)}) < 0 ? 7 : 2);
      }
  const CubeLattice from_labels = lattice_from_labels(volume, {7, 9}, options);
  // They differ in cubes of which the solid takes a thin corner: a layer of one voxel (1 mm * 0.0113 m^2) is
  // 177 cubes, 8 %; the finer mesh lies within 0.03 mm of the sphere, the samples within half a cell.
  EXPECT_NEAR(from_mesh.cube_count(), from_sdf.cube_count(), 0.03 * from_sdf.cube_count());
  EXPECT_NEAR(from_labels.cube_count(), from_sdf.cube_count(), 0.08 * from_sdf.cube_count());
  for (const CubeLattice* lattice : {&from_sdf, &from_mesh, &from_labels}) {
    double nodes_kg = 0;
    for (const float m : lattice->node_mass_kg) nodes_kg += double{m};
    EXPECT_NEAR(nodes_kg, lattice->mass_kg(), 1e-5 * lattice->mass_kg());
    const double solid = lattice == &from_mesh ? volume_m3(mesh) : 6.4e-8 * lattice->cube_count();
    EXPECT_NEAR(lattice->mass_kg(), 900 * solid, 1e-5 * lattice->mass_kg());
    for (Index c = 0; c < lattice->cube_count(); ++c)
      for (int q = 0; q < 8; ++q) {
        const Index node = lattice->cube_nodes[at(c)][static_cast<std::size_t>(q)];
        EXPECT_EQ(lattice->nodes[at(node)], lattice->cubes[at(c)] + (Vec3i{q & 1, q >> 1 & 1, q >> 2}));
      }
  }
}

TEST(CubeLattice, HollowBodyStaysHollowAndBoxFits) {
  TriangleMesh shell = box_mesh({0, 0, 0}, {0.05F, 0.05F, 0.05F});
  EXPECT_EQ(lattice_from_mesh(shell, {}).cube_count(), 1000);
  const TriangleMesh hole = box_mesh({0.016F, 0.016F, 0.016F}, {0.034F, 0.034F, 0.034F});
  for (const Vec3f p : hole.positions_m) shell.positions_m.push_back(p);
  for (const auto& t : hole.triangles) shell.triangles.push_back({t[0] + 8, t[2] + 8, t[1] + 8});
  // The hole spans cubes 3..6 along each axis; its faces lie within the outermost of those: 2^3 stay empty.
  EXPECT_EQ(lattice_from_mesh(shell, {}).cube_count(), 1000 - 8);
}

/// Faces on planes of the lattice touch no cube's inside, and still keep inside and outside apart.
TEST(CubeLattice, FacesOnLatticePlanesDoNotLeak) {
  TriangleMesh shell = box_mesh({0, 0, 0}, {0.05F, 0.05F, 0.05F});
  const TriangleMesh hole = box_mesh({0.015F, 0.02F, 0.01F}, {0.035F, 0.03F, 0.035F});
  for (const Vec3f p : hole.positions_m) shell.positions_m.push_back(p);
  for (const auto& t : hole.triangles) shell.triangles.push_back({t[0] + 8, t[2] + 8, t[1] + 8});
  EXPECT_EQ(lattice_from_mesh(shell, {}).cube_count(), 1000 - 4 * 2 * 5);
}

TEST(CubeLattice, FixedNodes) {
  CubeLattice lattice = lattice_from_box({1, 2, 3}, {4, 3, 2}, {.spacing_m = 0.5F});
  EXPECT_EQ(lattice.node_count(), 60);
  EXPECT_EQ(lattice.rest_m(59), (Vec3f{3, 3.5F, 4}));
  EXPECT_EQ(lattice.fix_half_space({1.1F, 0, 0}, {1, 0, 0}), 12);
  EXPECT_EQ(lattice.fix_where([](Vec3f p) { return p == Vec3f{3, 2, 3}; }), 13);
}

TEST(CubeLattice, BadInputIsExplained) {
  TriangleMesh open = box_mesh({0, 0, 0}, {0.05F, 0.05F, 0.05F});
  open.triangles.pop_back();
  EXPECT_NE(message_of([&] { lattice_from_mesh(open, {}); }).find("3 open edges"), std::string::npos);
  TriangleMesh nan = box_mesh({0, 0, 0}, {0.05F, 0.05F, 0.05F});
  nan.positions_m[5].y = NAN;
  EXPECT_NE(message_of([&] { lattice_from_mesh(nan, {}); }).find("vertex 5 is not finite"),
            std::string::npos);
  const TriangleMesh good = box_mesh({0, 0, 0}, {0.05F, 0.05F, 0.05F});
  EXPECT_NE(message_of([&] { lattice_from_mesh(good, {.spacing_m = 0.06F}); }).find("larger than the body"),
            std::string::npos);
  EXPECT_NE(
      message_of([&] { lattice_from_mesh(good, {.spacing_m = 1e-6F}); }).find("more than the limit of 2"),
      std::string::npos);
  EXPECT_NE(message_of([&] { lattice_from_mesh(good, {.spacing_m = -1}); }).find("positive"),
            std::string::npos);
  EXPECT_NE(message_of([&] { lattice_from_mesh({}, {}); }).find("no triangles"), std::string::npos);
  EXPECT_NE(message_of([&] { lattice_from_sdf([](Vec3f) { return 1.F; }, kSphereBox, {}); }).find("empty"),
            std::string::npos);
  EXPECT_NE(
      message_of([&] { lattice_from_sdf([](Vec3f) { return NAN; }, kSphereBox, {}); }).find("not finite"),
      std::string::npos);
  EXPECT_NE(message_of([&] {
              lattice_from_labels({{1, 2}, {3, 1, 1}, {1, 1, 1}, {}}, {1}, {});
            }).find("2 labels"),
            std::string::npos);
}

class EmbeddedDevices : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(EmbeddedDevices);

TEST_P(EmbeddedDevices, SurfaceFollowsAnAffineMapExactly) {
  DeviceSet set(GetParam(), 5);
  ExecContext& ctx = set.context(0);
  const TriangleMesh mesh = surface_nets(sphere, kSphereBox, 0.002F);
  const CubeLattice lattice = lattice_from_sdf(sphere, kSphereBox, {.spacing_m = 0.005F});
  EmbeddedSurface surface(ctx, lattice, mesh);
  BodyState body = rest_state(ctx, lattice);
  const Mat3f F{{{1.3F, 0.2F, -0.1F}, {0.05F, 0.8F, 0.3F}, {-0.2F, 0.1F, 1.1F}}};
  const Vec3f t{0.2F, -0.1F, 0.3F};
  std::vector<Vec3f> x = lattice.rest_positions_m();
  for (Vec3f& p : x) p = F * p + t;
  ctx.upload(std::span<const Vec3f>(x), body.x_m.view());
  surface.update(ctx, body);
  const TriangleMesh moved = surface.to_mesh(ctx);
  ASSERT_EQ(moved.positions_m.size(), mesh.positions_m.size());
  TriangleMesh expected = mesh;
  for (Vec3f& p : expected.positions_m) p = F * p + t;
  compute_normals(expected);
  for (std::size_t v = 0; v < mesh.positions_m.size(); ++v) {
    // Positions of some 0.4 m are rounded to 3e-8 m, a few times.
    EXPECT_LT(length(moved.positions_m[v] - expected.positions_m[v]), 2e-7F);
    EXPECT_GT(dot(moved.normals[v], expected.normals[v]), 0.9999F);
  }
  EXPECT_EQ(moved.triangles, mesh.triangles);
  DeviceSet reference("cpu");
  EmbeddedSurface other(reference.context(0), lattice, mesh);
  BodyState same = rest_state(reference.context(0), lattice);
  reference.context(0).upload(std::span<const Vec3f>(x), same.x_m.view());
  other.update(reference.context(0), same);
  EXPECT_EQ(other.to_mesh(reference.context(0)).normals, moved.normals);
}

TEST(EmbeddedSurface, OutsideVerticesAndForeignSurfaces) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const CubeLattice lattice = lattice_from_box({}, {4, 4, 4}, {.spacing_m = 0.01F});
  // Half a spacing outside on all sides: linear continuation keeps the affine map.
  EmbeddedSurface surface(ctx, lattice, box_mesh({-0.005F, -0.005F, -0.005F}, {0.045F, 0.045F, 0.045F}));
  BodyState body = rest_state(ctx, lattice);
  surface.update(ctx, body);
  EXPECT_LT(length(surface.to_mesh(ctx).positions_m[7] - Vec3f{0.045F, 0.045F, 0.045F}), 1e-8F);
  EXPECT_NE(message_of([&] {
              EmbeddedSurface(ctx, lattice, box_mesh({0, 0, 0}, {0.1F, 0.04F, 0.04F}));
            }).find("away from all cubes"),
            std::string::npos);
}

/// Vertices and faces of an OFF file.
TriangleMesh read_off(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::string word;
  std::size_t vertices = 0, faces = 0, edges = 0;
  in >> word >> vertices >> faces >> edges;
  TriangleMesh mesh;
  mesh.positions_m.resize(vertices);
  for (Vec3f& p : mesh.positions_m) in >> p.x >> p.y >> p.z;
  for (std::size_t f = 0; f < faces; ++f) {
    int n = 0;
    std::array<Index, 3> t{};
    in >> n >> t[0] >> t[1] >> t[2];
    mesh.triangles.push_back(t);
  }
  return mesh;
}

TEST(CubeLattice, ScannedHandFillsItsVolume) {
  const std::string file = data_folder() + "/meshes/hand.off";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << without_data("meshes/hand.off");
  TriangleMesh mesh = read_off(file);
  const Box3f box = bounds(mesh);
  const Vec3f e = box.extent();
  const float scale = 0.2F / max(e.x, max(e.y, e.z));
  for (Vec3f& p : mesh.positions_m) p = scale * (p - box.center());
  if (!topology(mesh).closed_manifold()) {
    EXPECT_NE(message_of([&] { lattice_from_mesh(mesh, {}); }).find("does not bound a solid"),
              std::string::npos);
    return;
  }
  const CubeLattice lattice = lattice_from_mesh(mesh, {.spacing_m = 0.002F});
  // Cubes that it shares volume with: more than the volume, by about half a spacing over the surface (up to a
  // whole one).
  const double volume = volume_m3(mesh), layer = area_m2(mesh) * 0.002, cubes = 8e-9 * lattice.cube_count();
  EXPECT_GT(cubes, volume);
  EXPECT_LT(cubes, volume + 1.2 * layer);
}

}  // namespace
}  // namespace tactus
