#include <cstdio>

#include "bench.h"
#include "tactus/base/error.h"
#include "tactus/base/safe_file.h"
#include "tactus/cli/bench/bench_flags.h"
#include "tactus/cli/interrupt.h"
#include "tactus/cli/version.h"
#include "tactus/compute/device.h"
#include "tactus/io/json_file.h"

namespace tactus {
namespace {

void print_row(const nlohmann::json& row) {
  const auto number = [&](const char* key) {
    return row.contains(key) && row[key].is_number() ? row[key].get<double>() : 0;
  };
  std::printf("%-12s %-8s %8.0f %-8s %9.4f %9.4f", row["name"].get<std::string>().c_str(),
              row["case"].get<std::string>().c_str(), number("size"),
              row["devices"].get<std::string>().c_str(), number("ms_p50"), number("ms_p99"));
  for (const char* key :
       {"hull_ms_p50", "upload_ms_p50", "device_ms", "floor_ms", "plain_loop_over_hull", "growth_from_128",
        "over_hand_written", "without_upload_ms_p50", "paper_over_ours", "real_time_factor", "ns_per_node",
        "ns_per_cube", "masks_per_s", "lost_masks", "clients_cores", "server_cores"}) {
    if (row.contains(key) && row[key].is_number()) std::printf("  %s %.4g", key, number(key));
  }
  std::printf("\n");
  std::fflush(stdout);
}

void run_benchmarks(const BenchOptions& options) {
  const auto& [name, wanted_case, devices, json_path] = options;
  if (!json_path.empty()) output_is_writable(json_path);
  bench::set_wanted_case(wanted_case);
  parse_devices(devices);  // a missing device is reported before the table begins
  bench::set_stop(interrupted);
  std::vector<std::string> names{"all"};
  for (const bench::Benchmark& b : bench::benchmarks()) names.push_back(b.name);
  if (std::find(names.begin(), names.end(), name) == names.end())
    throw usage_error("unknown benchmark '" + name + "'" + suggestion(name, names));
  nlohmann::json json{
      {"machine", machine_text()}, {"commit", commit_text()}, {"rows", nlohmann::json::array()}};
  std::printf("%s\n%-12s %-8s %8s %-8s %9s %9s\n", machine_text().c_str(), "name", "case", "size", "devices",
              "p50 [ms]", "p99 [ms]");
  std::fflush(stdout);
  for (const bench::Benchmark& b : bench::benchmarks()) {
    if ((name != "all" && name != b.name) || interrupted()) continue;
    try {
      for (const nlohmann::json& row : b.run(devices)) {
        print_row(row);
        json["rows"].push_back(row);
      }
    } catch (const bench::Stopped&) {  // before its first row: nothing of it is worth telling
    }
  }
  if (interrupted()) json["interrupted"] = true;
  if (!json_path.empty()) write_json_file(json_path, json);
}

}  // namespace

void add_bench_command(CLI::App& app) {
  auto options = std::make_shared<BenchOptions>();
  add_bench_flags(app, *options, true)->callback([options] { run_benchmarks(*options); });
}

}  // namespace tactus
