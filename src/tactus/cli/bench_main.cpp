#include "tactus/cli/program.h"

/// `tactus-bench bench hull ...`: the verb `bench` of tactus, and nothing else.
int main(int argc, char** argv) {
  return tactus::run_program(argc, argv, "tactus-bench", "Tactus' benchmarks.", tactus::add_bench_command);
}
