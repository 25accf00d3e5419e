#include "bandwidth.h"
#include "bench.h"
#include "tactus/fluid/liquid.h"
#include "tactus/geom/neighbour_lists.h"
#include "tactus/multi_device/device_set.h"

namespace tactus::bench {
namespace {

constexpr float kSpacing_m = 0.005F;
/// Bytes a particle that no method can avoid: position, id and velocity read and written.
constexpr double kStepBytes = 56;
/// Of 131 k to 700 k particles on the CPU of Tactus' tables with two cores and on an H200, best of several.
struct Peer {
  const char* name;
  double cpu_us_per_particle, gpu_us_per_particle;
};
constexpr Peer kPeers[] = {{"dualsphysics", 0.38, 0.0011}, {"splishsplash", 0.95, 0}};

/// A dam of n^3 particles that has begun to break, in a box with room for it.
class Dam {
 public:
  Dam(DeviceSet& devices, Index edge, LiquidSolver solver)
      : ctx_(devices.context(0)), liquid_(ctx_, settings(edge, solver)), size_(edge * edge * edge) {
    const float m = kSpacing_m * static_cast<float>(edge);
    liquid_.place(ctx_, fill_box({{0, 0, 0}, {m, m, m}}, kSpacing_m));
    for (int i = 0; i < (solver == LiquidSolver::dfsph ? 20 : 200); ++i) step();
    ctx_.synchronize();
  }
  void step() { liquid_.step(ctx_, {.dt_s = liquid_.largest_step_s(), .gravity_m_s2 = {0, -9.81F, 0}}); }
  double step_s() const { return static_cast<double>(liquid_.largest_step_s()); }
  ExecContext& ctx() { return ctx_; }
  Index size() const { return size_; }
  /// A particle's, itself included.
  double neighbours() {
    const LiquidView view = liquid_.view();
    NeighbourSearch search(ctx_.device(),
                           {.max_particles = size_, .reach_m = liquid_.constants().kernel.reach_m()});
    NeighbourLists lists(ctx_.device(), size_, 1);
    search.build(ctx_, view.x_m, view.id, view.count);
    lists.build(ctx_, search);
    return 1 + static_cast<double>(to_host(ctx_, lists.wanted())[0]) / size_;
  }

 private:
  static LiquidSettings settings(Index edge, LiquidSolver solver) {
    const float m = kSpacing_m * static_cast<float>(edge);
    return {.solver = solver,
            .spacing_m = kSpacing_m,
            .max_speed_m_s = std::sqrt(2 * 9.81F * m),
            .box_m = {{0, 0, 0}, {2 * m, 2 * m, m}},
            .max_particles = edge * edge * edge};
  }
  ExecContext& ctx_;
  Liquid liquid_;
  Index size_;
};

nlohmann::json step_row(DeviceSet& devices, Index edge, LiquidSolver solver, double bandwidth_B_s) {
  Dam dam(devices, edge, solver);
  ExecContext& ctx = dam.ctx();
  const int batch = ctx.device().is_cuda() ? 20 : 1;
  Replay replay;
  std::vector<double> ms = time_ms([&] {
    replay.run(ctx, [&] {
      for (int i = 0; i < batch; ++i) dam.step();
    });
    ctx.synchronize();
  });
  for (double& m : ms) m /= batch;
  nlohmann::json row{{"name", solver == LiquidSolver::dfsph ? "dfsph" : "wcsph"},
                     {"case", "dam"},
                     {"size", dam.size()},
                     {"devices", devices.name()},
                     {"ms_p50", p(ms, 50)},
                     {"ms_p99", p(ms, 99)},
                     {"ms_min", p(ms, 0)},
                     {"us_per_particle", p(ms, 0) * 1e3 / dam.size()},
                     {"wall_s_per_simulated_s", p(ms, 50) * 1e-3 / dam.step_s()},
                     {"neighbours", dam.neighbours()},
                     {"floor_ms", kStepBytes * dam.size() / bandwidth_B_s * 1e3},
                     {"reference", nlohmann::json::object()}};
  for (const Peer& peer : kPeers) {
    const double us = devices.is_cuda() ? peer.gpu_us_per_particle : peer.cpu_us_per_particle;
    if (us > 0 && solver == LiquidSolver::wcsph) row["reference"][peer.name] = us * dam.size() * 1e-3;
  }
  row["kernels_ms_p50"] = kernels_ms(ctx, [&] {
    for (int i = 0; i < 5; ++i) dam.step();
  });
  return row;
}

}  // namespace

/// Steps of the liquid, with the search, on one device.
Rows run_fluid(const std::string& device_text) {
  return collect([&](Rows& rows) {
    for (const std::string& set : single_devices(device_text)) {
      DeviceSet devices(set);
      const double bandwidth = measure_bandwidth_B_s(devices.context(0));
      std::vector<Index> edges{13, 34, 51};
      if (devices.is_cuda()) edges.insert(edges.end(), {89, 200});
      for (const LiquidSolver solver : {LiquidSolver::wcsph, LiquidSolver::dfsph}) {
        for (const Index edge : edges) rows.push_back(step_row(devices, edge, solver, bandwidth));
      }
    }
  });
}

}  // namespace tactus::bench
