#include "tactus/contact/body_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "tactus/contact/pair_find_kernels.h"
#include "tactus/contact/pair_response_kernels.h"

namespace tactus {
namespace {

constexpr Index kPatchEdge = 4;  ///< in cubes

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

Index size_of(const auto& v) { return static_cast<Index>(v.size()); }

/// Where a point rests, in spacings of the lattice.
Vec3f rest_of(const CubeLattice& lattice, const EmbeddedPoint& p) {
  Vec3f sum{};
  for (int k = 0; k < 8; ++k) sum += p.weight[k] * vec_cast<float>(lattice.nodes[at(p.node[k])]);
  return sum;
}

std::array<Index, 3> patch_key(Vec3f p) {
  const auto of = [](float u) { return static_cast<Index>(std::floor(u / kPatchEdge)); };
  return {of(p.z), of(p.y), of(p.x)};
}

}  // namespace

/// All bodies' patches, cubes, points and rows, one body after the other.
struct BodyPairs::Builder {
  std::vector<PairBody> bodies;
  std::vector<CubePatch> patches;
  std::vector<SolidCube> cubes;
  std::vector<float> samples;
  std::vector<PointGroup> groups;
  std::vector<EmbeddedPoint> points;
  std::vector<Vec3f> rest;
  std::vector<Index> patch_nodes, rows;
  std::vector<PairNode> nodes;
  std::vector<Index> incident_points, incident_cubes;
  float smallest_mass_kg = 1e30F;

  void add(const PairedBody& b) {
    const auto body = size_of(bodies);
    PairBody& out = bodies.emplace_back();
    out.nodes = b.nodes;
    out.spacing_m = b.lattice.spacing_m;
    out.touches_itself = b.touches_itself ? 1 : 0;
    out.first_patch = size_of(patches);
    out.first_point = size_of(points);
    const Index first_cube = size_of(cubes);
    add_patches(b, body);
    bodies[at(body)].end_patch = size_of(patches);
    bodies[at(body)].end_point = size_of(points);
    add_rows(b, body, first_cube);
    for (const float m : b.lattice.node_mass_kg) smallest_mass_kg = std::min(smallest_mass_kg, m);
  }

