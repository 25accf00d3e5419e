// What the liquid does in a frame.
#include "tactus/sim/scene_liquid.h"

namespace tactus {

void SceneLiquid::step(ContactOnDevices& world, const FrameOnDevices& frame, Vec3f gravity_m_s2,
                       int in_block) {
  const StepTime time{.gravity_m_s2 = gravity_m_s2, .in_block = in_block};
  liquid_.begin_step(time, &frame);
  for (const Felt& felt : bodies_) felt.walls->pose();
  for (int p = 0; p < liquid_.part_count(); ++p) {
    const ContactOnDevices::Part& solid = world.part(p);
    const NeighbourSearch& search = liquid_.search(p);
    solid.contact.find_walls(devices_.context(p), solid.surface, solid.obstacles.view(),
                             search.cells().particles, search.placed(), liquid_.constants().kernel.reach_m(),
                             Liquid::kFaces, in_block, liquid_.near_walls(p));
    for (const Felt& felt : bodies_) felt.walls->find_walls(p, search, liquid_.near_walls(p));
  }
  liquid_.end_step(time, &frame);
  for (const Felt& felt : bodies_) {
    for (int p = 0; p < liquid_.part_count(); ++p)
      felt.walls->push(p, liquid_.search(p), liquid_.near_walls(p));
    felt.walls->end_push();
  }
}

void SceneLiquid::add_stages(Schedule& schedule, Readback& readback, ContactOnDevices& world,
                             Vec3f gravity_m_s2) {
  const FrameOnDevices& frame = schedule.frame();
  const StageDevices devices = liquid_.part_count() > 1 ? StageDevices::all : StageDevices::first;
  std::vector<Resource> moved{"liquid"};
  for (const Felt& felt : bodies_) moved.push_back(felt.body->nodes_resource());
  schedule.add({.name = "liquid/step",
                .timed_as = "liquid",
                .rate = Rate::substep,
                .devices = devices,
                .updates = moved,
                .submit = [this, &world, &frame, gravity_m_s2](BlockPlace at) {
                  step(world, frame, gravity_m_s2, at.substep);
                }});
  schedule.add({.name = "liquid/end",
                .timed_as = "end",
                .rate = Rate::after,
                .devices = devices,
                .writes = {report_resource()},
                .updates = {"liquid"},
                .submit = [this](BlockPlace) { liquid_.end_frame(); }});
  report_ = readback.add(liquid_.report_view());
  impulses_ = readback.add(liquid_.wall_impulses_N_s());
  for (int p = 0; p < liquid_.part_count(); ++p) layers_.push_back(readback.add(liquid_.layers(p), p));
}

}  // namespace tactus
