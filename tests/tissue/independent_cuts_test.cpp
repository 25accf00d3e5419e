/// Straight cuts of bodies that rest, sag or fall, anywhere in the world, in one frame or in many. What is
/// right is known from the mesh that was given and the plane alone.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <numeric>
#include <set>
#include <string>

#include "plane_section.h"
#include "stroke_body.h"
#include "tactus/sim/body/cut_capacity.h"

namespace tactus {
namespace {

using test::CutPlane;
using test::Kind;
using test::Section;
using test::section_of;
using test::StrokeBody;

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

enum class Motion { rest, sags, falls, count };

struct Stroke {
  Kind kind;
  Motion motion;
  double spacing_m;
  Vec3d position_m;
  int frames;
  bool on_nodes;
  std::string text() const {
    char text[200];
    std::snprintf(text, sizeof text, "kind %d, motion %d, spacing %g mm, at (%.3g, %.3g, %.3g), %d frames%s",
                  int(kind), int(motion), 1e3 * spacing_m, position_m.x, position_m.y, position_m.z, frames,
                  on_nodes ? ", on nodes" : "");
    return text;
  }
};

Stroke stroke_of(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  Stroke s{};
  s.kind = static_cast<Kind>(random() % unsigned(Kind::count));
  s.motion = static_cast<Motion>(random() % unsigned(Motion::count));
  constexpr double kSpacings_m[] = {0.002, 0.004, 0.01, 0.0125, 0.025};
  s.spacing_m = kSpacings_m[random() % 5];
  const double far_m = random() % 4 == 0 ? 0 : random() % 3 == 0 ? 10 : 0.7;
  s.position_m = far_m * Vec3d{2 * uniform(random) - 1, 2 * uniform(random) - 1, 2 * uniform(random) - 1};
  s.frames = random() % 3 == 0 ? 1 : 3 + int(random() % 20);
  // What moves far in a frame is not where the plane says.
  if (s.frames == 1) s.motion = Motion::rest;
  if (s.motion != Motion::rest) s.frames += 5;
  s.on_nodes = random() % 3 == 0;
  return s;
}

Vec3d direction(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  return normalized(Vec3d{uniform(random), uniform(random), uniform(random)});
}

/// Through the middle, at random, or through nodes, edges or faces of the lattice.
CutPlane plane_of(const StrokeBody& body, bool on_nodes, std::mt19937& random) {
  const Box3f box = bounds(body.surface_m());
  const Vec3d middle = body.middle_m();
  CutPlane plane;
  if (!on_nodes) {
    plane.normal = direction(random);
    plane.point = middle + 0.3 * 0.5 * double{box.extent().y} * direction(random);
    plane.along = normalized(cross(plane.normal, direction(random)));
    return plane;
  }
  constexpr Vec3d kNormals[] = {{1, 0, 0}, {0, 1, 0},  {0, 0, 1}, {1, 1, 0}, {1, -1, 0},
                                {0, 1, 1}, {1, 0, -1}, {1, 1, 1}, {1, 2, 0}, {1, -1, 1}};
  constexpr Vec3d kWays[] = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0},  {0, 0, 1}, {1, 1, 0},
                             {1, 0, 0}, {0, 1, 0}, {1, -1, 0}, {0, 0, 1}, {1, 1, 0}};
  const std::size_t k = random() % 10;
  plane.normal = normalized(kNormals[k]);
  plane.along = normalized(kWays[k]);
  const Vec3d lattice = (middle - body.node_m({})) / body.spacing();
  plane.point = body.node_m({std::round(lattice.x), std::round(lattice.y), std::round(lattice.z)});
  return plane;
}

/// Where a point of the body is: it turns and falls, or is stretched and sheared.
auto motion_of(Motion motion, Vec3d middle_m, double spacing_m, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Vec3d axis = direction(random);
  const double turn = 1.5 * uniform(random);
  const Vec3d fall_m = 20 * spacing_m * Vec3d{uniform(random), -1, uniform(random)},
              sag = 0.1 * Vec3d{uniform(random), uniform(random), uniform(random)};
  return [=](Vec3d p_m, double time) {
    const Vec3d d = p_m - middle_m;
    if (motion == Motion::rest) return p_m;
    if (motion == Motion::sags) return middle_m + d + time * dot(axis, d) * sag;
    const double angle = turn * time;
    return middle_m + time * time * fall_m + std::cos(angle) * d + std::sin(angle) * cross(axis, d) +
           (1 - std::cos(angle)) * dot(axis, d) * axis;
  };
}

