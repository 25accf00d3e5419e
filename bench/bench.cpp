#include "bench.h"

#include "tactus/base/timing.h"
#include "tactus/compute/device.h"

namespace tactus::bench {
namespace {
bool (*stop_asked)() = nullptr;
std::string wanted_case;  // empty: all
}  // namespace

void set_stop(bool (*asked)()) { stop_asked = asked; }
void set_wanted_case(const std::string& text) { wanted_case = text; }
bool is_wanted(const std::string& name) { return name.find(wanted_case) != std::string::npos; }
void check_stop() {
  if (stop_asked != nullptr && stop_asked()) throw Stopped();
}

std::vector<std::string> single_devices(const std::string& device_text) {
  if (device_text != "auto") return {device_text};
  std::vector<std::string> sets{"cpu"};
  if (cuda_device_count() > 0) sets.emplace_back("cuda:0");
  return sets;
}

Rows collect(const std::function<void(Rows&)>& measure) {
  Rows rows;
  try {
    measure(rows);
  } catch (const Stopped&) {
    if (rows.empty()) throw;
  }
  return rows;
}

namespace {

std::vector<Benchmark>& all_benchmarks() {
  static std::vector<Benchmark> all{
      {"affine", run_affine},   {"hull", run_hull},     {"table2", run_table2}, {"table3", run_table3},
      {"table4", run_table4},   {"table5", run_table5}, {"tissue", run_tissue}, {"fig20", run_fig20},
      {"cut", run_cut},         {"fluid", run_fluid},   {"film", run_film},     {"frame", run_frame},
      {"texture", run_texture},
  };
  return all;
}

}  // namespace

const std::vector<Benchmark>& benchmarks() { return all_benchmarks(); }
void add_benchmark(const Benchmark& benchmark) { all_benchmarks().push_back(benchmark); }

std::vector<double> time_ms(const std::function<void()>& body, int least, double seconds) {
  for (int i = 0; i < 3; ++i) {
    check_stop();
    body();
  }
  std::vector<double> ms;
  const double start_s = now_s();
  while (static_cast<int>(ms.size()) < least || (now_s() - start_s < seconds && ms.size() < 400)) {
    check_stop();
    const double begin_s = now_s();
    body();
    ms.push_back((now_s() - begin_s) * 1e3);
    if (now_s() - start_s > 2 * seconds + 1 && ms.size() >= 3) break;
  }
  return ms;
}

namespace {

void profile(ExecContext& ctx, const std::function<void()>& run, Timings& timings) {
  ctx.profile(&timings);
  try {
    run();
  } catch (...) {
    ctx.profile(nullptr);
    throw;
  }
  ctx.profile(nullptr);
}

}  // namespace

nlohmann::json kernels_ms(ExecContext& ctx, const std::function<void()>& run) {
  Timings timings;
  profile(ctx, run, timings);
  nlohmann::json kernels;
  for (const std::string& name : timings.stages()) kernels[name] = timings.percentile_ms(name, 50);
  return kernels;
}

double launches(ExecContext& ctx, const std::function<void()>& run) {
  Timings timings;
  profile(ctx, run, timings);
  double count = 0;
  for (const std::string& name : timings.stages()) count += static_cast<double>(timings.count(name));
  return count;
}

double p(const std::vector<double>& ms, double percent) { return percentile(ms, percent); }

}  // namespace tactus::bench
