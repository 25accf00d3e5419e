#include "tactus/sim/body/body_shape.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tactus/base/error.h"
#include "tactus/contact/contact_on_devices.h"
#include "tactus/frame/readback.h"
#include "tactus/frame/schedule.h"
#include "tactus/geom/mesh/mesh_defects.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/sim/body/soft_body.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus {
namespace {

/// A cube of 0.2 m as a mesh body.
BodyAssets cube_asset(float scale, bool inside_out) {
  TriangleMesh mesh;
  for (int q = 0; q < 8; ++q)
    mesh.positions_m.push_back(
        scale * Vec3f{(q & 1) != 0 ? 0.1F : -0.1F, (q & 2) != 0 ? 0.1F : -0.1F, (q & 4) != 0 ? 0.1F : -0.1F});
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  if (inside_out)
    for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  return {{{"cube", mesh}}, {}};
}
/// Frames of a body that nothing real touches.
class OneBodyFrames {
 public:
  OneBodyFrames(DeviceSet& devices, SoftBody& body)
      : ctx_(devices.context(0)),
        body_(body),
        world_(devices, body.tissue().slab_count(),
               {.max_vertices = 8, .max_triangles = 8, .max_raw_samples = 8}, {}, {}),
        readback_(devices),
        schedule_(devices) {
    body.add_stages(schedule_, readback_, world_, {});
    schedule_.add({.name = "read back", .timed_as = "end", .rate = Rate::end, .submit = [this](BlockPlace) {
                     readback_.submit();
                   }});
    schedule_.close();
  }
  /// @returns what the body has to tell
  std::string play(float dt_s, int substeps, Vec3f gravity_m_s2) {
    schedule_.run({.dt_s = dt_s, .gravity_m_s2 = gravity_m_s2, .substeps = substeps}, false);
    schedule_.finish(timings_);
    return body_.end_frame(ctx_, readback_, substeps);
  }

