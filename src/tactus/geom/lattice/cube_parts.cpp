#include "tactus/geom/lattice/cube_parts.h"

#include <tbb/parallel_for.h>

#include "tactus/base/at.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <unordered_map>
#include <utility>

namespace tactus {
namespace {

/// Convex: a triangle has at most 9 corners after six cuts.
struct Polygon {
  std::array<Vec3d, 12> p;
  std::size_t n = 0;
  void add(Vec3d q) { p[n++] = q; }
};

/// The parts of a polygon below and above a plane across an axis. Corners on the plane belong to both.
std::pair<Polygon, Polygon> split(const Polygon& whole, int axis, double plane) {
  std::pair<Polygon, Polygon> parts;
  auto& [below, above] = parts;
  for (std::size_t i = 0; i < whole.n; ++i) {
    const Vec3d a = whole.p[i], b = whole.p[i + 1 < whole.n ? i + 1 : 0];
    const double da = a[axis] - plane, db = b[axis] - plane;
    if (da <= 0) below.add(a);
    if (da >= 0) above.add(a);
    if ((da < 0) == (db < 0) || da == 0 || db == 0) continue;
    Vec3d cut = a + da / (da - db) * (b - a);
    cut[axis] = plane;
    below.add(cut);
    above.add(cut);
  }
  return parts;
}

/// Calls use(k, part) for the part of a polygon between planes k and k + 1 of an axis, k in 0..count-1. The
/// outermost parts include corners that rounding has put outside.
template <class F>
void for_slices(Polygon rest, int axis, Index count, F&& use) {
  double low = rest.p[0][axis], high = low;
  for (std::size_t i = 1; i < rest.n; ++i) {
    low = std::min(low, rest.p[i][axis]);
    high = std::max(high, rest.p[i][axis]);
  }
  const auto slice = [&](double v) {
    return static_cast<Index>(std::clamp(std::floor(v), 0.0, static_cast<double>(count - 1)));
  };
  const Index last = slice(high);
  for (Index k = slice(low); k < last; ++k) {
    const auto [below, above] = split(rest, axis, k + 1);
    if (below.n > 2) use(k, below);
    if (above.n < 3) return;
    rest = above;
  }
  use(last, rest);
}

Vec3d squares(Vec3d p) { return {p.x * p.x, p.y * p.y, p.z * p.z}; }

/// Integrals over the pieces of surface in a cube: of x, x^2/2, x y, x z, x^3/3, x y^2, x z^2, counted from
/// its lowest corner, for the cube itself; and of 1, y, z, y^2, z^2 for those before it in its row.
struct Integrals {
  double volume = 0, covers = 0;
  Vec3d first{}, covers_first{};    ///< covers_first.x is that of covers / 2
  Vec3d second{}, covers_second{};  ///< covers_second.x is that of covers / 3
  bool touched = false;

  void add(const Polygon& piece, Vec3d corner) {
    touched = true;
    const Vec3d a = piece.p[0] - corner;
    for (std::size_t i = 2; i < piece.n; ++i) {
      const Vec3d b = piece.p[i - 1] - corner, c = piece.p[i] - corner;
      const double area_x = 0.5 * ((b.y - a.y) * (c.z - a.z) - (b.z - a.z) * (c.y - a.y));
      for (const Vec3d sum : {a + b, b + c, c + a}) {
        const Vec3d m = 0.5 * sum;
        const double w = area_x / 3;
        volume += w * m.x;
        first += (w * m.x) * Vec3d{0.5 * m.x, m.y, m.z};
        covers += w;
        covers_first += w * Vec3d{0.5, m.y, m.z};
        covers_second += w * Vec3d{1.0 / 3, m.y * m.y, m.z * m.z};
        add_second(2.0 / 15 * area_x, m);
      }
      for (const Vec3d corner_of_piece : {a, b, c}) add_second(area_x / 20, corner_of_piece);
      add_second(9.0 / 20 * area_x, 1.0 / 3 * (a + b + c));
    }
  }
  void add_second(double w, Vec3d m) { second += (w * m.x) * Vec3d{m.x * m.x / 3, m.y * m.y, m.z * m.z}; }
};

struct Surface {
  std::vector<Vec3d> x;  ///< in spacings from the grid's origin
  const std::vector<std::array<Index, 3>>& triangles;

