#include "tactus/geom/lattice/cube_lattice.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "tactus/base/at.h"
#include "tactus/base/error.h"
#include "tactus/geom/lattice/cube_parts.h"
#include "tactus/geom/mesh/mesh_defects.h"
#include "tactus/geom/mesh/point_in_mesh.h"

namespace tactus {
namespace {

/// The boxes of cubes a body may touch, and which are chosen.
struct CubeGrid {
  Vec3f origin_m{};
  float h = 0;
  Vec3i dims{};
  std::vector<std::uint8_t> solid;

  std::int64_t index(Index x, Index y, Index z) const { return (std::int64_t{z} * dims.y + y) * dims.x + x; }
  Vec3f center(Index x, Index y, Index z) const {
    const auto c = [&](Index i) { return (static_cast<float>(i) + 0.5F) * h; };
    return origin_m + Vec3f{c(x), c(y), c(z)};
  }
  template <class F>
  void for_each(F&& body) const {
    for (Index z = 0; z < dims.z; ++z)
      for (Index y = 0; y < dims.y; ++y)
        for (Index x = 0; x < dims.x; ++x) body(x, y, z);
  }
};

void check_options(const LatticeOptions& o) {
  if (!(o.spacing_m > 0) || !std::isfinite(o.spacing_m))
    throw Error("lattice spacing must be a positive length in m, not " + std::to_string(o.spacing_m));
  if (!(o.density_kg_m3 > 0) || !std::isfinite(o.density_kg_m3))
    throw Error("density must be positive [kg/m^3], not " + std::to_string(o.density_kg_m3));
}

/// Cubes of a grid centred on the body, along each axis: symmetric bodies get symmetric lattices. The margin
/// keeps faces that lie on a grid plane from touching a further layer through round-off.
Vec3d cells_along(Vec3f extent_m, double h) {
  Vec3d cells;
  for (int a = 0; a < 3; ++a) cells[a] = std::max(1.0, std::ceil(double{extent_m[a]} / h - 1e-4));
  return cells;
}

CubeGrid make_grid(const Box3f& box, const LatticeOptions& o) {
  check_lattice_size(box.extent(), o);
  const double h = o.spacing_m;
  const Vec3d cells = cells_along(box.extent(), h);
  CubeGrid grid;
  grid.h = o.spacing_m;
  grid.dims = vec_cast<Index>(cells);
  const Vec3f center = box.center();
  for (int a = 0; a < 3; ++a) grid.origin_m[a] = static_cast<float>(double{center[a]} - cells[a] * h / 2);
  grid.solid.assign(at(std::int64_t{grid.dims.x} * grid.dims.y * grid.dims.z), 0);
  return grid;
}

CubeLattice to_lattice(const CubeGrid& grid, const LatticeOptions& o) {
  CubeLattice lattice;
  lattice.spacing_m = grid.h;
  lattice.origin_m = grid.origin_m;
  lattice.node_dims = grid.dims + Vec3i{1, 1, 1};
  const Vec3i n = lattice.node_dims;
  const auto node = [&](Vec3i p) { return (std::int64_t{p.z} * n.y + p.y) * n.x + p.x; };
  const auto corner = [](Vec3i c, int q) { return c + Vec3i{q & 1, q >> 1 & 1, q >> 2}; };
  std::vector<Index> id(at(std::int64_t{n.x} * n.y * n.z), -1);
  grid.for_each([&](Index x, Index y, Index z) {
    if (grid.solid[at(grid.index(x, y, z))] == 0) return;
    lattice.cubes.push_back({x, y, z});
    for (int q = 0; q < 8; ++q) id[at(node(corner({x, y, z}, q)))] = 0;
  });
  if (lattice.cubes.empty()) throw Error("the body touches no cube of the lattice: it is empty");
  for (Index z = 0; z < n.z; ++z)
    for (Index y = 0; y < n.y; ++y)
      for (Index x = 0; x < n.x; ++x) {
        Index& i = id[at(node({x, y, z}))];
        if (i < 0) continue;
        i = lattice.node_count();
        lattice.nodes.push_back({x, y, z});
      }
  const float mass = o.density_kg_m3 * grid.h * grid.h * grid.h;
  lattice.cube_mass_kg.assign(lattice.cubes.size(), mass);
  lattice.fixed.assign(lattice.nodes.size(), 0);
  lattice.cube_nodes.resize(lattice.cubes.size());
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    for (int q = 0; q < 8; ++q) {
      const Index i = id[at(node(corner(lattice.cubes[c], q)))];
      lattice.cube_nodes[c][static_cast<std::size_t>(q)] = i;
    }
  }
  lattice.share_masses();
  return lattice;
}

/// Separating axes of a triangle (relative to the box's centre) and a box (Akenine-Moeller 2001).
bool triangle_touches_box(Vec3d a, Vec3d b, Vec3d c, double half) {
  const auto apart = [&](Vec3d axis) {
    const double p = dot(axis, a), q = dot(axis, b), r = dot(axis, c);
    const double reach = half * (abs(axis.x) + abs(axis.y) + abs(axis.z));
    return std::min({p, q, r}) > reach || std::max({p, q, r}) < -reach;
  };
  const Vec3d units[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Vec3d edges[3] = {b - a, c - b, a - c};
  for (const Vec3d u : units) {
    if (apart(u)) return false;
    for (const Vec3d e : edges) {
      if (apart(cross(u, e))) return false;
    }
  }
  return !apart(cross(edges[0], edges[1]));
}

void mark_surface(CubeGrid& grid, const TriangleMesh& mesh) {
  // Cubes are tested smaller by this margin, so a face on a grid plane touches none. Those that it bounds
  // become solid by their centres (fill_each), those on its other side don't.
  constexpr double kMargin = 1e-4;
  const double half = 0.5 * grid.h;
  for (const auto& t : mesh.triangles) {
    const Vec3f a = mesh.positions_m[at(t[0])], b = mesh.positions_m[at(t[1])],
                c = mesh.positions_m[at(t[2])];
    const Vec3f low = (min(a, min(b, c)) - grid.origin_m) / grid.h,
                high = (max(a, max(b, c)) - grid.origin_m) / grid.h;
    const auto cell = [](float v, Index n) { return clamp(floor_to_int(v), Index{0}, n - 1); };
    const auto e = static_cast<float>(kMargin);
    for (Index z = cell(low.z - e, grid.dims.z); z <= cell(high.z + e, grid.dims.z); ++z)
      for (Index y = cell(low.y - e, grid.dims.y); y <= cell(high.y + e, grid.dims.y); ++y)
        for (Index x = cell(low.x - e, grid.dims.x); x <= cell(high.x + e, grid.dims.x); ++x) {
          std::uint8_t& mark = grid.solid[at(grid.index(x, y, z))];
          if (mark != 0) continue;
          const Vec3d m = vec_cast<double>(grid.center(x, y, z));
          mark = triangle_touches_box(vec_cast<double>(a) - m, vec_cast<double>(b) - m,
                                      vec_cast<double>(c) - m, half * (1 - kMargin))
                     ? 1
                     : 0;
        }
  }
}

/// Through holes of an open mesh inside and outside hang together: every cube is asked.
void fill_each(CubeGrid& grid, const PointInMesh& query) {
  std::int64_t inside = 0;
  grid.for_each([&](Index x, Index y, Index z) {
    std::uint8_t& mark = grid.solid[at(grid.index(x, y, z))];
    const bool here = query.inside(grid.center(x, y, z));
    mark = mark != 0 || here ? 1 : 0;
    inside += here ? 1 : 0;
  });
  if (inside == 0)
    throw Error(
        "the mesh encloses nothing at this spacing: its winding number reaches 1/2 in no cube's centre");
}

/// Fills from the signed distances of the nodes to the surface (positive outside), trilinear in between.
void fill_by_distance(CubeLattice& lattice, const std::vector<float>& node_distance_m) {
  constexpr float kSmallestFill = 1.F / 16;  // of a cube that the surface only grazes
  constexpr int kSamples = 4;                // along each edge
  lattice.cube_fill.assign(lattice.cubes.size(), 1);
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    float d[8], largest = -1;
    for (std::size_t q = 0; q < 8; ++q) {
      d[q] = node_distance_m[at(lattice.cube_nodes[c][q])];
      largest = std::max(largest, d[q]);
    }
    if (largest <= 0) continue;
    int inside = 0;
    for (int k = 0; k < kSamples * kSamples * kSamples; ++k) {
      const auto along = [](int i) { return (static_cast<float>(i) + 0.5F) / kSamples; };
      const float x = along(k % kSamples), y = along(k / kSamples % kSamples),
                  z = along(k / kSamples / kSamples);
      const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
      const float low = mix(mix(d[0], d[1], x), mix(d[2], d[3], x), y);
      inside += mix(low, mix(mix(d[4], d[5], x), mix(d[6], d[7], x), y), z) <= 0 ? 1 : 0;
    }
    lattice.cube_fill[c] =
        std::max(kSmallestFill, static_cast<float>(inside) / (kSamples * kSamples * kSamples));
    lattice.cube_mass_kg[c] *= lattice.cube_fill[c];
  }
  lattice.share_masses();
}

/// An open mesh has no volume of its own: cubes are filled by distances and winding numbers of nodes.
CubeLattice lattice_from_open_mesh(const TriangleMesh& mesh, const LatticeOptions& options) {
  const PointInMesh query(mesh, options.fill);
  CubeGrid grid = make_grid(bounds(mesh), options);
  mark_surface(grid, mesh);
  fill_each(grid, query);
  CubeLattice lattice = to_lattice(grid, options);
  std::vector<float> distance_m(lattice.nodes.size());
  tbb::parallel_for(Index{0}, lattice.node_count(),
                    [&](Index i) { distance_m[at(i)] = query.signed_distance_m(lattice.rest_m(i)); });
  fill_by_distance(lattice, distance_m);
  return lattice;
}

}  // namespace

