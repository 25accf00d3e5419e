#include "tactus/cli/bench/bench_flags.h"

#include <unistd.h>

#include <filesystem>

#include "tactus/base/error.h"

namespace tactus {
namespace {

constexpr BenchmarkName kNames[] = {
    {"affine", "the smallest kernel through parallel_for, against the same loop written by hand"},
    {"hull", "visual hull and mesh of 8 silhouettes 640x480 and 16 of 1920x1080, up to 1024^3"},
    {"table2", "Table 2 of Shao et al. 2019: reconstruction on the CPU, one GPU and all (auto: all three)"},
    {"table3", "Table 3 of Shao et al. 2019: texture on the CPU, one GPU and all (auto: all three)"},
    {"table4", "Table 4 of Shao et al. 2019: neighbour search of 40,000 to 8 million particles"},
    {"table5", "Table 5 of Shao et al. 2019: whole frames of Fig 17, 18 and 19"},
    {"tissue", "substeps of soft bodies: finite elements (TLED) and shape matching (FLSM)"},
    {"fig20", "Fig 20 of Shao et al. 2019: hybrid bodies, 7:3 and 3:7, over their number of nodes"},
    {"cut", "a blade through a body of 20^3 cubes, and substeps with its copies"},
    {"film", "frames of a film of blood on 20,000 vertices"},
    {"fluid", "steps of the liquid, with the search: 2,000 particles to 8 million"},
    {"frame", "whole frames of the demo and fig17 scenes: host masks to surfaces on the device"},
    {"texture", "normals and view-dependent texture of every vertex from 8 photos 640x480"},
    {"blade", "the pose of a tracked blade from the masks of 8 cameras"},
    {"wire", "live cameras: eight processes of clients, one server, encrypted"},
};

}  // namespace

std::span<const BenchmarkName> benchmark_names() { return kNames; }

std::vector<std::string> benchmark_words() {
  std::vector<std::string> words{"all"};
  for (const BenchmarkName& b : kNames) words.emplace_back(b.name);
  return words;
}

CLI::App* add_bench_flags(CLI::App& app, BenchOptions& options, bool reserves_output) {
  CLI::App* command = app.add_subcommand("bench", "Time the parts, beside a reference and a floor");
  std::string list = "all";
  for (const BenchmarkName& b : kNames) list += std::string(", ") + b.name + " (" + b.what + ")";
  command->add_option("name", options.name, list)->capture_default_str();
  add_devices(*command, options.devices);
  command->add_option("--case", options.wanted_case,
                      "of frame and table5 only the scenes whose name holds this, as fig19");
  const std::string json_help = "write the rows (-: standard output)";
  if (reserves_output)
    add_output(*command, "--json", options.json_path, json_help);
  else
    command->add_option("--json", options.json_path, json_help);
  command->footer("Example:\n  tactus bench hull --devices cpu --json hull.json");
  return command;
}

std::string bench_program() {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  std::string path = (self.parent_path() / "tactus-bench").string();
  if (error || ::access(path.c_str(), X_OK) != 0)
    throw Error("the benchmarks are a program of their own, and '" + path +
                "' is not there: 'make bench' builds and runs it");
  return path;
}

}  // namespace tactus
