#include "tactus/fluid/liquid_part.h"

namespace tactus {
namespace {

/// Sums are the same: visits know no other order than z, y, x.
CellIds cell_ids(const Device& device, Index max_particles) {
  return device.is_cuda() && max_particles >= LiquidPart::kLeastInBricks ? CellIds::morton : CellIds::linear;
}

}  // namespace

/// In a liquid of several parts, particles that left and copies of the last step are still there when others
/// come.
LiquidPart::LiquidPart(Device& device, Index max_particles, Index arrivals, float reach_m,
                       Index wall_colliders, Index part, Index parts)
    : number(part),
      search(device, {.max_particles = max_particles,
                      .reach_m = reach_m,
                      .ids = cell_ids(device, max_particles),
                      .max_given = (parts > 1 ? 2 : 1) * max_particles + arrivals}),
      count(device, 1),
      id(device, (parts > 1 ? 2 : 1) * max_particles + arrivals),
      wall_count(device, max_particles),
      list_count(device, max_particles),
      near(device, NearLists::size(max_particles)),
      x_m(device, id.size()),
      v_m_s(device, id.size()),
      density_kg_m3(device, id.size()),
      push(device, id.size()),
      alpha(device, max_particles),
      found(device, max_particles),
      kappa_v(device, max_particles),
      relative_m_s(device, id.size()),
      motion(device, max_particles),
      v_star(device, max_particles),
      moved(device, max_particles),
      walls(device, std::int64_t{kNearWalls} * max_particles),
      wall_sums(device, std::int64_t{wall_colliders} * WallSumsCopy::kOfEach),
      wall_totals(device, wall_colliders),
      counters(device, 1),
      reports(device, ReportLiquid::kReports),
      ages(device, arrivals > 0 ? LiquidAges::kCounts : 0),
      own(device, 1),
      ghost_count(device, 1),
      shown_by(device, parts) {
  if (parts == 1) return;
  slabs = Buffer<LiquidSlabs>(device, 1);
  export_count = Buffer<Index>(device, kMostLiquidParts);
  export_list = Buffer<Index>(device, std::int64_t{parts} * max_particles);
  slot_of = Buffer<Index>(device, id.size());
  ghost_slot = Buffer<Index>(device, max_particles);
  import = Buffer<LiquidImport>(device, 1);
  originals = Buffer<LiquidOriginal>(device, max_particles);
  layers = Buffer<Index>(device, LiquidLayers::kCounts);
}

LiquidShown LiquidPart::shown() {
  return {.x_m = x_m.view(),
          .v_m_s = v_m_s.view(),
          .push = push.view(),
          .id = id.view(),
          .export_count = export_count.view(),
          .export_list = export_list.view(),
          .capacity = wall_count.size(),
          .slot_of = slot_of.const_view(),
          .own = own.const_view(),
          .ages = ages.const_view(),
          .wall_totals = wall_totals.const_view(),
          .reports = reports.const_view()};
}

}  // namespace tactus
