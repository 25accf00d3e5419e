#include "tactus/geom/lattice/cube_parts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tactus/geom/lattice/cube_lattice.h"
#include "tactus/geom/lattice/lattice_cut.h"
#include "tactus/geom/lattice/mass_points.h"
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

Vec3d center_of(const TriangleMesh& mesh) {
  double volume = 0;
  Vec3d first{};
  for (const auto& t : mesh.triangles) {
    const Vec3d a = vec_cast<double>(mesh.positions_m[at(t[0])]),
                b = vec_cast<double>(mesh.positions_m[at(t[1])]),
                c = vec_cast<double>(mesh.positions_m[at(t[2])]);
    const double v = dot(a, cross(b, c)) / 6;
    volume += v;
    first += v / 4 * (a + b + c);
  }
  return (1 / volume) * first;
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

/// Second moments of the space inside a mesh about its centre, x^2, y^2, z^2, and products xy, yz, zx: sums
/// over tetrahedra from the origin, V / 20 (sum of products of corners + product of the sums).
struct SecondMoments {
  Vec3d squares{}, products{};
};

SecondMoments of_solid(const TriangleMesh& mesh) {
  double volume = 0;
  Vec3d first{};
  SecondMoments m;
  for (const auto& t : mesh.triangles) {
    const Vec3d p[3] = {vec_cast<double>(mesh.positions_m[at(t[0])]),
                        vec_cast<double>(mesh.positions_m[at(t[1])]),
                        vec_cast<double>(mesh.positions_m[at(t[2])])};
    const double v = dot(p[0], cross(p[1], p[2])) / 6;
    const Vec3d sum = p[0] + p[1] + p[2];
    volume += v;
    first += v / 4 * sum;
    for (int a = 0; a < 3; ++a) {
      const int b = (a + 1) % 3;
      double squares = sum[a] * sum[a], products = sum[a] * sum[b];
      for (const Vec3d& q : p) squares += q[a] * q[a], products += q[a] * q[b];
      m.squares[a] += v / 20 * squares;
      m.products[a] += v / 20 * products;
    }
  }
  for (int a = 0; a < 3; ++a) {
    m.squares[a] -= first[a] * first[a] / volume;
    m.products[a] -= first[a] * first[(a + 1) % 3] / volume;
  }
  return m;
}

SecondMoments of_nodes(const CubeLattice& lattice) {
  const Moments all = moments(lattice);
  SecondMoments m{all.squares, {}};
  for (Index i = 0; i < lattice.node_count(); ++i) {
    const Vec3d d = vec_cast<double>(lattice.rest_m(i)) - all.center;
    m.products += double{lattice.node_mass_kg[at(i)]} * Vec3d{d.x * d.y, d.y * d.z, d.z * d.x};
  }
  return m;
}

CubeLattice placed(const TriangleMesh& mesh) {
  CubeLattice lattice = lattice_from_mesh(mesh, {.spacing_m = kH, .density_kg_m3 = 1000});
  place_masses(lattice);
  return lattice;
}

/// @param bar of every moment of inertia; products may be off by half of it, of the largest moment
void expect_inertia(const TriangleMesh& mesh, double bar, const std::string& what) {
  const CubeLattice lattice = placed(mesh);
  const SecondMoments nodes = of_nodes(lattice), solid = of_solid(mesh);
  const auto about = [](Vec3d squares, int a) { return squares[(a + 1) % 3] + squares[(a + 2) % 3]; };
  double largest = 0;
  for (int a = 0; a < 3; ++a) largest = std::max(largest, 1000 * about(solid.squares, a));
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(about(nodes.squares, a) / (1000 * about(solid.squares, a)), 1, bar) << what << ", axis " << a;
    EXPECT_NEAR(nodes.products[a] / largest, 1000 * solid.products[a] / largest, bar / 2) << what << a;
  }
  // First moments stay: 2e-3 of a spacing, with what rounding and the least masses of corners leave.
  EXPECT_LT(length(moments(lattice).center - center_of(mesh)), 2e-3 * double{kH}) << what;
  // Corners of cubes that are uneven by at most 1.6 have (1 - t)^3 of an eighth, 1 / (1 - t^2)^3 = 1.6.
  std::vector<double> eighths(lattice.nodes.size());
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c)
    for (const Index i : lattice.cube_nodes[c]) eighths[at(i)] += double{lattice.cube_mass_kg[c]} / 8;
  for (std::size_t i = 0; i < eighths.size(); ++i)
    EXPECT_GE(double{lattice.node_mass_kg[i]}, 0.23 * eighths[i]) << what << ", node " << i;
}

constexpr double kInertia = 0.02;

TEST(IndependentMass, CubesTurnAsTheySay) {
  for (const double across : {2.0, 3.0, 4.0, 8.0}) {
    for (const double degrees : {0.0, 17.0, 30.0, 45.0}) {
      const auto half = static_cast<float>(0.5 * across * double{kH});
      TriangleMesh cube = box_surface({half, half, half}, {1, 1, 1});
      place(cube, {0, 0, 1}, degrees, {0.003, 0.007, 0.001});
      const std::string what = std::to_string(across) + " across, turned by " + std::to_string(degrees);
      // Two across and turned, nodes far outside carry too much for any shares that steps and contact bear.
      expect_inertia(cube, across == 2 && degrees > 0 ? 0.65 : kInertia, what);
      place(cube, {1, 2, 3}, 37);
      expect_inertia(cube, across == 2 ? 0.65 : kInertia, what + " and by 37");
    }
  }
}