/// What is wrong, in words.
class Wrong {
 public:
  void check(bool is_right, const char* what, double value, double expected) {
    if (is_right) return;
    char text[200];
    std::snprintf(text, sizeof text, "; %s %.6g, expected %.6g", what, value, expected);
    text_ += text;
  }
  /// A closed surface per part, no edge that is long, and the volume, mass and momentum of the whole.
  /// @param dust what a part may hold inside out [cubes]
  void check_body(const StrokeBody& body, double mass_kg, Vec3d momentum, double dust = 0) {
    const auto volumes = body.volumes_m3();
    const auto surface = body.surface();
    check(int(volumes.size()) == surface.parts, "closed surfaces", double(volumes.size()), surface.parts);
    check(surface.parts == body.parts(), "parts with a surface", surface.parts, body.parts());
    check(!body.is_full(), "full", 1, 0);
    check(surface.open == 0, "open edges", surface.open, 0);
    check(surface.reaching == 0, "triangles from part to part", surface.reaching, 0);
    check(surface.longest < body.longest_allowed(), "longest edge", surface.longest, body.longest_allowed());
    const double sum = std::accumulate(volumes.begin(), volumes.end(), 0.0);
    check(std::abs(sum / body.volume_m3() - 1) < 2e-3, "volume", sum / body.volume_m3(), 1);
    const double least = -dust * std::pow(body.spacing(), 3);
    check(volumes.front() > least, "least volume", volumes.front(), least);
    check(std::abs(body.mass_kg() / mass_kg - 1) < 1e-6, "mass", body.mass_kg() / mass_kg, 1);
    const Vec3d change = body.momentum() - momentum;
    check(length(change) < 1e-6 * length(momentum), "momentum", length(change) / length(momentum), 0);
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

/// @returns what is wrong
std::string cut_and_check(unsigned seed) {
  std::mt19937 random(seed);
  const Stroke stroke = stroke_of(random);
  StrokeBody body(test::surface_of(stroke.kind, static_cast<float>(stroke.spacing_m),
                                   vec_cast<float>(stroke.position_m), random),
                  stroke.spacing_m);
  const CutPlane plane = plane_of(body, stroke.on_nodes, random);
  const Section section = section_of(body.surface_m(), plane);
  const double mass_kg = body.mass_kg();
  const Vec3d momentum = body.momentum();
  // What floats do to the places of nodes, and what an elastic body does between frames.
  if (stroke.frames > 1 && random() % 2 == 0) body.wobble(stroke.motion == Motion::rest ? 1e-5 : 1e-3);
  body.cut(body.way_through(plane), stroke.frames,
           motion_of(stroke.motion, body.middle_m(), stroke.spacing_m, random), random);
  // A piece with fewer than 4 of 800 points is not counted.
  const test::PieceCount count(body.surface_m(), {plane}, 800, random);
  const auto pieces = static_cast<int>(count.pieces(4).size());
  Wrong wrong;
  wrong.check_body(body, mass_kg, momentum);
  wrong.check(body.parts() == pieces, "parts", body.parts(), pieces);
  const auto volumes = body.volumes_m3();
  const double smaller = std::min(section.below_m3, section.above_m3) / body.volume_m3();
  wrong.check(volumes.size() != 2 || std::abs(volumes[0] / body.volume_m3() - smaller) < 2e-3, "smaller part",
              volumes[0] / body.volume_m3(), smaller);
  wrong.check(std::abs(body.area_m2() / section.area_m2 - 1) < 0.01, "area", body.area_m2() / section.area_m2,
              1);
  return wrong.text().empty() ? "" : stroke.text() + wrong.text();
}

bool is_long() { return std::getenv("TACTUS_LONG_TESTS") != nullptr; }

/// Of a test: all of its seeds, or the one that CUT_SEED names.
struct Seeds {
  unsigned first = 0, end;
  explicit Seeds(unsigned count) : end(count) {
    const char* one = std::getenv("CUT_SEED");
    if (one == nullptr) return;
    first = unsigned(std::atoi(one));
    const char* dash = std::strchr(one, '-');
    end = dash != nullptr ? unsigned(std::atoi(dash + 1)) : first + 1;
  }
};

TEST(IndependentCuts, StraightStrokesAnywhere) {
  const Seeds seeds(is_long() ? 1000 : 50);
  for (unsigned seed = seeds.first; seed < seeds.end; ++seed) {
    const std::string wrong = cut_and_check(seed);
    EXPECT_TRUE(wrong.empty()) << "seed " << seed << ": " << wrong;
  }
}

/// Pieces in which a ball of sqrt 3 spacings has capacity hold a whole cube of the lattice. Two points so far
/// from all planes are in one part of the lattice if they are in one piece, and only then.
std::string check_pieces(const StrokeBody& body, const std::vector<CutPlane>& planes, std::mt19937& random) {
  const test::PieceCount count(body.surface_m(), planes, 1500, random);
  const std::vector<Index> part_of_node = body.cutter().lattice().part_of_nodes();
  std::map<std::size_t, std::set<Index>> parts;   // per piece
  std::map<Index, std::set<std::size_t>> pieces;  // per part
  for (std::size_t i = 0; i < count.points().size(); ++i) {
    const Vec3d p = count.points()[i];
    // Blades find nodes up to 0.04 spacings from where they are.
    if (std::any_of(planes.begin(), planes.end(),
                    [&](const CutPlane& plane) { return std::abs(plane.above(p)) < 1.8 * body.spacing(); }))
      continue;
    const Index node = body.node_near(p);
    if (node < 0) continue;  // of the mesh, where it is thinner than floats tell
    const Index part = part_of_node[at(node)];
    parts[count.piece(i)].insert(part);
    pieces[part].insert(count.piece(i));
  }
  int torn = 0, joined = 0;
  for (const auto& [piece, of] : parts) torn += of.size() > 1 ? 1 : 0;
  for (const auto& [part, of] : pieces) joined += of.size() > 1 ? 1 : 0;
  if (std::getenv("CUT_TELL") != nullptr)
    std::printf("  %d pieces with capacity for a ball, %d parts\n", int(parts.size()), int(pieces.size()));
  if (torn == 0 && joined == 0) return "";
  return "; " + std::to_string(torn) + " pieces are torn, " + std::to_string(joined) + " parts are several";
}

/// A surface that holds less than the least fill of a copy may be inside out by rounding.
constexpr double kDust = 1.0 / 64;

/// Straight strokes through all of one body, over and over.
void cut_over_and_over(unsigned seed, double spacing_m, int strokes) {
  std::mt19937 random(seed);
  const Kind kind = static_cast<Kind>(seed % 3);
  StrokeBody body(test::surface_of(kind, 0.01F, {0.4F, -0.3F, 0.2F}, random), spacing_m,
                  spacing_m < 0.01 ? 60000 : 12000);
  const double mass_kg = body.mass_kg();
  const Vec3d momentum = body.momentum();
  std::vector<CutPlane> planes;
  for (int k = 0; k < strokes; ++k) {
    planes.push_back(plane_of(body, random() % 3 == 0, random));
    const int frames = random() % 2 == 0 ? 1 : 2 + int(random() % 8);
    const double before = body.area_m2();
    body.cut(
        body.way_through(planes.back()), frames, [](Vec3d p_m, double) { return p_m; }, random);
    Wrong wrong;
    wrong.check_body(body, mass_kg, momentum, kDust);
    const auto volumes = body.volumes_m3();
    const double volume = std::accumulate(volumes.begin(), volumes.end(), 0.0) / body.volume_m3();
    const std::string text = wrong.text() + check_pieces(body, planes, random);
    EXPECT_TRUE(text.empty()) << "seed " << seed << ", stroke " << k << ", " << frames << " frames" << text;
    if (std::getenv("CUT_TELL") != nullptr)
      std::printf(
          "seed %u stroke %d frames %d: parts %d, volume %.6f, area %.4f of %.4f, filled %d, copies %d of %d "
          "cubes, vertices %d, triangles %d%s\n",
          seed, k, frames, body.parts(), volume, 1e4 * (body.area_m2() - before),
          1e4 * section_of(body.surface_m(), planes.back()).area_m2, int(body.cutter().surface().filled()),
          int(body.cutter().lattice().copies_in_use()),
          int(body.cutter().lattice().lattice().regular_cubes()), int(body.cutter().surface().vertex_count()),
          int(body.cutter().surface().triangle_count()), text.c_str());
  }
}

int strokes_or(int standard) {
  const char* most = std::getenv("CUT_STROKES");
  return most != nullptr ? std::atoi(most) : standard;
}

TEST(IndependentCuts, StrokesThroughWhatWasCut) {
  const Seeds seeds(7);
  for (unsigned seed = seeds.first; seed < seeds.end; ++seed)
    cut_over_and_over(seed, 0.01, strokes_or(is_long() ? 200 : 22));
}

TEST(IndependentCuts, StrokesThroughWhatWasCutOfAFineLattice) {
  const Seeds seeds(3);
  for (unsigned seed = seeds.first; seed < seeds.end; ++seed) cut_over_and_over(seed, 0.004, strokes_or(4));
}

/// Where walls end at older ones, parts lack triangles on both sides of the gap, and fans close them. Fans at
/// one place sum up to nothing, so the body keeps its volume to 2e-6 spacings, by which its surface is taken
/// in: 292 faces of 336 cubes, 1.7e-6. Closed surfaces of less than 1/64 of a cube are dropped, though: with
/// these strokes bodies 3, 5 and 9 lose up to that.
TEST(IndependentCuts, FansAtOlderWallsKeepTheVolume) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    std::mt19937 random(seed);
    StrokeBody body(test::surface_of(Kind::box, 0.01F, {0.4F, -0.3F, 0.2F}, random), 0.01, 12000);
    for (int k = 0; k < 4; ++k) {
      CutPlane plane;
      do plane = plane_of(body, false, random);
      while (std::min({std::abs(plane.normal.x), std::abs(plane.normal.y), std::abs(plane.normal.z)}) < 0.3);
      body.cut(
          body.way_through(plane), 1, [](Vec3d p_m, double) { return p_m; }, random);
    }
    const auto volumes = body.volumes_m3();
    const double change = std::accumulate(volumes.begin(), volumes.end(), 0.0) / body.volume_m3() - 1;
    const bool has_dust = seed == 3 || seed == 5 || seed == 9;
    EXPECT_LT(change, 2e-6) << seed;
    EXPECT_GT(change, -2e-6 - (has_dust ? 1.0 / 64 / 336 : 0)) << seed;
    EXPECT_GT(body.cutter().surface().filled(), 10) << seed;
  }
}

