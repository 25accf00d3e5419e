#include "tactus/tissue/flsm/flsm_regions.h"

#include <algorithm>
#include <bit>
#include <string>

#include "tactus/base/at.h"
#include "tactus/base/error.h"
#include "tactus/geom/maths/symmetric_eigen.h"
#include "tactus/tissue/lattice_part.h"

namespace tactus {
namespace {

constexpr Index round_up(Index n, Index to) { return (n + to - 1) / to * to; }

/// Which nodes and cubes of the lattice's box exist, with a margin of w, as bits of rows along x.
class Occupancy {
 public:
  Occupancy(const CubeLattice& lattice, int w)
      : w_(w), rows_(lattice.node_dims.y + 2 * w), words_(ceil_div(lattice.node_dims.x + 2 * w, kBits) + 1) {
    node_.assign(at(std::int64_t{words_} * rows_ * (lattice.node_dims.z + 2 * w)), 0);
    cube_ = node_;
    for (const Vec3i p : lattice.nodes) set(node_, p);
    for (const Vec3i p : lattice.cubes) set(cube_, p);
  }
  /// Which of `count` nodes or cubes from p on along x exist: bit 0 is that of p.
  std::uint16_t nodes(Vec3i p, int count) const { return bits(node_, p, count); }
  std::uint16_t cubes(Vec3i p, int count) const { return bits(cube_, p, count); }

 private:
  using Words = std::vector<std::uint64_t>;
  static constexpr Index kBits = 64;
  std::size_t word_of(Vec3i p) const {
    return at((std::int64_t{p.z + w_} * rows_ + p.y + w_) * words_ + (p.x + w_) / kBits);
  }
  void set(Words& words, Vec3i p) const { words[word_of(p)] |= std::uint64_t{1} << (p.x + w_) % kBits; }
  std::uint16_t bits(const Words& words, Vec3i p, int count) const {
    const std::size_t word = word_of(p);
    const int first = (p.x + w_) % kBits;
    std::uint64_t found = words[word] >> first;
    if (first > 0) found |= words[word + 1] << (kBits - first);
    return static_cast<std::uint16_t>(found & ((1U << count) - 1));
  }
  Index w_, rows_, words_;
  Words node_, cube_;
};

/// The nodes of a box of up to 9^3 around a centre: bit x of row[z][y].
struct BoxBits {
  std::uint16_t row[9][9] = {};
  int count() const {
    int n = 0;
    for (const auto& plane : row)
      for (const std::uint16_t bits : plane) n += std::popcount(bits);
    return n;
  }
  template <class F>
  void for_each(int w, F&& body) const {
    for (int z = 0; z <= 2 * w; ++z)
      for (int y = 0; y <= 2 * w; ++y)
        for (unsigned left = row[z][y]; left != 0; left &= left - 1)
          body(Vec3i{std::countr_zero(left) - w, y - w, z - w});
  }
};

BoxBits nodes_in_box(const Occupancy& body, Vec3i center, int w) {
  BoxBits bits;
  for (int z = 0; z <= 2 * w; ++z)
    for (int y = 0; y <= 2 * w; ++y) bits.row[z][y] = body.nodes(center + Vec3i{-w, y - w, z - w}, 2 * w + 1);
  return bits;
}

/// w rounds of "every node of a cube that holds a reached node is reached"; w moves never leave the box.
BoxBits nodes_in_reach(const Occupancy& body, Vec3i center, int w) {
  std::uint16_t cubes[8][8] = {};
  for (int z = 0; z < 2 * w; ++z)
    for (int y = 0; y < 2 * w; ++y) cubes[z][y] = body.cubes(center + Vec3i{-w, y - w, z - w}, 2 * w);
  BoxBits reached;
  reached.row[w][w] = static_cast<std::uint16_t>(1U << w);
  for (int move = 0; move < w; ++move) {
    BoxBits next = reached;
    for (int z = 0; z < 2 * w; ++z)
      for (int y = 0; y < 2 * w; ++y) {
        const unsigned any = unsigned{reached.row[z][y]} | reached.row[z][y + 1] | reached.row[z + 1][y] |
                             reached.row[z + 1][y + 1];
        const unsigned hit = (any | any >> 1) & cubes[z][y];
        const auto corners = static_cast<std::uint16_t>(hit | hit << 1);
        for (int q = 0; q < 4; ++q) {
          std::uint16_t& row = next.row[z + (q >> 1)][y + (q & 1)];
          row = static_cast<std::uint16_t>(row | corners);
        }
      }
    reached = next;
  }
  return reached;
}

FlsmGrid make_grid(const CubeLattice& lattice, int w) {
  FlsmGrid grid;
  const Vec3i n = lattice.node_dims;
  const auto count = [&](Index i) { return static_cast<double>(round_up(i, FlsmGrid::kChunk) + 2 * w); };
  grid.pad = w;
  grid.stride_y = round_up(n.x, FlsmGrid::kLanes) + w;
  grid.stride_z = grid.stride_y * static_cast<Index>(count(n.y));
  const double cells = grid.stride_y * count(n.y) * count(n.z) + FlsmGrid::kLanes + w;
  if (cells * 12 > 2e9)
    throw Error("the body's box of " + std::to_string(n.x) + "x" + std::to_string(n.y) + "x" +
                std::to_string(n.z) + " nodes needs " + bytes_text(cells * 440) +
                " for shape matching, more than one device can index; use a larger spacing");
  grid.cells = static_cast<Index>(cells);
  return grid;
}

/// A set of rows (kLanes along x, at one y and z) of the lattice's box.
class Rows {
 public:
  explicit Rows(Vec3i n)
      : nx_(ceil_div(n.x, FlsmGrid::kLanes)), ny_(n.y), nz_(n.z), set_(at(std::int64_t{nx_} * ny_ * nz_)) {}
  void set(Index x, Index y, Index z) { set_[index(x, y, z)] = true; }
  bool get(Index x, Index y, Index z) const { return set_[index(x, y, z)]; }
  /// Rows with a member within w along y (axis 1) or z (axis 2).
  Rows grown(int axis, int w) const {
    Rows out = *this;
    for_each([&](Index x, Index y, Index z) {
      for (Index k = -w; k <= w; ++k) {
        const Index y2 = y + (axis == 1 ? k : 0), z2 = z + (axis == 2 ? k : 0);
        if (y2 >= 0 && y2 < ny_ && z2 >= 0 && z2 < nz_) out.set(x, y2, z2);
      }
    });
    return out;
  }
  Rows operator&(const Rows& o) const {
    Rows out = *this;
    for (std::size_t i = 0; i < set_.size(); ++i) out.set_[i] = set_[i] && o.set_[i];
    return out;
  }
  /// Cells where the rows start; with an axis (1, 2), those of its chunks that hold a member.
  std::vector<Index> starts(const FlsmGrid& grid, int axis) const {
    std::vector<Index> out;
    for_each([&](Index x, Index y, Index z) {
      Vec3i p{x * FlsmGrid::kLanes, y, z};
      if (axis > 0) p[axis] = p[axis] / FlsmGrid::kChunk * FlsmGrid::kChunk;
      out.push_back(grid.index(p));
    });
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    return out;
  }

