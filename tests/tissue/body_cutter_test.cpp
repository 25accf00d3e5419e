// A body whose lattice and surface are cut.
#include "tactus/tissue/cut/body_cutter.h"
#include "tactus/base/timing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <numeric>
#include <random>

#include "tactus/geom/lattice/lattice_cut.h"
#include "tactus/geom/mesh/box_surface.h"
#include "tactus/tissue/embedded_surface.h"

namespace tactus::cut {
namespace {

constexpr float kSpacing = 0.01F;
std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

/// A box with a vertex at every point of a grid that is not the lattice's: `fine` times as many.
TriangleMesh box_mesh(Vec3i n, float fine) {
  const auto pieces = [&](Index count) {
    return static_cast<Index>(std::lround(static_cast<float>(count) * fine));
  };
  const Vec3f half_m = 0.5F * kSpacing * vec_cast<float>(n);
  TriangleMesh mesh = box_surface(half_m, {pieces(n.x), pieces(n.y), pieces(n.z)});
  for (Vec3f& p : mesh.positions_m) p += half_m;
  return mesh;
}

struct Body {
  CubeLattice lattice;
  TriangleMesh surface;
  BodyCutter cutter;
  CubeLattice followed;  ///< by changes alone
  int frame = 0;

  Body(CubeLattice whole, TriangleMesh mesh, VirtualCapacity capacity)
      : lattice(cut_lattice(
            whole, [](Vec3i, int) { return false; }, capacity)),
        surface(std::move(mesh)),
        cutter(lattice, {}, surface, anchor_vertices(lattice, surface),
               {.vertices = 100 * capacity.copies + 100000, .triangles = 200 * capacity.copies + 100000}),
        followed(lattice) {}
  CutReport cut(Vec3f a, Vec3f b, Vec3f c, Vec3f d) {
    BladeStrip strip{{kSpacing * a, kSpacing * b}, {kSpacing * c, kSpacing * d}, frame++};
    return cut(strip, cutter.lattice().lattice().rest_positions_m());
  }
  CutReport cut(const BladeStrip& strip, const std::vector<Vec3f>& x_m) {
    TopologyChange change;
    const CutReport report = cutter.cut(strip, x_m, change);
    tactus::apply(change, followed);
    return report;
  }
  std::vector<double> volumes() const {
    return cutter.closed_volumes_m3(cutter.lattice().lattice().rest_positions_m());
  }
};

Body block(Vec3i n, float fine, VirtualCapacity capacity) {
  return {lattice_from_box({}, n, {.spacing_m = kSpacing}), box_mesh(n, fine), capacity};
}

/// Per cube and copy the part of the body that it belongs to.
std::vector<Index> parts_of_cubes(const CubeLattice& lattice) {
  std::vector<Index> parent(lattice.nodes.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](Index i) {
    while (parent[at(i)] != i) i = parent[at(i)] = parent[at(parent[at(i)])];
    return i;
  };
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c)
    if (lattice.has_cube(c))
      for (const Index i : lattice.cube_nodes[c]) parent[at(root(i))] = root(lattice.cube_nodes[c][0]);
  std::vector<Index> parts;
  for (const auto& nodes : lattice.cube_nodes) parts.push_back(root(nodes[0]));
  return parts;
}

/// Every directed edge has its twin, no triangle reaches from one part to another, masses are kept, and who
/// follows the changes has the same lattice.
/// @returns triangles that reach from one part to another
int expect_sound(const Body& body, double volume_error = 1e-4, bool may_reach = false) {
  int reaching = 0;
  const CubeLattice& lattice = body.cutter.lattice().lattice();
  EXPECT_NEAR(lattice.mass_kg(), body.lattice.mass_kg(), 1e-6 * body.lattice.mass_kg());
  for (Index c = 0; c < lattice.regular_cubes(); ++c)
    for (const Index cube : body.cutter.lattice().live(c)) EXPECT_GT(lattice.cube_fill[at(cube)], 0) << cube;
  std::map<std::pair<Index, Index>, int> edges;
  const std::vector<Index> parts = parts_of_cubes(lattice);
  // Nodes hang together as this sum over all cubes says.
  const std::vector<Index> part_of_node = body.cutter.lattice().part_of_nodes();
  std::map<Index, Index> lowest;
  for (std::size_t k = 0; k < lattice.cubes.size(); ++k)
    for (const Index i : lattice.cube_nodes[k])
      if (lattice.has_cube(k)) lowest[parts[k]] = std::min(lowest.try_emplace(parts[k], i).first->second, i);
  for (std::size_t k = 0; k < lattice.cubes.size(); ++k)
    for (const Index i : lattice.cube_nodes[k])
      if (lattice.has_cube(k)) {
        EXPECT_EQ(part_of_node[at(i)], lowest[parts[k]]);
      }
  for (const auto& [a, b, c] : body.cutter.surface().triangles()) {
    if (a == b && b == c) continue;
    const auto part = [&](Index v) {
      return parts[at(body.cutter.surface().anchor(body.cutter.lattice(), v).cube)];
    };
    reaching += part(a) != part(b) || part(b) != part(c) ? 1 : 0;
    EXPECT_TRUE(a != b && b != c && c != a);
    for (const auto& e : {std::pair(a, b), {b, c}, {c, a}}) ++edges[e];
  }
  int open = 0;
  for (const auto& [e, n] : edges) {
    const auto twin = edges.find({e.second, e.first});
    open += twin == edges.end() || twin->second != n ? 1 : 0;
  }
  EXPECT_EQ(open, 0);
  const auto volumes = body.volumes();
  const double whole = std::accumulate(volumes.begin(), volumes.end(), 0.0);
  const auto before = [&] {
    double v = 0;
    for (const auto& [a, b, c] : body.surface.triangles)
      v += dot(vec_cast<double>(body.surface.positions_m[at(a)]),
               cross(vec_cast<double>(body.surface.positions_m[at(b)]),
                     vec_cast<double>(body.surface.positions_m[at(c)]))) /
           6;
    return v;
  }();
  EXPECT_NEAR(whole, before, volume_error * before);
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    if (!lattice.has_cube(c)) continue;
    EXPECT_EQ(body.followed.cube_nodes[c], lattice.cube_nodes[c]);
  }
  EXPECT_TRUE(body.followed.node_mass_kg == lattice.node_mass_kg);
  EXPECT_TRUE(body.followed.cube_fill == lattice.cube_fill);
  EXPECT_TRUE(body.followed.virtual_nodes == lattice.virtual_nodes);
  EXPECT_TRUE(may_reach || reaching == 0);
  return reaching;
}