/// Fifty straight strokes through all of a body have capacity in as many copies as the notice of a full body
/// names.
TEST(IndependentCuts, FiftyStrokesFitTheCapacityThatIsNamed) {
  for (const double spacing_m : {0.01, 0.005})
    for (unsigned seed = 0; seed < 3; ++seed) {
      std::mt19937 random(seed);
      const int strokes = is_long() || spacing_m > 0.005 ? 50 : 5;
      const TriangleMesh surface =
          test::surface_of(static_cast<Kind>(seed), 0.01F, {0.4F, -0.3F, 0.2F}, random);
      const Index cubes =
          lattice_from_mesh(surface, {.spacing_m = static_cast<float>(spacing_m)}).cube_count();
      StrokeBody body(surface, spacing_m, copies_of_strokes(cubes, strokes));
      for (int k = 0; k < strokes; ++k) {
        const int frames = random() % 2 == 0 ? 1 : 2 + int(random() % 8);
        body.cut(
            body.way_through(plane_of(body, random() % 3 == 0, random)), frames,
            [](Vec3d p_m, double) { return p_m; }, random);
        ASSERT_FALSE(body.is_full()) << "seed " << seed << ", stroke " << k << ", " << cubes << " cubes";
      }
      if (std::getenv("CUT_TELL") != nullptr)
        std::printf("%d cubes: %d copies\n", int(cubes), int(body.cutter().lattice().copies_in_use()));
    }
}

