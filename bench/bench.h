#pragma once
/// Benchmarks: settings are frozen in code, results are a table and JSON.
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace tactus::bench {

/// Rows of one benchmark, each an object with name, case, size, devices, ms_p50, ms_p99, floor_ms, reference.
using Rows = std::vector<nlohmann::json>;

struct Benchmark {
  std::string name, what;
  Rows (*run)(const std::string& devices);
};
/// All benchmarks, in the order in which `all` runs them. Adding one: a line here.
const std::vector<Benchmark>& benchmarks();

Rows run_affine(const std::string& device_text);
Rows run_hull(const std::string& device_text);
Rows run_flsm(const std::string& device_text);
Rows run_texture(const std::string& device_text);
Rows run_tissue(const std::string& device_text);
Rows run_fig20(const std::string& device_text);
Rows run_frame(const std::string& device_text);

/// Milliseconds of `body` (which must wait for what it starts): at least `least` repetitions, then until
/// `seconds` are over.
std::vector<double> time_ms(const std::function<void()>& body, int least = 30, double seconds = 2);
/// p-th percentile of milliseconds.
double p(const std::vector<double>& ms, double percent);

}  // namespace tactus::bench