void plane_x(Body& body, float x, float n) {
  body.cut({x, -1, -1}, {x, -1, n + 1}, {x, n + 1, -1}, {x, n + 1, n + 1});
}
void plane_y(Body& body, float y, float n) {
  body.cut({-1, y, -1}, {-1, y, n + 1}, {n + 1, y, -1}, {n + 1, y, n + 1});
}
void plane_z(Body& body, float z, float n) {
  body.cut({-1, -1, z}, {-1, n + 1, z}, {n + 1, -1, z}, {n + 1, n + 1, z});
}

TEST(BodyCutter, APlaneMakesTwoClosedParts) {
  for (const float x : {2.3F, 3.F, 2.5F}) {
    Body body = block({6, 6, 6}, 1.5F, {.copies = 300, .nodes = 300});
    plane_x(body, x, 6);
    expect_sound(body);
    auto volumes = body.volumes();
    ASSERT_EQ(volumes.size(), 2U) << x;
    std::sort(volumes.begin(), volumes.end());
    EXPECT_NEAR(volumes[0], double{x} * 36e-6, 1e-4 * 216e-6);
    EXPECT_EQ(body.cutter.surface().filled(), 0);
  }
}

TEST(BodyCutter, PlanesMakeFourAndEightParts) {
  Body body = block({6, 6, 6}, 1.5F, {.copies = 900, .nodes = 900});
  plane_x(body, 2.3F, 6);
  plane_y(body, 3.6F, 6);
  expect_sound(body);
  EXPECT_EQ(body.volumes().size(), 4U);
  plane_z(body, 1.4F, 6);
  expect_sound(body);
  EXPECT_EQ(body.volumes().size(), 8U);
  // In the one cube where three walls meet, two ways to a corner end at an older wall's fold: a triangle on
  // each side of the new wall closes what is open there.
  EXPECT_LE(body.cutter.surface().filled(), 4);
}

