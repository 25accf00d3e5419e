// Stages of a soft body in a frame.
#include "tactus/frame/schedule.h"
#include "tactus/sim/body/body_pull.h"
#include "tactus/sim/body/body_steps.h"
#include "tactus/sim/body/slab_points.h"
#include "tactus/sim/body/soft_body.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus {

void SoftBody::add_stages(Schedule& schedule, Readback& readback, ContactOnDevices& world,
                          Vec3f gravity_m_s2) {
  ExecContext& ctx = devices_.context(0);
  tissue_->follow(schedule.frame());
  tissue_->add_reports(readback);
  schedule.add({.name = stage("begin"),
                .timed_as = "begin",
                .rate = Rate::before,
                .devices = stage_devices(),
                .updates = {resources().nodes},
                .submit = [this, &ctx](BlockPlace) { begin_stage(ctx); }});
  schedule.add({.name = stage("step"),
                .timed_as = "bodies",
                .rate = Rate::substep,
                .period = steps_->matching_every(),
                .devices = stage_devices(),
                .updates = {resources().nodes},
                .submit = [this, gravity_m_s2](BlockPlace at) {
                  tissue_->substep({.gravity_m_s2 = gravity_m_s2,
                                    .drag_per_s = static_cast<float>(description_.material.drag_per_s),
                                    .full_stiffness = description_.material.kappa == Stiffness::paper,
                                    .matching_every = steps_->matching_every()},
                                   at.substep, at.count);
                }});
  if (points_->count() > 0) add_contact_stages(schedule, readback, world);
  if (pull_->can_pull())
    schedule.add({.name = stage("pull"),
                  .timed_as = "bodies",
                  .rate = Rate::substep,
                  .devices = stage_devices(),
                  .updates = {resources().nodes},
                  .submit = [this, &schedule](BlockPlace at) { pull_->pull(at.substep, schedule.frame()); }});
  if (!steps_->nothing_acts())
    schedule.add({.name = stage("check nodes"),
                  .timed_as = "bodies",
                  .rate = Rate::substep,
                  .devices = stage_devices(),
                  .writes = {stage("node check record")},
                  .reads = {resources().nodes},
                  .submit = [this](BlockPlace at) { tissue_->check_nodes(at.substep, at.count); }});
  schedule.add({.name = stage("end"),
                .timed_as = "end",
                .rate = Rate::after,
                .devices = stage_devices(),
                .writes = {resources().report},
                .updates = {resources().nodes},
                .submit = [this](BlockPlace) {
                  tissue_->end_substeps(0);
                  tissue_->end_frame(0);
                }});
  schedule.add({.name = stage("embed"),
                .timed_as = "embed",
                .rate = Rate::end,
                .writes = {resources().surface},
                .reads = {resources().nodes},
                .submit = [this, &ctx](BlockPlace) { update_surface(ctx); }});
}

void SoftBody::begin_stage(ExecContext& ctx) {
  ctx.copy(tissue_->body().x_m.const_view(), frame_begin_x_m_.view());
  tissue_->begin_frame();
  tissue_->begin_substeps();
}

void SoftBody::add_contact_stages(Schedule& schedule, Readback& readback, ContactOnDevices& world) {
  const Resource records = stage("contact records");
  schedule.add({.name = stage("push out"),
                .timed_as = "begin",
                .rate = Rate::before,
                .devices = stage_devices(),
                .updates = {resources().nodes, records},
                .reads = {"contact/poses"},
                .submit = [this, &world](BlockPlace) { points_->begin_frame(world); }});
  // Where shape matching goes several substeps at once, the points that it alone moves touch once for all of
  // them, where the surface will be at their end.
  schedule.add({.name = stage("touch"),
                .timed_as = "bodies",
                .rate = Rate::substep,
                .period = steps_->matching_every(),
                .devices = stage_devices(),
                .updates = {resources().nodes, records},
                .submit = [this, &world](BlockPlace at) {
                  points_->correct(world, at.substep, steps_->matching_every());
                }});
  schedule.add({.name = stage("contact sums"),
                .timed_as = "end",
                .rate = Rate::after,
                .devices = stage_devices(),
                .writes = {resources().contact_report},
                .updates = {records},
                .submit = [this](BlockPlace) { points_->end_frame(); }});
  points_->add_reports(readback);
}

StageDevices SoftBody::stage_devices() const {
  return tissue_->slab_count() > 1 ? StageDevices::all : StageDevices::first;
}

}  // namespace tactus