void check_lattice_size(Vec3f e, const LatticeOptions& o) {
  check_options(o);
  if (!std::isfinite(e.x) || !std::isfinite(e.y) || !std::isfinite(e.z) || e.x < 0 || e.y < 0 || e.z < 0)
    throw Error("the body's bounding box is not finite or empty");
  const float largest = max(e.x, max(e.y, e.z));
  if (o.spacing_m > largest)
    throw Error("lattice spacing " + std::to_string(o.spacing_m) + " m is larger than the body (" +
                std::to_string(largest) + " m)");
  const Vec3d cells = cells_along(e, o.spacing_m);
  const double cubes = cells.x * cells.y * cells.z, need = cubes * o.bytes_per_cube;
  if (need > o.max_bytes || cubes > 2e9)
    throw Error("lattice spacing " + std::to_string(o.spacing_m) + " m needs " + bytes_text(need) + " for " +
                std::to_string(static_cast<std::int64_t>(std::min(cubes, 1e18))) +
                " cubes, more than the limit of " + bytes_text(o.max_bytes) + "; use a larger spacing");
}

Vec3f CubeLattice::rest_m(Index node) const {
  const Vec3i n = nodes[at(node)];
  const auto along = [&](int a) {
    return static_cast<float>(double{origin_m[a]} + double{spacing_m} * double(n[a]));
  };
  return {along(0), along(1), along(2)};
}