 private:
  ExecContext& ctx_;
  SoftBody& body_;
  ContactOnDevices world_;
  Readback readback_;
  Schedule schedule_;
  Timings timings_;
};

BodyDescription cube_body() {
  BodyDescription body;
  body.name = "cube";
  body.shape.kind = ShapeKind::mesh;
  body.spacing_m = 0.05;
  body.material.model = TissueModel::flsm;
  return body;
}

/// The message of the error that `body` throws, with its exit code: "2: ...".
template <class F>
std::string refusal(F&& body) {
  try {
    body();
  } catch (const Error& e) {
    return (e.kind() == ErrorKind::usage ? "2: " : "1: ") + std::string(e.what());
  }
  return "accepted";
}
std::string refusal(const BodyDescription& body, const BodyAssets& assets) {
  return refusal([&] { make_body_shape(body, assets); });
}

SpaceRegion ball(Vec3d center_m, double radius_m) {
  SpaceRegion region;
  region.kind = RegionKind::sphere;
  region.center_m = center_m;
  region.radius_m = radius_m;
  return region;
}

TEST(BodyShape, OddMeshesAreNamed) {
  EXPECT_TRUE(make_body_shape(cube_body(), cube_asset(1, false)).warnings.empty());
  const BodyShape turned = make_body_shape(cube_body(), cube_asset(1, true));
  ASSERT_EQ(turned.warnings.size(), 1U);
  EXPECT_EQ(turned.warnings[0], "its triangles face inwards; they are taken the other way round");
  EXPECT_GT(volume_m3(turned.surface_m), 0);
  BodyDescription large = cube_body();
  large.spacing_m = 50;
  const BodyShape millimetres = make_body_shape(large, cube_asset(1000, false));
  ASSERT_EQ(millimetres.warnings.size(), 1U);
  EXPECT_EQ(millimetres.warnings[0],
            "it is 200 m long: is its file in millimetres? Then say 'unit_m: 0.001'");
  BodyDescription free = cube_body();
  free.fixed.push_back({ball({5, 5, 5}, 0.1)});
  EXPECT_EQ(make_body_shape(free, cube_asset(1, false)).warnings.at(0),
            "its 'fixed' regions hold no node: it is free");
}

PaintedRegion core_region(const SpaceRegion& where) {
  PaintedRegion region;
  region.name = "core";
  region.where = where;
  region.young_modulus_pa = 50000;
  return region;
}

/// Meshes that are no boundary: how many edges, where, and what can be done.
TEST(BodyShape, MeshesThatBoundNoSolidAreRefused) {
  BodyAssets open = cube_asset(1, false);
  open.meshes["cube"].triangles.pop_back();
  EXPECT_EQ(
      refusal(cube_body(), open),
      "1: body 'cube': its mesh does not bound a solid: 3 open edges, the first from (0.1, 0.1, -0.1) to "
      "(0.1, -0.1, 0.1) m; repair it, or say 'fill: winding' to fill it by its winding number");
  BodyAssets turned = cube_asset(1, false);
  std::swap(turned.meshes["cube"].triangles[0][0], turned.meshes["cube"].triangles[0][1]);
  EXPECT_EQ(
      refusal(cube_body(), turned),
      "1: body 'cube': its mesh does not bound a solid: 3 edges between triangles that face opposite "
      "ways, the first from (-0.1, -0.1, -0.1) to (0.1, -0.1, -0.1) m; repair it, or say 'fill: winding' "
      "to fill it by its winding number");
  BodyAssets fin = cube_asset(1, false);  // a triangle stands on an edge
  fin.meshes["cube"].positions_m.push_back({0, 0.2F, 0.2F});
  fin.meshes["cube"].triangles.push_back({6, 7, 8});
  EXPECT_EQ(
      refusal(cube_body(), fin),
      "1: body 'cube': its mesh does not bound a solid: 2 open edges, the first from (-0.1, 0.1, 0.1) to "
      "(0, 0.2, 0.2) m; 1 edge of more than two triangles that don't pair up, the first from (-0.1, 0.1, "
      "0.1) to (0.1, 0.1, 0.1) m; repair it, or say 'fill: winding' to fill it by its winding number");
  BodyAssets nan = cube_asset(1, false);
  nan.meshes["cube"].positions_m[3].z = NAN;
  EXPECT_EQ(refusal(cube_body(), nan), "1: body 'cube': its mesh: vertex 3 is not finite: (0.1, 0.1, nan)");
}

/// The same meshes, filled by winding number when that is asked for, are the whole cube again: 4^3 cubes.
TEST(BodyShape, WindingNumberFillsThem) {
  BodyDescription body = cube_body();
  body.shape.fill = MeshFill::winding;
  const auto expect_cube = [&](const BodyAssets& assets, const std::string& warning, Index fewest) {
    const BodyShape shape = make_body_shape(body, assets);
    EXPECT_LE(shape.lattice.cube_count(), 64);
    EXPECT_GE(shape.lattice.cube_count(), fewest);
    // Seen through the hole of half a face, up to a quarter of the solid angle is missing just beside it:
    // nodes on that face may count as outside, no others.
    EXPECT_GT(shape.lattice.mass_kg(), 8 * 0.85);
    if (!warning.empty()) {
      ASSERT_EQ(shape.warnings.size(), 1U);
      EXPECT_NE(shape.warnings[0].find(warning), std::string::npos) << shape.warnings[0];
    }
  };
  expect_cube(cube_asset(1, false), "", 64);
  // What bounds a solid has its mass, 8 kg, at any spacing.
  body.spacing_m = 0.07;
  EXPECT_NEAR(make_body_shape(body, cube_asset(1, false)).lattice.mass_kg(), 8, 1e-3);
  body.spacing_m = 0.05;
  BodyAssets open = cube_asset(1, false);
  open.meshes["cube"].triangles.pop_back();
  expect_cube(open,
              "3 open edges, the first from (0.1, 0.1, -0.1) to (0.1, -0.1, 0.1) m; it is filled by its", 64);
  BodyAssets turned = cube_asset(1, false);
  std::swap(turned.meshes["cube"].triangles[0][0], turned.meshes["cube"].triangles[0][1]);
  // A turned triangle counts twice: the 10 cubes below this half of a face may see 1 - 2 * 1/4 of a turn or
  // less.
  expect_cube(turned, "face opposite ways", 64 - 10);
  BodyAssets sheet = cube_asset(1, false);
  sheet.meshes["cube"].triangles.resize(2);
  EXPECT_NE(refusal(body, sheet).find("the mesh encloses nothing at this spacing"), std::string::npos)
      << refusal(body, sheet);
}

TEST(BodyShape, WithoutThicknessIsNamed) {
  BodyAssets flat = cube_asset(1, false);
  for (Vec3f& p : flat.meshes["cube"].positions_m) p.y *= 1e-4F;
  EXPECT_NE(
      refusal(cube_body(), flat).find("its mesh has no thickness: 0.08 m^2 of surface enclose 8e-07 m^3"),
      std::string::npos)
      << refusal(cube_body(), flat);
}

TEST(BodyShape, SelfOverlapAndSharedEdgesAreNamed) {
  const auto with_second = [](Vec3f shift) {
    BodyAssets assets = cube_asset(1, false);
    TriangleMesh& mesh = assets.meshes["cube"];
    const TriangleMesh one = mesh;
    for (const Vec3f p : one.positions_m) mesh.positions_m.push_back(p + shift);
    for (const auto& t : one.triangles) mesh.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
    return assets;
  };
  // Two cubes a corner of which overlaps: 2 * 64 lattice cubes less those that both have. All their faces lie
  // on planes of the lattice.
  const BodyShape overlap = make_body_shape(cube_body(), with_second({0.1F, 0.1F, 0.1F}));
  ASSERT_EQ(overlap.warnings.size(), 2U);
  EXPECT_EQ(
      overlap.warnings[1],
      "its cubes hold 0.015 m^3, its mesh 0.016 m^3: where the mesh overlaps itself, its volume counts once");
  EXPECT_NE(overlap.warnings[0].find("its mesh overlaps itself: "), std::string::npos) << overlap.warnings[0];
  EXPECT_NE(overlap.warnings[0].find(" pairs of triangles cross, the first at ("), std::string::npos);
  EXPECT_EQ(overlap.lattice.cube_count(), 128 - 8);
  // Two that share an edge: four triangles meet there.
  BodyAssets edge = with_second({0.2F, 0.2F, 0});
  for (auto& t : edge.meshes["cube"].triangles)
    for (Index& v : t) v = v == 8 ? 3 : (v == 12 ? 7 : v);
  const BodyShape joined = make_body_shape(cube_body(), edge);
  ASSERT_EQ(joined.warnings.size(), 1U);
  EXPECT_EQ(
      joined.warnings[0],
      "its mesh is no manifold: 1 edge belongs to more than two triangles, the first from (0.1, 0.1, -0.1) "
      "to (0.1, 0.1, 0.1) m; inside is where the winding number is not 0");
}

/// A spacing that is larger than the body is thick: cushion, tilted plate, rod, ball and shell. What has one
/// cube across is not named.
TEST(IndependentMass, CoarseLatticesAreNamed) {
  BodyDescription body;
  body.name = "cushion";
  body.shape.size_m = {0.6, 0.16, 0.5};
  body.material.model = TissueModel::tled;
  body.spacing_m = 0.25;
  const BodyShape coarse = make_body_shape(body, {});
  ASSERT_EQ(coarse.warnings.size(), 1U);
  EXPECT_EQ(
      coarse.warnings[0],
      "its 'spacing_m' of 0.25 is larger than its thickness, 0.16 m: it neither bends nor is touched as it "
      "should; 'spacing_m: 0.04' has four cubes across it");
  EXPECT_NEAR(coarse.lattice.mass_kg(), 48, 48e-5);
  body.spacing_m = 0.16;
  EXPECT_TRUE(make_body_shape(body, {}).warnings.empty());
  body.placement.rotation_deg = {20, 30, 0};
  body.spacing_m = 0.2;
  const BodyShape tilted = make_body_shape(body, {});
  ASSERT_EQ(tilted.warnings.size(), 1U);
  EXPECT_NE(tilted.warnings[0].find("larger than its thickness, 0.16 m"), std::string::npos)
      << tilted.warnings[0];
  body.shape.kind = ShapeKind::sphere;
  body.shape.radius_m = 0.1;
  body.spacing_m = 0.1;
  EXPECT_TRUE(make_body_shape(body, {}).warnings.empty()) << make_body_shape(body, {}).warnings[0];
}

/// Smooth shapes: closed forms, though their surfaces are nets half a spacing wide. Labels: their voxels.
TEST(IndependentMass, BallsAndLabelsWeighWhatTheyAre) {
  BodyDescription body;
  body.name = "ball";
  body.shape.kind = ShapeKind::sphere;
  body.shape.radius_m = 0.025;
  for (const double spacing : {0.02, 0.01, 0.00625, 0.004}) {
    body.spacing_m = spacing;
    const double kg = 1000 * 4 * 3.14159265358979 / 3 * std::pow(0.025, 3);
    // The volume moves by A d + d^2 / R per step, d a hundredth of R at most: after three, 1e-6.
    EXPECT_NEAR(make_body_shape(body, {}).lattice.mass_kg(), kg, 1e-4 * kg) << spacing;
  }
  LabelVolume volume{{}, {44, 40, 36}, {0.001F, 0.0012F, 0.0015F}, {-0.02F, -0.02F, -0.03F}};
  std::int64_t solid = 0;
  for (int z = 0; z < 36; ++z)
    for (int y = 0; y < 40; ++y)
      for (int x = 0; x < 44; ++x) {
        const double u = (x - 21.5) / 18, v = (y - 19.5) / 14, w = (z - 17.5) / 12;
        const bool in = u * u + v * v + w * w < 1;
        solid += in ? 1 : 0;
        volume.labels.push_back(in ? 3 : 0);
      }
  body.name = "labels";
  body.shape.kind = ShapeKind::labels;
  const double kg = 1000 * static_cast<double>(solid) * 0.001 * 0.0012 * 0.0015;
  for (const double spacing : {0.01, 0.006, 0.003}) {
    body.spacing_m = spacing;
    EXPECT_NEAR(make_body_shape(body, {.labels = {{"labels", std::make_shared<const LabelVolume>(volume)}}})
                    .lattice.mass_kg(),
                kg, 0.005 * kg)
        << spacing;
  }
}

/// Moments of nodes about the middle of a cube of 4 across, m a^2 / 6 about each axis. Cuttable or not, a
/// body that nothing holds has them to the rounding of some thousand sums; shares of eighths have 12.5 %
/// more.
TEST(IndependentMass, FreeBodiesTurnAsHeavilyAsTheyAreCuttableOrNot) {
  for (const bool cuttable : {false, true}) {
    BodyDescription body;
    body.cuttable = cuttable;
    body.material.model = TissueModel::tled;
    body.shape.kind = ShapeKind::box;
    body.shape.size_m = {0.08, 0.08, 0.08};
    body.spacing_m = 0.02;
    const CubeLattice lattice = make_body_shape(body, {}).lattice;
    const std::vector<Vec3f> x_m = lattice.rest_positions_m();
    double moment = 0;
    for (std::size_t i = 0; i < x_m.size(); ++i)
      moment += double{lattice.node_mass_kg[i]} * (double{x_m[i].x * x_m[i].x} + double{x_m[i].y * x_m[i].y});
    EXPECT_NEAR(moment / (lattice.mass_kg() * 0.08 * 0.08 / 6), 1, 1e-4) << cuttable;
  }
}

TEST(BodyShape, SpacingsThatCantBe) {
  BodyDescription body = cube_body();
  body.spacing_m = 0.3;
  EXPECT_EQ(refusal(body, cube_asset(1, false)),
            "1: body 'cube': lattice spacing 0.300000 m is larger than the body (0.200000 m)");
  body.spacing_m = 1e-4;
  EXPECT_EQ(
      refusal(body, cube_asset(1, false)),
      "1: body 'cube': lattice spacing 0.000100 m needs 8.9 TB for 8000000000 cubes, more than the limit of "
      "8.0 GB; use a larger spacing");
  body = cube_body();  // millimetres are named where they are the reason
  EXPECT_EQ(
      refusal(body, cube_asset(1000, false)),
      "1: body 'cube': lattice spacing 0.050000 m needs 71.0 TB for 64000000000 cubes, more than the limit "
      "of 8.0 GB; use a larger spacing; it is 200 m long: is its file in millimetres? Then say 'unit_m: "
      "0.001'");
  EXPECT_EQ(
      refusal(body, cube_asset(0.001F, false)),
      "1: body 'cube': lattice spacing 0.050000 m is larger than the body (0.000200 m); it is only 0.2 mm "
      "long: check 'unit_m' and 'scale'");
  body.shape.kind = ShapeKind::sphere;
  body.shape.radius_m = 5;
  body.spacing_m = 0.0001;  // refused before its surface is made
  EXPECT_NE(refusal(body, {}).find("needs 1110.0 PB"), std::string::npos) << refusal(body, {});
}

TEST(BodyShape, RegionsThatDoNothingAreRefused) {
  BodyDescription body = cube_body();
  body.regions.push_back(core_region(ball({}, 0.06)));
  EXPECT_EQ(
      refusal(body, cube_asset(1, false)),
      "2: body 'cube': region 0 ('core') holds no element, so its 'young_modulus_pa' and 'poisson_ratio' do "
      "nothing: shape matching has the body's");
  body.material.model = TissueModel::tled;
  EXPECT_EQ(refusal(body, cube_asset(1, false)), "accepted");
  body.regions.clear();
  body.material.model = TissueModel::hybrid;
  body.ratio = RatioDescription{1, 1000, Axis::x};
  EXPECT_EQ(make_body_shape(body, cube_asset(1, false)).warnings.at(0),
            "it is hybrid, but no cube is an element");
  body.ratio = RatioDescription{1000, 1, Axis::x};
  EXPECT_EQ(make_body_shape(body, cube_asset(1, false)).warnings.at(0),
            "it is hybrid, but every cube is an element");
}

/// A box has its own volume and mass, with edges that surface nets would round: exact where faces fall on
/// those of cubes, to the rounding of positions of 0.2 m, 1e-8, over the smallest half edge.
TEST(BodyShape, ABoxIsSharp) {
  BodyDescription body = cube_body();
  body.shape.kind = ShapeKind::box;
  body.shape.size_m = {0.4, 0.1, 0.2};
  body.spacing_m = 0.025;
  const BodyShape shape = make_body_shape(body, {});
  EXPECT_TRUE(shape.warnings.empty());
  EXPECT_NEAR(volume_m3(shape.surface_m) / 0.008, 1, 1e-6);
  EXPECT_NEAR(shape.lattice.mass_kg() / 8, 1, 1e-5);
}

/// FreeSurfer has such numbers.
constexpr int kCoreLabel = 12175;

/// 0.2 m of 40^3 voxels: label 1 with a core of another label in the corner where x, y, z < 0.1 m.
BodyAssets labelled_cube() {
  LabelVolume volume{{}, {40, 40, 40}, {0.005F, 0.005F, 0.005F}, {}};
  for (int i = 0; i < 40 * 40 * 40; ++i)
    volume.labels.push_back(i % 40 < 20 && i / 40 % 40 < 20 && i / 1600 < 20 ? kCoreLabel : 1);
  return {.labels = {{"cube", std::make_shared<const LabelVolume>(volume)}}};
}

TEST(BodyShape, LabelsPaintAndHold) {
  BodyDescription body = cube_body();
  body.shape.kind = ShapeKind::labels;
  body.material.model = TissueModel::tled;
  body.placement = {{1, 2, 3}, {0, 0, 90}, 0.5};
  body.spacing_m = 0.02;
  SpaceRegion core;
  core.kind = RegionKind::label;
  core.labels = {kCoreLabel};
  body.regions.push_back(core_region(core));
  body.fixed.push_back({core});
  const BodyShape shape = make_body_shape(body, labelled_cube());
  // 0.1 m in the world, 5^3 cubes: the core takes half of the third layer along each axis, where it has the
  // majority only in cubes that lie in it along the two others: 2 1/2 layers round to 2 or 3.
  const auto painted = std::count(shape.material_of_cube.begin(), shape.material_of_cube.end(), 1);
  EXPECT_GE(painted, 8);
  EXPECT_LE(painted, 27);
  EXPECT_FLOAT_EQ(shape.materials[1].young_Pa, 50000);
  const auto held = std::count(shape.lattice.fixed.begin(), shape.lattice.fixed.end(), kAllAxes);
  EXPECT_GE(held, 27);
  EXPECT_LE(held, 64);
  // Turned by 90 degrees about z, the core lies at x < 1 and y > 2.
  for (std::size_t c = 0; c < shape.lattice.cubes.size(); ++c) {
    if (shape.material_of_cube[c] == 0) continue;
    const Vec3f p = shape.lattice.origin_m + 0.02F * vec_cast<float>(shape.lattice.cubes[c]);
    EXPECT_LT(p.x + 0.01F, 1.0001F);  // the third layer's cubes have their centres at 1
    EXPECT_LT(p.y + 0.01F, 2.06F);
  }
  body.regions[0].where.labels = {9};
  EXPECT_EQ(refusal(body, labelled_cube()),
            "2: body 'cube': region 0 ('core') holds no cube of the body; they have label 1, 12175");
  body.shape.labels = {9};
  EXPECT_EQ(refusal(body, labelled_cube()),
            "2: body 'cube': its label volume has no label 9; it has 1, 12175");
  EXPECT_EQ(refusal([&] {
              body.shape.labels.clear();
              const LabelVolume nothing{{0}, {1, 1, 1}, {0.1F, 0.1F, 0.1F}, {}};
              make_body_shape(body, {.labels = {{"cube", std::make_shared<const LabelVolume>(nothing)}}});
            }),
            "1: body 'cube': its label volume holds nothing but 0");
}

/// Where regions lie over one another the last one's density counts, once.
TEST(BodyShape, LaterRegionsPaintOver) {
  BodyDescription body = cube_body();
  body.material.model = TissueModel::tled;
  for (const double density : {3000.0, 2000.0}) {
    body.regions.push_back(core_region(ball({}, 0.06)));
    body.regions.back().density_kg_m3 = density;
  }
  EXPECT_NEAR(make_body_shape(body, cube_asset(1, false)).lattice.mass_kg(), 8 + 1, 1e-3);
}

TEST(BodyShape, RegionsPaintMaterialsAndModels) {
  BodyDescription body = cube_body();
  body.material.model = TissueModel::hybrid;
  PaintedRegion core;
  core.name = "core";
  core.where = ball({}, 0.06);
  core.model = RegionModel::tled;
  core.young_modulus_pa = 50000;
  core.density_kg_m3 = 2000;
  body.regions.push_back(core);
  const BodyShape shape = make_body_shape(body, cube_asset(1, false));
  // 4^3 cubes whose centres are 0.025 or 0.075 from the middle planes: the inner 8 lie within 0.06.
  EXPECT_EQ(std::count(shape.elements.begin(), shape.elements.end(), 1), 8);
  EXPECT_EQ(std::count(shape.material_of_cube.begin(), shape.material_of_cube.end(), 1), 8);
  EXPECT_FLOAT_EQ(shape.materials[1].young_Pa, 50000);
  // 0.2^3 m^3 of water and 8 cubes of 0.05^3 twice as heavy; the surface coincides with cube faces.
  EXPECT_NEAR(shape.lattice.mass_kg(), 8 + 1, 1e-3);
  body.regions[0].where.center_m = {3, 0, 0};
  try {
    make_body_shape(body, cube_asset(1, false));
    FAIL();
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(), "body 'cube': region 0 ('core') holds no cube of the body");
  }
}

