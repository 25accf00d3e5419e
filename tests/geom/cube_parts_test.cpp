#include "tactus/geom/lattice/cube_parts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "tactus/geom/lattice/cube_lattice.h"
#include "tactus/geom/mesh/box_surface.h"

namespace tactus {
namespace {

constexpr float kH = 0.01F;
constexpr double kPi = std::numbers::pi;

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

void place(TriangleMesh& mesh, Vec3d axis, double degrees, Vec3d to_m = {}) {
  const double a = degrees * kPi / 180, c = std::cos(a), s = std::sin(a);
  const Vec3d n = (1 / length(axis)) * axis;
  for (Vec3f& x : mesh.positions_m) {
    const Vec3d p = vec_cast<double>(x);
    x = vec_cast<float>(c * p + s * cross(n, p) + (1 - c) * dot(n, p) * n + to_m);
  }
}

/// A cube's surface, blown up.
TriangleMesh ball(double radius_m, Index pieces) {
  TriangleMesh mesh = box_surface({1, 1, 1}, Vec3i{pieces, pieces, pieces});
  for (Vec3f& p : mesh.positions_m) p = static_cast<float>(radius_m) / length(p) * p;
  return mesh;
}

/// A tube round the z axis: a torus of n x m flat quads.
TriangleMesh torus(double ring_m, double tube_m, Index n, Index m) {
  TriangleMesh mesh;
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < m; ++j) {
      const double u = 2 * kPi * i / n, v = 2 * kPi * j / m, r = ring_m + tube_m * std::cos(v);
      mesh.positions_m.push_back(
          vec_cast<float>(Vec3d{r * std::cos(u), r * std::sin(u), tube_m * std::sin(v)}));
    }
  const auto id = [&](Index i, Index j) { return i % n * m + j % m; };
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < m; ++j) {
      mesh.triangles.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
      mesh.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
    }
  return mesh;
}

/// A prism of n sides along z.
TriangleMesh cylinder(double radius_m, double half_m, Index n) {
  TriangleMesh mesh;
  for (const double z : {-half_m, half_m})
    for (Index i = 0; i < n; ++i)
      mesh.positions_m.push_back(vec_cast<float>(
          Vec3d{radius_m * std::cos(2 * kPi * i / n), radius_m * std::sin(2 * kPi * i / n), z}));
  for (Index i = 0; i < n; ++i) {
    const Index j = (i + 1) % n;
    mesh.triangles.push_back({i, j, n + j});
    mesh.triangles.push_back({i, n + j, n + i});
    if (i > 1) {
      mesh.triangles.push_back({0, i, i - 1});
      mesh.triangles.push_back({n, n + i - 1, n + i});
    }
  }
  return mesh;
}

struct Moments {
  double mass = 0;
  Vec3d center{};
  Vec3d squares{};  ///< of distances from the centre along each axis, times mass
};

Moments moments(const CubeLattice& lattice) {
  Moments m;
  for (Index i = 0; i < lattice.node_count(); ++i) {
    const double w = double{lattice.node_mass_kg[at(i)]};
    m.mass += w;
    m.center += w * vec_cast<double>(lattice.rest_m(i));
  }
  m.center = (1 / m.mass) * m.center;
  for (Index i = 0; i < lattice.node_count(); ++i) {
    const Vec3d d = vec_cast<double>(lattice.rest_m(i)) - m.center;
    m.squares += double{lattice.node_mass_kg[at(i)]} * Vec3d{d.x * d.x, d.y * d.y, d.z * d.z};
  }
  return m;
}

/// Of 1000 kg/m^3, cubes of 10 mm. @param volume_m3 closed form, of the triangles
CubeLattice expect_mass(const TriangleMesh& mesh, double volume, Vec3d center_m, const char* what) {
  CubeLattice lattice = lattice_from_mesh(mesh, {.spacing_m = kH, .density_kg_m3 = 1000});
  const Moments m = moments(lattice);
  // Vertices are floats, of 1e-7 of the distance from the origin; so are the masses of cubes and nodes.
  EXPECT_NEAR(m.mass, 1000 * volume, 1e-5 * 1000 * volume) << what;
  EXPECT_LT(length(m.center - center_m), 0.02 * double{kH}) << what;
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) EXPECT_GT(lattice.cube_fill[c], 0) << what;
  for (const float w : lattice.node_mass_kg) EXPECT_GT(w, 0) << what;
  return lattice;
}