 private:
  struct Patch {
    std::vector<std::size_t> cubes;  ///< of the solid
    std::vector<std::size_t> points;
  };
  void add_patches(const PairedBody& b, Index body) {
    const RestSolid solid = rest_solid(b.lattice, b.surface, b.fill);
    std::map<std::array<Index, 3>, Patch> of_key;
    for (std::size_t c = 0; c < solid.cubes.size(); ++c)
      of_key[patch_key(vec_cast<float>(b.lattice.cubes[at(solid.cubes[c])]))].cubes.push_back(c);
    for (std::size_t p = 0; p < b.points.size(); ++p)
      of_key[patch_key(rest_of(b.lattice, b.points[p]))].points.push_back(p);
    for (const auto& [key, patch] : of_key) add_patch(b, body, solid, patch);
  }
  void add_patch(const PairedBody& b, Index body, const RestSolid& solid, const Patch& patch) {
    std::set<Index> of_patch;
    CubePatch& out = patches.emplace_back();
    out.body = body;
    out.first_cube = size_of(cubes);
    for (const std::size_t c : patch.cubes) {
      SolidCube& cube = cubes.emplace_back();
      const auto& corners = b.lattice.cube_nodes[at(solid.cubes[c])];
      cube.body = body;
      cube.cell = b.lattice.cubes[at(solid.cubes[c])];
      std::copy(corners.begin(), corners.end(), cube.node);
      of_patch.insert(corners.begin(), corners.end());
      const auto first = solid.sample_m.begin() + static_cast<std::ptrdiff_t>(c * CubeSamples::kCount);
      samples.insert(samples.end(), first, first + CubeSamples::kCount);
    }
    out.end_cube = size_of(cubes);
    for (std::size_t k = 0; k < patch.points.size(); ++k) {
      if (k % kGroupPoints == 0) groups.push_back({body, size_of(patches) - 1, size_of(points), 0});
      ++groups.back().count;
      const EmbeddedPoint& p = b.points[patch.points[k]];
      points.push_back(p);
      rest.push_back(rest_of(b.lattice, p));
      for (int n = 0; n < 8; ++n) {
        if (p.weight[n] != 0) of_patch.insert(p.node[n]);
      }
    }
    out.first_node = size_of(patch_nodes);
    patch_nodes.insert(patch_nodes.end(), of_patch.begin(), of_patch.end());
    out.end_node = size_of(patch_nodes);
  }
  /// A row for each node with points or cubes.
  void add_rows(const PairedBody& b, Index body, Index first_cube) {
    const auto count = b.lattice.nodes.size();
    std::vector<std::vector<Index>> of_points(count), of_cubes(count);
    for (Index p = bodies[at(body)].first_point; p < size_of(points); ++p) {
      for (int k = 0; k < 8; ++k) {
        if (points[at(p)].weight[k] != 0) of_points[at(points[at(p)].node[k])].push_back(8 * p + k);
      }
    }
    for (Index c = first_cube; c < size_of(cubes); ++c) {
      for (int k = 0; k < 8; ++k) of_cubes[at(cubes[at(c)].node[k])].push_back(8 * c + k);
    }
    std::vector<Index> row(count);
    for (std::size_t n = 0; n < count; ++n) {
      if (of_points[n].empty() && of_cubes[n].empty()) continue;
      row[n] = size_of(nodes);
      PairNode& node = nodes.emplace_back();
      node.body = body;
      node.node = static_cast<Index>(n);
      node.first_point = size_of(incident_points);
      incident_points.insert(incident_points.end(), of_points[n].begin(), of_points[n].end());
      node.end_point = size_of(incident_points);
      node.first_cube = size_of(incident_cubes);
      incident_cubes.insert(incident_cubes.end(), of_cubes[n].begin(), of_cubes[n].end());
      node.end_cube = size_of(incident_cubes);
    }
    for (Index p = bodies[at(body)].first_point; p < size_of(points); ++p) {
      for (const Index node : points[at(p)].node) rows.push_back(row[at(node)]);
    }
    for (Index c = first_cube; c < size_of(cubes); ++c) {
      for (int k = 0; k < 8; ++k) cubes[at(c)].row[k] = row[at(cubes[at(c)].node[k])];
    }
  }
};

BodyPairs::BodyPairs(ExecContext& ctx, std::span<const PairedBody> bodies, const ContactSettings& settings,
                     bool touch_others)
    : settings_(checked(settings)), touch_others_(touch_others) {
  Builder all;
  for (const PairedBody& body : bodies) {
    first_point_.push_back(size_of(all.points));
    all.add(body);
  }
  first_point_.push_back(size_of(all.points));
  smallest_mass_kg_ = all.smallest_mass_kg;
  bodies_ = to_device(ctx, all.bodies);
  patches_ = to_device(ctx, all.patches);
  cubes_ = to_device(ctx, all.cubes);
  samples_ = to_device(ctx, all.samples);
  groups_ = to_device(ctx, all.groups);
  points_ = to_device(ctx, all.points);
  rest_ = to_device(ctx, all.rest);
  nodes_ = to_device(ctx, all.nodes);
  patch_nodes_ = to_device(ctx, all.patch_nodes);
  rows_ = to_device(ctx, all.rows);
  incident_points_ = to_device(ctx, all.incident_points);
  incident_cubes_ = to_device(ctx, all.incident_cubes);
  contact_ = to_device(ctx, std::vector<PairContact>(all.points.size()));
  const auto zeros = [&](std::size_t n) { return to_device(ctx, std::vector<std::uint32_t>(n)); };
  group_active_ = zeros(all.groups.size());
  row_weight_ = zeros(all.nodes.size());
  cube_list_ = zeros(all.cubes.size());
  next_ = zeros(all.points.size());
  used_ = zeros(bodies.size() * bodies.size());
  patch_box_ = Buffer<PatchBox>(ctx.device(), size_of(all.patches));
  body_box_ = Buffer<PatchBox>(ctx.device(), size_of(bodies));
  patch_way_ = Buffer<float>(ctx.device(), size_of(all.patches));
  last_x_ = to_device(ctx, std::vector<Vec3f>(all.patch_nodes.size()));
  self_motion_ = to_device(ctx, std::vector<SelfMotion>(bodies.size()));
  group_sleep_ = to_device(ctx, std::vector<SelfSleep>(all.groups.size()));
  point_sleep_ = to_device(ctx, std::vector<SelfSleep>(all.points.size()));
  recorded_ = Buffer<Index>(ctx.device(), size_of(all.points));
  records_ = Buffer<ContactRecord>(ctx.device(), size_of(all.points));
  totals_ = to_device(ctx, std::vector<OwnerTotals>(bodies.size() * bodies.size()));
  moved_on_ = to_device(ctx, std::vector<ReactionSums>(bodies.size() * bodies.size()));
  begin_frame(ctx);
  ctx.synchronize();
}

PairTable BodyPairs::table() const {
  return {bodies_.const_view(),
          patches_.const_view(),
          patch_nodes_.const_view(),
          cubes_.const_view(),
          {samples_.const_view()},
          groups_.const_view(),
          points_.const_view(),
          rows_.const_view(),
          rest_.const_view(),
          nodes_.const_view(),
          incident_points_.const_view(),
          incident_cubes_.const_view()};
}

PairState BodyPairs::state() {
  return {patch_box_.view(),   body_box_.view(),    patch_way_.view(),   last_x_.view(),
          self_motion_.view(), group_sleep_.view(), point_sleep_.view(), group_active_.view(),
          contact_.view(),     row_weight_.view(),  cube_list_.view(),   next_.view(),
          recorded_.view(),    records_.view(),     moved_on_.view(),    used_.view(),
          smallest_mass_kg_};
}

void BodyPairs::begin_frame(ExecContext& ctx) { ctx.fill_bytes(recorded_.view(), 0); }

void BodyPairs::correct(ExecContext& ctx, View<const SurfacePoses> poses) {
  const PairTable t = table();
  const PairState s = state();
  ctx.parallel_for("contact/bound patches", patches_.size(), BoundPatches{t, s});
  ctx.parallel_for("contact/bound bodies", bodies_.size(), BoundBodies{t, s});
  ctx.parallel_for("contact/find pairs", groups_.size(),
                   FindPairs{t, s, settings_.restitution, settings_.friction, touch_others_ ? 1 : 0});
  ctx.parallel_for("contact/pair impulses", groups_.size(), PairImpulses{t, s, poses});
  ctx.parallel_for("contact/move pairs", nodes_.size(), MovePairs{t, s});
}

void BodyPairs::archive(ExecContext& ctx, StateArchive& a) {
  std::vector<PairContact> contact = to_host(ctx, contact_.const_view());
  std::vector<std::uint32_t> list = to_host(ctx, cube_list_.const_view()),
                             next = to_host(ctx, next_.const_view());
  a.values("contacts", contact);
  a.values("points in cubes", list);
  a.values("next points in cubes", next);
  const auto is_cube = [&](Index cube) { return cube >= -1 && cube < cubes_.size(); };
  for (const PairContact& c : contact) a.check(is_cube(c.cube) && is_cube(c.held_cube), "contacts");
  for (const auto* points : {&list, &next})
    for (const std::uint32_t point : *points) a.check(point <= contact.size(), "points in cubes");
  a.buffer(ctx, "active groups", group_active_);
  a.buffer(ctx, "last nodes of patches", last_x_);
  a.buffer(ctx, "motion against itself", self_motion_);
  a.buffer(ctx, "sleeping groups", group_sleep_);
  a.buffer(ctx, "sleeping points", point_sleep_);
  a.buffer(ctx, "weights of nodes", row_weight_);
  if (!a.reads()) return;
  ctx.upload(contact, contact_.view());
  ctx.upload(list, cube_list_.view());
  ctx.upload(next, next_.view());
  ctx.synchronize();
}

void BodyPairs::end_frame(ExecContext& ctx) {
  const Index n = bodies_.size();
  for (Index a = 0; a < n; ++a) {
    const Index first = first_point_[at(a)], count = first_point_[at(a) + 1] - first;
    ctx.parallel_for("contact/pair totals", n,
                     SumRecords{recorded_.const_view().part(first, count),
                                records_.const_view().part(first, count), moved_on_.view().part(a * n, n),
                                used_.view().part(a * n, n), totals_.view().part(a * n, n)});
  }
}

std::vector<PairReaction> pair_reactions(std::span<const OwnerTotals> totals, Index bodies,
                                         float dt_frame_s) {
  std::vector<PairReaction> all;
  for (Index a = 0; a < bodies; ++a) {
    for (Index b = 0; b < bodies; ++b) {
      const OwnerTotals &there = totals[at(a * bodies + b)], &back = totals[at(b * bodies + a)];
      if (there.contacts + back.contacts == 0) continue;
      const Vec3f impulse = there.impulse_N_s() - back.impulse_N_s(),
                  moment = there.moment_N_m_s() - back.moment_N_m_s();
      all.push_back({a,
                     b,
                     {b, impulse / dt_frame_s, moment / dt_frame_s, impulse,
                      std::max(there.max_depth_m, back.max_depth_m),
                      a == b ? there.contacts : there.contacts + back.contacts}});
    }
  }
  return all;
}

}  // namespace tactus
