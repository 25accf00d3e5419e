#pragma once
/// Bodies that strokes cut on their own, as a simulation cuts them, and what is true of the cut.
#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "piece_count.h"
#include "tactus/geom/figures/figures.h"
#include "tactus/geom/lattice/lattice_cut.h"
#include "tactus/geom/mesh/box_surface.h"
#include "tactus/sim/body/cut_capacity.h"
#include "tactus/tissue/cut/body_cutter.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/tissue/surface_nets.h"

namespace tactus::test {

enum class Kind { box, ball, mesh, liver, count };

/// Two bumps on a ball, in triangles that follow no lattice.
inline TriangleMesh bumpy_ball(float radius_m, std::mt19937& random) {
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

/// Some 8 spacings across; a liver 14.
inline TriangleMesh surface_of(Kind kind, float spacing_m, Vec3f position_m, std::mt19937& random) {
  TriangleMesh mesh;
  if (kind == Kind::box) {
    mesh = box_surface(spacing_m * Vec3f{4, 3, 3.5F}, {16, 12, 14});
  } else if (kind == Kind::ball) {
    const float r_m = 3.7F * spacing_m, margin_m = r_m + spacing_m;
    mesh =
        surface_nets([&](Vec3f p) { return length(p) - r_m; },
                     {{-margin_m, -margin_m, -margin_m}, {margin_m, margin_m, margin_m}}, 0.5F * spacing_m);
  } else if (kind == Kind::mesh) {
    mesh = bumpy_ball(4.5F * spacing_m, random);
  } else {
    FigureOptions options;
    options.scale = 14 * spacing_m / 0.25F;
    const Figure liver = make_figure("liver", options);
    const FigureShape shape = liver.at(0);
    const Vec3f middle_m = liver.bounds_m().center();
    Box3f box = liver.bounds_m();
    box = {box.min - middle_m - Vec3f{spacing_m, spacing_m, spacing_m},
           box.max - middle_m + Vec3f{spacing_m, spacing_m, spacing_m}};
    mesh = surface_nets([&](Vec3f p) { return shape.distance_m(p + middle_m); }, box, 0.7F * spacing_m);
  }
  for (Vec3f& p : mesh.positions_m) p += position_m;
  compute_normals(mesh);
  return mesh;
}

/// A blade's edge at the begin and end of frames.
struct StrokeWay {
  Vec3d middle, along, across;  ///< along: of the way; across: of the edge; unit
  double half_way = 0, half_edge = 0;
  Vec3d end_of_edge(double time, double side) const {
    return middle + (2 * time - 1) * half_way * along + side * half_edge * across;
  }
};

class StrokeBody {
 public:
  StrokeBody(const TriangleMesh& surface_m, double spacing_m, Index copies = 6000)
      : surface_m_(surface_m),
        lattice_(cut_lattice(lattice_from_mesh(surface_m, {.spacing_m = static_cast<float>(spacing_m)}),
                             [](Vec3i, int) { return false; }, {.copies = copies, .nodes = 2 * copies})),
        cutter_(lattice_, {}, surface_m_, anchor_vertices(lattice_, surface_m_),
                {surface_capacity(lattice_, surface_m_).vertices,
                 surface_capacity(lattice_, surface_m_).triangles}),
        rest_m_(lattice_.rest_positions_m()),
        volume_m3_(tactus::volume_m3(surface_m_)) {
    velocity_m_s_.resize(rest_m_.size());
    for (std::size_t i = 0; i < rest_m_.size(); ++i)
      velocity_m_s_[i] = {0.5 + rest_m_[i].y, 0.25 - rest_m_[i].z, 1.0 + 2 * rest_m_[i].x};
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
  /// A node of the cube that holds a point; -1: none does.
  Index node_near(Vec3d p_m) const {
    const Vec3d p = (p_m - vec_cast<double>(lattice_.origin_m)) / spacing();
    const Index cube = cutter_.lattice().regular_at({static_cast<Index>(std::floor(p.x)),
                                                     static_cast<Index>(std::floor(p.y)),
                                                     static_cast<Index>(std::floor(p.z))});
    return cube < 0 ? -1 : cutter_.lattice().lattice().cube_nodes[at(cube)][0];
  }
  Vec3d middle_m() const { return vec_cast<double>(bounds(surface_m_).center()); }
  /// Through all of the body.
  StrokeWay way_through(const CutPlane& plane) const {
    const Box3f box = bounds(surface_m_);
    const double reach_m = 0.6 * double{length(box.extent())} + 2 * spacing();
    return {middle_m() - plane.above(middle_m()) * plane.normal, plane.along,
            cross(plane.normal, plane.along), reach_m, reach_m};
  }
  /// Each node moves by up to so much beside that, in spacings, anew in each frame.
  void wobble(double spacings) { wobble_ = spacings; }

  /// @param moved takes a point of the body at rest to where it is at a time 0..1
  template <class F>
  void cut(const StrokeWay& way, int frames, F&& moved, std::mt19937& random) {
    std::uniform_real_distribution<double> noise(-1, 1);
    cut::BladeTrail trail;
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
        edge_m.push_back(vec_cast<float>(moved(way.end_of_edge(time, side), time)));
      return edge_m;
    };
    std::vector<Vec3f> before_m = nodes_at(0);
    for (int k = 0; k < frames; ++k) {
      const double begin = double(k) / frames, end = double(k + 1) / frames;
      const std::vector<Vec3f> x_m = nodes_at(end);
      TopologyChange change;
      const cut::CutReport report =
          cutter_.cut(trail, {edge_at(begin), edge_at(end), frame_ + k}, before_m, x_m, change);
      is_full_ = is_full_ || report.is_full;
      cut_cubes_ += report.cut_cubes;
      slivers_ += report.slivers;
      area_m2_ += report.area_m2;
      before_m = x_m;
      do {
        trail.follow(change);
        for (const TopologyChange::Node& node : change.nodes)
          if (node.from >= 0) {
            before_m[at(node.node)] = before_m[at(node.from)];
            rest_m_[at(node.node)] = rest_m_[at(node.from)];
            velocity_m_s_[at(node.node)] = velocity_m_s_[at(node.from)];
          }
      } while (cutter_.match_parts(change));
    }
    frame_ += frames + 1;
  }

  int parts() const { return cutter_.lattice().part_count(); }
  /// Ascending. They are those of the surface that hang together.
  std::vector<double> volumes_m3() const {
    auto all = cutter_.closed_volumes_m3(rest_m_);
    std::sort(all.begin(), all.end());
    return all;
  }
  double area_m2() const { return area_m2_; }
  double volume_m3() const { return volume_m3_; }
  bool is_full() const { return is_full_; }
  Index cut_cubes() const { return cut_cubes_; }
  Index slivers() const { return slivers_; }
  double mass_kg() const { return cutter_.lattice().lattice().mass_kg(); }
  double lightest_part_kg() const {
    const std::vector<Index> part_of_node = cutter_.lattice().part_of_nodes();
    std::map<Index, double> mass_kg;
    for (std::size_t i = 0; i < part_of_node.size(); ++i)
      if (const float m = cutter_.lattice().lattice().node_mass_kg[i]; m > 0)
        mass_kg[part_of_node[i]] += double{m};
    double least = cutter_.lattice().lattice().mass_kg();
    for (const auto& [part, of] : mass_kg) least = std::min(least, of);
    return least;
  }
  Vec3d momentum() const {
    Vec3d sum{};
    for (std::size_t i = 0; i < velocity_m_s_.size(); ++i)
      sum += double{cutter_.lattice().lattice().node_mass_kg[i]} * velocity_m_s_[i];
    return sum;
  }
  TriangleMesh mesh() const { return cutter_.mesh(rest_m_); }

  /// Edges without a twin, triangles that reach from part to part, parts of the lattice that have a surface,
  /// and the longest edge at rest [spacings].
  struct Surface {
    int open = 0, reaching = 0, parts = 0;
    double longest = 0;
  };
  Surface surface() const {
    Surface found;
    const std::vector<Index> part_of_node = cutter_.lattice().part_of_nodes();
    const TriangleMesh mesh = this->mesh();
    const auto part = [&](Index v) {
      const auto anchor = cutter_.surface().anchor(cutter_.lattice(), v);
      return part_of_node[at(cutter_.lattice().lattice().cube_nodes[at(anchor.cube)][0])];
    };
    std::vector<std::array<Index, 3>>
        edges;  // the lower vertex, the other, and the way along it: 1, -1, or 0 where both are one
    edges.reserve(3 * mesh.triangles.size());
    for (const auto& t : mesh.triangles) {
      found.reaching += part(t[0]) != part(t[1]) || part(t[1]) != part(t[2]) ? 1 : 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const Index a = t[k], b = t[(k + 1) % 3];
        edges.push_back({std::min(a, b), std::max(a, b), int(a < b) - int(b < a)});
        found.longest = std::max(
            found.longest, double{length(mesh.positions_m[at(a)] - mesh.positions_m[at(b)])} / spacing());
      }
    }
    std::sort(edges.begin(), edges.end());
    for (std::size_t i = 0; i < edges.size();) {
      const auto first = edges[i];
      int sum = 0;
      for (; i < edges.size() && edges[i][0] == first[0] && edges[i][1] == first[1]; ++i) sum += edges[i][2];
      found.open += sum != 0 ? 1 : 0;
    }
    std::set<Index> seen;
    for (const auto& t : mesh.triangles) seen.insert(part(t[0]));
    found.parts = int(seen.size());
    return found;
  }
  /// Edges of the given surface may be longer.
  double longest_allowed() const { return std::max(3.0, longest_ + 0.01); }

 private:
  static std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }
  TriangleMesh surface_m_;
  CubeLattice lattice_;
  cut::BodyCutter cutter_;
  std::vector<Vec3f> rest_m_;
  std::vector<Vec3d> velocity_m_s_;
  double volume_m3_, area_m2_ = 0, longest_ = 0, wobble_ = 0;
  bool is_full_ = false;
  Index cut_cubes_ = 0, slivers_ = 0;
  int frame_ = 0;
};

}  // namespace tactus::test
