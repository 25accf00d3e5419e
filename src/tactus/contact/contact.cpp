#include "tactus/contact/contact.h"

#include <string>
#include <utility>

#include "tactus/contact/find_kernels.h"
#include "tactus/contact/paper_kernels.h"
#include "tactus/contact/walls/near_wall_kernels.h"

namespace tactus {
namespace {

/// A list of triangles holds until a point has moved by that much, in spacings of samples.
constexpr float kListMargin = 0.125F;

void check(const BodyPoints& points, const ContactNodes& nodes) {
  const Index n = nodes.size();
  const bool is_whole = nodes.fields.cells > 0 || nodes.v_m_s.size() == n;
  if (points.node_count() != n || !is_whole || nodes.mass_kg.size() != n ||
      (!nodes.held.empty() && nodes.held.size() != n)) {
    throw Error("contact: points of a body of " + std::to_string(points.node_count()) + " nodes, but " +
                std::to_string(n) + " positions, " + std::to_string(nodes.v_m_s.size()) + " velocities, " +
                std::to_string(nodes.mass_kg.size()) + " masses, " + std::to_string(nodes.held.size()) +
                " held flags");
  }
}

TouchingPoints touching_points(const RealSurface& surface, BodyPoints& points, const ContactNodes& nodes) {
  const float reach_m = 2 * surface.settings().sample_spacing_m;
  // A point's reference_node is at most sqrt(3)/2 spacings away at rest: capacity to be stretched to twice
  // that.
  return {nodes, points.table(), points.state(), reach_m, 2 * points.lattice_spacing_m() + reach_m};
}

void find(ExecContext& ctx, const ContactFinder& finder, const PointBlocks& blocks, Count count,
          bool has_last) {
  ctx.parallel_for("contact/wake", count, WakePoints{finder, blocks});
  const Count awake = finder.body.state.awake.used();
  ctx.parallel_for("contact/find", awake, FindContacts{finder});
  if (has_last) ctx.parallel_for("contact/find", awake, FindContacts{finder, 1});
}

void apply(ExecContext& ctx, Index end_point, Count blocks, Count row_groups, const WeighPoints& kernel) {
  ctx.parallel_for("contact/weigh", blocks, kernel);
  ctx.parallel_for("contact/apply", row_groups, ApplyContacts{kernel.body, end_point, kernel.times});
}

}  // namespace

ContactSettings checked(const ContactSettings& s) {
  if (!(s.restitution >= 0 && s.restitution <= 1))
    throw Error("contact: restitution is " + std::to_string(s.restitution) + ", must be 0..1");
  if (!(s.friction >= 0 && s.friction < 1e6F))
    throw Error("contact: friction is " + std::to_string(s.friction) + ", must be >= 0");
  return s;
}

Contact::Contact(Device& device, const ContactSettings& settings)
    : settings_(checked(settings)), poses_(device, device.is_cuda() ? kMostSubsteps : 2 * kMostSubsteps) {}

void Contact::set_response(float friction, float restitution) {
  ContactSettings changed = settings_;
  changed.friction = friction;
  changed.restitution = restitution;
  settings_ = checked(changed);
}

void Contact::begin_frame(ExecContext& ctx, const RealSurface& surface, const ContactTimes& times,
                          View<const ToolMotion> tools) {
  times_ = times;
  if (times.substeps > kMostSubsteps) {
    throw Error("contact: " + std::to_string(times.substeps) + " substeps, expected at most " +
                std::to_string(kMostSubsteps));
  }
  if (!ctx.device().is_cuda()) {  // else frames are recorded
    first_pose_ = kMostSubsteps - first_pose_;
    frame_ = {frame_.number + 1, std::exchange(is_changed_, false) ||
                                     std::exchange(surface_version_, surface.version()) != surface.version()};
  }
  ctx.parallel_for("contact/pose", times.frame.empty() ? Count(times.substeps) : substep_count(times.frame),
                   PoseSurface{surface.motions(), surface.components(), times,
                               poses_.view().part(first_pose_, kMostSubsteps), tools});
  if (settings_.response != ContactResponse::paper) return;
  const SamplesView samples = surface.samples();
  if (sample_m3_.empty()) sample_m3_ = Buffer<float>(ctx.device(), samples.x_m.size());
  ctx.parallel_for("contact/paper_volumes", Count(samples.count, samples.x_m.size()),
                   PaperVolumes{samples, {2 * surface.settings().sample_spacing_m}, sample_m3_.view()});
}

void Contact::push_out(ExecContext& ctx, const RealSurface& surface, BodyPoints& points,
                       const ContactNodes& nodes) {
  check(points, nodes);
  const View<const SurfacePoses> poses = this->poses();
  const TouchingPoints body = touching_points(surface, points, nodes);
  ctx.parallel_for("contact/push_out", points.used_point_count(),
                   DeepRescue{times_,
                              {surface.triangles(), surface.coarse_samples(), poses, {}},
                              surface.samples(),
                              body,
                              points.used_points(),
                              4 * body.reach_m});
  const PointBlocks blocks = points.blocks();
  apply(ctx, points.count(), points.used_blocks(), points.used_row_groups(),
        {body, blocks.used, blocks.points, poses, 1, times_});
}

void Contact::correct(ExecContext& ctx, const RealSurface& surface, View<const Obstacle> obstacles,
                      BodyPoints& points, const ContactNodes& nodes, Index k, Index later_steps) {
  check(points, nodes);
  const View<const SurfacePoses> poses = this->poses();
  const TouchingPoints body = touching_points(surface, points, nodes);
  // Where all points are corrected in every substep, none is one of the last.
  const bool has_last = later_steps > 1, all = k % later_steps == 0;
  const Index first_points = has_last ? points.first_count() : points.count(),
              end = all ? points.count() : first_points;
  const Count blocks = all || !has_last ? points.used_blocks() : points.used_first_blocks();
  const PointBlocks of_points = points.blocks();
  if (body.table.moved == 0 || end == 0) return;  // no point here moves anything
  const SubstepsTo now{k, times_.dt_s, times_.frame, first_points, later_steps};
  SubstepsTo in_all = now;
  in_all.first_pose = first_pose_;
  const float spacing_m = surface.settings().sample_spacing_m, lattice_m = points.lattice_spacing_m();
  if (settings_.response == ContactResponse::paper)
    ctx.parallel_for("contact/paper", end,
                     PaperContact{surface.samples(),
                                  sample_m3_.const_view(),
                                  poses,
                                  body,
                                  {2 * spacing_m},
                                  {spacing_m},
                                  settings_.friction,
                                  lattice_m * lattice_m * lattice_m,
                                  now});
  else
    find(ctx,
         {{surface.triangles(), surface.coarse_samples(), poses_.const_view(), obstacles},
          body,
          settings_.restitution,
          settings_.friction,
          kListMargin * spacing_m,
          in_all},
         of_points, blocks, has_last && all && points.block_count() > points.first_blocks());
  apply(ctx, end, blocks, points.used_row_groups(),
        {body, of_points.used, of_points.points, poses, 0, times_});
}

void Contact::find_walls(ExecContext& ctx, const RealSurface& surface, View<const Obstacle> obstacles,
                         View<const SearchParticle> particles, Count count, float reach_m,
                         Index first_collider, Index k, const NearWalls& near) const {
  ctx.parallel_for("contact/walls", count,
                   FindNearWalls{particles,
                                 {surface.triangles(), surface.coarse_samples(), poses(), obstacles},
                                 SubstepsTo{k, times_.dt_s, times_.frame},
                                 reach_m,
                                 first_collider,
                                 near});
}

void ContactReport::add(const ContactReport& body) {
  force_N += body.force_N;
  torque_N_m += body.torque_N_m;
  max_depth_m = max(max_depth_m, body.max_depth_m);
  contacts_per_substep += body.contacts_per_substep;
  pushed_out += body.pushed_out;
}

ContactReport contact_report(std::span<const ColliderTotals> totals, float dt_frame_s, int substeps) {
  ContactReport report;
  Index contacts = 0;
  for (const ColliderTotals& total : totals) {
    if (total.contacts + total.pushed_out == 0) continue;
    const Vec3f impulse_N_s = total.impulse_N_s(), moment_N_m_s = total.moment_N_m_s();
    report.colliders.push_back({total.collider, impulse_N_s / dt_frame_s, moment_N_m_s / dt_frame_s,
                                impulse_N_s, total.max_depth_m, total.contacts});
    contacts += total.contacts;
    report.pushed_out += total.pushed_out;
    report.max_depth_m = max(report.max_depth_m, total.max_depth_m);
    if (total.collider >= kComponents) continue;  // an obstacle is not real
    report.force_N += impulse_N_s / dt_frame_s;
    report.torque_N_m += moment_N_m_s / dt_frame_s;
  }
  report.contacts_per_substep = substeps > 0 ? static_cast<double>(contacts) / substeps : 0;
  return report;
}

}  // namespace tactus