std::vector<Vec3f> CubeLattice::rest_positions_m() const {
  std::vector<Vec3f> x(nodes.size());
  for (Index i = 0; i < node_count(); ++i) x[at(i)] = rest_m(i);
  return x;
}

void CubeLattice::share_masses() {
  node_mass_kg.assign(nodes.size(), 0);
  for (Index c = 0; c < cube_count(); ++c)
    for (int q = 0; q < 8; ++q)
      node_mass_kg[at(cube_nodes[at(c)][at(q)])] += share_of(c, q) * cube_mass_kg[at(c)];
}

double CubeLattice::mass_kg() const {
  double sum = 0;
  for (const float m : cube_mass_kg) sum += double{m};
  return sum;
}

bool CubeLattice::has_rollers() const {
  return std::any_of(fixed.begin(), fixed.end(), [](HeldAxes held) { return held != 0 && held != kAllAxes; });
}

Index CubeLattice::fix_where(const std::function<bool(Vec3f)>& predicate) {
  Index count = 0;
  for (Index i = 0; i < node_count(); ++i) {
    if (predicate(rest_m(i))) fixed[at(i)] = kAllAxes;
    count += fixed[at(i)] == kAllAxes ? 1 : 0;
  }
  return count;
}

Index CubeLattice::fix_half_space(Vec3f point_m, Vec3f normal) {
  return fix_where([&](Vec3f p) { return dot(normal, p - point_m) <= 0; });
}

