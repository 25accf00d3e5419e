#include <cstdlib>
#include <filesystem>
#include <optional>

#include "bandwidth.h"
#include "bench.h"
#include "tactus/base/log.h"
#include "tactus/base/timing.h"
#include "tactus/io/label_file.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/tissue/hybrid/hybrid.h"

namespace tactus::bench {
namespace {

nlohmann::json tled_row(DeviceSet& devices, Index edge, double bandwidth) {
  ExecContext& ctx = devices.context(0);
  CubeLattice lattice =
      lattice_from_box({0, 0, 0}, {edge, edge, edge}, {.spacing_m = 0.1F / static_cast<float>(edge)});
  lattice.fix_half_space({0.001F / static_cast<float>(edge), 0, 0}, {1, 0, 0});
  const ElasticMaterial material{.young_Pa = 3000};
  Tled tled(ctx, lattice, {&material, 1});
  BodyState state = rest_state(ctx, lattice);
  constexpr int kSubsteps = 20;
  const TledStep step{.dt_s = tled.stable_step_s()};
  Replay substeps;
  const auto ms = time_ms(
      [&] {
        substeps.run(ctx, [&] { tled.step(ctx, state, step, kSubsteps); });
        ctx.synchronize();
      },
      20, 2);
  const Index cubes = lattice.cube_count();
  // Read: 12 B position, 12 B velocity per node, 12 B stiffness per cube; written: 24 B.
  return {{"name", "tled neo-Hookean"},
          {"case", "box"},
          {"size", cubes},
          {"devices", devices.name()},
          {"ms_p50", p(ms, 50) / kSubsteps},
          {"ms_p99", p(ms, 99) / kSubsteps},
          {"ms_p10", p(ms, 10) / kSubsteps},
          {"ns_per_cube", p(ms, 50) / kSubsteps * 1e6 / cubes},
          {"floor_ms", 60.0 * cubes / bandwidth * 1e3}};
}

/// One frame at 90 Hz, with all its substeps, of the liver of a CT in cubes of 5 mm; nothing without the
/// data.
std::optional<nlohmann::json> liver_row(DeviceSet& devices, double bandwidth) {
  const char* folder = std::getenv("TACTUS_DATA");
  const std::string file = std::string(folder == nullptr ? "" : folder) + "/meshes/liver.inr.gz";
  if (folder == nullptr || !std::filesystem::exists(file)) {
    log_warning("'tled liver 5 mm' is left out: " +
                (folder == nullptr ? "TACTUS_DATA is not set" : "there is no " + file));
    return {};
  }
  ExecContext& ctx = devices.context(0);
  CubeLattice lattice =
      lattice_from_labels(read_label_volume(file), {255}, {.spacing_m = 0.005F, .smallest_fill = 0.5F});
  lattice.fix_half_space({0, 0, lattice.origin_m.z + 0.02F}, {0, 0, 1});
  const ElasticMaterial material{.young_Pa = 10000, .poisson = 0.45F};
  Tled tled(ctx, lattice, {&material, 1});
  BodyState state = rest_state(ctx, lattice);
  constexpr float kFrame_s = 1.F / 90;
  const int substeps = tled.substeps_for(kFrame_s);
  const TledStep step{.dt_s = kFrame_s / static_cast<float>(substeps)};
  Replay frame;
  const auto ms = time_ms(
      [&] {
        frame.run(ctx, [&] { tled.step(ctx, state, step, substeps); });
        ctx.synchronize();
      },
      20, 2);
  const Index cubes = lattice.cube_count();
  return {{{"name", "tled liver 5 mm"},
           {"case", "frame at 90 Hz"},
           {"size", lattice.node_count()},
           {"cubes", cubes},
           {"substeps", substeps},
           {"devices", devices.name()},
           {"ms_p50", p(ms, 50)},
           {"ms_p99", p(ms, 99)},
           {"ms_p10", p(ms, 10)},
           {"ns_per_cube", p(ms, 50) / substeps * 1e6 / cubes},
           {"floor_ms", 60.0 * cubes * substeps / bandwidth * 1e3}}};
}

/// A bar of square section, five times as long, with so many cubes across.
nlohmann::json hybrid_row(DeviceSet& devices, Index across, double elements, double matched,
                          const char* ratio, double bandwidth) {
  ExecContext& ctx = devices.context(0);
  CubeLattice lattice = lattice_from_box({0, 0, 0}, {5 * across, across, across},
                                         {.spacing_m = 0.02F / static_cast<float>(across)});
  lattice.fix_half_space({1e-5F, 0, 0}, {1, 0, 0});
  const ElasticMaterial material{.young_Pa = 30000};
  Hybrid hybrid(ctx, lattice, split_by_ratio(lattice, 0, elements, matched), {&material, 1}, {}, {},
                {.young_Pa = 30000, .half_width = 2});
  BodyState state = rest_state(ctx, lattice);
  constexpr int kSubsteps = 20;
  const HybridStep step{.dt_s = hybrid.stable_step_s()};
  Replay substeps;
  const auto ms = time_ms(
      [&] {
        substeps.run(ctx, [&] {
          for (int k = 0; k < kSubsteps; ++k) hybrid.step(ctx, state, step);
        });
        ctx.synchronize();
      },
      20, 1);
  return {{"name", std::string("fig20 ") + ratio},
          {"case", "bar"},
          {"size", lattice.node_count()},
          {"devices", devices.name()},
          {"ms_p50", p(ms, 50) / kSubsteps},
          {"ms_p99", p(ms, 99) / kSubsteps},
          {"ms_p10", p(ms, 10) / kSubsteps},
          {"ns_per_node", p(ms, 50) / kSubsteps * 1e6 / lattice.node_count()},
          {"floor_ms", 60.0 * lattice.node_count() / bandwidth * 1e3}};
}

}  // namespace

/// Fig 20 of Shao et al. 2019: time of a substep over the number of nodes, elements to shape matching 7:3 and
/// 3:7.
Rows run_fig20(const std::string& device_text) {
  DeviceSet devices(device_text);
  const double bandwidth = measure_bandwidth_B_s(devices.context(0));
  return collect([&](Rows& rows) {
    for (const Index across : {4, 6, 8, 12, 16, 24}) {
      rows.push_back(hybrid_row(devices, across, 7, 3, "7:3", bandwidth));
      rows.push_back(hybrid_row(devices, across, 3, 7, "3:7", bandwidth));
    }
  });
}

Rows run_tissue(const std::string& device_text) {
  DeviceSet devices(device_text);
  const double bandwidth = measure_bandwidth_B_s(devices.context(0));
  return collect([&](Rows& rows) {
    for (const Index edge : {16, 32, 46, 100}) rows.push_back(tled_row(devices, edge, bandwidth));
    if (auto row = liver_row(devices, bandwidth)) rows.push_back(std::move(*row));
    for (nlohmann::json& row : run_flsm(device_text)) rows.push_back(std::move(row));
  });
}

}  // namespace tactus::bench