 private:
  template <class F>
  void for_each(F&& body) const {
    for (Index z = 0; z < nz_; ++z)
      for (Index y = 0; y < ny_; ++y)
        for (Index x = 0; x < nx_; ++x)
          if (get(x, y, z)) body(x, y, z);
  }
  std::size_t index(Index x, Index y, Index z) const { return at((std::int64_t{z} * ny_ + y) * nx_ + x); }
  Index nx_, ny_, nz_;
  std::vector<bool> set_;
};

/// Work lists: sums along x and y are made only where they can be non-zero and a node needs them.
void make_blocks(const CubeLattice& lattice, FlsmRegions& r) {
  const int w = r.half_width;
  Rows nodes(lattice.node_dims), wide(lattice.node_dims);
  for (const Vec3i p : lattice.nodes) {
    nodes.set(p.x / FlsmGrid::kLanes, p.y, p.z);
    wide.set(max(p.x - w, Index{0}) / FlsmGrid::kLanes, p.y, p.z);
    wide.set(min(p.x + w, lattice.node_dims.x - 1) / FlsmGrid::kLanes, p.y, p.z);
  }
  const Rows needed_y = nodes.grown(2, w);          // read by the sums along z
  const Rows sums_y = needed_y & wide.grown(1, w);  // and not all zero
  const Rows sums_x = wide & sums_y.grown(1, w);
  r.node_rows = nodes.starts(r.grid, 0);
  r.x_rows = sums_x.starts(r.grid, 0);
  r.y_blocks = sums_y.starts(r.grid, 1);
  r.z_blocks = nodes.starts(r.grid, 2);
  // The transposed order: a goal's sums along z feed those along y, which feed those along x.
  const Rows goal_y = wide & needed_y.grown(1, w);
  r.goal_y_blocks = goal_y.starts(r.grid, 1);
  r.goal_z_blocks = (needed_y & goal_y.grown(1, w)).starts(r.grid, 2);
}

void add_exception(FlsmRegions& r, Index node, const BoxBits& all, const BoxBits& reached) {
  BoxBits outside;
  for (int z = 0; z < 9; ++z)
    for (int y = 0; y < 9; ++y)
      outside.row[z][y] = static_cast<std::uint16_t>(all.row[z][y] & ~reached.row[z][y]);
  const bool anew = reached.count() < outside.count();
  FlsmException e{r.cell[at(node)], static_cast<Index>(r.offsets.size()), 0, anew ? 1 : 0};
  (anew ? reached : outside).for_each(r.half_width, [&](Vec3i k) {
    r.offsets.push_back(
        {static_cast<std::int8_t>(k.x), static_cast<std::int8_t>(k.y), static_cast<std::int8_t>(k.z)});
  });
  e.end = static_cast<Index>(r.offsets.size());
  r.exceptions.push_back(e);
}

void check_half_width(int w) {
  if (w < 1 || w > 4) throw usage_error("region half width must be 1, 2, 3 or 4, not " + std::to_string(w));
}

/// The weight of every region from its spread, and how much those of a node are together.
void weigh_regions(const CubeLattice& lattice, const std::vector<BoxBits>& reach,
                   const std::vector<double>& spread, FlsmRegions& r) {
  std::vector<double> weight(at(r.grid.cells));
  for (std::size_t i = 0; i < spread.size(); ++i) weight[at(r.cell[i])] = 1 / spread[i];
  const auto sum_at = [&](std::size_t i) {
    double sum = 0;
    reach[i].for_each(r.half_width, [&](Vec3i k) {
      sum += weight[at(r.cell[i] + k.z * r.grid.stride_z + k.y * r.grid.stride_y + k.x)];
    });
    return sum;
  };
  double most = 0;
  for (std::size_t i = 0; i < spread.size(); ++i) most = std::max(most, sum_at(i) / r.region_nodes[i]);
  // Ends give way more than the spread of their regions says, as few regions cross the cubes near them. Half
  // of it is made up for: of bars 4 cubes across, pulled, the middle is 0 to 3 % stiffer than the material.
  const double ends = 1 + 0.025 * (r.half_width - 1);
  r.sigma2_m2 = sqr(double{lattice.spacing_m}) / (ends * most);
  for (std::size_t i = 0; i < spread.size(); ++i) {
    // Weights are rounded as the kernel's floats are, or bodies would be pulled to the world's origin.
    const std::size_t cell = at(r.cell[i]);
    r.turn_m[cell] = static_cast<float>(weight[cell] / most * double{lattice.spacing_m});
    weight[cell] = double{r.turn_m[cell]} / double{lattice.spacing_m};
    r.inverse_mass_per_kg[cell] *= weight[cell];
  }
  for (std::size_t i = 0; i < spread.size(); ++i) {
    r.weight_sum[i] = sum_at(i);
    r.held[i] = static_cast<float>(r.weight_sum[i] / r.region_nodes[i]);
  }
}

/// Mass, centre and weight of every region from the masses m~ of its nodes.
void sum_regions(const CubeLattice& lattice, const std::vector<BoxBits>& reach, FlsmRegions& r) {
  std::vector<double> mass(at(r.grid.cells)), spread(lattice.nodes.size());
  for (std::size_t i = 0; i < lattice.nodes.size(); ++i) mass[at(r.cell[i])] = r.shared_mass_kg[i];
  for (std::size_t i = 0; i < lattice.nodes.size(); ++i) {
    double m = 0;
    Vec3d first{};
    Mat3d square = Mat3d::zero();
    reach[i].for_each(r.half_width, [&](Vec3i k) {
      const double mk = mass[at(r.cell[i] + k.z * r.grid.stride_z + k.y * r.grid.stride_y + k.x)];
      const Vec3d kd = vec_cast<double>(k);
      m += mk;
      first += mk * kd;
      square = square + outer(mk * kd, kd);
    });
    const Vec3d c = first / m;
    r.inverse_mass_per_kg[at(r.cell[i])] = 1 / m;
    for (int a = 0; a < 3; ++a) r.center[at(a * std::int64_t{r.grid.cells} + r.cell[i])] = c[a];
    spread[i] = symmetric_eigen((1 / m) * square - outer(c, c)).values.x;
  }
  weigh_regions(lattice, reach, spread, r);
}

}  // namespace

FlsmRegions make_flsm_regions(const CubeLattice& lattice, int half_width) {
  check_half_width(half_width);
  FlsmRegions r;
  r.half_width = half_width;
  r.grid = make_grid(lattice, half_width);
  const std::size_t n = lattice.nodes.size();
  r.cell.resize(n);
  r.region_nodes.resize(n);
  r.shared_mass_kg.resize(n);
  r.weight_sum.resize(n);
  r.held.resize(n);
  r.inverse_mass_per_kg.assign(at(r.grid.cells), 0);
  r.turn_m.assign(at(r.grid.cells), 0);
  r.center.assign(at(std::int64_t{3} * r.grid.cells), 0);
  const Occupancy body(lattice, half_width);
  std::vector<BoxBits> reach(n);
  for (std::size_t i = 0; i < n; ++i) {
    r.cell[i] = r.grid.index(lattice.nodes[i]);
    reach[i] = nodes_in_reach(body, lattice.nodes[i], half_width);
    const BoxBits all = nodes_in_box(body, lattice.nodes[i], half_width);
    r.region_nodes[i] = reach[i].count();
    r.shared_mass_kg[i] = double{lattice.node_mass_kg[i]} / r.region_nodes[i];
    if (all.count() != r.region_nodes[i]) add_exception(r, static_cast<Index>(i), all, reach[i]);
  }
  sum_regions(lattice, reach, r);
  make_blocks(lattice, r);
  return r;
}

Slab flsm_window(Slab own, int half_width, Index layers) {
  const Index below = FlsmGrid::kChunk + half_width, above = 2 * half_width;
  return {std::max(own.begin - below, 0), std::min(own.end + above, layers)};
}

FlsmRegions flsm_layers(const FlsmRegions& all, const CubeLattice& lattice, Slab own) {
  const Index w = all.half_width;
  const Slab window = flsm_window(own, w, lattice.node_dims.z);
  const Index base = window.begin / FlsmGrid::kChunk * FlsmGrid::kChunk;
  FlsmRegions part;
  part.half_width = all.half_width;
  part.sigma2_m2 = all.sigma2_m2;
  part.grid = all.grid;
  const Index shift = base * all.grid.stride_z;
  part.grid.cells = std::min(
      (round_up(window.end - base, FlsmGrid::kChunk) + 2 * w) * all.grid.stride_z + FlsmGrid::kLanes + w,
      all.grid.cells - shift);

  const LatticeLayers nodes = lattice_layers(lattice, window);
  for (Index i = nodes.first_node; i < nodes.first_node + nodes.lattice.node_count(); ++i) {
    part.cell.push_back(all.cell[at(i)] - shift);
    part.region_nodes.push_back(all.region_nodes[at(i)]);
    part.shared_mass_kg.push_back(all.shared_mass_kg[at(i)]);
    part.weight_sum.push_back(all.weight_sum[at(i)]);
    part.held.push_back(all.held[at(i)]);
  }
  const auto cells_of = [&]<class T>(const std::vector<T>& fields, int count) {
    std::vector<T> out;
    for (int f = 0; f < count; ++f) {
      const auto begin = fields.begin() + std::int64_t{f} * all.grid.cells + shift;
      out.insert(out.end(), begin, begin + part.grid.cells);
    }
    return out;
  };
  part.inverse_mass_per_kg = cells_of(all.inverse_mass_per_kg, 1);
  part.turn_m = cells_of(all.turn_m, 1);
  part.center = cells_of(all.center, 3);

  const auto layer = [&](Index cell) { return cell / all.grid.stride_z - all.grid.pad; };
  const auto rows_in = [&](const std::vector<Index>& rows, Slab layers) {
    std::vector<Index> out;
    for (const Index row : rows)
      if (layer(row) >= layers.begin && layer(row) < layers.end) out.push_back(row - shift);
    return out;
  };
  const Slab fitted{own.begin - w, own.end + w};
  part.node_rows = rows_in(all.node_rows, fitted);
  part.x_rows = rows_in(all.x_rows, window);
  part.y_blocks = rows_in(all.y_blocks, window);
  part.z_blocks = rows_in(all.z_blocks, {fitted.begin - FlsmGrid::kChunk + 1, fitted.end});
  part.goal_z_blocks = rows_in(all.goal_z_blocks, own);
  part.goal_y_blocks = rows_in(all.goal_y_blocks, own);
  part.offsets = all.offsets;
  for (FlsmException e : all.exceptions) {
    if (layer(e.cell) < fitted.begin || layer(e.cell) >= fitted.end) continue;
    e.cell -= shift;
    part.exceptions.push_back(e);
  }
  return part;
}

std::vector<FlsmOffset> flsm_region_of(const CubeLattice& lattice, int half_width, Index node) {
  check_half_width(half_width);
  std::vector<FlsmOffset> offsets;
  nodes_in_reach(Occupancy(lattice, half_width), lattice.nodes[at(node)], half_width)
      .for_each(half_width, [&](Vec3i k) {
        offsets.push_back(
            {static_cast<std::int8_t>(k.x), static_cast<std::int8_t>(k.y), static_cast<std::int8_t>(k.z)});
      });
  return offsets;
}

}  // namespace tactus