namespace {

/// Cubes are in the order of their cells.
void take_moments(const CubeFills& fills, const CubeCells& cells, CubeLattice& lattice) {
  Index cube = 0;
  for (const CubeFills::Moments& of : fills.moments) {
    while (cells.index(lattice.cubes[at(cube)]) < of.cell) ++cube;
    if (lattice.off_centre.empty() || lattice.off_centre.back().cube != cube)
      lattice.off_centre.push_back({.cube = cube});
    CubeLattice::OffCentre& sum = lattice.off_centre.back();
    const double per_mass = 1 / double{lattice.cube_fill[at(cube)]};
    sum.first += vec_cast<float>(per_mass * of.first);
    sum.excess += vec_cast<float>(per_mass * of.excess);
  }
}

}  // namespace

CubeLattice lattice_from_mesh(const TriangleMesh& mesh, const LatticeOptions& options) {
  if (options.fill == MeshFill::winding) return lattice_from_open_mesh(mesh, options);
  check_closed(mesh, "mesh");
  CubeGrid grid = make_grid(bounds(mesh), options);
  const CubeCells cells{grid.origin_m, grid.h, grid.dims};
  CubeFills fills = fills_of_parts(parts_of_cubes(mesh, cells), cells);
  grid.solid = std::move(fills.exists);
  CubeLattice lattice = to_lattice(grid, options);
  lattice.cube_fill.resize(lattice.cubes.size());
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    lattice.cube_fill[c] = fills.fill[at(cells.index(lattice.cubes[c]))];
    lattice.cube_mass_kg[c] *= lattice.cube_fill[c];
  }
  take_moments(fills, cells, lattice);
  lattice.share_masses();
  return lattice;
}

CubeLattice lattice_from_sdf(const std::function<float(Vec3f)>& distance_m, const Box3f& box_m,
                             const LatticeOptions& options) {
  CubeGrid grid = make_grid(box_m, options);
  const float h = grid.h;
  grid.for_each([&](Index x, Index y, Index z) {
    const Vec3f m = grid.center(x, y, z);
    const float d = distance_m(m);
    if (!std::isfinite(d))
      throw Error("signed distance at (" + std::to_string(m.x) + ", " + std::to_string(m.y) + ", " +
                  std::to_string(m.z) + ") m is not finite");
    bool touched = d <= 0;
    for (int s = 0; s < 125 && !touched && d < 0.8661F * h; ++s) {
      const auto offset = [&](int i) { return (static_cast<float>(i) - 2.F) * 0.25F * h; };
      touched = distance_m(m + Vec3f{offset(s % 5), offset(s / 5 % 5), offset(s / 25)}) < 0;
    }
    grid.solid[at(grid.index(x, y, z))] = touched ? 1 : 0;
  });
  return to_lattice(grid, options);
}

CubeLattice lattice_from_labels(const LabelVolume& volume, const std::set<VoxelLabel>& solid,
                                const LatticeOptions& options) {
  const Vec3i n = volume.dims;
  if (n.x <= 0 || n.y <= 0 || n.z <= 0 || volume.labels.size() != at(std::int64_t{n.x} * n.y * n.z))
    throw Error("label volume of " + std::to_string(n.x) + "x" + std::to_string(n.y) + "x" +
                std::to_string(n.z) + " voxels holds " + std::to_string(volume.labels.size()) + " labels");
  const Vec3f v = volume.voxel_size_m;
  if (!(v.x > 0) || !(v.y > 0) || !(v.z > 0))
    throw Error("label volume: voxel sizes must be positive lengths");
  const auto is_solid = [&](Index x, Index y, Index z) {
    return solid.contains(volume.labels[at((std::int64_t{z} * n.y + y) * n.x + x)]);
  };
  Vec3i low = n, high{-1, -1, -1};
  const auto for_each_solid = [&](auto&& body) {
    for (Index z = 0; z < n.z; ++z)
      for (Index y = 0; y < n.y; ++y)
        for (Index x = 0; x < n.x; ++x)
          if (is_solid(x, y, z)) body(Vec3i{x, y, z});
  };
  for_each_solid([&](Vec3i p) { low = min(low, p), high = max(high, p); });
  if (high.x < 0) throw Error("label volume: no voxel has one of the body's labels");
  const auto voxel_corner = [&](Vec3i p) {
    return volume.origin_m +
           Vec3f{v.x * static_cast<float>(p.x), v.y * static_cast<float>(p.y), v.z * static_cast<float>(p.z)};
  };
  CubeGrid grid = make_grid({voxel_corner(low), voxel_corner(high + Vec3i{1, 1, 1})}, options);
  std::vector<float> filled(grid.solid.size());  // shares of cubes
  for_each_solid([&](Vec3i p) {
    const Vec3f a = (voxel_corner(p) - grid.origin_m) / grid.h,
                b = (voxel_corner(p + Vec3i{1, 1, 1}) - grid.origin_m) / grid.h;
    const auto cell = [](float c, Index count) { return clamp(floor_to_int(c), Index{0}, count - 1); };
    const auto overlap = [](float from, float to, Index c) {
      return std::max(0.F, std::min(to, static_cast<float>(c + 1)) - std::max(from, static_cast<float>(c)));
    };
    const float e = 1e-4F;  // sharing a face is not sharing volume
    for (Index z = cell(a.z + e, grid.dims.z); z <= cell(b.z - e, grid.dims.z); ++z)
      for (Index y = cell(a.y + e, grid.dims.y); y <= cell(b.y - e, grid.dims.y); ++y)
        for (Index x = cell(a.x + e, grid.dims.x); x <= cell(b.x - e, grid.dims.x); ++x)
          filled[at(grid.index(x, y, z))] +=
              overlap(a.x, b.x, x) * overlap(a.y, b.y, y) * overlap(a.z, b.z, z);
  });
  for (std::size_t c = 0; c < filled.size(); ++c)
    grid.solid[c] = filled[c] > 0 && filled[c] >= options.smallest_fill ? 1 : 0;
  return to_lattice(grid, options);
}

