#include "reconstruct_case.h"
#include "tactus/compute/device.h"

namespace tactus::bench {
namespace {

/// Milliseconds that the paper states for 64^3 and 100^3 voxels, on its CPU, one of its GPUs, all of them.
struct PaperRow {
  const char* figure;
  Index resolution;
  double cpu_ms, gpu_ms, gpus_ms;
  double on(const DeviceSet& devices) const {
    return !devices.is_cuda() ? cpu_ms : (devices.count() == 1 ? gpu_ms : gpus_ms);
  }
};
constexpr PaperRow kTable2[] = {{"hand", 64, 180.4, 57.6, 26.2},
                                {"rabbit", 64, 194.6, 64.4, 27.5},
                                {"hand", 100, 554.5, 137.5, 39.3},
                                {"rabbit", 100, 596.8, 149.8, 41.5}};
constexpr PaperRow kTable3[] = {{"hand", 64, 52.5, 13.2, 9.4},
                                {"rabbit", 64, 56.7, 14.7, 9.8},
                                {"hand", 100, 207.4, 46.9, 27.6},
                                {"rabbit", 100, 221.3, 50.6, 28.1}};

/// `auto` makes the whole table: the CPU and, where there are some, one GPU and all of them.
std::vector<std::string> table_devices(const std::string& text) {
  if (text != "auto") return {text};
  std::vector<std::string> sets{"cpu"};
  if (cuda_device_count() > 0) sets.emplace_back("cuda:0");
  if (cuda_device_count() > 1) sets.emplace_back("cuda:all");
  return sets;
}

void put_paper(nlohmann::json& row, double paper_ms) {
  row["reference"]["paper"] = paper_ms;
  row["paper_over_ours"] = paper_ms / row["ms_p50"].get<double>();
}

nlohmann::json table2_row(DeviceSet& devices, const PaperRow& paper) {
  ReconstructCase c(devices, {.figure = paper.figure, .resolution = paper.resolution, .depth = true});
  const auto whole = [&] {
    c.upload();
    c.reconstruct();
  };
  nlohmann::json row = c.row("table2", c.timed_ms(whole));
  row["without_upload_ms_p50"] = p(c.timed_ms([&] { c.reconstruct(); }, 20, 1), 50);
  row["kernels_ms_p50"] = c.kernels_ms(whole);
  put_paper(row, paper.on(devices));
  return row;
}

nlohmann::json table3_row(DeviceSet& devices, const PaperRow& paper) {
  ReconstructCase c(devices,
                    {.figure = paper.figure, .resolution = paper.resolution, .depth = true, .texture_k = 1});
  c.upload();
  c.reconstruct();
  const auto whole = [&] {
    c.upload_photos();
    c.shade();
  };
  nlohmann::json row = c.row("table3", c.timed_ms(whole));
  row["without_upload_ms_p50"] = p(c.timed_ms([&] { c.shade(); }, 20, 1), 50);
  row["kernels_ms_p50"] = c.kernels_ms(whole);
  put_paper(row, paper.on(devices));
  return row;
}

Rows run_table(const std::string& device_text, std::span<const PaperRow> table,
               nlohmann::json (*measure)(DeviceSet&, const PaperRow&)) {
  return collect([&](Rows& rows) {
    for (const std::string& set : table_devices(device_text)) {
      DeviceSet devices(set);
      for (const PaperRow& paper : table) rows.push_back(measure(devices, paper));
    }
  });
}

}  // namespace

/// Table 2 of Shao et al. 2019: from masks and a depth image in the host's memory to the mesh on the device.
Rows run_table2(const std::string& device_text) { return run_table(device_text, kTable2, table2_row); }

/// Table 3: from photos in the host's memory to a colour at every vertex, normals included, from the camera
/// nearest to the view. The first device does it, which has the mesh.
Rows run_table3(const std::string& device_text) { return run_table(device_text, kTable3, table3_row); }

}  // namespace tactus::bench
