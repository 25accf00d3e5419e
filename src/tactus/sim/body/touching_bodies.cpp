#include "tactus/sim/body/touching_bodies.h"

#include <algorithm>
#include <cstdio>
#include <numeric>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/sim/body/slab_points.h"

namespace tactus {
namespace {

Box3f box_of(const TriangleMesh& mesh) {
  Box3f box{mesh.positions_m.front(), mesh.positions_m.front()};
  for (const Vec3f& p : mesh.positions_m) box = {min(box.min, p), max(box.max, p)};
  return box;
}

bool holds(const Box3f& box, Vec3f p) {
  const Vec3f out = max(box.min - p, p - box.max);
  return max(out.x, max(out.y, out.z)) < 0.F;
}

/// The deepest of a's points in b.
void see(const TriangleMesh& a, const TriangleMesh& b, MeshFill fill, float spacing_m, BodyOverlap& most) {
  const Box3f box = box_of(b);
  std::optional<PointInMesh> query;
  for (const SpreadPoint& p : spread_points(a, spacing_m)) {
    if (!holds(box, p.x_m)) continue;
    if (!query) query.emplace(b, fill);
    const float depth_m = -query->signed_distance_m(p.x_m);
    if (depth_m > most.depth_m) most = {depth_m, p.x_m};
  }
}

void warn_of_overlap(const SoftBody& a, const SoftBody& b, const BodyOverlap& overlap, bool touch) {
  char text[160];
  std::snprintf(text, sizeof text,
                "' overlap at rest by %.3g m, most at (%.3f, %.3f, %.3f) m: ", double{overlap.depth_m},
                double{overlap.at_m.x}, double{overlap.at_m.y}, double{overlap.at_m.z});
  log_warning(
      "bodies '" + a.name() + "' and '" + b.name() + text +
      (touch ? "contact will press them apart; move one by that much ('placement.position_m'), or let "
               "bodies not touch one another ('contact.bodies: false')"
             : "they don't touch one another, as 'contact' of one of them or 'contact.bodies' is false"));
}

}  // namespace

std::optional<BodyOverlap> overlap_at_rest(const TriangleMesh& a, MeshFill fill_a, const TriangleMesh& b,
                                           MeshFill fill_b, float spacing_m) {
  const Box3f box_a = box_of(a), box_b = box_of(b);
  const Vec3f apart = max(box_a.min - box_b.max, box_b.min - box_a.max);
  if (max(apart.x, max(apart.y, apart.z)) > 0.F) return {};
  BodyOverlap most;
  see(a, b, fill_b, spacing_m, most);
  see(b, a, fill_a, spacing_m, most);
  if (!(most.depth_m > 0.01F * spacing_m)) return {};
  return most;
}

TouchingBodies::TouchingBodies(ExecContext& ctx, const std::vector<std::unique_ptr<SoftBody>>& bodies,
                               const ContactDescription& contact, const FrameDescription& frame)
    : ctx_(ctx) {
  for (std::size_t b = 1; b < bodies.size(); ++b) {
    for (std::size_t a = 0; a < b; ++a) {
      const auto spacing_m = static_cast<float>(
          std::min(bodies[a]->description().spacing_m, bodies[b]->description().spacing_m));
      const auto overlap = overlap_at_rest(bodies[a]->shape().surface_m, bodies[a]->description().shape.fill,
                                           bodies[b]->shape().surface_m, bodies[b]->description().shape.fill,
                                           0.5F * spacing_m);
      const bool touch =
          contact.bodies && bodies[a]->description().contact && bodies[b]->description().contact;
      if (overlap) warn_of_overlap(*bodies[a], *bodies[b], *overlap, touch);
    }
  }
  rebuild(bodies, contact);
  every_ = contact.every;
  if (pairs_ && frame.substeps && *frame.substeps % every_ != 0)
    throw usage_error("'frame.substeps' is " + std::to_string(*frame.substeps) +
                      ", expected a multiple of 'contact.every', " + std::to_string(every_));
}

void TouchingBodies::rebuild(const std::vector<std::unique_ptr<SoftBody>>& bodies,
                             const ContactDescription& contact) {
  pairs_.reset();
  body_of_.clear();
  nodes_.clear();
  solid_.clear();
  std::vector<std::vector<EmbeddedPoint>> points;
  std::vector<PairedBody> all;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    if (!bodies[b]->description().contact) continue;
    body_of_.push_back(static_cast<Index>(b));
    nodes_.push_back(bodies[b]->resources().nodes);
  }
  const bool touch_themselves = std::any_of(body_of_.begin(), body_of_.end(), [&](Index b) {
    return touches_itself(contact, bodies[static_cast<std::size_t>(b)]->cuts() != nullptr);
  });
  if (!touch_themselves && !(contact.bodies && body_of_.size() > 1)) return;
  std::vector<RestSolid> solids(body_of_.size());
  for (const Index b : body_of_)
    points.push_back(to_host(ctx_, bodies[static_cast<std::size_t>(b)]->points().points(0).table().points));
  for (std::size_t k = 0; k < body_of_.size(); ++k) {
    SoftBody& body = *bodies[static_cast<std::size_t>(body_of_[k])];
    const BodyShape& shape = body.shape();
    solid_.emplace_back();
    if (body.cuts() != nullptr) {
      solids[k] = rest_solid(shape.lattice, shape.surface_m, body.description().shape.fill);
      solid_.back().emplace(shape.lattice, solids[k]);
    }
    all.push_back({.lattice = shape.lattice,
                   .surface = shape.surface_m,
                   .fill = body.description().shape.fill,
                   .points = points[k],
                   .nodes = body.points().nodes(0),
                   .touches_itself = contact.self,
                   .cuttable = body.cuts() != nullptr,
                   .walls_touch = contact.cut_walls,
                   .solid = body.cuts() != nullptr ? &solids[k] : nullptr});
  }
  pairs_ = std::make_unique<BodyPairs>(ctx_, all,
                                       ContactSettings{.restitution = static_cast<float>(contact.restitution),
                                                       .friction = static_cast<float>(contact.friction)},
                                       contact.bodies);
}

