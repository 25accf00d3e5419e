#include <utility>

#include "bench.h"
#include "tactus/base/timing.h"
#include "tactus/geom/lattice/lattice_cut.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/sim/body/cut_capacity.h"
#include "tactus/tissue/cut/body_cutter.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus::bench {
namespace {

constexpr float kSpacing_m = 0.005F;
constexpr ElasticMaterial kMaterial{.young_Pa = 3000, .poisson = 0.45F};

BodyShape shape_of(const BodyDescription& body) {
  BodyShape shape = make_body_shape(body, {});
  const Index copies = first_cut_capacity(body, shape);
  return with_cut_capacity(std::move(shape), copies);
}

/// A block of n^3 cubes, whose surface has triangles of half a spacing.
class Block {
 public:
  Block(DeviceSet& devices, Index n)
      : devices_(devices),
        n_(n),
        shape_(shape_of(description(n))),
        surface_(devices.context(0), shape_.lattice, shape_.surface_m, 1,
                 surface_capacity(shape_.lattice, shape_.surface_m)),
        cutter_(shape_.lattice, {}, shape_.surface_m, to_host(devices.context(0), surface_.anchors()),
                capacity(surface_capacity(shape_.lattice, shape_.surface_m))),
        body_(devices, {.lattice = shape_.lattice, .materials = {&kMaterial, 1}}, {}),
        rest_m_(shape_.lattice.rest_positions_m()) {
    cutter_.take_capacity_for(change_);
  }
  /// Times of a cut, in ms.
  struct CutTimes {
    std::vector<double> all, host, solver, surface, match;
  };
  /// Through `layers` layers of cubes, in its middle, or across that. @returns cubes that fell apart
  Index cut(Index layers, bool across, CutTimes& ms) {
    const double begin_s = now_s();
    const float x = 0.013F, half_m = 0.5F * kSpacing_m * static_cast<float>(n_),
                deep_m = kSpacing_m * (static_cast<float>(layers) + 0.5F) - half_m;
    const auto edge = [&](float y) {
      const auto end = [&](float z) { return across ? Vec3f{z, y, x * 0.1F} : Vec3f{x * 0.1F, y, z}; };
      return std::vector<Vec3f>{end(-1), end(1)};
    };
    const cut::CutReport report = cutter_.cut({edge(-1), edge(deep_m), across ? 1 : 0}, rest_m_, change_);
    const double host_s = now_s();
    body_.apply(change_);
    const double solver_s = now_s();
    surface_.apply(devices_.context(0), change_);
    const double surface_s = now_s();
    while (cutter_.match_parts(change_)) {
      body_.apply(change_);
      surface_.apply(devices_.context(0), change_);
    }
    const double end_s = now_s();
    ms.all.push_back((end_s - begin_s) * 1000);
    ms.host.push_back((host_s - begin_s) * 1000);
    ms.solver.push_back((solver_s - host_s) * 1000);
    ms.surface.push_back((surface_s - solver_s) * 1000);
    ms.match.push_back((end_s - surface_s) * 1000);
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
  static cut::CutSurface::Capacity capacity(SurfaceCapacity of) { return {of.vertices, of.triangles}; }
  DeviceSet& devices_;
  Index n_;
  BodyShape shape_;
  EmbeddedSurface surface_;
  cut::BodyCutter cutter_;
  BodySolver body_;
  std::vector<Vec3f> rest_m_;
  TopologyChange change_;
};

nlohmann::json row(const DeviceSet& devices, const char* what, Index size, const std::vector<double>& ms) {
  return {{"name", "cut"},       {"case", what},       {"size", size}, {"devices", devices.name()},
          {"ms_p50", p(ms, 50)}, {"ms_p99", p(ms, 99)}};
}

}  // namespace

/// The first cut of a body, all of it, and by stages: where edges are crossed, copies, walls and surface on
/// the host, then what the solver's and the surface's devices are told, then that each part has one closed
/// surface. Then substeps with the copies, beside those of the body as it was.
Rows run_cut(const std::string& device_text) {
  return collect([&](Rows& rows) {
    DeviceSet devices(device_text);
    constexpr Index kEdge = 20;
    constexpr int kSubsteps = 50;
    for (const Index layers : {Index{10}, kEdge}) {
      Block::CutTimes ms, across_ms;
      std::vector<double> uncut_ms, cut_ms;
      Index cubes = 0, cubes_across = 0;
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
        cubes = block.cut(layers, false, ms);
        substeps(cut_ms);
        cubes_across = block.cut(layers, true, across_ms);
      }
      rows.push_back(row(devices, "cut", cubes, ms.all));
      rows.push_back(row(devices, "cut: host", cubes, ms.host));
      rows.push_back(row(devices, "cut: solver", cubes, ms.solver));
      rows.push_back(row(devices, "cut: surface", cubes, ms.surface));
      rows.push_back(row(devices, "cut: match parts", cubes, ms.match));
      rows.push_back(row(devices, "cut across", cubes_across, across_ms.all));
      rows.push_back(row(devices, "cut across: match parts", cubes_across, across_ms.match));
      rows.push_back(row(devices, "substep uncut", 0, uncut_ms));
      rows.push_back(row(devices, "substep copies", 2 * cubes, cut_ms));
    }
  });
}

}  // namespace tactus::bench
