#include "tactus/contact/pairs/pair_model.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "tactus/base/at.h"
#include "tactus/base/error.h"

namespace tactus {
namespace {

constexpr Index kPatchEdge = 4;  ///< in cubes

Index size_in(const auto& v) { return static_cast<Index>(v.size()); }

bool is_capacity(const EmbeddedPoint& p) { return p.weight[0] == 0; }

/// Where a point rests, in spacings of the lattice.
Vec3f rest_of(const CubeLattice& lattice, const EmbeddedPoint& p) {
  Vec3f sum{};
  for (int k = 0; k < 8; ++k) sum += p.weight[k] * vec_cast<float>(lattice.nodes[at(p.node[k])]);
  return sum;
}

void sort_once(std::vector<Index>& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

}  // namespace

PairModel::Key PairModel::key_of(Vec3f p) {
  const auto of = [](float u) { return static_cast<Index>(std::floor(u / kPatchEdge)); };
  return {of(p.z), of(p.y), of(p.x)};
}

void PairModel::add(const PairedBody& b) {
  const auto body = size_in(bodies);
  PairBody& out = bodies.emplace_back();
  host_.emplace_back().cuttable = b.cuttable;
  host_.back().walls_touch = b.walls_touch;
  out.nodes = b.nodes;
  out.spacing_m = b.lattice.spacing_m;
  out.self = b.touches_itself ? SelfTouch::all : SelfTouch::none;
  out.first_patch = size_in(patches);
  out.first_point = size_in(points);
  out.first_group = size_in(groups);
  const Index first_cube = size_in(cubes);
  if (b.cuttable) {
    host_.back().place_of_cube.assign(b.lattice.cubes.size(), -1);
    host_.back().place_of_point.assign(b.points.size(), -1);
  }
  std::map<Key, Patch> of_key;
  if (b.cuttable)
    for (Index c = 0; c < b.lattice.regular_cubes(); ++c)
      of_key[key_of(vec_cast<float>(b.lattice.cubes[at(c)]))];
  const RestSolid solid = b.solid != nullptr ? *b.solid : rest_solid(b.lattice, b.surface, b.fill);
  for (std::size_t c = 0; c < solid.cubes.size(); ++c)
    of_key[key_of(vec_cast<float>(b.lattice.cubes[at(solid.cubes[c])]))].cubes.push_back(c);
  for (std::size_t p = 0; p < b.points.size(); ++p)
    if (!is_capacity(b.points[p])) of_key[key_of(rest_of(b.lattice, b.points[p]))].points.push_back(p);
  for (const auto& [key, patch] : of_key) add_patch(b, body, solid, patch, key);
  bodies[at(body)].end_patch = size_in(patches);
  if (b.cuttable) add_capacity(b, body);
  bodies[at(body)].end_point = size_in(points);
  bodies[at(body)].end_group = size_in(groups);
  add_rows(b, body, first_cube);
  for (const float m : b.lattice.node_mass_kg)
    if (m > 0) smallest_mass_kg = std::min(smallest_mass_kg, m);
}

void PairModel::add_patch(const PairedBody& b, Index body, const RestSolid& solid, const Patch& patch,
                          const Key& key) {
  std::set<Index> of_patch;
  Body& host = host_[at(body)];
  const Index number = size_in(patches);
  host.patch_of[key] = number;
  patches.push_back({body});
  std::vector<Index>& list = patch_cubes.emplace_back();
  for (const std::size_t c : patch.cubes) {
    list.push_back(size_in(cubes));
    if (host.cuttable) host.place_of_cube[at(solid.cubes[c])] = size_in(cubes);
    SolidCube& cube = cubes.emplace_back();
    const auto& corners = b.lattice.cube_nodes[at(solid.cubes[c])];
    cube.body = body;
    cube.cell = b.lattice.cubes[at(solid.cubes[c])];
    std::copy(corners.begin(), corners.end(), cube.node);
    of_patch.insert(corners.begin(), corners.end());
    const auto first = solid.sample_m.begin() + static_cast<std::ptrdiff_t>(c * CubeSamples::kCount);
    samples.insert(samples.end(), first, first + CubeSamples::kCount);
  }
  for (std::size_t k = 0; k < patch.points.size(); ++k) {
    if (k % kGroupPoints == 0) groups.push_back({body, number, size_in(points), 0});
    ++groups.back().count;
    const EmbeddedPoint& p = b.points[patch.points[k]];
    if (host.cuttable) host.place_of_point[patch.points[k]] = size_in(points);
    points.push_back(p);
    rest.push_back({.p = rest_of(b.lattice, p), .wall = {}});
    for (int n = 0; n < 8; ++n) {
      if (p.weight[n] != 0) of_patch.insert(p.node[n]);
    }
  }
  patch_nodes.emplace_back(of_patch.begin(), of_patch.end());
}

/// Every cube may come near a surface once. Each patch may have one group of points that is not full.
void PairModel::add_capacity(const PairedBody& b, Index body) {
  Body& host = host_[at(body)];
  Index cubes_known = 0, points_known = 0;
  for (const Index place : host.place_of_cube) cubes_known += place >= 0 ? 1 : 0;
  for (const Index place : host.place_of_point) points_known += place >= 0 ? 1 : 0;
  host.next_cube = size_in(cubes);
  host.end_cube = host.next_cube + b.lattice.cube_count() - cubes_known;
  SolidCube capacity;
  capacity.body = body;
  cubes.resize(at(host.end_cube), capacity);
  samples.resize(at(host.end_cube) * CubeSamples::kCount);
  const PairBody& out = bodies[at(body)];
  const Index place_count = size_in(host.place_of_point) - points_known;
  host.next_group = size_in(groups);
  if (place_count > 0)
    for (Index g = 0; g < place_count / kGroupPoints + 1 + out.end_patch - out.first_patch; ++g)
      groups.push_back({body, out.first_patch, size_in(points) + g * kGroupPoints, 0});
  host.end_group = size_in(groups);
  const auto count = at(size_in(points) + (host.end_group - host.next_group) * kGroupPoints);
  points.resize(count);
  rest.resize(count);
}

/// A row for each node with points or cubes; where the body may be cut, for all.
void PairModel::add_rows(const PairedBody& b, Index body, Index first_cube) {
  const auto count = b.lattice.nodes.size();
  std::vector<std::vector<Index>> of_points(count), of_cubes(count);
  const Index first_point = bodies[at(body)].first_point;
  for (Index p = first_point; p < size_in(points); ++p) {
    for (int k = 0; k < 8; ++k) {
      if (points[at(p)].weight[k] != 0) of_points[at(points[at(p)].node[k])].push_back(8 * p + k);
    }
  }
  const Index end_cube = b.cuttable ? host_[at(body)].next_cube : size_in(cubes);
  for (Index c = first_cube; c < end_cube; ++c) {
    for (int k = 0; k < 8; ++k) of_cubes[at(cubes[at(c)].node[k])].push_back(8 * c + k);
  }
  std::vector<Index> row(count);
  for (std::size_t n = 0; n < count; ++n) {
    if (!b.cuttable && of_points[n].empty() && of_cubes[n].empty()) continue;
    row[n] = size_in(nodes);
    nodes.push_back({body, static_cast<Index>(n)});
    part.push_back(0);
    row_points.push_back(std::move(of_points[n]));
    row_cubes.push_back(std::move(of_cubes[n]));
  }
  for (Index p = first_point; p < size_in(points); ++p) {
    for (const Index node : points[at(p)].node) rows.push_back(row[at(node)]);
  }
  for (Index c = first_cube; c < end_cube; ++c) {
    for (int k = 0; k < 8; ++k) cubes[at(c)].row[k] = row[at(cubes[at(c)].node[k])];
  }
  if (b.cuttable) host_[at(body)].row_of = std::move(row);
}

void PairModel::apply(Index body, const SolidChange& change) {
  changed_ = {};
  Body& host = host_.at(at(body));
  if (!host.cuttable) throw Error("contact: body " + std::to_string(body) + " is not cuttable");
  PairBody& out = bodies[at(body)];
  out.is_cut = 1;
  if (out.self == SelfTouch::none && host.walls_touch) out.self = SelfTouch::walls;
  for (const Index cube : change.gone) remove_cube(body, cube);
  for (const SolidChange::Cube& cube : change.cubes) set_cube(body, cube);
  for (const PointChange& point : change.points) set_point(body, point);
  for (std::size_t n = 0; n < change.part.size(); ++n) part[at(host.row_of.at(n))] = change.part[n];
  count_parts(body);
  sort_once(changed_.patches);
  sort_once(changed_.rows);
  for (const Index row : changed_.rows) {
    std::sort(row_points[at(row)].begin(), row_points[at(row)].end());
    std::sort(row_cubes[at(row)].begin(), row_cubes[at(row)].end());
  }
}

/// Every part has a surface, and cubes next to it.
void PairModel::count_parts(Index body) {
  std::vector<Index> parts;
  for (const Index place : host_[at(body)].place_of_cube)
    if (place >= 0) parts.push_back(part[at(cubes[at(place)].row[0])]);
  sort_once(parts);
  bodies[at(body)].parts = size_in(parts);
}

Index PairModel::row_of(Index body, Index node) const {
  const auto& rows_of = host_[at(body)].row_of;
  if (node < 0 || node >= size_in(rows_of))
    throw Error("contact: a cut names node " + std::to_string(node) + ", the body has " +
                std::to_string(rows_of.size()));
  return rows_of[at(node)];
}

Index PairModel::patch_at(Index body, Vec3f p) const {
  const auto& known = host_[at(body)].patch_of;
  const auto patch = known.find(key_of(p));
  // A point that sticks out of all cubes goes with any patch: its nodes are added there.
  return patch == known.end() ? bodies[at(body)].first_patch : patch->second;
}

void PairModel::hold(Index patch, Index node) {
  std::vector<Index>& list = patch_nodes[at(patch)];
  if (std::find(list.begin(), list.end(), node) == list.end()) list.push_back(node);
}

void PairModel::remove_cube(Index body, Index cube) {
  std::vector<Index>& places = host_[at(body)].place_of_cube;
  const Index place = places.at(at(cube));
  if (place < 0) return;
  places[at(cube)] = -1;
  const Index patch = patch_at(body, vec_cast<float>(cubes[at(place)].cell));
  std::erase(patch_cubes[at(patch)], place);
  changed_.patches.push_back(patch);
  changed_.gone.push_back(place);
  for (int k = 0; k < 8; ++k) {
    const Index row = cubes[at(place)].row[k];
    std::erase(row_cubes[at(row)], 8 * place + k);
    changed_.rows.push_back(row);
  }
}

void PairModel::set_cube(Index body, const SolidChange::Cube& cube) {
  Body& host = host_[at(body)];
  Index& place = host.place_of_cube.at(at(cube.cube));
  const Index patch = patch_at(body, vec_cast<float>(cube.cell));
  const bool is_new = place < 0;
  if (is_new) {
    if (host.next_cube >= host.end_cube) throw Error("contact: there is no capacity for more cubes");
    place = host.next_cube++;
    cubes[at(place)].cell = cube.cell;
    patch_cubes[at(patch)].push_back(place);
    changed_.patches.push_back(patch);
  }
  changed_.cubes.push_back(place);
  SolidCube& out = cubes[at(place)];
  for (std::size_t k = 0; k < 8; ++k) {
    if (!is_new && out.node[k] == cube.nodes[k]) continue;
    const Index row = row_of(body, cube.nodes[k]), entry = 8 * place + static_cast<Index>(k);
    if (!is_new) {
      std::erase(row_cubes[at(out.row[k])], entry);
      changed_.rows.push_back(out.row[k]);
    }
    out.node[k] = cube.nodes[k];
    out.row[k] = row;
    row_cubes[at(row)].push_back(entry);
    changed_.rows.push_back(row);
    hold(patch, cube.nodes[k]);
    changed_.patches.push_back(patch);
  }
}

Index PairModel::new_point(Index body, const PointChange& change) {
  Body& host = host_[at(body)];
  const Index patch = patch_at(body, change.rest);
  const auto [open, is_new] = host.open_group.try_emplace(patch, host.next_group);
  if (is_new || groups[at(open->second)].count == kGroupPoints) {
    if (host.next_group >= host.end_group) throw Error("contact: there is no capacity for more points");
    open->second = host.next_group++;
    groups[at(open->second)].patch = patch;
  }
  PointGroup& group = groups[at(open->second)];
  const Index place = group.first + group.count++;
  rest[at(place)].p = change.rest;
  return place;
}

void PairModel::set_point(Index body, const PointChange& change) {
  Body& host = host_[at(body)];
  Index& place = host.place_of_point.at(at(change.point));
  const bool is_new = place < 0;
  if (is_new) place = new_point(body, change);
  changed_.points.push_back(place);
  rest[at(place)].wall = change.wall;
  rest[at(place)].cube = change.cube < 0 ? -1 : host.place_of_cube.at(at(change.cube));
  const Index patch = patch_at(body, rest[at(place)].p);
  EmbeddedPoint& point = points[at(place)];
  for (int k = 0; k < 8; ++k) {
    const Index row = rows[at(8 * place + k)];
    if (!is_new && point.weight[k] != 0) {
      std::erase(row_points[at(row)], 8 * place + k);
      changed_.rows.push_back(row);
    }
  }
  point = change.to;
  for (int k = 0; k < 8; ++k) {
    const Index row = row_of(body, point.node[k]);
    rows[at(8 * place + k)] = row;
    if (point.weight[k] == 0) continue;
    row_points[at(row)].push_back(8 * place + k);
    changed_.rows.push_back(row);
    hold(patch, point.node[k]);
  }
  changed_.patches.push_back(patch);
}

}  // namespace tactus
