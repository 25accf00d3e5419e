// What the liquid does in a frame.
#include "tactus/sim/scene_liquid.h"

namespace tactus {

void SceneLiquid::add_stages(Schedule& schedule, Readback& readback, ContactOnDevices& world,
                             Vec3f gravity_m_s2) {
  const View<const FrameParams> frame = schedule.frame().view(0);
  std::vector<Resource> moved{"liquid"};
  for (const Felt& felt : bodies_) moved.push_back(felt.body->nodes_resource());
  schedule.add({.name = "liquid/step",
                .timed_as = "liquid",
                .rate = Rate::substep,
                .updates = moved,
                .submit = [this, &world, frame, gravity_m_s2](BlockPlace at) {
                  const StepTime time{.gravity_m_s2 = gravity_m_s2, .frame = frame, .in_block = at.substep};
                  const ContactOnDevices::Part& solid = world.part(0);
                  liquid_.begin_step(ctx_, time);
                  solid.contact.find_walls(ctx_, solid.surface, solid.obstacles.view(),
                                           liquid_.search().cells().particles, liquid_.search().placed(),
                                           liquid_.constants().kernel.reach_m(), Liquid::kFaces, at.substep,
                                           liquid_.near_walls());
                  for (const Felt& felt : bodies_) {
                    felt.walls->pose(ctx_);
                    felt.walls->find_walls(ctx_, liquid_.search(), liquid_.near_walls());
                  }
                  liquid_.end_step(ctx_, time);
                  for (const Felt& felt : bodies_)
                    felt.walls->push(ctx_, liquid_.search(), liquid_.near_walls());
                }});
  schedule.add({.name = "liquid/end",
                .timed_as = "end",
                .rate = Rate::after,
                .writes = {report_resource()},
                .updates = {"liquid"},
                .submit = [this](BlockPlace) { liquid_.end_frame(ctx_); }});
  report_ = readback.add(liquid_.report_view());
  impulses_ = readback.add(liquid_.wall_impulses_N_s());
}

}  // namespace tactus
