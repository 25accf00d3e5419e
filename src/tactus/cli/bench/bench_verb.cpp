// `tactus bench`: becomes tactus-bench.
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/cli/bench/bench_flags.h"

namespace tactus {
namespace {

void become_bench(const BenchOptions& options) {
  const std::vector<std::string> words = benchmark_words();
  if (std::find(words.begin(), words.end(), options.name) == words.end())
    throw usage_error("unknown benchmark '" + options.name + "'" + suggestion(options.name, words));
  std::string program = bench_program();
  std::vector<std::string> arguments{program, "bench", options.name, "--devices", options.devices};
  const auto add = [&](const char* flag, const std::string& value) {
    if (!value.empty()) arguments.insert(arguments.end(), {flag, value});
  };
  add("--case", options.wanted_case);
  add("--json", options.json_path);
  if (log_level() == LogLevel::quiet) arguments.emplace_back("--quiet");
  if (log_level() == LogLevel::debug) arguments.emplace_back("--verbose");
  std::vector<char*> argv;
  for (std::string& a : arguments) argv.push_back(a.data());
  argv.push_back(nullptr);
  ::execv(program.c_str(), argv.data());
  throw Error("can't run '" + program + "': " + std::strerror(errno));
}

}  // namespace

void add_bench_command(CLI::App& app) {
  auto options = std::make_shared<BenchOptions>();
  add_bench_flags(app, *options, false)->callback([options] { become_bench(*options); });
}

}  // namespace tactus
