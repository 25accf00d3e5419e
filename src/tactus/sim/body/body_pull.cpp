#include "tactus/sim/body/body_pull.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "tactus/base/at.h"
#include "tactus/tissue/boundary/pull_kernels.h"

namespace tactus {
namespace {

bool has(Slab layers, Index layer) { return layer >= layers.begin && layer < layers.end; }

Vec3f rest_point_m(const CubeLattice& lattice, const BodyPoint& point) {
  const Vec3i c = lattice.cubes[at(point.cube)];
  const Vec3f corner{static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z)};
  return lattice.origin_m + lattice.spacing_m * (corner + point.local);
}

/// Nodes within the radius, from cube to cube along common nodes: the two walls of a cut have none. At least
/// those of the point's cube.
std::vector<Index> nodes_near(const CubeLattice& lattice, const BodyPoint& point, float radius_m) {
  const Vec3f center_m = rest_point_m(lattice, point);
  const auto is_near = [&](Index node) { return length(lattice.rest_m(node) - center_m) < radius_m; };
  std::map<Index, std::vector<Index>> cubes_of;  // of near nodes
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    if (!lattice.has_cube(c)) continue;
    for (const Index node : lattice.cube_nodes[c])
      if (is_near(node)) cubes_of[node].push_back(static_cast<Index>(c));
  }
  std::vector<Index> found, cubes{point.cube};
  std::vector<Index> seen{point.cube};
  while (!cubes.empty()) {
    const Index cube = cubes.back();
    cubes.pop_back();
    for (const Index node : lattice.cube_nodes[at(cube)]) {
      if (std::find(found.begin(), found.end(), node) != found.end()) continue;
      if (cube != point.cube && !is_near(node)) continue;
      found.push_back(node);
      for (const Index next : cubes_of[node]) {
        if (std::find(seen.begin(), seen.end(), next) != seen.end()) continue;
        seen.push_back(next);
        cubes.push_back(next);
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

BodyPull::BodyPull(BodySolver& tissue) : tissue_(&tissue) {
  for (int s = 0; s < tissue.slab_count(); ++s) {
    ExecContext& ctx = tissue.slab(s).ctx;
    Part& part = parts_.emplace_back();
    part.pull = to_device(ctx, std::vector<boundary::Pull>(1));
    part.nodes = to_device(ctx, std::vector<boundary::PulledNode>(at(kMostNodes)));
    part.impulse_N_s = to_device(ctx, std::vector<Vec3f>(at(kMostNodes)));
  }
}

void BodyPull::attach(const CubeLattice& lattice, const BodyPoint& point, double radius_m,
                      std::span<const Vec3f> x_m) {
  point_ = point;
  const auto radius = static_cast<float>(radius_m);
  const Vec3f rest_m = rest_point_m(lattice, point), now_m = point.position_m(x_m);
  nodes_.clear();
  for (const Index node : nodes_near(lattice, point, radius)) {
    const float mass_kg = lattice.node_mass_kg[at(node)],
                far = length(lattice.rest_m(node) - rest_m) / radius;
    if (!(mass_kg > 0)) continue;
    // Corners of the point's own cube may be farther than the radius.
    const float fading = std::max(1 - far * far, 0.05F);
    nodes_.push_back({.node = node,
                      .layer = lattice.nodes[at(node)].z,
                      .weight = mass_kg * fading * fading,
                      .inverse_mass_per_kg = 1 / mass_kg,
                      .offset_m = x_m[at(node)] - now_m});
  }
  std::stable_sort(nodes_.begin(), nodes_.end(),
                   [](const Shared& a, const Shared& b) { return a.weight > b.weight; });
  nodes_.resize(std::min(nodes_.size(), at(kMostNodes)));
  const float sum = std::accumulate(nodes_.begin(), nodes_.end(), 0.F,
                                    [](float all, const Shared& s) { return all + s.weight; });
  for (Shared& s : nodes_) s.weight /= sum;
  send_nodes();
}

void BodyPull::release() {
  nodes_.clear();
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    parts_[s].sent = {};
    ExecContext& ctx = tissue_->slab(static_cast<int>(s)).ctx;
    ctx.upload(std::span<const boundary::Pull>(&parts_[s].sent, 1), parts_[s].pull.view());
  }
}

/// A slab pulls all of the nodes that it may change, as every slab that holds them does.
void BodyPull::send_nodes() {
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    Part& part = parts_[s];
    const BodySolver::SlabNodes slab = tissue_->slab(static_cast<int>(s));
    std::vector<boundary::PulledNode> here;
    part.own.clear();
    for (const Shared& n : nodes_) {
      const Index place = tissue_->find(static_cast<int>(s), n.node, n.layer);
      if (place < 0 || !has(slab.changed_layers, n.layer)) continue;
      if (has(slab.own_layers, n.layer)) part.own.push_back(static_cast<Index>(here.size()));
      here.push_back({place, n.weight, n.inverse_mass_per_kg, n.offset_m});
    }
    part.sent.nodes = static_cast<Index>(here.size());
    here.resize(at(kMostNodes));
    slab.ctx.upload(here, part.nodes.view());
    slab.ctx.synchronize();
  }
}

void BodyPull::begin_frame(const PullSettings& settings) {
  if (!is_attached()) return;
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    Part& part = parts_[s];
    ExecContext& ctx = tissue_->slab(static_cast<int>(s)).ctx;
    part.sent.target_m = vec_cast<float>(settings.target_m);
    part.sent.stiffness_N_m = static_cast<float>(settings.stiffness_N_m);
    part.sent.max_force_N = static_cast<float>(settings.max_force_N);
    ctx.upload(std::span<const boundary::Pull>(&part.sent, 1), part.pull.view());
    ctx.fill_bytes(part.impulse_N_s.view(), 0);
  }
}

void BodyPull::pull(int k, const FrameOnDevices& frame) {
  if (!is_active_) return;
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    const Part& part = parts_[s];
    const BodySolver::SlabNodes slab = tissue_->slab(static_cast<int>(s), k);
    slab.ctx.parallel_for("pull/nodes", kMostNodes,
                          boundary::PullNodes{part.pull.const_view(), part.nodes.const_view(),
                                              parts_[s].impulse_N_s.view(), slab.x_m, slab.v_m_s, slab.fields,
                                              slab.held, slab.stopped, frame.view(static_cast<int>(s))});
  }
}

Vec3d BodyPull::mean_force_N(double dt_frame_s) const {
  Vec3d sum{};
  if (!is_attached() || !(dt_frame_s > 0)) return sum;
  for (std::size_t s = 0; s < parts_.size(); ++s) {
    const std::vector<Vec3f> of_node =
        to_host(tissue_->slab(static_cast<int>(s)).ctx, parts_[s].impulse_N_s.const_view());
    for (const Index i : parts_[s].own) sum += vec_cast<double>(of_node[at(i)]);
  }
  return (1 / dt_frame_s) * sum;
}

void BodyPull::archive(StateArchive& a) {
  if (!can_pull()) return;
  auto count = static_cast<Index>(nodes_.size());
  a.value("pulled nodes", count);
  a.check(count >= 0 && count <= kMostNodes, "pulled nodes");
  if (a.reads() && count == 0 && is_attached()) release();
  if (count == 0) return;
  nodes_.resize(at(count));
  a.value("pulled point", point_);
  a.values("pulled", nodes_);
  if (!a.reads()) return;
  const Index most = tissue_->body().x_m.size();
  for (const Shared& n : nodes_) a.check(n.node >= 0 && n.node < most, "pulled");
  send_nodes();
}

}  // namespace tactus