/// Shape matching alone has no cubes that would tell.
TEST(SoftBody, ShapeMatchingThatBlowsUpIsNamedAndSurvived) {
  DeviceSet devices("cpu");
  ExecContext& ctx = devices.context(0);
  BodyDescription description = cube_body();
  MovedRegion grip;
  grip.name = "grip";
  grip.where.kind = RegionKind::half_space;
  grip.where.point_m = {0, -0.09, 0};
  grip.path = {{0.002, {}, 0}, {0.003, {200, 0, 0}, 0}};
  description.moved.push_back(grip);
  LoadedRegion load;
  load.where = grip.where;
  load.pressure_pa = 1;
  description.loads.push_back(load);
  description.contact = false;
  SoftBody body(devices, description, cube_asset(1, false));
  // 200 m in a millisecond are twice what is taken for numbers; the lowest layer of nodes is the lowest rows.
  const std::string trouble = OneBodyFrames(devices, body).play(1e-3F, 5, {});
  EXPECT_EQ(
      trouble,
      "body 'cube' blew up in substep 3 of 5, first seen at node 0, at rest at (-0.100, -0.100, -0.100) m: "
      "'moved[0]' (grip) moves it, at up to 2e+05 m/s, 'loads[0]' acts on it; in the frame before, its "
      "fastest node went at 0 "
      "m/s, waves at 3.16 m/s; it rests from now on: press or move it less, use more substeps, more "
      "damping or a finer lattice");
  EXPECT_TRUE(body.status().is_frozen);
  for (const Vec3f x : body.positions_m(ctx)) EXPECT_LT(length(x), 0.2F);
}