TEST(IndependentMass, BallsBoxesAndFiguresTurnAsTheySay) {
  for (const double r : {2.5, 4.0, 8.0}) expect_inertia(ball(r * double{kH}, 24), kInertia, "ball");
  TriangleMesh box = box_surface({0.0515F, 0.0235F, 0.0255F}, {3, 2, 1});
  expect_inertia(box, kInertia, "box");
  place(box, {1, 2, 3}, 37, {0.1, 0.2, 0.3});
  expect_inertia(box, kInertia, "turned box");
  expect_inertia(torus(0.05, 0.017, 80, 40), kInertia, "torus");
  expect_inertia(cylinder(0.025, 0.04, 40), kInertia, "cylinder");
  for (const double across : {2.7, 4.1, 4.6}) {
    const auto half = static_cast<float>(0.5 * across * double{kH});
    expect_inertia(box_surface({half, half, half}, {1, 1, 1}), kInertia, "cube of cut cubes");
  }
}

/// A bar of n cubes in a row keeps what nodes make of it: 2 / n^2 more across, three times as much along.
TEST(IndependentMass, RowsOfSingleCubesKeepTheirExcess) {
  CubeLattice row = lattice_from_box({}, {6, 1, 1}, {.spacing_m = kH});
  place_masses(row);
  EXPECT_TRUE(row.mass_at.empty());
  const Vec3d squares = moments(row).squares;
  EXPECT_NEAR(squares.x / (row.mass_kg() * 36 / 12 * sqr(double{kH})), 1 + 2.0 / 36, 1e-5);
  EXPECT_NEAR(squares.y / (row.mass_kg() / 12 * sqr(double{kH})), 3, 1e-5);
}

/// Copies of cubes have the shares of the cube that they were cut from.
TEST(IndependentMass, PartsOfACutBodyHaveTheirMassAndNodesTheirSum) {
  const CubeLattice whole = placed(ball(0.025, 24));
  const CubeLattice cut =
      cut_lattice(whole, [](Vec3i node, int axis) { return axis == 0 && node.x == 2; }, {});
  ASSERT_GT(cut.copies.size(), 0U);
  EXPECT_NEAR(cut.mass_kg(), whole.mass_kg(), 1e-6 * whole.mass_kg());
  std::vector<double> sum(whole.nodes.size());
  double left = 0, left_cubes = 0;
  std::vector<std::uint8_t> is_left(cut.nodes.size());
  for (Index c = 0; c < cut.cube_count(); ++c) {
    const Index copy = c - cut.regular_cubes();
    const bool here = cut.cubes[at(c)].x < 2 || (copy >= 0 && (cut.copies[at(copy)].corners & 1U) != 0);
    if (!here || !(cut.cube_mass_kg[at(c)] > 0)) continue;
    left_cubes += double{cut.cube_mass_kg[at(c)]};
    for (const Index i : cut.cube_nodes[at(c)]) is_left[at(i)] = 1;
  }
  for (Index i = 0; i < cut.node_count(); ++i) {
    const Index k = i - cut.regular_nodes();
    sum[at(k < 0 ? i : cut.virtual_nodes[at(k)])] += double{cut.node_mass_kg[at(i)]};
    if (is_left[at(i)] != 0) left += double{cut.node_mass_kg[at(i)]};
  }
  EXPECT_NEAR(left, left_cubes, 1e-6 * whole.mass_kg());
  for (std::size_t i = 0; i < sum.size(); ++i)  // eight floats a node
    EXPECT_NEAR(sum[i], double{whole.node_mass_kg[i]}, 1e-6 * sum[i]);
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
        Vec3d center{}, second{};
        for (int a = 0; a < 3; ++a) {
          const double low = std::max(origin[a] + cube[a], -half[a]) - origin[a] - cube[a],
                       high = std::min(origin[a] + cube[a] + 1, half[a]) - origin[a] - cube[a];
          volume *= std::max(0.0, high - low);
          center[a] = 0.5 * (low + high);
          second[a] = (high - low) * (high - low) / 12 + (center[a] - 0.5) * (center[a] - 0.5);
        }
        const bool is_partial = volume > 0 && volume < 1 - 1e-9;
        EXPECT_EQ(parts.full[at(cells.index(cube))], volume >= 1 - 1e-9 ? 1 : 0);
        if (!is_partial) continue;
        ASSERT_LT(next, parts.partial.size());
        EXPECT_EQ(parts.partial[next].cube, cube);
        EXPECT_NEAR(parts.partial[next].volume, volume, 1e-6);  // floats of the box
        EXPECT_LT(length(parts.partial[next].centroid - center), 1e-5);
        EXPECT_LT(length(parts.partial[next].second - second), 1e-5);
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