/// A blade that goes through in many frames. The surface is closed in each, and at the end as if it had been
/// one strip.
TEST(BodyCutter, ABladeGoesThroughFrameByFrame) {
  for (const float step : {0.37F, 0.5F, 1.F}) {
    Body body = block({6, 6, 6}, 1.5F, {.copies = 300, .nodes = 300});
    for (float y = -0.5F; y < 6.5F; y += step) {
      body.cut({2.3F, y, -1}, {2.4F, y, 7}, {2.3F, y + step, -1}, {2.4F, y + step, 7});
      expect_sound(body);
      if (y + step < 5) {
        EXPECT_EQ(body.volumes().size(), 1U);
      }
    }
    EXPECT_EQ(body.volumes().size(), 2U);
    EXPECT_EQ(body.cutter.surface().filled(), 0);
  }
}

/// As above on a larger block, with a slope, as a scene does.
TEST(BodyCutter, ASlopingBladeGoesThroughFrameByFrame) {
  Body body = block({10, 10, 10}, 2, {.copies = 900, .nodes = 900});
  for (int k = 0; k < 30; ++k) {
    const auto edge = [](int frame) {
      const auto t = static_cast<float>(frame);
      return Vec3f{-2.5F + 0.583F * t, 4.F - 0.0667F * t, -1};
    };
    const Vec3f along{0, 0, 12};
    body.cut(edge(k), edge(k) + along, edge(k + 1), edge(k + 1) + along);
  }
  expect_sound(body);
  EXPECT_EQ(body.volumes().size(), 2U);
  EXPECT_EQ(body.cutter.surface().filled(), 0);
}

/// Distance of vertices on walls to the plane, and the angle of their normals with it [degrees].
std::pair<double, double> farthest_from_plane(const Body& body, Vec3d point, Vec3d normal) {
  const TriangleMesh mesh = body.cutter.mesh(body.cutter.lattice().lattice().rest_positions_m());
  std::vector<Vec3d> normals(mesh.positions_m.size());
  std::vector<bool> is_wall_only(mesh.positions_m.size(), true), is_on_wall(mesh.positions_m.size());
  const auto p = [&](Index v) { return vec_cast<double>(mesh.positions_m[at(v)]) / double{kSpacing}; };
  for (std::size_t t = 0; t < body.cutter.surface().triangles().size(); ++t) {
    const auto& [a, b, c] = body.cutter.surface().triangles()[t];
    const Vec3d n = cross(p(b) - p(a), p(c) - p(a));
    const bool is_wall = body.cutter.surface().is_wall(static_cast<Index>(t)) || (a == b && b == c);
    for (const Index v : {a, b, c}) {
      normals[at(v)] += n;
      if (!is_wall) is_wall_only[at(v)] = false;
      if (is_wall && a != b) is_on_wall[at(v)] = true;
    }
  }
  double farthest = 0, angle = 0;
  for (std::size_t v = 0; v < normals.size(); ++v) {
    if (!is_on_wall[v] || length(normals[v]) == 0) continue;
    farthest = std::max(farthest, std::abs(dot(normal, p(static_cast<Index>(v)) - point)));
    if (is_wall_only[v])
      angle = std::max(angle, std::asin(std::min(1.0, length(cross(normalized(normals[v]), normal)))));
  }
  return {farthest, angle * 180 / M_PI};
}

TEST(BodyCutter, WallsAreAsSmoothAsTheBladesPath) {
  Body body = block({6, 6, 6}, 1.5F, {.copies = 400, .nodes = 400});
  const Vec3f u = 8.F * normalized(Vec3f{0.2F, 1, 0.1F}), v = 8.F * normalized(Vec3f{-0.5F, 0.2F, 1}),
              middle{3.13F, 2.91F, 3.05F};
  body.cut(middle - u - v, middle - u + v, middle + u - v, middle + u + v);
  expect_sound(body);
  EXPECT_EQ(body.volumes().size(), 2U);
  const auto [farthest, angle] = farthest_from_plane(
      body, vec_cast<double>(middle), normalized(cross(vec_cast<double>(u), vec_cast<double>(v))));
  EXPECT_LT(farthest, 1e-4);
  EXPECT_LT(angle, 0.1);
}

