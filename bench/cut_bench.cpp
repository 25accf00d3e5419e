#include "bench.h"
#include "tactus/base/timing.h"
#include "tactus/geom/lattice_cut.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/sim/body_cut.h"
#include "tactus/tissue/cut/body_cutter.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus::bench {
namespace {

constexpr float kSpacing_m = 0.005F;
constexpr ElasticMaterial kMaterial{.young_Pa = 3000, .poisson = 0.45F};

/// A block of n^3 cubes, whose surface has triangles of half a spacing.
class Block {
 public:
  Block(DeviceSet& devices, Index n)
      : devices_(devices),
        n_(n),
        shape_(with_cut_room(description(n), make_body_shape(description(n), {}))),
        surface_(devices.context(0), shape_.lattice, shape_.surface_m, 1,
                 surface_room(shape_.lattice, shape_.surface_m)),
        cutter_(shape_.lattice, {}, shape_.surface_m, to_host(devices.context(0), surface_.anchors()),
                room(surface_room(shape_.lattice, shape_.surface_m))),
        body_(devices, {.lattice = shape_.lattice, .materials = {&kMaterial, 1}}, {}) {}
  /// Through `layers` layers of cubes, in its middle. @returns cubes that fell apart
  Index cut(Index layers) {
    const float x = 0.013F, half_m = 0.5F * kSpacing_m * static_cast<float>(n_),
                deep_m = kSpacing_m * (static_cast<float>(layers) + 0.5F) - half_m;
    TopologyChange change;
    const cut::CutReport report = cutter_.cut(
        {{{x * 0.1F, -1, -1}, {x * 0.1F, -1, 1}}, {{x * 0.1F, deep_m, -1}, {x * 0.1F, deep_m, 1}}, 0},
        shape_.lattice.rest_positions_m(), change);
    body_.apply(change);
    surface_.apply(devices_.context(0), change);
    return report.cut_cubes;
  }
  void step(int count) {
    body_.step({.dt_s = body_.stable_step_s()}, count);
    devices_.synchronize();
  }

 private:
  static BodyDescription description(Index n) {
    BodyDescription body;
    const double edge_m = double{kSpacing_m} * n;
    body.shape.size_m = {edge_m, edge_m, edge_m};
    body.spacing_m = double{kSpacing_m};
    body.material.model = TissueModel::tled;
    body.cuttable = true;
    return body;
  }
  static cut::CutSurface::Room room(SurfaceRoom of) { return {of.vertices, of.triangles}; }
  DeviceSet& devices_;
  Index n_;
  BodyShape shape_;
  EmbeddedSurface surface_;
  cut::BodyCutter cutter_;
  BodySolver body_;
};

nlohmann::json row(const DeviceSet& devices, const char* what, Index size, const std::vector<double>& ms) {
  return {{"name", "cut"},       {"case", what},       {"size", size}, {"devices", devices.name()},
          {"ms_p50", p(ms, 50)}, {"ms_p99", p(ms, 99)}};
}

}  // namespace

/// The first cut of a body, all of it: where edges are crossed, copies, walls, surface, and what devices are
/// told. Then substeps with the copies, beside those of the body as it was.
Rows run_cut(const std::string& device_text) {
  return collect([&](Rows& rows) {
    DeviceSet devices(device_text);
    constexpr Index kEdge = 20;
    constexpr int kSubsteps = 50;
    for (const Index layers : {Index{10}, kEdge}) {
      std::vector<double> ms, uncut_ms, cut_ms;
      Index cubes = 0;
      for (int k = 0; k < 9; ++k) {
        check_stop();
        Block block(devices, kEdge);
        const auto substeps = [&](std::vector<double>& to) {
          block.step(kSubsteps);
          for (int i = 0; i < 5; ++i) {
            const double begin_s = now_s();
            block.step(kSubsteps);
            to.push_back((now_s() - begin_s) * 1000 / kSubsteps);
          }
        };
        substeps(uncut_ms);
        const double begin_s = now_s();
        cubes = block.cut(layers);
        ms.push_back((now_s() - begin_s) * 1000);
        substeps(cut_ms);
      }
      rows.push_back(row(devices, "cut", cubes, ms));
      rows.push_back(row(devices, "substep uncut", 0, uncut_ms));
      rows.push_back(row(devices, "substep copies", 2 * cubes, cut_ms));
    }
  });
}

}  // namespace tactus::bench