/// The automatic capacity of 20 x 20 x 20 cubes, 2000 copies, holds a stroke through all and one across it.
TEST(IndependentCuts, TwoStrokesThrough8000CubesFitTheAutomaticCapacity) {
  std::mt19937 random(1);
  StrokeBody body(box_surface({0.1F, 0.1F, 0.1F}, {40, 40, 40}), 0.01, 2000);
  for (const int axis : {0, 2}) {
    CutPlane plane;
    plane.normal[axis] = plane.along[1] = 1;
    plane.point[axis] = 0.0013;
    body.cut(
        body.way_through(plane), 1, [](Vec3d p_m, double) { return p_m; }, random);
    EXPECT_FALSE(body.is_full()) << axis;
  }
  EXPECT_EQ(body.parts(), 4);
}

/// Incisions of random length and depth into one body. Its surface stays closed and its mass what it is,
/// though the body is in more parts than it has cubes for by then; which piece is whose is not asked here.
TEST(IndependentCuts, ManyStrokesIntoOneBody) {
  std::mt19937 random(7);
  constexpr double kSpacing_m = 0.01;
  StrokeBody body(test::surface_of(Kind::box, 0.01F, {0.4F, -0.3F, 0.2F}, random), kSpacing_m, 40000);
  const double mass_kg = body.mass_kg();
  const Vec3d momentum = body.momentum();
  std::uniform_real_distribution<double> uniform(0, 1);
  const int strokes = is_long() ? 200 : 50;
  for (int k = 0; k < strokes; ++k) {
    const CutPlane plane = plane_of(body, random() % 3 == 0, random);
    test::StrokeWay way = body.way_through(plane);
    way.middle += 0.02 * direction(random);
    way.half_way *= 0.1 + 0.4 * uniform(random);
    way.half_edge *= 0.1 + 0.4 * uniform(random);
    body.cut(
        way, 1 + int(random() % 8), [](Vec3d p_m, double) { return p_m; }, random);
    ASSERT_FALSE(body.is_full());
    EXPECT_EQ(body.surface().open, 0) << k;
    EXPECT_NEAR(body.mass_kg(), mass_kg, 1e-6 * mass_kg);
    EXPECT_LT(length(body.momentum() - momentum), 1e-6 * length(momentum));
  }
}