/// A body that is pressed to numbers that are no longer finite goes back and rests; the run goes on.
TEST(SoftBody, BlowingUpIsNamedAndSurvived) {
  DeviceSet devices("cpu");
  ExecContext& ctx = devices.context(0);
  BodyDescription description = cube_body();
  description.material.model = TissueModel::tled;
  description.contact = false;
  SoftBody body(devices, description, cube_asset(1, false));
  OneBodyFrames frames(devices, body);
  const std::string trouble = frames.play(1e-5F, 3, {0, NAN, 0});
  EXPECT_EQ(
      trouble.find("body 'cube' blew up in substeps 1 to 3 of 3, first seen at node 0, at rest at (-0.100, "),
      0U)
      << trouble;
  EXPECT_NE(trouble.find("least volume was 1 of that at rest in cube 0"), std::string::npos) << trouble;
  EXPECT_TRUE(body.status().is_frozen);
  for (const Vec3f x : body.positions_m(ctx)) EXPECT_LT(length(x), 0.2F);
  for (const Vec3f x : body.surface().to_mesh(ctx).positions_m) EXPECT_LT(length(x), 0.2F);  // that is seen
  const std::vector<Vec3f> before = body.positions_m(ctx);
  EXPECT_EQ(frames.play(1e-5F, 1, {0, -9.81F, 0}), "");
  EXPECT_EQ(body.positions_m(ctx), before);
}

}  // namespace
}  // namespace tactus