TEST(IndependentMass, BoxesBallsAndCylindersWeighWhatTheirSurfaceEncloses) {
  expect_mass(box_surface({0.0515F, 0.0235F, 0.0255F}, {3, 2, 1}), 0.103 * 0.047 * 0.051, {}, "box");
  for (const double r : {1.0, 1.3, 2.5, 4.0}) {  // in spacings; faceted, so the mesh is its own measure
    const TriangleMesh mesh = ball(r * double{kH}, 24);
    expect_mass(mesh, volume_m3(mesh), {}, "ball");
    EXPECT_NEAR(volume_m3(mesh), 4 * kPi / 3 * std::pow(r * double{kH}, 3), 0.01 * volume_m3(mesh));
  }
  for (const double degrees : {10.0, 30.0, 45.0}) {
    TriangleMesh cube = box_surface({0.02F, 0.02F, 0.02F}, {1, 1, 1});
    place(cube, {0, 0, 1}, degrees, {0.313, -0.207, 0.1});
    expect_mass(cube, 6.4e-5, {0.313, -0.207, 0.1}, "turned cube");
    place(cube, {1, 2, 3}, degrees);
    expect_mass(cube, volume_m3(cube), moments(lattice_from_mesh(cube, {.spacing_m = 0.001F})).center,
                "cube turned twice");
  }
  const double polygon = 0.5 * 40 * std::sin(2 * kPi / 40);  // over the square of the radius
  TriangleMesh rod = cylinder(0.023, 0.0555, 40);
  expect_mass(rod, polygon * 0.023 * 0.023 * 0.111, {}, "cylinder");
  place(rod, {1, 1, 0}, 37, {0.1, 0.2, 0.3});
  expect_mass(rod, polygon * 0.023 * 0.023 * 0.111, {0.1, 0.2, 0.3}, "turned cylinder");
  TriangleMesh ring = torus(0.05, 0.017, 80, 40);
  expect_mass(ring, volume_m3(ring), {}, "torus");
  EXPECT_NEAR(volume_m3(ring), 2 * kPi * kPi * 0.05 * 0.017 * 0.017, 0.01 * volume_m3(ring));
}

/// About an axis through the centre, over that of the solid, less 1. Nodes outside the surface carry mass of
/// the solid parts round them, so bodies turn as if they were larger (docs/tissue_verification.md): what is
/// asked for is 2 %.
double excess(const TriangleMesh& mesh, Vec3d true_squares, int axis) {
  const Vec3d squares = moments(lattice_from_mesh(mesh, {.spacing_m = kH, .density_kg_m3 = 1000})).squares;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  return (squares[u] + squares[v]) / (true_squares[u] + true_squares[v]) - 1;
}

TEST(IndependentMass, MomentsOfInertiaAreAsMuchTooLargeAsDocumented) {
  constexpr double kHalf = 0.02, kPrint = 0.005;  // the docs give whole percents
  const double of_cube = 1000 * 8 * kHalf * kHalf * kHalf * kHalf * kHalf / 3;  // m a^2 / 3, along each axis
  for (const auto& [degrees, expected] : {std::pair{0.0, 0.125}, {30.0, 0.203}, {45.0, 0.201}}) {
    TriangleMesh cube = box_surface({0.02F, 0.02F, 0.02F}, {1, 1, 1});
    place(cube, {0, 0, 1}, degrees);
    EXPECT_NEAR(excess(cube, {of_cube, of_cube, of_cube}, 2), expected, kPrint) << degrees << " degrees";
  }
  for (const auto& [r, expected] : {std::pair{2.5, 0.212}, {4.0, 0.08}, {8.0, 0.019}}) {
    const TriangleMesh mesh = ball(r * double{kH}, 48);
    const double each = 1000 * volume_m3(mesh) * r * r * double{kH * kH} / 5;  // m R^2 / 5, along each axis
    EXPECT_NEAR(excess(mesh, {each, each, each}, 0), expected, kPrint) << r;
  }
}

/// Thinner than a cube, in a layer, across two, and turned.
TEST(IndependentMass, ThinPlatesKeepTheirMass) {
  for (const double t : {0.001, 0.004, 0.0095, 0.0149}) {
    const TriangleMesh plate = box_surface(vec_cast<float>(Vec3d{0.05, 0.06, t / 2}), {3, 4, 1});
    expect_mass(plate, 0.1 * 0.12 * t, {}, "plate");
    for (const double degrees : {20.0, 45.0, 71.0}) {
      TriangleMesh turned = plate;
      place(turned, {1, 0.3, 0.2}, degrees, {0.02, 0.01, 0});
      expect_mass(turned, 0.1 * 0.12 * t, {0.02, 0.01, 0}, "turned plate");
    }
  }
}

