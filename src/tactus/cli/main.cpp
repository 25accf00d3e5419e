#include <opencv2/core/utility.hpp>

#include <cstdio>

#include "tactus/base/error.h"
#include "tactus/cli/commands.h"
#include "tactus/cli/interrupt.h"
#include "tactus/cli/version.h"

namespace {

/// A first word that is no verb gets the nearest one.
void check_verb(int argc, char** argv) {
  static const std::string kVerbs[] = {"run", "reconstruct", "synth", "bench", "info"};
  if (argc < 2 || argv[1][0] == '-') return;
  for (const std::string& verb : kVerbs) {
    if (verb == argv[1]) return;
  }
  throw tactus::usage_error("unknown command '" + std::string(argv[1]) + "'" +
                            tactus::suggestion(argv[1], kVerbs));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Tactus: real objects, seen by cameras, touch virtual ones.", "tactus");
  app.set_version_flag("--version", [] { return tactus::version_text(); });
  app.require_subcommand(1);
  app.footer(
      "Examples:\n  tactus run scenes/demo.yaml\n  tactus reconstruct --source synthetic hand --resolution "
      "128 --mesh hand.ply\n"
      "  tactus bench hull --devices cpu\n  tactus info\nExit codes: 0 done, 1 failed, 2 wrong usage, 130 "
      "interrupted.");
  tactus::add_run_command(app);
  tactus::add_reconstruct_command(app);
  tactus::add_synth_command(app);
  tactus::add_bench_command(app);
  tactus::add_info_command(app);
  tactus::install_interrupt_handler();
  cv::setNumThreads(1);  // one pool of threads for the process: ours
  try {
    check_verb(argc, argv);
    app.parse(argc, argv);
    return tactus::interrupted() ? 130 : 0;
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  } catch (const tactus::Error& e) {
    std::fprintf(stderr, "error: %s\n", e.what());
    return e.kind() == tactus::ErrorKind::usage ? 2 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "error: %s\n", e.what());
    return 1;
  }
}
