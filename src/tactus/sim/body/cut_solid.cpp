#include "tactus/sim/body/cut_solid.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/at.h"

namespace tactus {
namespace {

/// Walls that are flatter than that, in spacings, count as planes.
constexpr double kFlat = 0.01;

/// Signed distance to the wall of a cube, positive on side 1 [spacings].
class WallDistance {
 public:
  WallDistance(const cut::CutSurface& surface, const cut::CutSurface::NewSplit& split)
      : surface_(surface), parent_(split.split.parent), triangles_(surface.triangles_of(split)) {
    Vec3d normal{};
    double area = 0;
    for (const auto& [a, b, c] : triangles_) {
      const Vec3d n = cross(b - a, c - a);
      normal += n;
      middle_ += length(n) / 3 * (a + b + c);
      area += length(n);
    }
    normal_ = normalized(normal);
    if (area > 0) middle_ = middle_ / area;
    for (const auto& t : triangles_)
      for (const Vec3d& p : t) is_flat_ = is_flat_ && std::abs(dot(normal_, p - middle_)) < kFlat;
  }
  double at(Vec3d p) const {
    if (is_flat_) return dot(normal_, p - middle_);
    float least2 = 1e30F;
    const auto f = [&](Vec3d v) { return vec_cast<float>(v - p); };
    for (const auto& [a, b, c] : triangles_)
      least2 = std::min(least2, squared_distance_to_triangle({}, f(a), f(b), f(c)));
    return (surface_.side(parent_, p) == 1 ? 1 : -1) * std::sqrt(double{least2});
  }

 private:
  const cut::CutSurface& surface_;
  Index parent_;
  std::span<const std::array<Vec3d, 3>> triangles_;
  Vec3d normal_{}, middle_{};
  bool is_flat_ = true;
};

constexpr Vec3i kBeside[6] = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};

}  // namespace

CutSolid::CutSolid(const CubeLattice& lattice, const RestSolid& solid)
    : spacing_m_(lattice.spacing_m),
      dims_(lattice.node_dims),
      to_wall_(at(std::int64_t{dims_.x} * dims_.y * dims_.z), kWallBand) {
  deep_.fill(-kBandSpacings * spacing_m_);
  for (std::size_t k = 0; k < solid.cubes.size(); ++k)
    std::copy_n(solid.sample_m.begin() + static_cast<std::ptrdiff_t>(k * CubeSamples::kCount),
                CubeSamples::kCount, samples_[solid.cubes[k]].begin());
}

const CutSolid::Samples& CutSolid::samples_of(Index cube) const {
  const auto known = samples_.find(cube);
  return known == samples_.end() ? deep_ : known->second;
}

void CutSolid::part_samples(const cut::BodyCutter& cutter, const cut::CutSurface::NewSplit& split) {
  const WallDistance wall(cutter.surface(), split);
  const Samples parent = samples_of(split.split.parent);
  const Vec3d low = vec_cast<double>(cutter.lattice().lattice().cubes[at(split.split.part[0])]);
  Samples &low_side = samples_[split.split.part[0]] = parent,
          &high_side = samples_[split.split.part[1]] = parent;
  constexpr Index kEdge = CubeSamples::kEdge;
  for (Index k = 0; k < kEdge; ++k)
    for (Index j = 0; j < kEdge; ++j)
      for (Index i = 0; i < kEdge; ++i) {
        const Vec3d p = low + (1.0 / CubeSamples::kCuts) * vec_cast<double>(Vec3i{i, j, k});
        const float above_m = static_cast<float>(wall.at(p)) * spacing_m_;
        const std::size_t place = at(CubeSamples::place(i, j, k));
        low_side[place] = std::max(low_side[place], above_m);
        high_side[place] = std::max(high_side[place], -above_m);
      }
  samples_.erase(split.split.parent);
}

/// The new walls in the body, per cube.
std::vector<CutSolid::WallPatch> CutSolid::new_walls(const cut::BodyCutter& cutter) {
  std::vector<WallPatch> walls;
  std::unordered_map<Index, std::size_t> of_part;
  for (const auto& wall : cutter.surface().new_walls()) {
    const auto [known, is_new] = of_part.try_emplace(wall.part[0], walls.size());
    if (is_new) walls.emplace_back();
    const auto& [a, b, c] = wall.corners;
    walls[known->second].triangles.push_back({vec_cast<float>(a), vec_cast<float>(b), vec_cast<float>(c)});
  }
  return walls;
}

Index CutSolid::node_at(Vec3i p) const {
  const bool is_there = p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x < dims_.x && p.y < dims_.y && p.z < dims_.z;
  return is_there ? (p.z * dims_.y + p.y) * dims_.x + p.x : -1;
}