/// Two plates back to back in one cube, and a hole: a column along x has several pieces of surface.
TEST(IndependentMass, HolesAndPiecesInOneCubeCountAsTheyAre) {
  TriangleMesh mesh = box_surface({0.05F, 0.05F, 0.05F}, {1, 1, 1});
  const auto add = [&](Vec3f half, Vec3f to, bool hole) {
    TriangleMesh part = box_surface(half, {2, 1, 1});
    const auto first = static_cast<Index>(mesh.positions_m.size());
    for (const Vec3f p : part.positions_m) mesh.positions_m.push_back(p + to);
    for (const auto& t : part.triangles)
      mesh.triangles.push_back({first + t[0], first + t[hole ? 2 : 1], first + t[hole ? 1 : 2]});
  };
  add({0.0013F, 0.03F, 0.02F}, {0.003F, 0, 0}, true);
  add({0.0013F, 0.03F, 0.02F}, {0.007F, 0, 0}, true);
  add({0.0013F, 0.04F, 0.04F}, {0.0533F, 0, 0}, false);
  add({0.0013F, 0.04F, 0.04F}, {0.0573F, 0, 0}, false);
  const double solid = 1e-3, hole = 0.0026 * 0.06 * 0.04, plate = 0.0026 * 0.08 * 0.08;
  const double x = (hole * -0.01 + plate * 0.1106) / (solid - 2 * hole + 2 * plate);
  const CubeLattice lattice = lattice_from_mesh(mesh, {.spacing_m = kH, .density_kg_m3 = 1000});
  EXPECT_NEAR(moments(lattice).mass, 1000 * (solid - 2 * hole + 2 * plate), 1e-5);
  EXPECT_NEAR(moments(lattice).center.x, x, 0.02 * double{kH});
}

/// Volume and centroid of each cube of a box with known faces: products of overlaps.
TEST(IndependentMass, PartsOfCubesAreProductsOfOverlaps) {
  TriangleMesh mesh = box_surface({0.0137F, 0.0171F, 0.0093F}, {2, 3, 1});
  const CubeCells cells{{-0.03F, -0.03F, -0.02F}, kH, {6, 6, 4}};
  const CubeParts parts = parts_of_cubes(mesh, cells);
  const double half[3] = {1.37, 1.71, 0.93}, origin[3] = {-3, -3, -2};
  std::size_t next = 0;
  for (Index z = 0; z < 4; ++z)
    for (Index y = 0; y < 6; ++y)
      for (Index x = 0; x < 6; ++x) {
        const Vec3i cube{x, y, z};
        double volume = 1;
        Vec3d center{};
        for (int a = 0; a < 3; ++a) {
          const double low = std::max(origin[a] + cube[a], -half[a]) - origin[a] - cube[a],
                       high = std::min(origin[a] + cube[a] + 1, half[a]) - origin[a] - cube[a];
          volume *= std::max(0.0, high - low);
          center[a] = 0.5 * (low + high);
        }
        const bool is_partial = volume > 0 && volume < 1 - 1e-9;
        EXPECT_EQ(parts.full[at(cells.index(cube))], volume >= 1 - 1e-9 ? 1 : 0);
        if (!is_partial) continue;
        ASSERT_LT(next, parts.partial.size());
        EXPECT_EQ(parts.partial[next].cube, cube);
        EXPECT_NEAR(parts.partial[next].volume, volume, 1e-6);  // floats of the box
        EXPECT_LT(length(parts.partial[next].centroid - center), 1e-5);
        ++next;
      }
  EXPECT_EQ(next, parts.partial.size());
}

/// A face a hair beyond a lattice plane makes no layer of empty cubes, and loses nothing.
TEST(IndependentMass, SliversJoinTheirNeighbour) {
  const TriangleMesh exact = box_surface({0.05F, 0.03F, 0.02F}, {1, 1, 1});
  TriangleMesh more = exact;
  for (Vec3f& p : more.positions_m)
    if (p.x > 0) p.x += 0.0003F;  // 3 % of a cube, shared by both ends: the lattice is centred
  EXPECT_EQ(lattice_from_mesh(exact, {.spacing_m = kH}).cube_count(), 10 * 6 * 4);
  const CubeLattice lattice = expect_mass(more, 0.1003 * 0.06 * 0.04, {0.00015, 0, 0}, "box");
  EXPECT_EQ(lattice.node_dims.x, 12);
  EXPECT_LE(lattice.cube_count(), 11 * 6 * 4);
}

}  // namespace
}  // namespace tactus
