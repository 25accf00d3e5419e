#pragma once
/// The verb `bench`, as `tactus` offers it and `tactus-bench`, a program of its own beside it, takes it: so
/// scenes run without building the benchmarks.
#include <span>
#include <string>
#include <vector>

#include "tactus/cli/commands.h"

namespace tactus {

struct BenchOptions {
  std::string name = "all", wanted_case, devices = "auto", json_path;
};

struct BenchmarkName {
  const char *name, *what;
};
/// In the order in which `all` runs them.
std::span<const BenchmarkName> benchmark_names();
/// These, and `all`.
std::vector<std::string> benchmark_words();

/// @param reserves_output `--json -` takes standard output
CLI::App* add_bench_flags(CLI::App& app, BenchOptions& options, bool reserves_output);

/// `tactus-bench` beside this program. @throws Error naming the path and the command that builds it.
std::string bench_program();

}  // namespace tactus
