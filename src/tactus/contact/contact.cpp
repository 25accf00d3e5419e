#include "tactus/contact/contact.h"

#include <string>

namespace tactus {
namespace {

ContactSettings checked(const ContactSettings& s) {
  if (!(s.restitution >= 0 && s.restitution <= 1))
    throw Error("contact: restitution is " + std::to_string(s.restitution) + ", must be 0..1");
  if (!(s.friction >= 0 && s.friction < 1e6F))
    throw Error("contact: friction is " + std::to_string(s.friction) + ", must be >= 0");
  return s;
}

}  // namespace

Contact::Contact(Device& device, Index max_contact_nodes, const ContactSettings& settings)
    : settings_(checked(settings)),
      records_(device, max(max_contact_nodes, Index(1))),
      total_(device, 1),
      poses_(device, kMostSubsteps) {}

void Contact::check(const ContactNodes& body) const {
  const Index n = body.x_m.size();
  if (body.v_m_s.size() != n || body.mass_kg.size() != n || body.rest_gap_m.size() != n ||
      (!body.fixed.empty() && body.fixed.size() != n)) {
    throw Error("contact: " + std::to_string(n) + " positions, but " + std::to_string(body.v_m_s.size()) +
                " velocities, " + std::to_string(body.mass_kg.size()) + " masses, " +
                std::to_string(body.rest_gap_m.size()) + " rest gaps, " + std::to_string(body.fixed.size()) +
                " fixed flags");
  }
  if (!body.memory.empty() && body.memory.size() != body.nodes.size()) {
    throw Error("contact: " + std::to_string(body.nodes.size()) + " contact nodes, but memory for " +
                std::to_string(body.memory.size()));
  }
  if (body.first_record < 0 || body.nodes.size() > records_.size() - body.first_record) {
    throw Error("contact: " + std::to_string(body.nodes.size()) + " contact nodes from record " +
                std::to_string(body.first_record) + " on, room for " + std::to_string(records_.size()));
  }
}

void Contact::begin_frame(ExecContext& ctx, const RealSurface& surface, const ContactTimes& times) {
  times_ = times;
  if (times.substeps > kMostSubsteps)
    throw Error("contact: " + std::to_string(times.substeps) + " substeps, at most " +
                std::to_string(kMostSubsteps));
  ctx.parallel_for("contact/pose", times.frame.empty() ? Count(times.substeps) : substep_count(times.frame),
                   PoseSurface{surface.motions(), surface.pieces(), times, poses_.view()});
  ctx.fill_bytes(records_.view(), 0);
}

void Contact::rescue(ExecContext& ctx, const RealSurface& surface, const ContactNodes& body) {
  check(body);
  const float s = surface.settings().sample_spacing_m;
  ctx.parallel_for("contact/rescue", body.nodes.size(),
                   DeepRescue{surface.samples(), surface.coarse_samples(), poses_.const_view(), body, 2 * s,
                              8 * s, records_of(body)});
}

void Contact::correct(ExecContext& ctx, const RealSurface& surface, const ContactNodes& body, Index k,
                      Index steps) {
  check(body);
  ctx.parallel_for(
      "contact/response", body.nodes.size(),
      ContactResponse{surface.samples(), poses_.const_view(), body, 2 * surface.settings().sample_spacing_m,
                      settings_.restitution, settings_.friction,
                      SubstepsTo{k, steps, times_.dt_s, times_.frame}, records_of(body)});
}

void Contact::end_frame(ExecContext& ctx) {
  ctx.parallel_for("contact/totals", 1, SumRecords{records_.const_view(), total_.view()});
}

ContactReport Contact::report(ExecContext& ctx, float dt_frame_s, int substeps) const {
  return contact_report(to_host(ctx, total_.const_view())[0], dt_frame_s, substeps);
}

ContactReport contact_report(const ContactRecord& total, float dt_frame_s, int substeps) {
  ContactReport report;
  report.force_N = total.impulse_N_s / dt_frame_s;
  report.torque_N_m = total.moment_N_m_s / dt_frame_s;
  report.max_depth_m = total.max_depth_m;
  report.contacts_per_substep = substeps > 0 ? static_cast<double>(total.contacts) / substeps : 0;
  report.rescued = total.rescued;
  return report;
}

}  // namespace tactus
