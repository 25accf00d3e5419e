#include <cstdio>

#include "bench.h"
#include "tactus/base/error.h"
#include "tactus/base/safe_file.h"
#include "tactus/cli/commands.h"
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

struct BenchOptions {
  std::string name = "all", wanted_case, devices = "auto", json_path;
};

void run_benchmarks(const BenchOptions& options) {
  const auto& [name, wanted_case, devices, json_path] = options;
  if (!json_path.empty()) output_is_writable(json_path);
  bench::set_wanted_case(wanted_case);
  parse_devices(devices);  // what is not here is told before the table begins
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
  CLI::App* command = app.add_subcommand("bench", "Time the parts, beside a reference and a floor");
  std::string list = "all";
  for (const bench::Benchmark& b : bench::benchmarks()) list += ", " + b.name + " (" + b.what + ")";
  command->add_option("name", options->name, list)->capture_default_str();
  command->add_option("--devices", options->devices, "cpu, cpu:N (virtual), cuda:0, cuda:0-3, cuda:all, auto")
      ->capture_default_str();
  command->add_option("--case", options->wanted_case,
                      "of frame and table5 only the scenes whose name holds this, as fig19");
  add_output(*command, "--json", options->json_path, "write the rows (-: standard output)");
  command->footer("Example:\n  tactus bench hull --devices cpu --json hull.json");
  command->callback([options] { run_benchmarks(*options); });
}

}  // namespace tactus
