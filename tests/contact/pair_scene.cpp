#include "contact/pair_scene.h"

namespace tactus::test {
namespace {

BodyPairs make_pairs(ExecContext& ctx, const std::vector<SoftThing*>& things, const ContactSettings& settings,
                     bool touching_itself) {
  std::vector<std::vector<EmbeddedPoint>> points;
  std::vector<PairedBody> bodies;
  for (SoftThing* thing : things) points.push_back(to_host(ctx, thing->points.table().points));
  for (std::size_t b = 0; b < things.size(); ++b)
    bodies.push_back({.lattice = things[b]->lattice,
                      .surface = things[b]->surface,
                      .points = points[b],
                      .nodes = things[b]->nodes(),
                      .touches_itself = touching_itself});
  return {ctx, bodies, settings};
}

}  // namespace

PairScene::PairScene(ExecContext& context, std::vector<SoftThing*> things, const ContactSettings& settings,
                     bool touching_itself)
    : ctx(context),
      bodies(std::move(things)),
      surface(context.device(), small_surface(0.01F)),
      contact(context.device(), settings),
      pairs(make_pairs(context, bodies, settings, touching_itself)) {
  surface.clear(ctx);
}

void PairScene::run(int substeps, float dt_s, Vec3f gravity_m_s2, float drag_per_s) {
  frame_s = dt_s * static_cast<float>(substeps);
  frame_substeps = substeps;
  contact.begin_frame(ctx, surface, {.dt_s = dt_s, .substeps = substeps, .dt_frame_s = 0});
  for (SoftThing* body : bodies) body->points.begin_frame(ctx);
  pairs.begin_frame(ctx);
  for (int k = 0; k < substeps; ++k) {
    for (SoftThing* body : bodies) {
      body->solver.step(ctx, body->state, {dt_s, gravity_m_s2, drag_per_s});
      if (!obstacles.view().empty())
        contact.correct(ctx, surface, obstacles.view(), body->points, body->nodes(), k);
    }
    pairs.correct(ctx, contact.poses(), {dt_s});
  }
  for (SoftThing* body : bodies) body->points.end_frame(ctx);
  pairs.end_frame(ctx);
}

std::vector<PairReaction> PairScene::reactions() {
  return pair_reactions(to_host(ctx, pairs.totals()), pairs.body_count(), frame_s);
}

ContactReport PairScene::on_obstacles(std::size_t body) {
  return contact_report(to_host(ctx, bodies[body]->points.totals()), frame_s, frame_substeps);
}

float PairScene::deepest_m() {
  float most = 0;
  for (const PairReaction& r : reactions()) most = std::max(most, r.reaction.max_depth_m);
  return most;
}

PairSums PairScene::sums() const {
  PairSums sums;
  for (const SoftThing* body : bodies) {
    const BodyMonitors m = body->monitors(ctx);
    sums.kinetic_J += m.kinetic_J;
    sums.energy_J += m.kinetic_J + m.elastic_J + m.hourglass_J;
    sums.momentum_kg_m_s += m.momentum_kg_m_s;
    sums.size_of_momentum += length(m.momentum_kg_m_s);
  }
  return sums;
}

float PairScene::stable_step_s() const {
  float step = 1;
  for (const SoftThing* body : bodies) step = std::min(step, body->solver.stable_step_s());
  return step;
}

Vec3d middle_m(ExecContext& ctx, const SoftThing& body) {
  Vec3d sum{};
  const std::vector<Vec3f> x = to_host(ctx, body.state.x_m.const_view());
  for (const Vec3f& p : x) sum += vec_cast<double>(p) / static_cast<double>(x.size());
  return sum;
}

}  // namespace tactus::test
