#include "bandwidth.h"
#include "bench.h"
#include "tactus/fluid/liquid.h"
#include "tactus/geom/search/neighbour_lists.h"
#include "tactus/multi_device/device_replay.h"

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

/// A dam of n^3 particles, in a box with capacity for it.
class Dam {
 public:
  /// @param box_edges the box's length over the dam's
  Dam(DeviceSet& devices, Index edge, LiquidSolver solver, float box_edges = 2)
      : devices_(devices), liquid_(devices, settings(edge, solver, box_edges)), size_(edge * edge * edge) {
    const float m = kSpacing_m * static_cast<float>(edge);
    liquid_.place(fill_box({{0, 0, 0}, {m, m, m}}, kSpacing_m));
  }
  /// Asynchronous. @param in_block which of the steps that are recorded together
  void step(int in_block = 0) {
    liquid_.step({.dt_s = liquid_.largest_step_s(), .gravity_m_s2 = {0, -9.81F, 0}, .in_block = in_block});
  }
  /// So many steps, the same number in every call: a GPU replays them. Waits for them.
  void steps(int count) {
    replay_.run(devices_, [&] {
      for (int i = 0; i < count; ++i) step(i);
    });
    devices_.synchronize();
  }
  /// Moves the cuts between devices, as a frame does at its end.
  void balance() {
    liquid_.end_frame();
    std::vector<std::vector<Index>> layers;
    for (int part = 0; part < liquid_.part_count(); ++part)
      layers.push_back(to_host(devices_.context(part), liquid_.layers(part)));
    liquid_.balance(layers);
  }
  const Liquid& liquid() const { return liquid_; }
  double step_s() const { return static_cast<double>(liquid_.largest_step_s()); }
  Index size() const { return size_; }
  /// A particle's, itself included.
  double neighbours() const {
    ExecContext& ctx = devices_.context(0);
    std::vector<Vec3f> x_m;
    for (const LiquidParticle& p : liquid_.particles()) x_m.push_back(p.x_m);
    const Buffer<Vec3f> x = to_device(ctx, x_m);
    NeighbourSearch search(ctx.device(),
                           {.max_particles = size_, .reach_m = liquid_.constants().kernel.reach_m()});
    NeighbourLists lists(ctx.device(), size_, 1);
    search.build(ctx, x.view(), {}, x.size());
    lists.build(ctx, search);
    return 1 + static_cast<double>(to_host(ctx, lists.wanted())[0]) / size_;
  }

 private:
  static LiquidSettings settings(Index edge, LiquidSolver solver, float box_edges) {
    const float m = kSpacing_m * static_cast<float>(edge);
    return {.solver = solver,
            .spacing_m = kSpacing_m,
            .max_speed_m_s = std::sqrt(2 * 9.81F * m),
            .box_m = {{0, 0, 0}, {box_edges * m, 2 * m, m}},
            .max_particles = edge * edge * edge};
  }
  DeviceSet& devices_;
  Liquid liquid_;
  Index size_;
  DeviceReplay replay_;
};

/// In one go on a GPU: a launch of the recording is not what is measured.
int batch_on(const DeviceSet& devices) { return devices.is_cuda() ? 20 : 1; }

nlohmann::json step_row(DeviceSet& devices, Index edge, LiquidSolver solver, double bandwidth_B_s) {
  Dam dam(devices, edge, solver);
  const int batch = batch_on(devices);
  for (int i = 0; i < (solver == LiquidSolver::dfsph ? 20 : 200); i += batch) {
    dam.steps(batch);
    dam.balance();
  }
  std::vector<double> ms = time_ms([&] { dam.steps(batch); });
  for (double& m : ms) m /= batch;
  nlohmann::json row{{"name", solver == LiquidSolver::dfsph ? "dfsph" : "wcsph"},
                     {"case", "dam"},
                     {"size", dam.size()},
                     {"devices", devices.name()},
                     {"parts", dam.liquid().part_count()},
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
  row["kernels_ms_p50"] = kernels_ms(devices.context(0), [&] {
    for (int i = 0; i < 5; ++i) dam.step();
    devices.synchronize();
  });
  return row;
}

/// A dam that has run to the other end of a trough four times as long: all of it began in a quarter. With
/// cuts as they were at the start, or moved every 20 steps.
nlohmann::json balance_row(DeviceSet& devices, Index edge, bool is_balanced) {
  Dam dam(devices, edge, LiquidSolver::dfsph, 4);
  const int batch = 20;
  // A dam's tip runs at 2 sqrt(g h): three heights take 1.5 sqrt(h / g). Most follows in as long again.
  const double fall_s = 3 * std::sqrt(static_cast<double>(kSpacing_m) * edge / 9.81);
  for (int i = 0; i < static_cast<int>(fall_s / dam.step_s()); i += batch) {
    check_stop();
    dam.steps(batch);
    if (is_balanced) dam.balance();
  }
  std::vector<double> ms;
  for (int i = 0; i < 10; ++i) {
    check_stop();
    const double begin_s = now_s();
    dam.steps(batch);
    ms.push_back(1e3 * (now_s() - begin_s) / batch);
    if (is_balanced) dam.balance();
  }
  return {{"name", "dam"},
          {"case", is_balanced ? "balanced" : "unbalanced"},
          {"size", dam.size()},
          {"devices", devices.name()},
          {"parts", dam.liquid().part_count()},
          {"ms_p50", p(ms, 50)},
          {"ms_p99", p(ms, 99)},
          {"ms_min", p(ms, 0)},
          {"reference", nlohmann::json::object()}};
}

}  // namespace

/// Steps of the liquid, with the search; on several devices, also with and without moving cuts.
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
      if (devices.count() == 1) continue;
      for (const bool is_balanced : {false, true})
        rows.push_back(balance_row(devices, devices.is_cuda() ? 126 : 20, is_balanced));
    }
  });
}

}  // namespace tactus::bench