/// A corner of a box that a blade severs is a part of its own, with what it weighs and holds, unless that is
/// less than 1/64 of a cube: then it joins the part across the blade's wall, and the surface is whole again.
/// The blade's way and nodes are multiples of 2^-14 spacings, so its plane is up to sqrt(3) / 2 of that
/// aside, and legs are sqrt(3) times that shorter: 9e-5 spacings of 0.49 or more, 5e-4 of the volume. 2e-3 is
/// asked. A surface that is whole has the volume that it had, to the rounding of floats (1e-6).
TEST(IndependentCuts, ASliverJoinsThePartAcrossItsWall) {
  for (int corner = 0; corner < 8; ++corner)
    for (const int frames : {1, 7})
      for (const double cubes : {0.002, 0.01, 0.02, 0.1}) {
        std::mt19937 random(1);
        StrokeBody body(test::surface_of(Kind::box, 0.01F, {}, random), 0.01);
        const Vec3d side{(corner & 1) != 0 ? 1.0 : -1.0, (corner & 2) != 0 ? 1.0 : -1.0,
                         (corner & 4) != 0 ? 1.0 : -1.0};
        // A plane that leaves legs of s on the edges cuts s^3 / 6 off.
        const double leg_m = body.spacing() * std::cbrt(6 * cubes);
        CutPlane plane;
        plane.normal = (1 / std::sqrt(3.0)) * side;
        plane.point = Vec3d{0.04 * side.x, 0.03 * side.y, 0.035 * side.z} - leg_m * Vec3d{side.x, 0, 0};
        plane.along = normalized(Vec3d{side.x, -side.y, 0});
        const double mass_kg = body.mass_kg(), cube_kg = mass_kg / 336;
        const Vec3d momentum = body.momentum();
        body.cut(
            body.way_through(plane), frames, [](Vec3d p_m, double) { return p_m; }, random);
        const std::string where =
            std::to_string(corner) + ", " + std::to_string(frames) + ", " + std::to_string(cubes);
        Wrong wrong;
        wrong.check_body(body, mass_kg, momentum);
        EXPECT_EQ(wrong.text(), "") << where;
        const bool is_sliver = cubes < 1.0 / 64;
        EXPECT_EQ(body.slivers(), is_sliver ? 1 : 0) << where;
        ASSERT_EQ(body.parts(), is_sliver ? 1 : 2) << where;
        if (is_sliver) {
          EXPECT_NEAR(body.volumes_m3().front(), body.volume_m3(), 1e-6 * body.volume_m3()) << where;
          continue;
        }
        EXPECT_NEAR(body.volumes_m3().front() / std::pow(body.spacing(), 3), cubes, 2e-3 * cubes) << where;
        EXPECT_NEAR(body.lightest_part_kg(), cubes * cube_kg, 2e-3 * cubes * cube_kg) << where;
      }
}