/// 1.5 spacings thick, so no edge is cut twice, but cubes are. It has the volume and the mass that it should.
TEST(BodyCutter, ASliceIsAsThickAsItsCuts) {
  for (const double turn : {0.0, 0.3}) {
    Body body = block({6, 6, 6}, 1.5F, {.copies = 600, .nodes = 900});
    const Vec3d n{std::cos(turn), 0, std::sin(turn)}, u{0, 1, 0}, v = cross(n, u);
    for (const double offset : {-0.75, 0.75}) {
      const Vec3d middle = Vec3d{3.11, 3, 3.04} + offset * n;
      const auto corner = [&](double a, double b) { return vec_cast<float>(middle + 9 * a * u + 9 * b * v); };
      body.cut(corner(-1, -1), corner(-1, 1), corner(1, -1), corner(1, 1));
      expect_sound(body);
    }
    const auto volumes = body.volumes();
    ASSERT_EQ(volumes.size(), 3U);
    const double expected = 1.5e-6 * 36 / std::cos(turn);
    double best = 1;
    for (const double volume : volumes) best = std::min(best, std::abs(volume / expected - 1));
    EXPECT_LT(best, 1e-3);
    std::map<Index, double> mass;
    const CubeLattice& lattice = body.cutter.lattice().lattice();
    const std::vector<Index> parts = parts_of_cubes(lattice);
    for (Index c = 0; c < lattice.cube_count(); ++c)
      if (lattice.has_cube(at(c))) mass[parts[at(c)]] += double{lattice.cube_mass_kg[at(c)]};
    ASSERT_EQ(mass.size(), 3U);
    best = 1;
    for (const auto& [part, m] : mass) best = std::min(best, std::abs(m / (1000 * expected) - 1));
    EXPECT_LT(best, 5e-3) << turn;  // no copy has less than 1/64 of a cube
  }
}

/// A mesh that does not follow the lattice: its volume is kept, cut after cut.
/// Against all points of the walls. Those that are left out are no deeper by the triangle inequality, but for
/// the rounding of distances to floats: of up to 6 spacings, three of them by 2^-22 each.
TEST(BodyCutter, ItIsAsDeepAsTheDeepestPointOfItsWalls) {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> uniform(1, 11);
  for (int k = 0; k < 12; ++k) {
    Body body = block({12, 12, 12}, 1.5F, {.copies = 800, .nodes = 2400});
    const float y = uniform(random);  // of the strip's end: it goes down from above
    const CutReport report = body.cut({uniform(random), 13, -1}, {uniform(random), 13, 13},
                                      {uniform(random), y, -1}, {uniform(random), y, 13});
    double deepest = 0;
    for (const CutSurface::NewWall& wall : body.cutter.surface().new_walls()) {
      const auto& [a, b, c] = wall.corners;
      deepest = std::max(deepest, body.cutter.surface().depth((a + b + c) / 3.0));
    }
    EXPECT_GT(deepest, 0);
    EXPECT_NEAR(report.depth_m / double{kSpacing}, deepest, 1e-6) << k;
  }
}

TEST(BodyCutter, CutsABall) {
  // A cube's surface, blown up to the ball.
  TriangleMesh mesh = box_mesh({9, 9, 9}, 1);
  for (Vec3f& p : mesh.positions_m) {
    const Vec3f d = p - Vec3f{0.045F, 0.045F, 0.045F};
    p = Vec3f{0.05F, 0.05F, 0.05F} + 0.0305F * normalized(d);
  }
  const CubeLattice lattice = lattice_from_mesh(mesh, {.spacing_m = kSpacing});
  Body body(lattice, mesh, {.copies = 900, .nodes = 1200});
  const auto o = vec_cast<double>(lattice.origin_m);
  EXPECT_LT(length(o), 1.0);
  body.cut({4.8F, 0, 0}, {4.9F, 0, 10}, {4.7F, 10, 0}, {4.8F, 10, 10});
  expect_sound(body);
  EXPECT_EQ(body.volumes().size(), 2U);
  body.cut({0, 5.3F, 0}, {0, 5.2F, 10}, {10, 5.3F, 0}, {10, 5.4F, 10});
  expect_sound(body);
  EXPECT_EQ(body.volumes().size(), 4U);
  // In one cube the second wall ends at a fold of the first, on both sides, beside the ball's surface.
  EXPECT_LE(body.cutter.surface().filled(), 11);
}

