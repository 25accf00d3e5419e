// What the liquid does in a frame.
#include <algorithm>

#include "tactus/sim/scene_liquid.h"

namespace tactus {

void SceneLiquid::add_stages(Schedule& schedule, Readback& readback, ContactOnDevices& world,
                             Vec3f gravity_m_s2) {
  const View<const FrameParams> frame = schedule.frame().view(0);
  std::vector<Resource> moved{"liquid"};
  for (const Felt& felt : bodies_) moved.push_back(felt.body->nodes_resource());
  const bool bleeds =
      std::any_of(bodies_.begin(), bodies_.end(), [](const Felt& felt) { return felt.wounds != nullptr; });
  if (bleeds)
    schedule.add({.name = "liquid/bleed",
                  .timed_as = "liquid",
                  .rate = Rate::before,
                  .updates = moved,
                  .reads = {"contact/poses"},
                  .submit = [this, &world, frame](BlockPlace) {
                    for (const Felt& felt : bodies_) felt.walls->pose(ctx_);
                    for (Felt& felt : bodies_)
                      if (felt.wounds) bleed(felt, world.part(0), frame);
                  }});
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
  for (Felt& felt : bodies_)
    if (felt.wounds) felt.books = readback.add(felt.wounds->books());
}

void SceneLiquid::bleed(Felt& felt, const ContactOnDevices::Part& solid, View<const FrameParams> frame) {
  const ContactNodes nodes = felt.body->contact_nodes();
  Wounds& wounds = *felt.wounds;
  wounds.try_places(ctx_, frame, View<const Vec3f>(nodes.x_m), View<const Vec3f>(nodes.v_m_s));
  liquid_.find_box_walls(ctx_, wounds.search(), wounds.near_walls());
  solid.contact.find_walls(ctx_, solid.surface, solid.obstacles.view(), wounds.search().cells().particles,
                           wounds.search().placed(), liquid_.constants().kernel.reach_m(), Liquid::kFaces, 0,
                           wounds.near_walls());
  for (const Felt& other : bodies_)
    other.walls->find_walls(ctx_, wounds.search(), wounds.near_walls(), felt.hits.view());
  wounds.bleed(ctx_, liquid_.search(), liquid_.arrivals());
}

}  // namespace tactus