void TouchingBodies::apply(Index body, const cut::BodyCutter& cutter, const TopologyChange& change,
                           std::span<const PointChange> points) {
  const auto known = std::find(body_of_.begin(), body_of_.end(), body);
  if (!pairs_ || known == body_of_.end()) return;
  const auto number = static_cast<std::size_t>(known - body_of_.begin());
  pairs_->apply(ctx_, static_cast<Index>(number), solid_[number]->update(cutter, change, points));
}

void TouchingBodies::add_stages(Schedule& schedule, Readback& readback, const Contact& contact) {
  if (!pairs_) return;
  const Resource records = "bodies/contact records";
  schedule.add({.name = "bodies/begin",
                .timed_as = "begin",
                .rate = Rate::before,
                .updates = {records},
                .submit = [this](BlockPlace) { pairs_->begin_frame(ctx_); }});
  Stage touch{.name = "bodies/touch",
              .timed_as = "bodies",
              .rate = Rate::substep,
              .every = every_,
              .updates = nodes_,
              .submit = [this, &contact, &frame = schedule.frame()](BlockPlace) {
                pairs_->correct(ctx_, contact.poses(), {.substeps = every_, .frame = frame.view(0)});
              }};
  touch.updates.push_back(records);
  schedule.add(std::move(touch));
  schedule.add({.name = "bodies/contact sums",
                .timed_as = "end",
                .rate = Rate::after,
                .writes = report_resources(),
                .updates = {records},
                .submit = [this](BlockPlace) { pairs_->end_frame(ctx_); }});
  report_ = readback.add(pairs_->totals());
}

std::vector<Resource> TouchingBodies::report_resources() const {
  return pairs_ ? std::vector<Resource>{"bodies/contact report"} : std::vector<Resource>{};
}

std::vector<PairReaction> TouchingBodies::reactions(const Readback& readback, float dt_frame_s) const {
  if (!pairs_) return {};
  std::vector<PairReaction> all =
      pair_reactions(readback.get<ColliderTotals>(report_), pairs_->body_count(), dt_frame_s);
  for (PairReaction& r : all) {
    r.body = body_of_[static_cast<std::size_t>(r.body)];
    r.other = r.reaction.collider = body_of_[static_cast<std::size_t>(r.other)];
  }
  return all;
}

}  // namespace tactus
