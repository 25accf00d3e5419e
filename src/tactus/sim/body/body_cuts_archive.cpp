// Cuts of a body, for runs that go on from a checkpoint.
#include <algorithm>
#include <utility>

#include "tactus/sim/body/body_cuts.h"
#include "tactus/sim/body/body_shape.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus {
namespace {

using Journal = cut::LatticeCutter::Journal;

/// Nothing in a file decides how much memory is taken: more than these no body has.
constexpr Index kMostJournals = 1 << 20, kMostTrailPoints = 1 << 16, kMostTrails = 1 << 10,
                kMostStrokes = 1 << 20;

Index size_of(const auto& v) { return static_cast<Index>(v.size()); }

template <class T>
void archive_list(StateArchive& a, const char* name, std::vector<T>& list, Index most) {
  Index count = size_of(list);
  a.value("how many", count);
  a.check(count >= 0 && count <= most, name);
  list.resize(static_cast<std::size_t>(count));
  a.values(name, list);
}

/// Nodes that there was no capacity for are where the last one is: none of them was in use.
template <class T>
void extend(std::vector<T>& of_nodes, Index count) {
  if (!of_nodes.empty()) of_nodes.resize(static_cast<std::size_t>(count), T{of_nodes.back()});
}

}  // namespace

/// Where blades found the nodes, while they cut and in the frame before.
void BodyCuts::archive_nodes(StateArchive& a) {
  const Index count = body_.shape.lattice.node_count();
  archive_list(a, "nodes while blades cut", x_m_, count);
  archive_list(a, "nodes when blades cut last", last_x_m_, count);
  extend(x_m_, count);
  extend(last_x_m_, count);
}

void BodyCuts::archive(ExecContext& ctx, StateArchive& a, const Observer& observer,
                       const std::function<void(int frame)>& end_frame) {
  a.set_owner("cuts of body '" + body_.description.name + "'");
  std::vector<Index> edges_of, cubes_of, cubes;
  std::vector<Journal::Edge> edges;
  for (const Journal& journal : cutter_.lattice().journals()) {
    edges_of.push_back(size_of(journal.edges));
    cubes_of.push_back(size_of(journal.cubes));
    edges.insert(edges.end(), journal.edges.begin(), journal.edges.end());
    cubes.insert(cubes.end(), journal.cubes.begin(), journal.cubes.end());
  }
  std::vector<JournalOrigin> origins = journal_origins_;
  // A cube has 19 edges and diagonals, each cut once; it is listed with each of them at most.
  const Index most = 19 * body_.shape.lattice.cube_count();
  archive_list(a, "edges of strips", edges_of, kMostJournals);
  archive_list(a, "cubes of strips", cubes_of, size_of(edges_of));
  archive_list(a, "edges that are cut", edges, most);
  archive_list(a, "cubes with cut edges", cubes, 8 * most);
  a.check(edges_of.size() == cubes_of.size(), "cubes of strips");
  archive_list(a, "strokes of strips", origins, size_of(edges_of));
  a.check(edges_of.size() == origins.size(), "strokes of strips");
  archive_nodes(a);
  std::vector<cut::LatticeCutter::KeptOff> kept_off = cutter_.lattice().kept_off();
  archive_list(a, "nodes that are kept off blades", kept_off, body_.shape.lattice.node_count());
  archive_trails(a);
  if (!a.reads()) return;
  auto trails = std::exchange(trails_, {});
  auto x_m = std::exchange(x_m_, {}), last_x_m = std::exchange(last_x_m_, {});
  auto edge = edges.begin();
  auto cube = cubes.begin();
  for (std::size_t k = 0; k < edges_of.size(); ++k) {
    a.check(edges_of[k] >= 0 && edges_of[k] <= edges.end() - edge, "edges of strips");
    a.check(cubes_of[k] >= 0 && cubes_of[k] <= cubes.end() - cube, "cubes of strips");
    const Journal journal{{edge, edge + edges_of[k]}, {cube, cube + cubes_of[k]}};
    edge += edges_of[k];
    cube += cubes_of[k];
    a.check(origins[k].stroke >= 0 && origins[k].stroke < kMostStrokes, "strokes of strips");
    do_again(ctx, journal, origins[k], observer);
    if (k + 1 == origins.size() || origins[k + 1].frame != origins[k].frame) end_frame(origins[k].frame);
  }
  cutter_.keep_off(kept_off);
  trails_ = std::move(trails);
  x_m_ = std::move(x_m);
  last_x_m_ = std::move(last_x_m);
  body_.surface.update(ctx, body_.tissue.body());
}

void BodyCuts::do_again(ExecContext& ctx, const Journal& journal, const JournalOrigin& origin,
                        const Observer& observer) {
  begin_stroke(origin.stroke, origin.frame);
  journal_origins_.push_back(origin);
  if (origin.is_refused != 0) return cutter_.mark(journal);
  cutter_.cut(journal, change_);
  if (change_.copies.empty()) return;
  do follow(ctx, change_, observer);
  while (cutter_.match_parts(change_));
}

void BodyCuts::archive_trails(StateArchive& a) {
  Index count = size_of(trails_);
  a.value("trails of blades", count);
  a.check(count >= 0 && count <= kMostTrails, "trails of blades");
  std::vector<std::pair<std::size_t, cut::BladeTrail>> trails(trails_.begin(), trails_.end());
  trails.resize(static_cast<std::size_t>(count));
  for (auto& [blade, trail] : trails) {
    std::uint64_t number = blade;
    a.value("blade", number);
    blade = static_cast<std::size_t>(number);
    a.value("last strip", trail.frame);
    a.value("steps of the blade", trail.steps);
    a.value("turn of the body", trail.turn);
    archive_list(a, "last edge", trail.edge, kMostTrailPoints);
    archive_list(a, "parts of the edge", trail.parts, kMostTrailPoints);
    archive_list(a, "nodes of the trail", trail.nodes, body_.shape.lattice.node_count());
    archive_list(a, "names of nodes", trail.names, body_.shape.lattice.node_count());
    extend(trail.nodes, body_.shape.lattice.node_count());
    extend(trail.names, body_.shape.lattice.node_count());
    Index points = 1;
    for (const int part : trail.parts) {
      a.check(part >= 1 && part <= 200, "parts of the edge");
      points += part;
    }
    const bool is_empty = trail.nodes.empty() && trail.edge.empty();
    a.check(is_empty ||
                (size_of(trail.edge) == points && size_of(trail.nodes) == body_.shape.lattice.node_count()),
            "last edge");
    a.check(trail.names.size() == trail.nodes.size(), "names of nodes");
  }
  trails_ = {trails.begin(), trails.end()};
}

}  // namespace tactus
