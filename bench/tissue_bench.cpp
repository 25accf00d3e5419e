#include <cstdlib>
#include <filesystem>
#include <optional>

#include "bandwidth.h"
#include "bench.h"
#include "tactus/base/log.h"
#include "tactus/base/timing.h"
#include "tactus/io/labels/label_file.h"
#include "tactus/multi_device/device_replay.h"
#include "tissue_rows.h"

namespace tactus::bench {
namespace {

constexpr int kSubsteps = 20;

/// Of whatever moves nodes: position and velocity read and written, 12 B of forces or of rest shape read.
constexpr double kBytesPerNode = 60;
/// Elements are bodies of their own here, and read mass and stiffness, too.
constexpr double kBytesPerElement = kBytesPerNode + 6;
/// Two terms of six stresses, read and written.
constexpr double kBytesPerRelaxingElement = kBytesPerElement + 96;

nlohmann::json row(DeviceSet& devices, const TissueCase& body, double bandwidth_B_s) {
  const ElasticMaterial material{.young_Pa = body.matched.young_Pa};
  // On all devices, also where fewer would be faster.
  BodySolver tissue(devices,
                    {.lattice = body.lattice,
                     .elements = body.elements,
                     .materials = {&material, 1},
                     .tled = body.options,
                     .flsm = body.matched,
                     .conditions = {body.motions, {}, nullptr}},
                    {.least_elements = 0});
  const int count = body.frame_s > 0 ? tissue.model().substeps_for(body.frame_s) : kSubsteps;
  const int per_row = body.frame_s > 0 ? count : 1;  // substeps in the row's times
  BodyStep step{.dt_s = body.step_s > 0 ? body.step_s : tissue.stable_step_s(),
                .matching_every = body.matching_every};
  if (body.frame_s > 0) step.dt_s = body.frame_s / static_cast<float>(count);
  const Index size = body.per_cube ? body.lattice.cube_count() : body.lattice.node_count();
  DeviceReplay substeps;
  const auto ms = time_ms(
      [&] {
        substeps.run(devices, [&] { tissue.step(step, count); });
        devices.synchronize();
      },
      20, 2);
  return {{"name", body.name},
          {"case", body.form},
          {"size", size},
          {"devices", devices.name()},
          {"slabs", tissue.slab_count()},
          {"substeps", per_row},
          {"ms_p50", p(ms, 50) / count * per_row},
          {"ms_p99", p(ms, 99) / count * per_row},
          {"ms_p10", p(ms, 10) / count * per_row},
          {body.per_cube ? "ns_per_cube" : "ns_per_node", p(ms, 50) / count * 1e6 / size},
          {"floor_ms", per_row * bytes_per_node(body) * body.lattice.node_count() / tissue.slab_count() /
                           bandwidth_B_s * 1e3}};
}

/// A cube of edge^3 cubes, fixed at its lowest layer of nodes.
CubeLattice clamped_cube(Index edge) {
  CubeLattice lattice =
      lattice_from_box({0, 0, 0}, {edge, edge, edge}, {.spacing_m = 0.1F / static_cast<float>(edge)});
  lattice.fix_half_space({0, 0, 0.001F / static_cast<float>(edge)}, {0, 0, 1});
  return lattice;
}

TissueCase elements(Index edge) {
  TissueCase body{.name = "tled neo-Hookean", .form = "box", .lattice = clamped_cube(edge)};
  body.per_cube = true;
  return body;
}

/// Elements whose stress relaxes in two terms.
TissueCase viscoelastic(Index edge) {
  TissueCase body = elements(edge);
  body.name = "tled viscoelastic";
  body.options.relaxation = {{{0.4F, 0.05F}, {0.2F, 0.5F}}};
  return body;
}

/// Elements whose highest layer of nodes is turned.
TissueCase moved(Index edge) {
  TissueCase body = elements(edge);
  body.name = "tled moved";
  NodeMotion& turn = body.motions.emplace_back();
  turn.name = "turn";
  turn.keys = {{10, {}, 1}};
  turn.axis = {0, 0, 1};
  turn.pivot_m = {0.05, 0.05, 0};
  for (Index i = 0; i < body.lattice.node_count(); ++i)
    if (body.lattice.nodes[static_cast<std::size_t>(i)].z == edge) turn.nodes.push_back(i);
  return body;
}

TissueCase matched(Index edge, int half_width) {
  TissueCase body{
      .name = "flsm w=" + std::to_string(half_width), .form = "box", .lattice = clamped_cube(edge)};
  body.elements.assign(body.lattice.cubes.size(), 0);
  body.matched.half_width = half_width;
  body.step_s = 1e-3F;
  return body;
}

/// The liver of a CT in cubes of 5 mm, for one frame at 90 Hz; nothing without the data.
std::optional<TissueCase> liver() {
  const char* folder = std::getenv("TACTUS_DATA");
  const std::string file = std::string(folder == nullptr ? "" : folder) + "/meshes/liver.inr.gz";
  if (folder == nullptr || !std::filesystem::exists(file)) {
    log_warning("'tled liver 5 mm' is left out: " +
                (folder == nullptr ? "TACTUS_DATA is not set" : "there is no " + file));
    return {};
  }
  TissueCase body{.name = "tled liver 5 mm",
                  .form = "frame at 90 Hz",
                  .lattice = lattice_from_labels(read_label_volume(file), {255},
                                                 {.spacing_m = 0.005F, .smallest_fill = 0.5F})};
  body.lattice.fix_half_space({0, 0, body.lattice.origin_m.z + 0.02F}, {0, 0, 1});
  body.matched.young_Pa = 10000;
  body.frame_s = 1.F / 90;
  return body;
}

/// A bar of square section, five times as long, with so many cubes across.
TissueCase bar(Index across, double elements, double matched, const char* ratio) {
  TissueCase body{.name = std::string("fig20 ") + ratio,
                  .form = "bar",
                  .lattice = lattice_from_box({0, 0, 0}, {across, across, 5 * across},
                                              {.spacing_m = 0.02F / static_cast<float>(across)})};
  body.lattice.fix_half_space({0, 0, 1e-5F}, {0, 0, 1});
  body.elements = split_by_ratio(body.lattice, 2, elements, matched);
  body.matched = {.young_Pa = 30000, .half_width = 2};
  return body;
}

}  // namespace

double bytes_per_node(const TissueCase& body) {
  if (body.options.faded_share() > 0) return kBytesPerRelaxingElement;
  return body.elements.empty() ? kBytesPerElement : kBytesPerNode;
}

/// Fig 20 of Shao et al. 2019: time of a substep over the number of nodes, elements to shape matching 7:3 and
/// 3:7.
Rows run_fig20(const std::string& device_text) {
  DeviceSet devices(device_text);
  const double bandwidth = measure_bandwidth_B_s(devices.context(0));
  return collect([&](Rows& rows) {
    for (const Index across : {4, 6, 8, 12, 16, 24, 48}) {
      rows.push_back(row(devices, bar(across, 7, 3, "7:3"), bandwidth));
      rows.push_back(row(devices, bar(across, 3, 7, "3:7"), bandwidth));
      // As seldom as its stiffness allows with these materials.
      TissueCase seldom = bar(across, 3, 7, "3:7, matched every 4th");
      seldom.matching_every = 4;
      rows.push_back(row(devices, seldom, bandwidth));
    }
  });
}

/// Substeps of bodies of one model.
Rows run_tissue(const std::string& device_text) {
  DeviceSet devices(device_text);
  const double bandwidth = measure_bandwidth_B_s(devices.context(0));
  return collect([&](Rows& rows) {
    for (const Index edge : {16, 32, 46, 100}) rows.push_back(row(devices, elements(edge), bandwidth));
    rows.push_back(row(devices, viscoelastic(32), bandwidth));
    for (const Index edge : {32, 46, 100}) rows.push_back(row(devices, moved(edge), bandwidth));
    for (const Index edge : {32, 46, 100}) rows.push_back(touched_row(devices, elements(edge), bandwidth));
    rows.push_back(touched_row(devices, bar(12, 7, 3, "7:3"), bandwidth));
    if (const auto body = liver()) rows.push_back(row(devices, *body, bandwidth));
    for (int w = 1; w <= 4; ++w) rows.push_back(row(devices, matched(31, w), bandwidth));
    rows.push_back(row(devices, matched(99, 2), bandwidth));
  });
}

}  // namespace tactus::bench
