/// Straight cuts of bodies that rest, sag or fall, anywhere in the world, in one frame or in many. What is
/// right is known from the mesh that was given and the plane alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <numeric>
#include <random>
#include <string>

#include "tactus/geom/box_surface.h"
#include "tactus/geom/lattice_cut.h"
#include "tactus/tissue/cut/body_cutter.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/tissue/surface_nets.h"

namespace tactus {
namespace {

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

enum class Kind { box, ball, mesh, count };
enum class Motion { rest, sags, falls, count };

struct Plane {
  Vec3d point, normal, along;  ///< along: the way of the blade; unit, in the plane
};

/// Two bumps on a ball, in triangles that follow no lattice.
TriangleMesh bumpy_ball(float radius_m, std::mt19937& random) {
  TriangleMesh mesh = box_surface({1, 1, 1}, {12, 12, 12});
  std::uniform_real_distribution<float> uniform(-1, 1);
  const Vec3f a = normalized(Vec3f{uniform(random), uniform(random), uniform(random)}, Vec3f{1, 0, 0}),
              b = normalized(Vec3f{uniform(random), uniform(random), uniform(random)}, Vec3f{0, 1, 0});
  for (Vec3f& p : mesh.positions_m) {
    const Vec3f d = normalized(p);
    p = radius_m * (0.8F + 0.2F * max(0.F, dot(a, d)) + 0.15F * max(0.F, dot(b, d))) * d;
  }
  return mesh;
}

/// What a plane does to a closed mesh: volumes below and above, and the area of the section. Both are
/// integrals over the surface about a point of the plane, where the section itself adds nothing.
struct Section {
  double below_m3 = 0, above_m3 = 0, area_m2 = 0;
};
Section section_of(const TriangleMesh& mesh, const Plane& plane) {
  Section s;
  for (const auto& t : mesh.triangles) {
    std::array<Vec3d, 3> p;
    std::array<double, 3> d;
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = vec_cast<double>(mesh.positions_m[at(t[k])]) - plane.point;
      d[k] = dot(p[k], plane.normal);
    }
    std::vector<Vec3d> low, high, on;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t n = (k + 1) % 3;
      (d[k] < 0 ? low : high).push_back(p[k]);
      if ((d[k] < 0) == (d[n] < 0)) continue;
      const Vec3d cut = p[k] + d[k] / (d[k] - d[n]) * (p[n] - p[k]);
      low.push_back(cut), high.push_back(cut);
      d[k] < 0 ? on.push_back(cut) : (void)on.insert(on.begin(), cut);
    }
    const auto volume = [](const std::vector<Vec3d>& of) {
      double v = 0;
      for (std::size_t i = 2; i < of.size(); ++i) v += dot(of[0], cross(of[i - 1], of[i])) / 6;
      return v;
    };
    s.below_m3 += volume(low);
    s.above_m3 += volume(high);
    if (on.size() == 2) s.area_m2 += 0.5 * dot(plane.normal, cross(on[0], on[1]));
  }
  s.area_m2 = std::abs(s.area_m2);
  return s;
}

/// A body on its own, as a simulation has it.
class CutBody {
 public:
  CutBody(Kind kind, double spacing_m, Vec3d position_m, std::mt19937& random)
      : surface_m_(surface_of(kind, static_cast<float>(spacing_m), vec_cast<float>(position_m), random)),
        lattice_(lattice_of(surface_m_, static_cast<float>(spacing_m))),
        cutter_(lattice_, {}, surface_m_, anchor_vertices(lattice_, surface_m_), {500000, 1000000}),
        rest_m_(lattice_.rest_positions_m()),
        volume_m3_(tactus::volume_m3(surface_m_)) {
    for (const auto& t : surface_m_.triangles)
      for (std::size_t k = 0; k < 3; ++k)
        longest_ = std::max(longest_, double{length(surface_m_.positions_m[at(t[k])] -
                                                    surface_m_.positions_m[at(t[(k + 1) % 3])])} /
                                          spacing());
  }
  double spacing() const { return double{lattice_.spacing_m}; }
  const TriangleMesh& surface_m() const { return surface_m_; }
  const cut::BodyCutter& cutter() const { return cutter_; }
  Vec3d node_m(Vec3d lattice) const { return vec_cast<double>(lattice_.origin_m) + spacing() * lattice; }