std::vector<VoxelLabel> labels_of_cubes(const CubeLattice& lattice, const LabelVolume& volume,
                                        const std::set<VoxelLabel>& solid,
                                        const std::function<Vec3d(Vec3d)>& to_volume) {
  constexpr int kSamples = 4;  // along each edge
  const double h = lattice.spacing_m;
  // The map is affine: a corner and three edges tell it all.
  const Vec3d zero = to_volume({}), edge[3] = {to_volume({h, 0, 0}) - zero, to_volume({0, h, 0}) - zero,
                                               to_volume({0, 0, h}) - zero};
  std::vector<char> is_solid(kMostLabel + 1);
  for (const VoxelLabel label : solid) is_solid[label] = true;
  const auto fullest = [&](Vec3d center, double size) {
    std::array<VoxelLabel, kSamples * kSamples * kSamples> seen;
    auto end = seen.begin();
    for (int k = 0; k < static_cast<int>(seen.size()); ++k) {
      const auto along = [&](int i) { return size * ((i + 0.5) / kSamples - 0.5); };
      const Vec3d p = center + along(k % kSamples) * edge[0] + along(k / kSamples % kSamples) * edge[1] +
                      along(k / kSamples / kSamples) * edge[2];
      const VoxelLabel label = volume.at(p);
      if (is_solid[label] != 0) *end++ = label;
    }
    // Among labels that are as frequent, the smallest number wins.
    std::sort(seen.begin(), end);
    VoxelLabel best = 0;
    std::ptrdiff_t most = 0;
    for (auto run = seen.begin(); run != end;) {
      const auto next = std::upper_bound(run, end, *run);
      if (next - run > most) best = *run;
      most = std::max(most, next - run);
      run = next;
    }
    return best;
  };
  std::vector<VoxelLabel> labels(lattice.cubes.size());
  for (std::size_t c = 0; c < labels.size(); ++c) {
    const Vec3d center = to_volume(vec_cast<double>(lattice.origin_m) +
                                   h * (vec_cast<double>(lattice.cubes[c]) + Vec3d{0.5, 0.5, 0.5}));
    for (double size = 1; size <= 8 && labels[c] == 0; size *= 2) labels[c] = fullest(center, size);
    if (labels[c] == 0)
      throw Error("cube " + std::to_string(c) + " is further than 4 spacings from every labelled voxel");
  }
  return labels;
}

CubeLattice lattice_from_box(Vec3f origin_m, Vec3i cubes, const LatticeOptions& options) {
  check_options(options);
  if (cubes.x <= 0 || cubes.y <= 0 || cubes.z <= 0)
    throw Error("a box needs at least one cube along each axis");
  CubeGrid grid{origin_m, options.spacing_m, cubes, {}};
  grid.solid.assign(at(std::int64_t{cubes.x} * cubes.y * cubes.z), 1);
  return to_lattice(grid, options);
}

}  // namespace tactus
