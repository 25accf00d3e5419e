// What a soft body does in a frame.
#include "tactus/sim/soft_body.h"

namespace tactus {

void SoftBody::add_stages(Schedule& schedule, Readback& readback, Contact& contact,
                          const RealSurface& surface, Vec3f gravity_m_s2) {
  ExecContext& ctx = devices_.context(0);
  const HybridStep step{
      .gravity_m_s2 = gravity_m_s2, .full_stiffness = full_stiffness_, .matched_every = matching_every()};
  tissue_.follow(schedule.frame());
  tissue_.add_reports(readback);
  schedule.add({.name = stage("begin"),
                .timed_as = "begin",
                .rate = Rate::before,
                .devices = stage_devices(),
                .updates = {nodes_resource()},
                .submit = [this, &ctx](BlockPlace) { begin_stage(ctx); }});
  schedule.add({.name = stage("step"),
                .timed_as = "bodies",
                .rate = Rate::substep,
                .period = matching_every(),
                .devices = stage_devices(),
                .updates = {nodes_resource()},
                .submit = [this, step](BlockPlace at) { tissue_.substep(step, at.substep, at.count); }});
  if (contact_node_count() > 0) add_contact_stages(schedule, contact, surface);
  const bool acted_on = !is_untouched() || !shape_.motions.empty() || !shape_.loads.empty();
  if (acted_on)
    schedule.add({.name = stage("watch"),
                  .timed_as = "bodies",
                  .rate = Rate::substep,
                  .devices = stage_devices(),
                  .writes = {stage("watch record")},
                  .reads = {nodes_resource()},
                  .submit = [this](BlockPlace at) { tissue_.watch(at.substep, at.count); }});
  schedule.add({.name = stage("end"),
                .timed_as = "end",
                .rate = Rate::after,
                .devices = stage_devices(),
                .writes = {stage("report")},
                .updates = {nodes_resource()},
                .submit = [this](BlockPlace) {
                  tissue_.end_substeps(0);
                  tissue_.end_frame(0);
                }});
  schedule.add({.name = stage("embed"),
                .timed_as = "embed",
                .rate = Rate::end,
                .writes = {stage("surface")},
                .reads = {nodes_resource()},
                .submit = [this, &ctx](BlockPlace) { surface_.update(ctx, tissue_.body()); }});
}

void SoftBody::begin_stage(ExecContext& ctx) {
  ctx.copy(tissue_.body().x_m.const_view(), frame_begin_x_m_.view());
  tissue_.begin_frame();
  tissue_.begin_substeps();
}

/// Where shape matching goes several substeps at once, the nodes that it alone moves touch the surface once
/// for all of them, where it will be at their end.
void SoftBody::add_contact_stages(Schedule& schedule, Contact& contact, const RealSurface& surface) {
  ExecContext& ctx = devices_.context(0);
  const Index count = contact_node_count();
  schedule.add({.name = stage("rescue"),
                .timed_as = "begin",
                .rate = Rate::before,
                .updates = {nodes_resource(), "contact/records"},
                .reads = {"contact/poses"},
                .submit = [this, &ctx, &contact, &surface, count](BlockPlace) {
                  contact.rescue(ctx, surface, contact_nodes(0, count));
                }});
  const auto add = [&](const char* what, Index begin, Index end, int steps) {
    if (begin == end) return;
    schedule.add({.name = stage(what),
                  .timed_as = "bodies",
                  .rate = Rate::substep,
                  .every = steps,
                  .updates = {nodes_resource(), "contact/records"},
                  .submit = [this, &ctx, &contact, &surface, begin, end, steps](BlockPlace at) {
                    contact.correct(ctx, surface, contact_nodes(begin, end), at.substep, steps);
                  }});
  };
  if (matching_every() == 1) return add("touch", 0, count, 1);
  add("touch elements", 0, element_contact_nodes_, 1);
  add("touch matched", element_contact_nodes_, count, matching_every());
}

ContactNodes SoftBody::contact_nodes(Index begin, Index end) {
  BodyState& state = tissue_.body();
  return {state.x_m.view(),
          state.v_m_s.view(),
          mass_kg_.const_view(),
          rest_gap_m_.const_view(),
          contact_nodes_.const_view().part(begin, end - begin),
          tissue_.boundary().held(),
          memory_.view().part(begin, end - begin),
          first_record_ + begin};
}

}  // namespace tactus