/// Nodes take the wall of a neighbour if it is nearer than theirs. @returns places that came nearer to a wall
std::vector<Vec3i> CutSolid::spread(const std::vector<WallPatch>& walls) {
  struct Try {
    Vec3i p;
    std::size_t wall;
  };
  std::vector<Try> tries;
  std::vector<Vec3i> nearer;
  for (std::size_t w = 0; w < walls.size(); ++w) {
    const auto& [a, b, c] = walls[w].triangles.front();
    const Vec3f middle = (1.F / 3) * (a + b + c);
    const Vec3i cell{static_cast<Index>(std::floor(middle.x)), static_cast<Index>(std::floor(middle.y)),
                     static_cast<Index>(std::floor(middle.z))};
    for (int q = 0; q < 8; ++q) tries.push_back({cell + Vec3i{q & 1, q >> 1 & 1, q >> 2}, w});
  }
  for (std::size_t k = 0; k < tries.size(); ++k) {
    const Try now = tries[k];
    const Index node = node_at(now.p);
    if (node < 0) continue;
    float least2 = 1e30F;
    for (const auto& [a, b, c] : walls[now.wall].triangles)
      least2 = std::min(least2, squared_distance_to_triangle(vec_cast<float>(now.p), a, b, c));
    const float distance = std::sqrt(least2);
    if (!(distance < to_wall_[at(node)])) continue;
    to_wall_[at(node)] = distance;
    nearer.push_back(now.p);
    for (const Vec3i d : kBeside) tries.push_back({now.p + d, now.wall});
  }
  return nearer;
}

/// No material is deeper than the nearest wall is far, be it another cube's: cubes and parts of cubes get
/// that distance from their corners. It is convex, so it takes off nothing from what is nearer to a wall of
/// its own.
/// @returns those that changed
std::vector<Index> CutSolid::press(const cut::LatticeCutter& cutter, const std::vector<Vec3i>& nearer) {
  std::vector<Index> cubes;
  for (const Vec3i p : nearer)
    for (int q = 0; q < 8; ++q) {
      const Index regular = cutter.regular_at(p - Vec3i{q & 1, q >> 1 & 1, q >> 2});
      if (regular < 0) continue;
      for (const Index cube : cutter.live(regular))
        if (cutter.lattice().cube_fill[at(cube)] > 0) cubes.push_back(cube);
    }
  std::sort(cubes.begin(), cubes.end());
  cubes.erase(std::unique(cubes.begin(), cubes.end()), cubes.end());
  for (const Index cube : cubes) {
    Samples& samples = samples_.try_emplace(cube, deep_).first->second;
    float corner_m[8];
    for (int q = 0; q < 8; ++q)
      corner_m[q] =
          -spacing_m_ *
          to_wall_[at(node_at(cutter.lattice().cubes[at(cube)] + Vec3i{q & 1, q >> 1 & 1, q >> 2}))];
    constexpr Index kEdge = CubeSamples::kEdge;
    for (Index k = 0; k < kEdge; ++k)
      for (Index j = 0; j < kEdge; ++j)
        for (Index i = 0; i < kEdge; ++i) {
          const Vec3f q = (1.F / CubeSamples::kCuts) * vec_cast<float>(Vec3i{i, j, k});
          float value_m = 0;
          for (int n = 0; n < 8; ++n) value_m += CubeMap::weight(q, n) * corner_m[n];
          float& sample_m = samples[at(CubeSamples::place(i, j, k))];
          sample_m = std::max(sample_m, value_m);
        }
  }
  return cubes;
}

SolidChange CutSolid::update(const cut::BodyCutter& cutter, const TopologyChange& change,
                             std::span<const PointChange> points) {
  SolidChange solid;
  for (const auto& split : cutter.surface().new_splits()) part_samples(cutter, split);
  const CubeLattice& lattice = cutter.lattice().lattice();
  std::vector<Index> cubes = press(cutter.lattice(), spread(new_walls(cutter)));
  for (const TopologyChange::Copy& copy : change.copies) cubes.push_back(copy.cube);
  std::sort(cubes.begin(), cubes.end());
  cubes.erase(std::unique(cubes.begin(), cubes.end()), cubes.end());
  for (const Index cube : cubes) {
    solid.cubes.push_back({cube, lattice.cubes[at(cube)], lattice.cube_nodes[at(cube)]});
    const Samples& samples = samples_of(cube);
    solid.sample_m.insert(solid.sample_m.end(), samples.begin(), samples.end());
  }
  for (const TopologyChange::Cut& cut : change.cut) solid.gone.push_back(cut.cube);
  solid.points.assign(points.begin(), points.end());
  solid.part = cutter.lattice().part_of_nodes();
  return solid;
}

}  // namespace tactus
