#include "tactus/cli/program.h"
#ifndef TACTUS_BENCH_OF_DEVICES
#include "tactus/cli/bench/blade_bench.h"
#include "tactus/cli/bench/wire_bench.h"
#endif

/// `tactus-bench bench hull ...`: the verb `bench` of tactus, and nothing else.
int main(int argc, char** argv) {
#ifndef TACTUS_BENCH_OF_DEVICES
  tactus::add_blade_benchmark();
  tactus::add_wire_benchmark();
#endif
  return tactus::run_program(argc, argv, "tactus-bench", "Tactus' benchmarks.", tactus::add_bench_command);
}