/// Along a plane of nodes the wall is 0.02 spacings or less off them, so every cube beside it has a part of
/// less than 1/64, which weighs 1/64 of a cube. By that a half of 4 x 6 x 7 cubes is off by 42 / 64 of 168
/// cubes, 0.39 %, whichever way the blade goes; volumes are right to the wall's place, 0.02 of 4 cubes.
TEST(IndependentCuts, AHalfAlongNodesWeighsHalfButForItsSlivers) {
  for (const double way : {-1.0, 1.0})
    for (const int frames : {1, 7}) {
      std::mt19937 random(1);
      StrokeBody body(test::surface_of(Kind::box, 0.01F, {}, random), 0.01);
      CutPlane plane;
      plane.normal = {1, 0, 0};
      plane.along = {0, way, 0};
      const double mass_kg = body.mass_kg();
      const Vec3d momentum = body.momentum();
      body.cut(
          body.way_through(plane), frames, [](Vec3d p_m, double) { return p_m; }, random);
      Wrong wrong;
      wrong.check_body(body, mass_kg, momentum);
      EXPECT_EQ(wrong.text(), "");
      ASSERT_EQ(body.parts(), 2);
      EXPECT_NEAR(body.lightest_part_kg() / mass_kg, 0.5 - 42.0 / 64 / 336, 1e-6);
      EXPECT_NEAR(body.volumes_m3().front() / body.volume_m3(), 0.5, 0.02 / 8);
    }
}

/// A blade in a face of a box that lies on a plane of the lattice parts nothing, whichever way it goes.
TEST(IndependentCuts, ABladeInAFaceCutsNothing) {
  for (int face = 0; face < 6; ++face) {
    for (const int frames : {1, 9}) {
      std::mt19937 random(1);
      StrokeBody body(test::surface_of(Kind::box, 0.01F, {}, random), 0.01);
      CutPlane plane;
      Vec3d half{0.04, 0.03, 0.035};
      plane.normal[face / 2] = 1;
      plane.along[(face / 2 + 1) % 3] = face % 2 == 0 ? 1 : -1;
      plane.point[face / 2] = (face % 2 == 0 ? 1 : -1) * half[face / 2];
      body.cut(
          body.way_through(plane), frames, [](Vec3d p_m, double) { return p_m; }, random);
      EXPECT_EQ(body.parts(), 1) << face << ", " << frames;
      EXPECT_EQ(body.cut_cubes(), 0) << face << ", " << frames;
    }
  }
}

/// Where a blade comes back along its own cut, nothing changes.
TEST(IndependentCuts, ABladeThatComesBackChangesNothing) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    std::mt19937 random(seed);
    StrokeBody body(test::surface_of(Kind::box, 0.01F, {}, random), 0.01);
    test::StrokeWay way = body.way_through(plane_of(body, seed % 3 == 0, random));
    const auto still = [](Vec3d p_m, double) { return p_m; };
    body.cut(way, 7, still, random);
    const auto volumes = body.volumes_m3();
    const Index cubes = body.cut_cubes();
    const double area_m2 = body.area_m2();
    way.along = -way.along;
    body.cut(way, 5, still, random);
    EXPECT_EQ(body.parts(), 2) << seed;
    EXPECT_EQ(body.cut_cubes(), cubes) << seed;
    EXPECT_EQ(body.area_m2(), area_m2) << seed;
    EXPECT_EQ(body.volumes_m3(), volumes) << seed;
  }
}

}  // namespace
}  // namespace tactus
