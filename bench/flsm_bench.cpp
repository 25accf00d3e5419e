#include "bandwidth.h"
#include "bench.h"
#include "tactus/base/timing.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/tissue/flsm/flsm.h"

namespace tactus::bench {

/// A box of 31^3 cubes (32,768 nodes). Floor: 24 B of state read and written, 12 B of rest position and mass
/// read per node.
Rows run_flsm(const std::string& device_text) {
  DeviceSet devices(device_text);
  ExecContext& ctx = devices.context(0);
  LatticeOptions lattice_options;
  lattice_options.spacing_m = 0.005F;
  const CubeLattice lattice = lattice_from_box({0, 0, 0}, {31, 31, 31}, lattice_options);
  const double floor_ms = 60.0 * lattice.node_count() / measure_bandwidth_B_s(ctx) * 1e3;
  return collect([&](Rows& rows) {
    for (int w = 1; w <= 4; ++w) {
      Flsm flsm(ctx, lattice, {.half_width = w});
      BodyState state = rest_state(ctx, lattice);
      constexpr int kSubsteps = 10;
      const auto ms = time_ms(
          [&] {
            for (int k = 0; k < kSubsteps; ++k) flsm.step(ctx, state, {.dt_s = 1e-3F});
            ctx.synchronize();
          },
          20, 2);
      const Index nodes = lattice.node_count();
      rows.push_back({{"name", "flsm w=" + std::to_string(w)},
                      {"case", "box"},
                      {"size", nodes},
                      {"devices", devices.name()},
                      {"ms_p50", p(ms, 50) / kSubsteps},
                      {"ms_p99", p(ms, 99) / kSubsteps},
                      {"ms_p10", p(ms, 10) / kSubsteps},
                      {"ns_per_node", p(ms, 50) / kSubsteps * 1e6 / nodes},
                      {"floor_ms", floor_ms}});
    }
  });
}

}  // namespace tactus::bench
