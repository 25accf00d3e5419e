#include "tactus/fluid/liquid_split.h"

namespace tactus {

LiquidSplit::LiquidSplit(DeviceSet& devices, std::vector<LiquidPart>& parts)
    : devices_(devices), parts_(parts), barrier_(devices, static_cast<int>(parts.size())), ring_(devices, 1) {
  std::vector<LiquidShown> shown;
  for (LiquidPart& part : parts_) shown.push_back(part.shown());
  each([&](ExecContext& ctx, LiquidPart& part) { ctx.upload(shown, part.shown_by.view()); });
  devices_.synchronize();
}

void LiquidSplit::send_slabs(const LiquidSlabs& slabs) {
  if (!is_split()) return;
  ring_.next()[0] = slabs;
  each([&](ExecContext& ctx, LiquidPart& part) { ctx.upload(ring_.newest(), part.slabs.view()); });
  ring_.sent();
}

void LiquidSplit::take_over(const char* name, bool are_ghosts) {
  barrier_.meet();
  each([&](ExecContext& ctx, LiquidPart& part) {
    ctx.parallel_for(name, 1,
                     PlanImport{part.number, part.shown_by.const_view(), part.count.view(),
                                part.ghost_count.view(), part.import.view()});
    ctx.parallel_for(name, part.ghosts(),
                     TakeOver{part.number, part.shown_by.const_view(), part.import.const_view(),
                              are_ghosts ? part.originals.view() : View<LiquidOriginal>{}});
  });
}

void LiquidSplit::migrate() {
  if (!is_split()) return;
  each([&](ExecContext& ctx, LiquidPart& part) {
    ctx.fill_bytes(part.export_count.view(), 0);
    ctx.parallel_for(
        "fluid/leave", part.given(),
        ListLeavers{part.number, part.slabs.const_view(), part.search.cells().hash, part.shown()});
  });
  take_over("fluid/migrate", false);
}

void LiquidSplit::add_ghosts(float reach_m) {
  if (!is_split()) return;
  barrier_.meet();  // those that left were taken over
  each([&](ExecContext& ctx, LiquidPart& part) {
    ctx.fill_bytes(part.export_count.view(), 0);
    ctx.parallel_for(
        "fluid/near cuts", part.given(),
        ListGhosts{part.number, part.slabs.const_view(), part.search.cells().hash, reach_m, part.shown()});
  });
  take_over("fluid/ghosts", true);
}

void LiquidSplit::link_ghosts() {
  if (!is_split()) return;
  each([&](ExecContext& ctx, LiquidPart& part) {
    ctx.parallel_for("fluid/slots", part.search.placed(),
                     InvertOrder{part.search.cells().order, part.slot_of.view()});
  });
  barrier_.meet();
  each([&](ExecContext& ctx, LiquidPart& part) {
    ctx.parallel_for(
        "fluid/link", part.ghosts(),
        FindOriginals{part.shown_by.const_view(), part.import.const_view(), part.slot_of.const_view(),
                      part.originals.view(), part.ghost_slot.view(), part.x_m.view()});
  });
}

}  // namespace tactus
