#include <cstdio>

#include "tactus/base/error.h"
#include "tactus/cli/commands.h"
#include "tactus/cli/interrupt.h"

/// `tactus-bench bench hull ...`: the verb `bench` of tactus, and nothing else.
int main(int argc, char** argv) {
  CLI::App app("Tactus' benchmarks.", "tactus-bench");
  app.require_subcommand(1);
  tactus::add_bench_command(app);
  tactus::install_interrupt_handler();
  try {
    app.parse(argc, argv);
    return tactus::interrupted() ? 130 : 0;
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  } catch (const tactus::Error& e) {
    std::fprintf(stderr, "error: %s\n", e.what());
    return e.kind() == tactus::ErrorKind::usage ? 2 : 1;
  }
}