  Polygon polygon(Index t) const {
    Polygon p;
    for (const Index v : triangles[at(t)]) p.add(x[at(v)]);
    return p;
  }
};

/// Triangles of each layer of cubes, in ascending order.
struct LayerLists {
  std::vector<std::int64_t> begin;
  std::vector<Index> triangles;
};

LayerLists list_layers(const Surface& surface, Index layers) {
  const auto count = static_cast<Index>(surface.triangles.size());
  LayerLists lists{std::vector<std::int64_t>(at(layers) + 1), {}};
  const auto for_each = [&](auto&& use) {
    for (Index t = 0; t < count; ++t) {
      const auto& v = surface.triangles[at(t)];
      const double z[3] = {surface.x[at(v[0])].z, surface.x[at(v[1])].z, surface.x[at(v[2])].z};
      const auto layer = [&](double c) {
        return static_cast<Index>(std::clamp(std::floor(c), 0.0, static_cast<double>(layers - 1)));
      };
      const Index last = layer(std::max({z[0], z[1], z[2]}));
      for (Index k = layer(std::min({z[0], z[1], z[2]})); k <= last; ++k) use(k, t);
    }
  };
  for_each([&](Index k, Index) { ++lists.begin[at(k) + 1]; });
  std::partial_sum(lists.begin.begin(), lists.begin.end(), lists.begin.begin());
  lists.triangles.resize(at(lists.begin.back()));
  std::vector<std::int64_t> next(lists.begin.begin(), lists.begin.end() - 1);
  for_each([&](Index k, Index t) { lists.triangles[at(next[at(k)]++)] = t; });
  return lists;
}

/// Sums up a row from its far end: each cube has the integrals of the pieces in it and of all pieces beyond.
void finish_row(Integrals* row, Vec3i first, Index count, std::uint8_t* full,
                std::vector<CubePart>& partial) {
  constexpr double kAll = 1 - 1e-7, kNothing = 1e-9;
  double covers = 0;
  Vec3d covers_first{}, covers_second{};
  std::vector<CubePart> found;
  for (Index x = count - 1; x >= 0; --x) {
    const Integrals& cube = row[x];
    const double volume = std::abs(cube.volume + covers);
    if (!cube.touched || volume >= kAll) {
      full[x] = volume > 0.5 ? 1 : 0;
    } else if (volume > kNothing) {
      const double sign = cube.volume + covers < 0 ? -1 : 1;
      const Vec3d c = sign / volume * (cube.first + covers_first),
                  square = sign / volume * (cube.second + covers_second);
      const Vec3d about_center = square - c + Vec3d{0.25, 0.25, 0.25};
      found.push_back({{x, first.y, first.z},
                       volume,
                       min(max(c, Vec3d{}), Vec3d{1, 1, 1}),
                       min(max(about_center, Vec3d{}), Vec3d{0.25, 0.25, 0.25})});
    }
    covers += cube.covers;
    covers_first += cube.covers_first;
    covers_second += cube.covers_second;
  }
  partial.insert(partial.end(), found.rbegin(), found.rend());
}

}  // namespace

CubeParts parts_of_cubes(const TriangleMesh& closed, const CubeCells& cells) {
  const Vec3i n = cells.dims;
  Surface surface{{}, closed.triangles};
  const double inverse_h = 1 / double{cells.spacing_m};
  for (const Vec3f p : closed.positions_m)
    surface.x.push_back(inverse_h * (vec_cast<double>(p) - vec_cast<double>(cells.origin_m)));
  const LayerLists layers = list_layers(surface, n.z);
  CubeParts parts{std::vector<std::uint8_t>(at(cells.count())), {}};
  std::vector<std::vector<CubePart>> partial(at(n.z));
  tbb::parallel_for(Index{0}, n.z, [&](Index z) {
    std::vector<Integrals> layer(at(std::int64_t{n.x} * n.y));
    for (std::int64_t i = layers.begin[at(z)]; i < layers.begin[at(z) + 1]; ++i) {
      Polygon piece = surface.polygon(layers.triangles[at(i)]);
      if (z > 0) piece = split(piece, 2, z).second;
      if (z + 1 < n.z && piece.n > 2) piece = split(piece, 2, z + 1).first;
      if (piece.n < 3) continue;
      for_slices(piece, 1, n.y, [&](Index y, const Polygon& of_row) {
        for_slices(of_row, 0, n.x, [&](Index x, const Polygon& of_cube) {
          layer[at(std::int64_t{y} * n.x + x)].add(of_cube, vec_cast<double>(Vec3i{x, y, z}));
        });
      });
    }
    for (Index y = 0; y < n.y; ++y)
      finish_row(&layer[at(std::int64_t{y} * n.x)], {0, y, z}, n.x, &parts.full[at(cells.index({0, y, z}))],
                 partial[at(z)]);
  });
  for (const std::vector<CubePart>& of_layer : partial)
    parts.partial.insert(parts.partial.end(), of_layer.begin(), of_layer.end());
  return parts;
}

namespace {

/// Hands partly filled cubes on to neighbours.
class FillSharing {
 public:
  FillSharing(const CubeParts& parts, const CubeCells& cells)
      : parts_(parts), cells_(cells), fill_(at(cells.count())), volume_(fill_.size()) {
    for (std::size_t c = 0; c < fill_.size(); ++c) fill_[c] = volume_[c] = parts.full[c];
    for (const CubePart& part : parts.partial) volume_[index(part)] = static_cast<float>(part.volume);
    exists_.resize(fill_.size());
    for (std::size_t c = 0; c < fill_.size(); ++c) exists_[c] = volume_[c] > 0 ? 1 : 0;
  }

