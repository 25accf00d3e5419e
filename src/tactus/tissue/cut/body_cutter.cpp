#include "tactus/tissue/cut/body_cutter.h"

#include <map>
#include <numeric>

#include "tactus/base/at.h"
#include "tactus/compute/cpu_for.h"

namespace tactus::cut {

void BodyCutter::take_capacity_for(TopologyChange& change) const {
  const std::size_t splits = std::min(lattice_.lattice().copies.size() / 2, kFrameSplits);
  take_capacity(change.cut, splits);
  take_capacity(change.copies, 3 * splits);
  take_capacity(change.nodes, 6 * splits);
  take_capacity(change.vertices, 20 * splits);
  take_capacity(change.triangles, 50 * splits);
}

CutReport BodyCutter::cut(const BladeStrip& strip, std::span<const Vec3f> x_m, TopologyChange& change) {
  const bool is_refused = lattice_.mark(strip, x_m).refused;
  CutReport report = cut_marked(change);
  report.is_refused = is_refused;
  return report;
}

CutReport BodyCutter::cut(BladeTrail& trail, const BladeStrip& strip, std::span<const Vec3f> before_m,
                          std::span<const Vec3f> x_m, TopologyChange& change) {
  const bool is_refused = lattice_.mark(trail, strip, before_m, x_m).refused;
  CutReport report = cut_marked(change);
  report.is_refused = is_refused;
  return report;
}

bool BodyCutter::has_capacity(Index copies) const {
  constexpr Index kForIslands = 64;
  const Index left = static_cast<Index>(lattice_.lattice().copies.size()) - lattice_.copies_in_use();
  return surface_.has_capacity(copies / 2) && (!keeps_spare_ || 2 * copies + kForIslands <= left);
}

CutReport BodyCutter::cut_marked(TopologyChange& change) {
  CutReport report;
  change.clear();
  const auto stages = lattice_.splits([&](Index copies) { return has_capacity(copies); });
  report.is_full = lattice_.is_full();
  if (stages.empty()) return report;
  const double area_before = surface_.wall_area();
  for (const auto& stage : stages) {
    lattice_.divide(stage, surface_.cut(lattice_, stage));
    report.cut_cubes += static_cast<Index>(stage.size());
  }
  cpu_for(2, 1, [&](int task) {
    if (task == 0)
      lattice_.commit(stages, change);
    else
      surface_.find_near_splits(lattice_, stages);
  });
  surface_.update(lattice_, change);
  const double h = double{lattice_.lattice().spacing_m};
  report.area_m2 = (surface_.wall_area() - area_before) * h * h;
  report.depth_m = surface_.take_depth() * h;
  report.slivers = surface_.take_slivers();
  report.is_full = report.is_full || surface_.is_full();
  return report;
}

bool BodyCutter::match_parts(TopologyChange& change) {
  change.clear();
  std::vector<Index> cubes;
  std::vector<std::uint8_t> is_whole;
  for (const CutSurface::IslandCube& cube : surface_.find_island(lattice_)) {
    cubes.push_back(cube.cube);
    is_whole.push_back(cube.is_whole ? 1 : 0);
  }
  if (cubes.empty()) {
    lattice_.join(surface_.join_bare(lattice_), change);
    if (!change.copies.empty()) return true;
    lattice_.join(surface_.join_slivers(lattice_), change);
    if (change.copies.empty()) return false;
    surface_.update(lattice_, change);
    return true;
  }
  const auto stages = lattice_.part_island(cubes, is_whole);
  if (stages.empty()) return false;
  lattice_.divide(stages.front(), surface_.part_island(lattice_, stages.front()));
  lattice_.commit(stages, change);
  surface_.find_near_splits(lattice_, stages);
  surface_.update(lattice_, change);
  return true;
}

TriangleMesh BodyCutter::mesh(std::span<const Vec3f> x_m) const {
  TriangleMesh mesh;
  for (Index v = 0; v < surface_.vertex_count(); ++v) {
    const embed::Anchor a = surface_.anchor(lattice_, v);
    const auto& nodes = lattice_.lattice().cube_nodes[at(a.cube)];
    Vec3f sum{};
    for (int q = 0; q < 8; ++q) {
      const float w = ((q & 1) != 0 ? a.local.x : 1 - a.local.x) *
                      ((q & 2) != 0 ? a.local.y : 1 - a.local.y) * ((q & 4) != 0 ? a.local.z : 1 - a.local.z);
      sum += w * x_m[at(nodes[at(q)])];
    }
    mesh.positions_m.push_back(sum);
  }
  for (const auto& t : surface_.triangles())
    if (t[0] != t[1] || t[1] != t[2]) mesh.triangles.push_back(t);
  return mesh;
}

std::vector<double> BodyCutter::closed_volumes_m3(std::span<const Vec3f> x_m) const {
  const TriangleMesh surface = mesh(x_m);
  std::vector<Index> parent(surface.positions_m.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](Index i) {
    while (parent[at(i)] != i) i = parent[at(i)] = parent[at(parent[at(i)])];
    return i;
  };
  for (const auto& [a, b, c] : surface.triangles) parent[at(root(a))] = parent[at(root(b))] = root(c);
  std::map<Index, double> volume;
  const Vec3d o = vec_cast<double>(surface.positions_m.front());
  for (const auto& t : surface.triangles) {
    const auto p = [&](std::size_t k) { return vec_cast<double>(surface.positions_m[at(t[k])]) - o; };
    volume[root(t[0])] += dot(p(0), cross(p(1), p(2))) / 6;
  }
  std::vector<double> volumes;
  for (const auto& [piece, v] : volume) volumes.push_back(v);
  return volumes;
}

}  // namespace tactus::cut