/// The strip goes through a body that is stretched and turned: walls lie where it went.
TEST(BodyCutter, CutsWhatIsStretchedAndTurned) {
  Body body = block({6, 6, 6}, 1.5F, {.copies = 400, .nodes = 400});
  std::vector<Vec3f> x = body.cutter.lattice().lattice().rest_positions_m();
  const auto place = [](Vec3f p) {
    const Vec3f q{1.5F * p.x, p.y, p.z};
    return Vec3f{0.8F * q.x - 0.6F * q.y, 0.6F * q.x + 0.8F * q.y, q.z};
  };
  for (Vec3f& p : x) p = place(p);
  const auto corner = [&](float y, float z) { return place(kSpacing * Vec3f{2.3F + 0.1F * z, y, z}); };
  body.cut({{corner(-1, -1), corner(-1, 7)}, {corner(7, -1), corner(7, 7)}, 0}, x);
  expect_sound(body);
  EXPECT_EQ(body.volumes().size(), 2U);
  const auto [farthest, angle] = farthest_from_plane(body, {2.3, 0, 0}, normalized(Vec3d{1, 0, -0.1}));
  EXPECT_LT(farthest, 1e-4);
  EXPECT_LT(angle, 0.1);
}

/// Strips in every position, a third of them exactly on nodes, edges and faces, and vertices of the surface
/// on them, too. Nothing is lost, whatever they cross.
TEST(BodyCutter, RandomStripsLeaveItClosed) {
  const bool is_long = std::getenv("TACTUS_LONG_TESTS") != nullptr;
  Index triangles = 0;
  int reaching = 0;
  for (unsigned seed = 0; seed < (is_long ? 10000U : 60U); ++seed) {
    std::mt19937 random(seed);
    Body body = block({6, 6, 6}, seed % 2 == 0 ? 1.F : 1.37F, {.copies = 2000, .nodes = 3000});
    for (int k = 0; k < 3; ++k) {
      const auto point = [&] {
        Vec3f p;
        for (int a = 0; a < 3; ++a) {
          p[a] = std::uniform_real_distribution<float>(-1, 7)(random);
          if (seed % 3 == 0) p[a] = std::round(p[a]);
        }
        return p;
      };
      const Vec3f a = point(), b = point(), c = point(), d = point();
      const CutReport report = body.cut(a, b, c, d);
      ASSERT_FALSE(report.is_full) << seed;
      // Where ends of walls do not meet, a fan closes the surface, and its volume is that of a sliver.
      reaching += expect_sound(body, 1e-2, true);
      triangles += body.cutter.surface().triangle_count();
      if (HasFailure()) FAIL() << "seed " << seed << ", strip " << k;
    }
  }
  // Strips that turn by much within a cube: of 3 such bodies in 60, single triangles of 200 000.
  EXPECT_LT(reaching, 5e-4 * triangles);
}

/// 1,000 strips, ten in each of 100 blocks of 20^3 cubes, a third of them exactly on nodes. Nothing runs
/// away: a strip across the block cuts some 500 cubes, so ten seconds are far more than it needs.
TEST(BodyCutter, AThousandStripsInABlockOf20) {
  if (std::getenv("TACTUS_LONG_TESTS") == nullptr) GTEST_SKIP() << "20 s: set TACTUS_LONG_TESTS=1";
  std::int64_t triangles = 0, reaching = 0;
  double slowest_s = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    std::mt19937 random(seed);
    Body body = block({20, 20, 20}, seed % 2 == 0 ? 1.F : 1.37F, {.copies = 40000, .nodes = 60000});
    for (int k = 0; k < 10; ++k) {
      const auto point = [&] {
        Vec3f p;
        for (int a = 0; a < 3; ++a) {
          p[a] = std::uniform_real_distribution<float>(-1, 21)(random);
          if (seed % 3 == 0) p[a] = std::round(p[a]);
        }
        return p;
      };
      const Vec3f a = point(), b = point(), c = point(), d = point();
      const double begin_s = now_s();
      const CutReport report = body.cut(a, b, c, d);
      slowest_s = std::max(slowest_s, now_s() - begin_s);
      ASSERT_FALSE(report.is_full) << seed << ", strip " << k;
    }
    reaching += expect_sound(body, 1e-2, true);
    triangles += body.cutter.surface().triangle_count();
    if (HasFailure()) FAIL() << "seed " << seed;
  }
  std::printf("  %.0f ms for the slowest strip, %lld of %lld triangles reach to another part\n",
              1e3 * slowest_s, static_cast<long long>(reaching), static_cast<long long>(triangles));
  EXPECT_LT(slowest_s, 10);
  // As in blocks of 6^3.
  EXPECT_LT(static_cast<double>(reaching), 5e-4 * static_cast<double>(triangles));
}

}  // namespace
}  // namespace tactus::cut