  /// @param moved takes a point of the body at rest to where it is at a time 0..1
  template <class F>
  void cut(const Plane& plane, int frames, F&& moved, std::mt19937& random) {
    const Vec3d across = cross(plane.normal, plane.along);
    const Box3f box = bounds(surface_m_);
    const double reach_m = 0.6 * double{length(box.extent())} + 2 * spacing();
    const Vec3d middle = vec_cast<double>(box.center()) -
                         dot(vec_cast<double>(box.center()) - plane.point, plane.normal) * plane.normal;
    std::uniform_real_distribution<double> noise(-1, 1);
    cut::BladeTrail trail;
    // A node keeps its own offset, which changes a little from frame to frame.
    const auto nodes_at = [&](double time) {
      std::vector<Vec3f> x_m;
      for (Index i = 0; i < lattice_.node_count(); ++i) {
        const Vec3d wobble{noise(random), noise(random), noise(random)};
        x_m.push_back(
            vec_cast<float>(moved(vec_cast<double>(rest_m_[at(i)]), time) + wobble_ * spacing() * wobble));
      }
      return x_m;
    };
    const auto edge_at = [&](double time) {
      std::vector<Vec3f> edge_m;
      for (const double side : {-1.0, 1.0})
        edge_m.push_back(
            vec_cast<float>(moved(middle + reach_m * ((2 * time - 1) * plane.along + side * across), time)));
      return edge_m;
    };
    std::vector<Vec3f> before_m = nodes_at(0);
    for (int k = 0; k < frames; ++k) {
      const double begin = double(k) / frames, end = double(k + 1) / frames;
      const std::vector<Vec3f> x_m = nodes_at(end);
      TopologyChange change;
      const cut::CutReport report =
          cutter_.cut(trail, {edge_at(begin), edge_at(end), frame_ + k}, before_m, x_m, change);
      EXPECT_FALSE(report.is_full);
      trail.follow(change);
      area_m2_ += report.area_m2;
      before_m = x_m;
      for (const TopologyChange::Node& node : change.nodes)
        if (node.from >= 0) {
          before_m[at(node.node)] = before_m[at(node.from)];
          rest_m_[at(node.node)] = rest_m_[at(node.from)];
        }
    }
    frame_ += frames + 1;
  }
  void wobble(double spacings) { wobble_ = spacings; }

  int parts() const { return cutter_.lattice().part_count(); }
  /// Ascending. They are those of the surface that hang together.
  std::vector<double> volumes_m3() const {
    auto all = cutter_.closed_volumes_m3(rest_m_);
    std::sort(all.begin(), all.end());
    return all;
  }
  double area_m2() const { return area_m2_; }
  double volume_m3() const { return volume_m3_; }

  /// Edges without a twin, triangles that reach from part to part, and the longest edge at rest.
  struct Surface {
    int open = 0, reaching = 0;
    double longest = 0;
  };
  Surface surface() const {
    Surface found;
    const std::vector<Index> part_of_node = cutter_.lattice().part_of_nodes();
    const TriangleMesh mesh = cutter_.mesh(rest_m_);
    const auto part = [&](Index v) {
      const auto anchor = cutter_.surface().anchor(cutter_.lattice(), v);
      return part_of_node[at(cutter_.lattice().lattice().cube_nodes[at(anchor.cube)][0])];
    };
    std::map<std::pair<Index, Index>, int> edges;
    for (const auto& t : mesh.triangles) {
      found.reaching += part(t[0]) != part(t[1]) || part(t[1]) != part(t[2]) ? 1 : 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const Index a = t[k], b = t[(k + 1) % 3];
        ++edges[{a, b}];
        --edges[{b, a}];
        found.longest = std::max(
            found.longest, double{length(mesh.positions_m[at(a)] - mesh.positions_m[at(b)])} / spacing());
      }
    }
    for (const auto& [edge, sum] : edges) found.open += sum != 0 ? 1 : 0;
    return found;
  }
  /// Edges of the given surface may be longer.
  double longest_allowed() const { return std::max(3.0, longest_ + 0.01); }

 private:
  static TriangleMesh surface_of(Kind kind, float spacing_m, Vec3f position_m, std::mt19937& random) {
    TriangleMesh mesh;
    if (kind == Kind::box) {
      mesh = box_surface(spacing_m * Vec3f{4, 3, 3.5F}, {16, 12, 14});
    } else if (kind == Kind::ball) {
      const float r_m = 3.7F * spacing_m, margin_m = r_m + spacing_m;
      mesh =
          surface_nets([&](Vec3f p) { return length(p) - r_m; },
                       {{-margin_m, -margin_m, -margin_m}, {margin_m, margin_m, margin_m}}, 0.5F * spacing_m);
    } else {
      mesh = bumpy_ball(4.5F * spacing_m, random);
    }
    for (Vec3f& p : mesh.positions_m) p += position_m;
    compute_normals(mesh);
    return mesh;
  }
  static CubeLattice lattice_of(const TriangleMesh& mesh, float spacing_m) {
    CubeLattice lattice = lattice_from_mesh(mesh, {.spacing_m = spacing_m});
    return cut_lattice(lattice, [](Vec3i, int) { return false; }, {.copies = 6000, .nodes = 12000});
  }
  TriangleMesh surface_m_;
  CubeLattice lattice_;
  cut::BodyCutter cutter_;
  std::vector<Vec3f> rest_m_;
  double volume_m3_, area_m2_ = 0, longest_ = 0, wobble_ = 0;
  int frame_ = 0;
};

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

