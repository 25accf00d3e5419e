#include "tactus/tissue/cut/lattice_cutter.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <string>

#include "tactus/base/at.h"
#include "tactus/base/error.h"
#include "tactus/compute/cpu_for.h"

namespace tactus::cut {
const std::array<std::array<int, 2>, kPairs> kCornerPairs = {{{0, 1},
                                                              {2, 3},
                                                              {4, 5},
                                                              {6, 7},
                                                              {0, 2},
                                                              {1, 3},
                                                              {4, 6},
                                                              {5, 7},
                                                              {0, 4},
                                                              {1, 5},
                                                              {2, 6},
                                                              {3, 7},
                                                              {0, 3},
                                                              {4, 7},
                                                              {0, 5},
                                                              {2, 7},
                                                              {0, 6},
                                                              {1, 7},
                                                              {0, 7}}};

LatticeCutter::LatticeCutter(CubeLattice lattice, std::vector<std::uint8_t> may_cut)
    : lattice_(std::move(lattice)),
      may_cut_(std::move(may_cut)),
      next_copy_(lattice_.regular_cubes()),
      next_node_(lattice_.regular_nodes()) {
  if (lattice_.cube_fill.empty()) lattice_.cube_fill.assign(lattice_.cubes.size(), 1);
  const Vec3i n = lattice_.node_dims - Vec3i{1, 1, 1};
  grid_.assign(at(std::int64_t{n.x} * n.y * n.z), -1);
  for (Index c = 0; c < lattice_.regular_cubes(); ++c) {
    const Vec3i p = lattice_.cubes[at(c)];
    if (lattice_.has_cube(at(c))) grid_[cell(p)] = c;
  }
  island_.assign(lattice_.cubes.size(), 0);
  cut_place_.assign(at(lattice_.regular_cubes()), -1);
  kept_off_.assign(lattice_.nodes.size(), Vec3f{});
  cuts_.reserve(4 * lattice_.copies.size());
  find_blocks();
  take_capacity_for_frame(std::min(lattice_.copies.size() / 2, kFrameSplits));
}

/// Per cube that falls apart, as much as walls of one layer need.
void LatticeCutter::take_capacity_for_frame(std::size_t splits) {
  take_capacity(live_, lattice_.copies.size() / 2);
  take_capacity(dirty_, 2 * splits);
  take_capacity(dirty_cubes_, 2 * splits);
  take_capacity(affected_, 4 * splits);
  take_capacity(at_corners_, 32 * splits);
  strip_.reserve(400);
  take_capacity(hits_, first_of_cubes_.size());
  take_capacity(crossed_, 2 * splits);
  take_capacity(falling_, splits);
  take_capacity(before_, splits);
  stages_.resize(1);
  take_capacity(stages_.front(), splits);
  take_capacity(found_, 4 * splits);
  take_capacity(root_, 2 * splits);
  take_capacity(journal_.edges, 16 * splits);
  take_capacity(journal_.cubes, 2 * splits);
}

/// Regular cubes keep their nodes as long as they are whole.
void LatticeCutter::find_blocks() {
  std::vector<Index> blocks;
  for (Index first = 0; first < lattice_.regular_cubes(); first += kCubeBlock) {
    first_of_cubes_.push_back(static_cast<Index>(blocks_of_cubes_.size()));
    blocks.clear();
    for (Index c = first; c < std::min(first + kCubeBlock, lattice_.regular_cubes()); ++c)
      for (const Index node : lattice_.cube_nodes[at(c)])
        blocks.push_back(node / static_cast<Index>(PointBlocks::kSize));
    std::sort(blocks.begin(), blocks.end());
    blocks_of_cubes_.insert(blocks_of_cubes_.end(), blocks.begin(),
                            std::unique(blocks.begin(), blocks.end()));
  }
  first_of_cubes_.push_back(static_cast<Index>(blocks_of_cubes_.size()));
}

std::uint64_t LatticeCutter::key(Index a, Index b) {
  return static_cast<std::uint64_t>(std::min(a, b)) << 32U | static_cast<std::uint64_t>(std::max(a, b));
}

/// Bits of the cube's edges, as in kCornerPairs; of copies those of all pairs.
std::uint32_t LatticeCutter::cut_edges(Index cube) const {
  const auto& nodes = lattice_.cube_nodes[at(cube)];
  std::uint32_t found = 0;
  for (unsigned e = 0; e < pairs_of(cube); ++e) {
    const auto [a, b] = kCornerPairs[e];
    if (cuts_.contains(key(nodes[at(a)], nodes[at(b)]))) found |= 1U << e;
  }
  return found;
}

double LatticeCutter::place(Index cube, int a, int b) const {
  const auto& nodes = lattice_.cube_nodes[at(cube)];
  const Index from = nodes[at(a)], to = nodes[at(b)];
  const float* cut = cuts_.find(key(from, to));
  if (cut == nullptr) return -1;
  return from < to ? double{*cut} : 1 - double{*cut};
}

std::vector<LatticeCutter::KeptOff> LatticeCutter::kept_off() const {
  std::vector<KeptOff> nodes;
  for (Index i = 0; i < lattice_.node_count(); ++i)
    if (kept_off_[at(i)] != Vec3f{}) nodes.push_back({i, kept_off_[at(i)]});
  return nodes;
}

void LatticeCutter::keep_off(std::span<const KeptOff> nodes) {
  kept_off_.assign(kept_off_.size(), Vec3f{});
  near_wall_.clear();
  Index last = -1;
  for (const KeptOff& k : nodes) {
    if (k.node <= last || k.node >= next_node_)
      throw Error("cut: node " + std::to_string(k.node) + " is kept off a blade after node " +
                  std::to_string(last) + ", the body has " + std::to_string(next_node_));
    kept_off_[at(k.node)] = k.by;
    near_wall_.push_back(last = k.node);
  }
}

/// Whole cubes in a row are one set, whose number is that of its first cube. Where the next cube of a row
/// meets the sets that its predecessor met, nothing is joined.
std::vector<Index> LatticeCutter::part_of_nodes() const {
  std::vector<Index> parent(at(next_copy_)), set_of(lattice_.nodes.size(), -1);
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](Index i) {
    while (parent[at(i)] != i) i = parent[at(i)] = parent[at(parent[at(i)])];
    return i;
  };
  std::array<Index, 8> met{};
  Index set = -1;
  for (Index c = 0; c < next_copy_; ++c) {
    if (!lattice_.has_cube(at(c))) continue;
    const Vec3i step = c > 0 ? lattice_.cubes[at(c)] - lattice_.cubes[at(c - 1)] : Vec3i{};
    const bool goes_on =
        set >= 0 && c < lattice_.regular_cubes() && lattice_.has_cube(at(c - 1)) && step == Vec3i{1, 0, 0};
    if (!goes_on) {
      set = c;
      met.fill(-1);
    }
    // The left nodes of one that goes on are the right ones of the cube before.
    for (std::size_t q = goes_on ? 1 : 0; q < 8; q += goes_on ? 2 : 1) {
      Index& of = set_of[at(lattice_.cube_nodes[at(c)][q])];
      if (of < 0) of = set;
      if (of == set || of == met[q]) continue;
      met[q] = of;
      const Index a = root(of), b = root(set);
      parent[at(std::max(a, b))] = std::min(a, b);
    }
  }
  std::vector<Index> part(lattice_.nodes.size()), lowest(at(next_copy_), -1);
  for (Index i = 0; i < lattice_.node_count(); ++i) {
    part[at(i)] = i;
    if (set_of[at(i)] < 0) continue;
    Index& of = lowest[at(root(set_of[at(i)]))];
    if (of < 0) of = i;
    part[at(i)] = of;
  }
  return part;
}

int LatticeCutter::part_count() const {
  const std::vector<Index> part = part_of_nodes();
  int count = 0;
  std::vector<std::uint8_t> seen(part.size());
  for (Index c = 0; c < next_copy_; ++c) {
    if (!lattice_.has_cube(at(c))) continue;
    std::uint8_t& is_known = seen[at(part[at(lattice_.cube_nodes[at(c)][0])])];
    count += is_known == 0 ? 1 : 0;
    is_known = 1;
  }
  return count;
}

}  // namespace tactus::cut
