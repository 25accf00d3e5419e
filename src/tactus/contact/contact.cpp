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
      parts_(device, kTotalsParts),
      totals_(device, 1),
      poses_(device, 1) {}

void Contact::pose(ExecContext& ctx, const RealSurface& surface, const ContactNodes& body, float time_s) {
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
  if (body.nodes.size() > records_.size()) {
    throw Error("contact: " + std::to_string(body.nodes.size()) + " contact nodes, room for " +
                std::to_string(records_.size()));
  }
  ctx.parallel_for("contact/pose", kPieces,
                   PoseSurface{surface.motions(), surface.pieces(), time_s, poses_.view()});
}

void Contact::begin_frame(ExecContext& ctx) { ctx.fill_bytes(totals_.view(), 0); }

void Contact::rescue(ExecContext& ctx, const RealSurface& surface, const ContactNodes& body, float time_s) {
  pose(ctx, surface, body, time_s);
  const float s = surface.settings().sample_spacing_m;
  ctx.parallel_for("contact/rescue", body.nodes.size(),
                   DeepRescue{surface.samples(), surface.coarse_samples(), poses_.const_view(), body, 2 * s,
                              8 * s, records_.view()});
  add_records(ctx, body.nodes.size(), true);
}

void Contact::correct(ExecContext& ctx, const RealSurface& surface, const ContactNodes& body, float time_s,
                      float dt_s) {
  pose(ctx, surface, body, time_s);
  ctx.parallel_for(
      "contact/response", body.nodes.size(),
      ContactResponse{surface.samples(), poses_.const_view(), body, 2 * surface.settings().sample_spacing_m,
                      settings_.restitution, settings_.friction, dt_s, records_.view()});
  add_records(ctx, body.nodes.size(), false);
}

void Contact::add_records(ExecContext& ctx, Index count, bool rescues) {
  ctx.parallel_for("contact/totals", kTotalsParts,
                   TotalsParts{records_.const_view().part(0, count), parts_.view()});
  ctx.parallel_for("contact/totals", 1, AddTotals{parts_.const_view(), totals_.view(), rescues});
}

ContactReport Contact::report(ExecContext& ctx, float dt_frame_s, int substeps) const {
  const ContactTotals totals = to_host(ctx, totals_.const_view())[0];
  ContactReport report;
  report.force_N = totals.impulse_N_s / dt_frame_s;
  report.torque_N_m = totals.moment_N_m_s / dt_frame_s;
  report.max_depth_m = totals.max_depth_m;
  report.contacts_per_substep = substeps > 0 ? static_cast<double>(totals.contacts) / substeps : 0;
  report.rescued = totals.rescued;
  return report;
}

}  // namespace tactus
