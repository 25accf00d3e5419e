#pragma once
/// Benchmarks: settings are frozen in code, results are a table and JSON.
#include <functional>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "tactus/compute/exec_context.h"

namespace tactus::bench {

/// Rows of one benchmark, each an object with name, case, size, devices, ms_p50, ms_p99, floor_ms, reference.
using Rows = std::vector<nlohmann::json>;

struct Benchmark {
  std::string name;
  Rows (*run)(const std::string& devices);
};
/// All benchmarks, in the order in which `all` runs them. Adding one: a line here, and one in
/// cli/bench/bench_flags.cpp.
const std::vector<Benchmark>& benchmarks();
/// One more, of a program that has what it needs. Before the others are asked for.
void add_benchmark(const Benchmark& benchmark);

Rows run_affine(const std::string& device_text);
Rows run_hull(const std::string& device_text);
Rows run_texture(const std::string& device_text);
Rows run_table2(const std::string& device_text);
Rows run_table3(const std::string& device_text);
Rows run_table4(const std::string& device_text);
Rows run_table5(const std::string& device_text);
Rows run_tissue(const std::string& device_text);
Rows run_fig20(const std::string& device_text);
Rows run_cut(const std::string& device_text);
Rows run_fluid(const std::string& device_text);
Rows run_film(const std::string& device_text);
Rows run_frame(const std::string& device_text);

/// Of benchmarks on one device: the set that the user named; for `auto`, the CPU and the first GPU.
std::vector<std::string> single_devices(const std::string& device_text);

/// Thrown where a benchmark is stopped: a row that was not measured to its end is worth nothing.
struct Stopped : std::runtime_error {
  Stopped() : std::runtime_error("stopped") {}
};
/// From now on `asked` is polled within benchmarks, never inside of what is timed (default: nobody asks).
void set_stop(bool (*asked)());
/// From now on only cases whose name holds `text` are run, by those who ask is_wanted() (default: all are).
void set_wanted_case(const std::string& text);
bool is_wanted(const std::string& name);
/// For loops that don't use time_ms. @throws Stopped.
void check_stop();
/// The rows that `measure` appends; when it is stopped, those that were finished.
Rows collect(const std::function<void(Rows&)>& measure);

/// Milliseconds of `body` (which must wait for what it starts): at least `least` repetitions, then until
/// `seconds` are over. @throws Stopped between repetitions.
std::vector<double> time_ms(const std::function<void()>& body, int least = 30, double seconds = 2);
/// Median milliseconds of every kernel that `run` launches there, run one by one: where time goes. On GPUs
/// each has the wait for it on top.
nlohmann::json kernels_ms(ExecContext& ctx, const std::function<void()>& run);
/// Of the kernels that `run` launches there: how many.
double launches(ExecContext& ctx, const std::function<void()>& run);
/// p-th percentile of milliseconds.
double p(const std::vector<double>& ms, double percent);

}  // namespace tactus::bench