/// Through the middle, at random, or through nodes, edges or faces of the lattice.
Plane plane_of(const CutBody& body, bool on_nodes, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto direction = [&] { return normalized(Vec3d{uniform(random), uniform(random), uniform(random)}); };
  const Box3f box = bounds(body.surface_m());
  const Vec3d middle = vec_cast<double>(box.center());
  Plane plane;
  if (!on_nodes) {
    plane.normal = direction();
    plane.point = middle + 0.3 * 0.5 * double{box.extent().y} * direction();
    plane.along = normalized(cross(plane.normal, direction()));
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
  const Vec3d axis = normalized(Vec3d{uniform(random), uniform(random), uniform(random)});
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

/// @returns what is wrong
std::string cut_and_check(unsigned seed) {
  std::mt19937 random(seed);
  const Stroke stroke = stroke_of(random);
  CutBody body(stroke.kind, stroke.spacing_m, stroke.position_m, random);
  const Plane plane = plane_of(body, stroke.on_nodes, random);
  const Section section = section_of(body.surface_m(), plane);
  const double mass_kg = body.cutter().lattice().lattice().mass_kg();
  // What floats do to the places of nodes, and what an elastic body does between frames.
  if (stroke.frames > 1 && random() % 2 == 0) body.wobble(stroke.motion == Motion::rest ? 1e-5 : 1e-3);
  body.cut(
      plane, stroke.frames,
      motion_of(stroke.motion, vec_cast<double>(bounds(body.surface_m()).center()), stroke.spacing_m, random),
      random);
  std::string wrong;
  char text[200];
  const auto check = [&](bool is_right, const char* what, double value, double expected) {
    if (is_right) return;
    std::snprintf(text, sizeof text, "; %s %.6g, expected %.6g", what, value, expected);
    wrong += text;
  };
  const auto volumes = body.volumes_m3();
  const auto surface = body.surface();
  check(body.parts() == 2, "parts", body.parts(), 2);
  check(volumes.size() == 2, "closed surfaces", double(volumes.size()), 2);
  check(surface.open == 0, "open edges", surface.open, 0);
  check(surface.reaching == 0, "triangles from part to part", surface.reaching, 0);
  check(surface.longest < body.longest_allowed(), "longest edge", surface.longest, body.longest_allowed());
  const double sum = std::accumulate(volumes.begin(), volumes.end(), 0.0);
  check(std::abs(sum / body.volume_m3() - 1) < 2e-3, "volume", sum / body.volume_m3(), 1);
  const double smaller = std::min(section.below_m3, section.above_m3) / body.volume_m3();
  check(volumes.size() != 2 || std::abs(volumes[0] / body.volume_m3() - smaller) < 2e-3, "smaller part",
        volumes[0] / body.volume_m3(), smaller);
  check(std::abs(body.area_m2() / section.area_m2 - 1) < 0.01, "area", body.area_m2() / section.area_m2, 1);
  check(std::abs(body.cutter().lattice().lattice().mass_kg() / mass_kg - 1) < 1e-6, "mass",
        body.cutter().lattice().lattice().mass_kg() / mass_kg, 1);
  return wrong.empty() ? "" : stroke.text() + wrong;
}

TEST(IndependentCuts, StraightStrokesAnywhere) {
  const bool is_long = std::getenv("TACTUS_LONG_TESTS") != nullptr;
  const char* from = std::getenv("CUT_SEED");
  const unsigned first = from != nullptr ? unsigned(std::atoi(from)) : 0, count = is_long ? 1000 : 50;
  unsigned wrong_count = 0;
  const unsigned end = first + (from != nullptr ? 1 : count);
  for (unsigned seed = first; seed < end; ++seed) {
    const std::string wrong = cut_and_check(seed);
    if (wrong.empty()) continue;
    ++wrong_count;
    std::printf("  seed %u: %s\n", seed, wrong.c_str());
  }
  // Not yet 0: in some strokes of many frames, triangles of early frames join the two surfaces.
  EXPECT_LE(wrong_count, (end - first) / 50);
}

}  // namespace
}  // namespace tactus