  CubeFills share() {
    std::vector<std::int64_t> joins;
    for (const CubePart& part : parts_.partial) joins.push_back(neighbour_to_join(part));
    for (std::size_t k = 0; k < joins.size(); ++k)
      if (joins[k] >= 0) exists_[index(parts_.partial[k])] = 0, joined_[index(parts_.partial[k])] = joins[k];
    for (std::size_t k = 0; k < joins.size(); ++k) {
      std::int64_t other = joins[k];
      while (other >= 0 && exists_[at(other)] == 0) other = joined_.at(at(other));
      if (other >= 0)
        join(parts_.partial[k], other);
      else
        spread(parts_.partial[k]);
    }
    for (std::size_t k = 0; k < joins.size(); ++k)
      if (joins[k] < 0) fill_up(parts_.partial[k]);
    std::stable_sort(moments_.begin(), moments_.end(),
                     [](const auto& a, const auto& b) { return a.cell < b.cell; });
    return {exists_, {fill_.begin(), fill_.end()}, moments_};
  }

 private:
  std::size_t index(const CubePart& part) const { return at(cells_.index(part.cube)); }
  /// Neighbour number a (bit per axis) on the side where the centroid lies; -1: none.
  std::int64_t neighbour(const CubePart& part, int a) const {
    Vec3i c = part.cube;
    for (int axis = 0; axis < 3; ++axis)
      if ((a >> axis & 1) != 0) c[axis] += part.centroid[axis] < 0.5 ? -1 : 1;
    return cells_.holds(c) && exists_[at(cells_.index(c))] != 0 ? cells_.index(c) : -1;
  }
  /// The fullest that takes this sliver, and has more: no chain of slivers comes back.
  std::int64_t neighbour_to_join(const CubePart& part) const {
    const bool is_crumb = part.volume < kCrumb;
    std::int64_t best = -1;
    for (int a = 1; a < 8; ++a) {
      double square = 0;
      for (int axis = 0; axis < 3; ++axis)
        if ((a >> axis & 1) != 0) square += sqr(std::min(part.centroid[axis], 1 - part.centroid[axis]));
      const std::int64_t other = neighbour(part, a);
      if (other < 0 || (!is_crumb && square > sqr(kSliverReach))) continue;
      if (double{volume_[at(other)]} < (is_crumb ? 10 * part.volume : kGives)) continue;
      if (best < 0 || volume_[at(other)] > volume_[at(best)]) best = other;
    }
    return best;
  }
  /// From one cube to another.
  Vec3d way(const CubePart& part, std::int64_t other) const {
    const Index x = static_cast<Index>(other % cells_.dims.x),
                y = static_cast<Index>(other / cells_.dims.x % cells_.dims.y),
                z = static_cast<Index>(other / cells_.dims.x / cells_.dims.y);
    return vec_cast<double>(Vec3i{x, y, z} - part.cube);
  }
  void join(const CubePart& part, std::int64_t other) {
    fill_[at(other)] += part.volume;
    const Vec3d d = way(part, other), off = part.centroid - kCenter;
    Vec3d square = part.second + squares(d);
    for (int a = 0; a < 3; ++a) square[a] -= 2 * d[a] * off[a];
    moments_.push_back({other, part.volume * (off - d), part.volume * (kOfNodes - kExpected - square)});
  }
  void spread(const CubePart& part) {
    std::array<double, 8> weight{};
    double sum = 0;
    for (int a = 0; a < 8; ++a) {
      if (neighbour(part, a) < 0) continue;
      weight[at(a)] = 1;
      for (int axis = 0; axis < 3; ++axis) {
        const double way = kTowardsCentroid * std::abs(part.centroid[axis] - 0.5);
        weight[at(a)] *= (a >> axis & 1) != 0 ? way : 1 - way;
      }
      sum += weight[at(a)];
    }
    Vec3d handed{}, off = part.centroid - kCenter;
    for (int a = 0; a < 8; ++a) {
      if (!(weight[at(a)] > 0)) continue;
      fill_[at(neighbour(part, a))] += weight[at(a)] / sum * part.volume;
      for (int axis = 0; axis < 3; ++axis)
        if ((a >> axis & 1) != 0) handed[axis] += weight[at(a)] / sum;
    }
    for (int axis = 0; axis < 3; ++axis)
      off[axis] -= part.centroid[axis] < 0.5 ? -handed[axis] : handed[axis];
    moments_.push_back({cells_.index(part.cube), part.volume * off,
                        part.volume * (kOfNodes - kExpected - part.second + handed)});
  }
  void fill_up(const CubePart& part) {
    double& own = fill_[index(part)];
    const double lacks = kLeastFill - own;
    if (lacks <= 0) return;
    std::int64_t fullest = -1;
    for (int a = 1; a < 8; ++a) {
      const std::int64_t other = neighbour(part, a);
      if (other >= 0 && (fullest < 0 || fill_[at(other)] > fill_[at(fullest)])) fullest = other;
    }
    if (fullest < 0 || fill_[at(fullest)] < kGives) return;
    fill_[at(fullest)] -= lacks;
    own += lacks;
    const Vec3d d = way(part, fullest);
    moments_.push_back({cells_.index(part.cube), lacks * d, -lacks * squares(d)});
  }

  /// So full is a neighbour that takes slivers, or gives to them. A crumb is too little for a cube wherever
  /// it lies.
  static constexpr double kGives = 0.25, kCrumb = 1e-3;
  /// Nodes of a cube lie 1/2 off its centre; of their squares, 1/6 is more than a full cube has.
  static constexpr Vec3d kCenter{0.5, 0.5, 0.5}, kOfNodes{0.25, 0.25, 0.25},
      kExpected{1.0 / 6, 1.0 / 6, 1.0 / 6};
  const CubeParts& parts_;
  const CubeCells& cells_;
  std::vector<CubeFills::Moments> moments_;
  std::vector<double> fill_;
  std::vector<float> volume_;
  std::vector<std::uint8_t> exists_;
  std::unordered_map<std::size_t, std::int64_t> joined_;
};

}  // namespace

CubeFills fills_of_parts(const CubeParts& parts, const CubeCells& cells) {
  return FillSharing(parts, cells).share();
}

}  // namespace tactus
