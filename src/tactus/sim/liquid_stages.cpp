// Stages of the liquid in a frame.
#include <algorithm>

#include "tactus/sim/body/slab_points.h"
#include "tactus/sim/scene_liquid.h"

namespace tactus {

/// What needs the particles alone: bodies move meanwhile.
void SceneLiquid::begin_step(const FrameOnDevices& frame, Vec3f gravity_m_s2) {
  liquid_.begin_step({.gravity_m_s2 = gravity_m_s2}, &frame);
  for (const Felt& felt : bodies_)
    felt.walls->begin([&](int p) -> const NeighbourSearch& { return liquid_.search(p); });
}

void SceneLiquid::end_step(ContactOnDevices& world, const FrameOnDevices& frame, Vec3f gravity_m_s2) {
  // A step comes after the substep that was last done: the real surface is where it was then.
  constexpr int kLastDone = -1;
  const StepTime time{.gravity_m_s2 = gravity_m_s2};
  for (const Felt& felt : bodies_) felt.walls->pose();
  for (int p = 0; p < liquid_.part_count(); ++p) {
    const ContactOnDevices::Part& solid = world.part(p);
    const NeighbourSearch& search = liquid_.search(p);
    solid.contact.find_walls(devices_.context(p), solid.surface, solid.obstacles.view(),
                             search.cells().particles, search.placed(), liquid_.constants().kernel.reach_m(),
                             Liquid::kFaces, kLastDone, liquid_.near_walls(p));
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
  for (const Felt& felt : bodies_) moved.push_back(felt.body->resources().nodes);
  if (film_) film_->add_stages(schedule, readback);
  const bool bleeds =
      std::any_of(bodies_.begin(), bodies_.end(), [](const Felt& felt) { return felt.wounds != nullptr; });
  if (bleeds)
    schedule.add({.name = "liquid/bleed",
                  .timed_as = "liquid",
                  .rate = Rate::before,
                  .updates = moved,
                  .reads = {"contact/poses"},
                  .submit = [this, &world, &frame](BlockPlace) {
                    for (Felt& felt : bodies_)
                      if (felt.wounds) bleed(felt, world.part(0), frame.view(0));
                  }});
  const FrameOnDevices& paced = schedule.paced_frame();
  schedule.add({.name = "liquid/neighbours",
                .timed_as = "liquid",
                .rate = Rate::ahead,
                .devices = devices,
                .updates = {"liquid"},
                .submit = [this, &paced, gravity_m_s2](BlockPlace) { begin_step(paced, gravity_m_s2); }});
  schedule.add(
      {.name = "liquid/step",
       .timed_as = "liquid",
       .rate = Rate::paced,
       .devices = devices,
       .updates = moved,
       .submit = [this, &world, &paced, gravity_m_s2](BlockPlace) { end_step(world, paced, gravity_m_s2); }});
  schedule.add({.name = "liquid/end",
                .timed_as = "end",
                .rate = Rate::after,
                .devices = devices,
                .writes = {report_resource()},
                .updates = {"liquid"},
                .submit = [this](BlockPlace) { liquid_.end_frame(); }});
  report_ = readback.add(liquid_.report_view());
  impulses_ = readback.add(liquid_.wall_impulses_N_s());
  layers_.clear();
  for (int p = 0; p < liquid_.part_count(); ++p) layers_.push_back(readback.add(liquid_.layers(p), p));
  for (Felt& felt : bodies_)
    if (felt.wounds) felt.ledgers = readback.add(felt.wounds->ledgers());
}

void SceneLiquid::bleed(Felt& felt, const ContactOnDevices::Part& solid, View<const FrameParams> frame) {
  const ContactNodes nodes = felt.body->points().nodes(0);
  Wounds& wounds = *felt.wounds;
  ExecContext& ctx = devices_.context(0);
  wounds.set_rate_m_s(
      static_cast<float>(felt.body->description().bleeding->rate_m_s));  // it may change between frames
  wounds.try_places(ctx, frame, View<const Vec3f>(nodes.x_m), View<const Vec3f>(nodes.v_m_s));
  liquid_.find_box_walls(ctx, wounds.search(), wounds.near_walls());
  solid.contact.find_walls(ctx, solid.surface, solid.obstacles.view(), wounds.search().cells().particles,
                           wounds.search().placed(), liquid_.constants().kernel.reach_m(), Liquid::kFaces, 0,
                           wounds.near_walls());
  for (const Felt& other : bodies_) {
    other.walls->begin([&](int) -> const NeighbourSearch& { return wounds.search(); });
    other.walls->pose();
    other.walls->find_walls(0, wounds.search(), wounds.near_walls(), felt.hits.view());
  }
  wounds.bleed(ctx, frame, liquid_.search(), liquid_.arrivals());
}

}  // namespace tactus
